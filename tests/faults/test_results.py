"""Results that are damaged, half written or in odd places: which file, and which command mends it."""

import json
import os
import subprocess
import sys

import pytest

from pellet_study.__main__ import main
from pellet_study.study import history
from tests.faults.driver import ROOT, command, paragraph
from tests.helpers.make_study import incline


@pytest.fixture
def study(tmp_path):
    """One that was refined, compared and diagnosed."""
    folder = incline(tmp_path / "study", c=60.0)
    for verb in ("refine", "compare", "diagnose"):
        assert main([verb, str(folder)]) == 0
    return folder


def without(answer, *place):
    """An answer less one of its keys."""
    *above, key = place
    inner = answer
    for name in above:
        inner = inner[name]
    del inner[key]
    return answer


DAMAGES = {
    "refine.json without diagnoses": ("refine", lambda a: without(a, "diagnoses"), "refine"),
    "refine.json without a verdict": ("refine", lambda a: without(a, "diagnoses", 0, "verdict"), "refine"),
    "refine.json without the name of an effect": (
        "refine",
        lambda a: without(a, "diagnoses", 0, "ranking", 0, "effect"),
        "refine",
    ),
    "compare.json without rows": ("compare", lambda a: without(a, "rows"), "compare"),
    "compare.json with a row less": ("compare", lambda a: {**a, "rows": [1, 2]}, "compare"),
    "compare.json that is a list": ("compare", lambda a: [], "compare"),
    "diagnose.json without a ranking": ("diagnose", lambda a: {**a, "effects": ["?"], "ranking": 3}, "diagnose"),
    "a history whose steps are numbers": ("history", lambda a: {"steps": [1, 2]}, "refine"),
    "a history whose steps are words": ("history", lambda a: {"steps": ["a", "b"]}, "refine"),
    "a history without effects": ("history", lambda a: without(a, "steps", 0, "effects"), "refine"),
    "a history without chi2": ("history", lambda a: without(a, "steps", 0, "chi2"), "refine"),
    "a history without steps": ("history", lambda a: {}, "refine"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_result_is_named_with_the_command_that_mends_it(study, capsys, damage):
    name, change, mends = DAMAGES[damage]
    file = study / f"{name}.json"
    file.write_text(json.dumps(change(json.loads(file.read_text())), indent=1) + "\n")
    capsys.readouterr()
    for verb in ["report", *(["history"] if name == "history" else [])]:
        assert main([verb, str(study)]) == 2
        said = capsys.readouterr().err
        assert paragraph(said) and str(file) in said and f"pellet-study {mends}" in said
    if name == "history":
        file.unlink()  # as the message says
    assert main([mends, str(study), "--force"]) == 0
    capsys.readouterr()
    assert main(["report", str(study)]) == 0, capsys.readouterr().err


KILLED = """
import os, sys
from pellet_study.__main__ import main
from pellet_study.study import history
setattr(history, sys.argv[1], lambda *_: os.kill(os.getpid(), 9))
main(["add", sys.argv[2], "cohesion"])
"""


@pytest.mark.parametrize("at", ["record", "leave"])
def test_an_add_that_was_killed_is_finished_by_the_next(tmp_path, capsys, at):
    whole, study = incline(tmp_path / "whole", c=60.0), incline(tmp_path / "study", c=60.0)
    assert main(["add", str(whole), "cohesion"]) == 0
    killed = subprocess.run([sys.executable, "-c", KILLED, at, study], cwd=ROOT, capture_output=True)
    assert killed.returncode == -9 and "cohesion" in (study / "study.toml").read_text()
    assert not (study / "compare.json").exists()
    assert main(["add", str(study), "cohesion"]) == 0
    for name in ("compare.json", "history.json", "compare.txt"):
        assert (study / name).read_bytes() == (whole / name).read_bytes()
    capsys.readouterr()
    assert main(["add", str(study), "cohesion"]) == 2
    assert "already" in capsys.readouterr().err


def test_a_step_is_not_recorded_twice(study):
    steps = history.read_history(study)
    history.record(study, steps[-2:])
    assert history.read_history(study) == steps


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names are Unicode")
def test_a_study_whose_path_is_no_utf_8(tmp_path):
    place = os.fsdecode(os.fsencode(tmp_path) + b"/Sch\xfcttgut")
    study = incline(tmp_path / "plain", c=60.0)
    os.rename(study, place)
    for words in (["compare", place, "--figures"], ["refine", place], ["report", place], ["history", place]):
        found = command(*words, "--json", tmp_path / "answer.json", errors="surrogateescape")
        assert found.returncode == 0 and "Traceback" not in found.stderr, found.stderr
    assert command("compare", place + "/nowhere").returncode == 2
    assert os.path.exists(place + "/report.html")
