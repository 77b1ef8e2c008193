"""The answers in results/ are those of today's code."""

import json
import shutil

import pytest

from pellet_study.__main__ import main
from tests import ROOT

STUDIES = ("wet_beads", "caco3")


@pytest.mark.parametrize("name", STUDIES)
def test_refine_writes_what_is_committed(name, tmp_path, monkeypatch, capsys):
    """From study.toml and measurements.csv alone, word by word and number by number."""
    there = ROOT / "results" / name
    here = tmp_path / "results" / name
    here.mkdir(parents=True)
    for file in ("study.toml", "measurements.csv"):
        shutil.copy(there / file, here / file)
    monkeypatch.chdir(tmp_path)
    assert main(["diagnose", f"results/{name}"]) == 0
    assert main(["refine", f"results/{name}"]) == 0
    for file in ("diagnose.txt", "refine.txt", "compare.txt"):
        assert (here / file).read_text() == (there / file).read_text(), file
    for file in ("diagnose.json", "refine.json", "compare.json"):
        same(json.loads((here / file).read_text()), json.loads((there / file).read_text()), file)


def same(made, committed, where):
    """Equal but for the last digits, which are a machine's."""
    if isinstance(made, dict):
        assert made.keys() == committed.keys(), where
        for key in made:
            same(made[key], committed[key], f"{where}: {key}")
    elif isinstance(made, list):
        assert len(made) == len(committed), where
        for k, (one, other) in enumerate(zip(made, committed, strict=True)):
            same(one, other, f"{where}[{k}]")
    elif isinstance(made, float):
        assert made == pytest.approx(committed, rel=1e-4, abs=1e-9), where
    else:
        assert made == committed, where
