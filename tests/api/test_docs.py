"""Examples of the Python API: docs/python.md, the README and the docstrings, run as they stand."""

import doctest
import importlib
import re
import shutil

import pytest

from tests import ROOT

BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A folder that looks like the project's where the examples read from it, and may be written to."""
    for study in ("wet_beads", "caco3", "paper"):
        shutil.copytree(ROOT / "results" / study, tmp_path / "results" / study)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.yade
def test_the_page_runs_from_top_to_bottom(project):
    names: dict = {}
    blocks = BLOCK.findall((ROOT / "docs" / "python.md").read_text(encoding="utf-8"))
    assert len(blocks) >= 7
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), names)
    assert (project / "criticism.svg").stat().st_size > 5_000
    assert set(names["table"]["status"]) == {"ok"}


def test_the_readme_lines_print_the_ladder(project, capsys):
    (block,) = BLOCK.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    exec(compile(block, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert re.search(r"1 +cohesion +11\.2", printed), printed


@pytest.mark.parametrize("name", ["answers", "studies", "criticism", "simulation", "figures"])
def test_docstrings(project, name):
    found = doctest.testmod(importlib.import_module(f"pellet_study.api.{name}"))
    assert not found.failed
