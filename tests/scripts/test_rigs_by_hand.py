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
