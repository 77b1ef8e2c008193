"""The bounds of the dependencies: the lowest versions give the same numbers; the audit fails when it looked nothing up."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests import ROOT

DOCUMENTED = (ROOT / "docs" / "dependencies.md").read_text()
LOWEST = dict(re.findall(r"([\w-]+)==([\d.]+)", DOCUMENTED))
PATIENCE_S = 1500.0


def test_the_documented_versions_are_the_lower_bounds():
    wanted = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    bounds = {name: low for name, low in (re.fullmatch(r"([\w-]+)>=([\d.]+),<[\d.]+", w).groups() for w in wanted)}
    assert set(bounds) == set(LOWEST)
    for name, low in bounds.items():
        assert [*map(int, LOWEST[name].split("."))][: len(low.split("."))] == [*map(int, low.split("."))], name


@pytest.fixture(scope="module")
def lowest(tmp_path_factory) -> Path:
    """Python 3.11 with the lowest versions, as the documented command installs them."""
    if sys.version_info[:2] != (3, 11):
        pytest.skip("the lowest versions are those of Python 3.11")
    home = tmp_path_factory.mktemp("lowest")
    subprocess.run([sys.executable, "-m", "venv", home], check=True)
    words = [home / "bin" / "pip", "install", "--quiet", *(f"{name}=={version}" for name, version in LOWEST.items())]
    made = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S)
    if made.returncode and any(
        word in made.stderr for word in ("NewConnectionError", "Could not find a version", "Read timed out")
    ):
        pytest.skip(f"no package index can be reached: {made.stderr[-300:]}")
    assert made.returncode == 0, made.stderr[-2000:]
    return home / "bin" / "python"


def answers(python: Path | str, folder: Path) -> dict[str, dict]:
    """What `pb`, `bbd`, `audit` and `refine` answer there."""
    study = folder / "study"
    study.mkdir(parents=True)
    for name in ("study.toml", "measurements.csv"):
        shutil.copy(ROOT / "results" / "wet_beads" / name, study)
    paper = ROOT / "results" / "paper"
    factors = [word for f in ("B=0.90,0.82", "C=0.25,0.33", "G=0.10,0.18") for word in ("--factor", f)]
    commands = {
        "pb": ["pb", paper / "table07_design.csv"],
        "bbd": ["bbd", paper / "table12_design.csv", *factors, "--target", "41.69", "--uncertainty", "0.79"],
        "design": ["bbd", "--design", "A=1,2", "B=1,2", "C=1,2", "--seed", "1"],
        "audit": ["audit"],
        "refine": ["refine", study],
    }
    found = {}
    for name, words in commands.items():
        file = folder / f"{name}.json"
        done = subprocess.run(
            [str(python), "-m", "pellet_study", *map(str, words), "--json", str(file)],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr[-2000:]
        assert "Warning" not in done.stderr
        found[name] = json.loads(file.read_text())
    return found


def numbers(answer, place: str = "") -> dict[str, object]:
    """Everything in an answer, by its place."""
    if not isinstance(answer, dict | list):
        return {place: answer}
    parts = answer.items() if isinstance(answer, dict) else enumerate(answer)
    return {inner: value for name, part in parts for inner, value in numbers(part, f"{place}.{name}").items()}


def test_the_lowest_versions_give_the_same_numbers(lowest, tmp_path):
    there, here = answers(lowest, tmp_path / "lowest"), answers(sys.executable, tmp_path / "installed")
    for name in here:
        one, other = numbers(there[name]), numbers(here[name])
        assert one.keys() == other.keys() and len(one) > 20
        for place, value in one.items():
            if isinstance(value, float) and other[place] is not None:
                assert value == pytest.approx(other[place], rel=1e-4, abs=1e-9), f"{name}{place}"
            else:
                assert value == other[place], f"{name}{place}"


PACKAGE = {"name": "numpy", "version": "2.0", "vulns": []}
FINDING = {"name": "jinja2", "version": "3.0", "vulns": [{"id": "GHSA-0000"}]}
SKIPPED = {"name": "scipy", "skip_reason": "Dependency not found on PyPI"}


@pytest.mark.parametrize(
    "listed, status, words",
    [
        ([PACKAGE], 0, "1 of 1 packages were looked up"),
        ([PACKAGE, FINDING], 1, "GHSA-0000"),
        ([SKIPPED, SKIPPED], 3, "0 of 2 packages were looked up"),
        ([PACKAGE, SKIPPED], 3, "1 were not looked up"),
        ([], 3, "none is listed"),
        (None, 3, "gave no answer"),
    ],
)
def test_the_audit_fails_when_it_looked_nothing_up(tmp_path, listed, status, words):
    """A stub of pip-audit, which needs the network."""
    stub = tmp_path / "pip-audit"
    said = "no connection" if listed is None else json.dumps({"dependencies": listed, "fixes": []})
    stub.write_text(f"#!/bin/sh\ncat <<'END'\n{said}\nEND\n")
    stub.chmod(0o755)
    found = subprocess.run([ROOT / ".ci" / "vulnerabilities", stub, "x.txt"], capture_output=True, text=True)
    assert found.returncode == status and words in found.stdout + found.stderr
    assert ".ci/vulnerabilities" in DOCUMENTED
