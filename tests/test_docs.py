"""The walk-throughs of docs/, done as they stand: files written, commands run, printed lines met in their order."""

import importlib
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

from pellet_study.__main__ import main
from tests import ROOT
from tests.helpers.heap_photographs import draw

STEP = re.compile(
    r"<!-- file: (?P<file>\S+) -->\n```\w*\n(?P<content>.*?)```"
    r"|<!-- copy: (?P<source>\S+) (?P<target>\S+) -->"
    r"|```console\n(?P<console>.*?)```",
    re.DOTALL,
)
WALKS = (
    "first_study",
    "designs",
    "design_tables",
    "calibrate_your_own_powder",
    "find_the_missing_effect",
    "add_a_rig_and_an_effect",
    "audit_a_paper",
)


def photographs() -> None:
    """Four heaps of about 41.69 deg, in place of the reader's own."""
    from PIL import Image

    for k, angle in enumerate((40.9, 41.3, 42.1, 42.5), start=1):
        Image.fromarray(np.uint8(255 * draw(angle, angle, seed=k))).save(f"heap_{k}.png")


def met(expected: list[str], printed: str) -> None:
    """Each line stands in what was printed, in this order; `...` is anything."""
    place = 0
    for line in expected:
        if line.strip() in ("", "..."):
            continue
        pattern = ".*".join(map(re.escape, line.rstrip().split("...")))
        found = re.compile(f"^{pattern}$", re.MULTILINE).search(printed, place)
        assert found, f"{line!r} was not printed after character {place} of:\n{printed}"
        place = found.end()


@pytest.mark.parametrize("name", WALKS)
def test_walk_through(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    if "angle heap_1" in (text := (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")):
        pytest.importorskip("skimage")
        photographs()
    commands = 0
    for step in STEP.finditer(text):
        if step["file"]:
            Path(step["file"]).parent.mkdir(parents=True, exist_ok=True)
            Path(step["file"]).write_text(step["content"], encoding="utf-8")
        elif step["source"]:
            shutil.copy(ROOT / step["source"], step["target"])
        else:
            for block in re.split(r"^\$ ", step["console"], flags=re.MULTILINE)[1:]:
                line, *expected = block.splitlines()
                program, *arguments = shlex.split(line)
                assert program == "pellet-study", line
                assert main(arguments) == 0, capsys.readouterr().err
                met(expected, capsys.readouterr().out)
                commands += 1
    assert commands >= 3


CONSTANT = re.compile(r"^\| `(\w+)\.([A-Z_]+)` \| (\S+) \|", re.MULTILINE)


def numbers_of(module: str) -> dict[str, float]:
    """The numbers that a module of the criticism names."""
    held = vars(importlib.import_module(f"pellet_study.criticism.{module}"))
    written = (ROOT / "pellet_study" / "criticism" / f"{module}.py").read_text(encoding="utf-8")
    own = set(re.findall(r"^([A-Z_]+)(?:: \w+)? = ", written, re.MULTILINE))
    return {name: held[name] for name in own if isinstance(held[name], int | float)}


def test_every_constant_of_a_verdict_is_explained_with_its_number():
    modules = [file.stem for file in (ROOT / "pellet_study" / "criticism").glob("*.py") if file.stem != "__init__"]
    held = {f"{module}.{name}": value for module in modules for name, value in numbers_of(module).items()}
    page = (ROOT / "docs" / "method.md").read_text(encoding="utf-8")
    told = {f"{module}.{name}": float(value) for module, name, value in CONSTANT.findall(page)}
    assert told == held
