"""study.toml: checks, and edits that keep the user's other lines."""

import sys

import pytest

from pellet_study.errors import InputError
from pellet_study.model.model import Model
from pellet_study.study.edit import erase_effect, write_effect
from pellet_study.study.load import load
from pellet_study.study.study import settings
from tests.helpers.make_study import command, folder, incline

OWN_EFFECT = """
EFFECT = {
    "name": "suction",
    "means": "a constant angle is added",
    "formula": "a + s",
    "parameters": {"stress_pa": {"absent": 0.0, "min": 0.0, "max": 900.0, "unit": "Pa", "meaning": "s"}},
    "sides": 1,
    "rigs": {"layer_on_incline": "everywhere"},
    "signature": "like cohesion",
    "source": "this test",
}


def act(shear, normal, conditions, values):
    return shear + values["stress_pa"]


CLOSED_FORM = {"layer_on_incline": act}
"""


def test_settings(tmp_path):
    study = load(incline(tmp_path, more="[effects]\ncohesion = { cohesive_stress_pa = 40 }\n"))
    assert study.parameters["internal_friction"].free
    assert not study.effects["cohesion"]["cohesive_stress_pa"].free
    assert "finite_thickness" in study.absent() and "cohesion" not in study.absent()
    assert study.rigs == ("layer_on_incline",)


def test_an_effect_of_ones_own_is_one_file(tmp_path):
    incline(tmp_path, more="[effects]\nsuction = { stress_pa = { value = 5, min = 0, max = 100 } }\n")
    (tmp_path / "effects").mkdir()
    (tmp_path / "effects" / "suction.py").write_text(OWN_EFFECT)
    study = load(tmp_path)
    assert study.effects["suction"]["stress_pa"].high == 100.0


@pytest.mark.parametrize(
    "more, words",
    [
        ("[effects]\ncohesoin = {}\n", ("cohesoin", "did you mean 'cohesion'")),
        ("[effects]\ncohesion = { stress = 1 }\n", ("stress", "cohesive_stress_pa")),
        ("[effects]\ncohesion = { cohesive_stress_pa = -1 }\n", ("-1", "outside")),
        ("[possible.layer_on_incline]\nheight = { min = 1, max = 2 }\n", ("height", "layer_height_mm")),
        ("[possible.nowhere]\n", ("nowhere",)),
        ("[typo]\n", ("typo", "accepted")),
    ],
)
def test_refused(tmp_path, more, words):
    with pytest.raises(InputError) as error:
        load(incline(tmp_path, more=more))
    for word in ("study.toml", *words):
        assert word in str(error.value)


@pytest.mark.parametrize(
    "line, word",
    [
        ("internal_friction = { value = 3, min = 0, max = 1 }", "outside its own"),
        ("internal_friction = { value = 0.5, min = 1, max = 0.1 }", "not below"),
        ("internal_friction = { value = 0.5, min = 0.1 }", "both"),
        ("internal_frction = 0.5", "did you mean 'internal_friction'"),
        ('internal_friction = "half"', "finite number"),
        ("powder_surface_energy = 0.1", "powder_surface_energy"),
    ],
)
def test_refused_parameter(tmp_path, line, word):
    incline(tmp_path)
    (tmp_path / "study.toml").write_text(f"[parameters]\n{line}\n")
    with pytest.raises(InputError) as error:
        load(tmp_path)
    assert word in str(error.value)


def test_measurements_outside_the_study_are_refused(tmp_path):
    incline(tmp_path / "a")
    (tmp_path / "measurements.csv").write_text("rig,observable,value\n")
    (tmp_path / "a" / "study.toml").write_text('measurements = "../measurements.csv"\n')
    with pytest.raises(InputError, match="outside the study"):
        load(tmp_path / "a")


def test_effect_that_acts_in_no_rig_used(tmp_path):
    study = folder(tmp_path, ["rig,observable,value,normal_stress_pa", "shear_cell,shear_stress_pa,500,1000"])
    (study / "study.toml").write_text('candidates = ["finite_thickness"]\n')
    with pytest.raises(InputError, match="finite_thickness acts in none of the rigs used"):
        load(study)


def test_writing_keeps_the_other_lines(tmp_path):
    study = load(
        incline(
            tmp_path,
            more="\n[effects]  # mine\nside_wall_friction = { wall_friction = 0.1 }\n\n[possible.shear_cell]\n",
        )
    )
    file = tmp_path / "study.toml"
    before = file.read_text()
    write_effect(file, "cohesion", settings(study.catalogue.effects["cohesion"], {"cohesive_stress_pa": 12.5}))
    assert load(tmp_path).effects["cohesion"]["cohesive_stress_pa"].value == 12.5
    assert set(before.splitlines()) <= set(file.read_text().splitlines())
    erase_effect(file, "cohesion")
    assert file.read_text() == before


def test_what_is_not_there_cannot_be_dropped(tmp_path, capsys):
    status, _ = command(
        "drop", folder(tmp_path, ["rig,observable,value", "shear_cell,shear_stress_pa,500"]), "cohesion"
    )
    assert status == 2 and "cohesion is not in [effects]; there is none" in capsys.readouterr().err


@pytest.mark.parametrize("terminal", [False, True])
def test_a_note_is_a_warning_too_but_not_on_the_same_terminal(tmp_path, capsys, monkeypatch, terminal):
    study = folder(tmp_path, ["rig,observable,value", "shear_cell,shear_stress_pa,500"])
    for stream in (sys.stdout, sys.stderr):
        monkeypatch.setattr(stream, "isatty", lambda: terminal)
    assert command("compare", study)[0] == 0
    said = capsys.readouterr()
    assert "NOTE" in said.out and ("warning:" in said.err) != terminal


HEAP = ["rig,observable,value,sd", "repose,repose_angle_deg,40,1"]


def test_an_effect_has_the_parameters_of_the_rigs_used(tmp_path):
    """Cohesion is a surface energy in a heap and a stress in a shear cell, and cannot be both in one study."""

    def heap(effects: str, lines=HEAP):
        study = folder(tmp_path, lines)
        (study / "study.toml").write_text(f"[effects]\n{effects}\n")
        return load(study)

    study = heap("cohesion = { surface_energy_j_m2 = 0.1 }")
    assert study.effects["cohesion"]["surface_energy_j_m2"].value == 0.1
    model = Model(study, engines={"repose": None})
    assert model.base[model.column["cohesion.surface_energy_j_m2"]] == 0.1
    assert "cohesion.cohesive_stress_pa" not in model.column
    assert (
        study.without_effect("cohesion").with_effect("cohesion").effects["cohesion"]["surface_energy_j_m2"].high == 0.4
    )
    with pytest.raises(InputError, match="'cohesive_stress_pa' is unknown; accepted are surface_energy_j_m2"):
        heap("cohesion = { cohesive_stress_pa = 1 }")
    with pytest.raises(
        InputError, match="surface_energy_j_m2 in repose; cohesive_stress_pa in shear_cell; make a study"
    ):
        heap("", [*HEAP, "shear_cell,shear_stress_pa,500,10"])
