"""Powder that sticks together has no place in hertz_mindlin: a study, a calibration and a case are refused, and say why."""

import pytest

from pellet_study.errors import InputError
from pellet_study.powder.from_study import plan_of
from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch
from pellet_study.study.load import load

WHY = "hertz_mindlin is not offered for cohesive powder: .* use cohesive_frictional"
PRESENT = "cohesion = { surface_energy_j_m2 = 0.1 }"
ABSENT = "cohesion = { surface_energy_j_m2 = 0.0 }"


def study(folder, words="", law="hertz_mindlin", column=""):
    (folder / "study.toml").write_text(f'contact_law = "{law}"\n{words}\n')
    name, value = column.split("=") if column else ("note", "")
    (folder / "measurements.csv").write_text(
        f"rig,observable,value,sd,{name}\nrepose,repose_angle_deg,41.69,0.79,{value}\n"
    )
    return folder


@pytest.mark.parametrize(
    ("words", "place"),
    [
        (f"[effects]\n{PRESENT}", "effects: cohesion"),
        ("[effects]\ncohesion = { surface_energy_j_m2 = { min = 0.0, max = 0.2 } }", "effects: cohesion"),
        ("[effects]\nliquid_bridges = { surface_tension_n_m = 0.05 }", "effects: liquid_bridges"),
        (f"[parameters]\npowder_surface_energy = 0.1\n[effects]\n{ABSENT}", "parameters: powder_surface_energy"),
        (
            f"[parameters]\npowder_surface_energy = {{ min = 0.0, max = 0.1 }}\n[effects]\n{ABSENT}",
            "parameters: powder_surface_energy",
        ),
        ('candidates = ["cohesion"]', "candidates: cohesion"),
    ],
)
def test_a_study_of_cohesive_powder_is_refused(tmp_path, words, place):
    with pytest.raises(InputError, match=f"study.toml: {place}: {WHY}"):
        load(study(tmp_path, words))
    load(study(tmp_path, words, law="cohesive_frictional"))


def test_a_row_that_knows_its_surface_energy_is_refused(tmp_path):
    with pytest.raises(InputError, match=f"measurements, line 2: powder_surface_energy: {WHY}"):
        load(study(tmp_path, column="powder_surface_energy=0.1"))
    load(study(tmp_path, column="powder_surface_energy=0"))


def test_without_cohesion_it_is_no_candidate(tmp_path):
    found = load(study(tmp_path, f"[parameters]\npowder_surface_energy = 0\n[effects]\n{ABSENT}"))
    assert "rolling_resistance" in found.absent() and "liquid_bridges" not in found.absent()
    with pytest.raises(InputError, match=WHY):
        found.with_effect("liquid_bridges")
    assert "liquid_bridges" in load(study(tmp_path, law="cohesive_frictional")).absent()


def test_calibrate_varies_the_surface_energy_and_is_refused(tmp_path):
    with pytest.raises(InputError, match=f"calibrate varies powder_surface_energy, but {WHY}"):
        plan_of(load(study(tmp_path)))
    other = load(study(tmp_path, law="cohesive_frictional"))
    assert plan_of(other).contact_law == "cohesive_frictional"
    with pytest.raises(InputError, match=WHY):
        plan_of(other, "hertz_mindlin")


@pytest.mark.yade
def test_a_case_of_cohesive_powder_says_why_there_is_no_heap(tmp_path):
    cases = [
        on_yade.case("repose", contact_law="hertz_mindlin", parameters={"powder_surface_energy": 0.1}),
        on_yade.case("repose", contact_law="hertz_mindlin", effects={"liquid_bridges": {"surface_tension_n_m": 0.05}}),
    ]
    for status in dispatch.run(cases, tmp_path / ".store", workers=1, quiet=True)["status"]:
        assert status.startswith("hertz_mindlin is not offered for cohesive powder: ")
