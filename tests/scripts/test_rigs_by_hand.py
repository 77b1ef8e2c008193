"""Rigs run by hand, as their files say, on real YADE."""

import csv
import json
import math
import subprocess
from pathlib import Path

import pytest

from pellet_study.rigs import on_yade, scripts
from yade_scripts import case as case_file

pytestmark = pytest.mark.yade

SCRIPTS = Path(scripts.SCRIPTS)


def yade(*arguments: str, folder: Path) -> subprocess.CompletedProcess:
    return subprocess.run(
        ["yade", "-x", "-n", "-j1", *arguments], cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True
    )


@pytest.mark.parametrize("name", ["rebound", "slope_slip", "inclined_roll"])
def test_a_rig_runs_on_its_own_example(name, tmp_path):
    script = str(SCRIPTS / f"{name}.py")
    assert yade(script, "--example", "cases.json", folder=tmp_path).returncode == 0
    cases = json.loads((tmp_path / "cases.json").read_text())
    cases[0]["id"] = "mine"
    cases[0]["parameters"]["seed_powder_static_friction"] = 0.5
    if name == "inclined_roll":
        cases[0]["conditions"].update(slope_deg=40.0, release_distance_mm=30.0)
    (tmp_path / "cases.json").write_text(json.dumps(cases))
    done = yade(script, "cases.json", "observables.csv", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    row = next(csv.DictReader(open(tmp_path / "observables.csv")))
    assert row["id"] == "mine" and row["status"] == "ok" and row["seed_powder_static_friction"] == "0.5"
    value = float(row[next(iter(on_yade.rig(name).observables))])
    assert math.isfinite(value)
    if name == "slope_slip":
        assert value == pytest.approx(math.degrees(math.atan(0.5)), abs=0.06)
    assert "seconds" in (tmp_path / "timings.csv").read_text()
    assert "seconds" not in (tmp_path / "observables.csv").read_text()


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda case: case["parameters"].pop("seed_powder_restitution"), "missing seed_powder_restitution"),
        (lambda case: case["conditions"].update(wind=1.0), "unknown wind"),
        (lambda case: case["conditions"].update(drop_height_mm="high"), "drop_height_mm: expected a finite number"),
    ],
)
def test_a_case_with_wrong_names_is_refused_before_anything_runs(spoil, message, tmp_path):
    case = case_file.example(vars(on_yade.rig("rebound")))
    spoil(case)
    (tmp_path / "cases.json").write_text(json.dumps([case]))
    done = yade(str(SCRIPTS / "rebound.py"), "cases.json", "out.csv", folder=tmp_path)
    assert done.returncode == 2
    assert message in done.stderr
    assert not (tmp_path / "out.csv").exists()


def cases(*changed: dict) -> str:
    return json.dumps([case_file.example(vars(on_yade.rig("rebound"))) | one for one in changed])


OURS = ",".join(case_file.columns(vars(on_yade.rig("rebound"))))
WRONG = {  # (cases.json, other files, arguments, what the line says)
    "bad JSON": ("[{", {}, (), ["cases.json: no valid JSON", "line 1", "--example"]),
    "an empty file": ("", {}, (), ["cases.json: is empty", "--example"]),
    "no text": (b"\xff\xfe\x00", {}, (), ["utf-8"]),
    "brackets without end": ("[" * 100_000, {}, (), ["cases.json: no valid JSON"]),
    "an object": ("{}", {}, (), ["got dict", "expected a list of cases"]),
    "an empty list": ("[]", {}, (), ["got an empty list", "expected a list of cases"]),
    "a case that is no object": (f"[{cases({})[1:-1]}, 7]", {}, (), ["case number 2", "expected an object, got 7"]),
    "a missing id": (cases({}).replace('"id": "example", ', ""), {}, (), ["case number 1", "missing id"]),
    "an empty id": (cases({"id": ""}), {}, (), ["id: expected a name, got ''"]),
    "another law": (cases({"contact_law": "hooke"}), {}, (), ["contact_law: expected one of", "'hooke'"]),
    "a number of 400 digits": (cases({"seed": 10**400}), {}, (), ["seed: expected a finite number"]),
    "no file": (None, {}, (), ["cases.json: no such file"]),
    "input and output the same": (cases({}), {}, ("cases.json", "cases.json"), ["would be written over"]),
    "the same by another name": (cases({}), {}, ("cases.json", "./cases.json"), ["would be written over"]),
    "input the table of times": (None, {"timings.csv": cases({})}, ("timings.csv", "out.csv"), ["would be written over"]),
    "output the table of times": (cases({}), {}, ("cases.json", "timings.csv"), ["the table of times"]),
    "a foreign timings.csv": (cases({}), {"timings.csv": "lap,time\n1,2\n"}, (), ["timings.csv: is no table", "move it away"]),
    "foreign observables": (cases({}), {"out.csv": "my notes\n"}, (), ["out.csv: is no table", "name another file"]),
    "observables of another rig": (cases({}), {"out.csv": OURS.replace("rebound", "x") + "\n"}, (), ["out.csv: is no table"]),
    "a folder that is not there": (cases({}), {}, ("cases.json", "far/out.csv"), ["no folder far"]),
    "a folder as output": (cases({}), {}, ("cases.json", "."), ["is a folder"]),
    "an example over a list of cases": (cases({"id": "mine"}), {}, ("--example", "cases.json"), ["cases.json: exists already"]),
    "no arguments": (cases({}), {}, (None,), ["usage: yade -x -n rebound.py cases.json observables.csv"]),
}  # fmt: skip


ON_YADE = (
    "bad JSON", "an empty file", "an object", "a case that is no object", "a missing id", "no file",
    "input and output the same", "a foreign timings.csv", "foreign observables", "no arguments",
)  # fmt: skip


@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_input_is_told_in_a_line_and_nothing_is_touched(wrong, tmp_path, monkeypatch, capsys):
    text, others, arguments, words = WRONG[wrong]
    files = {"cases.json": text, **others}
    for name, content in files.items():
        if content is not None:
            (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    given = [a for a in arguments or ("cases.json", "out.csv") if a is not None]
    monkeypatch.chdir(tmp_path)
    assert case_file.by_hand(SCRIPTS / "rebound.py", given) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and all(word in told for word in words), told
    if wrong in ON_YADE:
        done = yade(str(SCRIPTS / "rebound.py"), *given, folder=tmp_path)
        assert done.returncode == 2
        assert told in done.stderr and "Traceback" not in done.stderr + done.stdout
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


def test_a_rig_that_is_not_there_is_told_in_a_line(tmp_path):
    done = yade(str(SCRIPTS / "case.py"), "mine.py", "cases.json", "out.csv", folder=tmp_path)
    assert done.returncode == 2 and "mine.py: no such file" in done.stderr and "Traceback" not in done.stderr


def test_a_rig_run_again_writes_its_tables_anew(tmp_path):
    """Over tables of its own and empty files; the answer is the same, byte for byte."""
    (tmp_path / "out.csv").touch()
    (tmp_path / "timings.csv").touch()
    (tmp_path / "cases.json").write_text(cases({"id": 7}))
    found = []
    for _ in range(2):
        assert yade(str(SCRIPTS / "rebound.py"), "cases.json", "out.csv", folder=tmp_path).returncode == 0
        found.append((tmp_path / "out.csv").read_bytes())
        assert len((tmp_path / "timings.csv").read_text().splitlines()) == 2
    assert found[0] == found[1] and found[0].startswith(OURS.encode() + b"\n7,")
