"""Libraries: the advice a command gives names it, links and clashes, rigs, and the scripts that run in YADE."""

import pytest

from pellet_study.__main__ import main
from pellet_study.study import load
from tests.faults.driver import command as in_a_process
from tests.helpers.make_study import command, folder, incline

SUCTION = """
EFFECT = {
    "name": "suction",
    "means": "a film pulls the layer to the plate",
    "formula": "tau = mu sigma + s",
    "parameters": {"stress_pa": {"absent": 0.0, "min": 0.0, "max": 900.0, "unit": "Pa", "meaning": "s"}},
    "sides": 1,
    "rigs": {"layer_on_incline": "thin layers are steeper"},
    "signature": "like cohesion",
    "source": "made up for this test",
}


def act(shear_pa, normal_pa, conditions, values):
    return shear_pa + values["stress_pa"]


CLOSED_FORM = {"layer_on_incline": act}
"""
PAD = """
QUANTITY = {"min": 0.0, "max": 9000.0, "unit": "1", "meaning": "made up"}
RIG = {
    "name": "pad",
    "parameters": {"pad_friction": {**QUANTITY, "default": 0.4}},
    "conditions": {"load_pa": {**QUANTITY, "default": 1000.0}},
    "observables": {"stress_pa": "where it slips"},
}


def predict(parameters, conditions, effects):
    return {"stress_pa": parameters["pad_friction"] * conditions["load_pa"]}
"""
GLUE = """
EFFECT = {
    "name": "glue",
    "means": "a film holds the seed",
    "formula": "mu + a",
    "parameters": {"extra": {"absent": 0.0, "min": 0.0, "max": 0.4, "unit": "1", "meaning": "a"}},
    "sides": 1,
    "rigs": {"slope_slip": "steeper angles"},
    "signature": "all angles alike",
    "source": "made up for this test",
}


def friction(mu, load, values):
    return mu + values["extra"]


SEED_SCENE = {"friction": friction}
"""
COMMANDS = ("compare", "diagnose", "add", "drop", "refine", "history", "bench", "calibrate", "report")
WORDS = {"add": ["suction"], "drop": ["suction"]}


@pytest.fixture
def library(tmp_path):
    """A library of an effect and a rig."""
    for kind, name, text in (("effects", "suction", SUCTION), ("rigs", "pad", PAD)):
        file = tmp_path / "shelf" / kind / f"{name}.py"
        file.parent.mkdir(parents=True)
        file.write_text(text)
    return tmp_path / "shelf"


@pytest.fixture
def study(tmp_path):
    """Slip angles of a layer that is held by 40 Pa."""
    made = incline(tmp_path / "study", c=40.0, sd=0.2)
    (made / "study.toml").write_text('candidates = ["suction"]\n' + (made / "study.toml").read_text())
    return made


def refused(capsys, *words) -> str:
    """What a command that is refused says."""
    assert main([str(word) for word in words]) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said
    return said


def test_an_effect_of_a_library_is_found_added_and_reported(tmp_path, study, library, capsys):
    status, answer = command("diagnose", study, "--library", library, json_file=tmp_path / "answer.json")
    assert status == 0 and answer["verdict"] == "missing" and answer["ranking"][0]["effect"] == "suction"
    advice = capsys.readouterr().out.rpartition("next: pellet-study ")[2].split()
    assert advice[0] == "add" and str(library) in advice
    status, answer = command(*advice, json_file=tmp_path / "answer.json")
    assert status == 0 and answer["parameters"]["suction.stress_pa"] == pytest.approx(40, rel=0.1)
    assert command("history", study, "--library", library)[0] == 0
    assert command("report", study, "--library", library)[0] == 0
    page = (study / "report.html").read_text()
    assert f"pellet-study compare {study} --library {library}" in page
    assert not list(library.rglob("__pycache__"))


def test_it_is_named_when_it_is_run(study, library):
    done = in_a_process("compare", study, "--library", library)
    assert done.returncode == 0, done.stderr
    for file in ("effects/suction.py", "rigs/pad.py"):
        assert f"pellet-study: running {library / file}, code of the library {library}\n" in done.stderr


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_that_loads_a_study_takes_it(name, study, tmp_path, capsys):
    said = refused(capsys, name, study, *WORDS.get(name, []), "--library", tmp_path / "nowhere")
    assert f"library {tmp_path / 'nowhere'}: no such folder" in said and "effects/ and rigs/" in said


@pytest.mark.parametrize("linked", ["effects/other.py", "effects"])
def test_a_link_that_leads_out_of_it_is_refused_and_not_run(tmp_path, study, library, linked, capsys):
    outside = tmp_path / "outside" / "effects" / "other.py"
    outside.parent.mkdir(parents=True)
    outside.write_text(SUCTION.replace('"suction"', '"other"') + "raise SystemExit('it was run')\n")
    if linked == "effects":
        (library / "effects" / "suction.py").unlink()
        (library / "effects").rmdir()
        (library / "effects").symlink_to(outside.parent)
    else:
        (library / linked).symlink_to(outside)
    said = refused(capsys, "compare", study, "--library", library)
    assert "other.py: is a link to" in said and "copy it there" in said and "it was run" not in said


def test_a_link_to_the_library_and_one_inside_it_are_no_matter(tmp_path, study, library):
    (tmp_path / "link").symlink_to(library)
    (library / "kept.txt").write_text((library / "effects" / "suction.py").read_text())
    (library / "effects" / "suction.py").unlink()
    (library / "effects" / "suction.py").symlink_to("../kept.txt")
    assert "suction" in load(study, tmp_path / "link").acting()


@pytest.mark.parametrize("kind, name", [("effects", "suction"), ("rigs", "pad")])
def test_a_name_that_study_and_library_both_declare_is_refused(study, library, kind, name, capsys):
    mine = study / kind / "mine.py"
    mine.parent.mkdir()
    mine.write_text((library / kind / f"{name}.py").read_text())
    said = refused(capsys, "compare", study, "--library", library)
    assert f"{name!r} is declared twice" in said and str(mine) in said and str(library / kind / f"{name}.py") in said


def test_rigs_and_effects_of_a_library_are_those_of_its_studies(tmp_path, library):
    rows = ["rig,observable,value,sd,load_pa", "pad,stress_pa,400,4,1000", "pad,stress_pa,801,4,2000"]
    for name in ("one", "other"):
        loaded = folder(tmp_path / name, rows)
        (loaded / "study.toml").write_text("[parameters]\npad_friction = { value = 0.5, min = 0.1, max = 1.0 }\n")
        status, answer = command("compare", loaded, "--library", library, json_file=tmp_path / "answer.json")
        assert status == 0 and answer["parameters"]["pad_friction"] == pytest.approx(0.4, abs=0.01)


def test_an_effect_of_a_library_reaches_the_scripts_that_run_in_yade(tmp_path, library):
    (library / "effects" / "glue.py").write_text(GLUE)
    loaded = folder(tmp_path / "study", ["rig,observable,value,sd", "slope_slip,slip_angle_deg,31,0.5"])
    (loaded / "study.toml").write_text("")
    without, with_it = load(loaded).catalogue.rigs["slope_slip"], load(loaded, library).catalogue.rigs["slope_slip"]
    assert with_it.extra == ((library / "effects" / "glue.py").resolve(),) and "glue" in with_it.effects
    assert with_it.fingerprint != without.fingerprint and "glue" not in without.effects
    assert load(loaded).catalogue.rigs["slope_slip"].effects.keys() == without.effects.keys()
