"""The pages: walk-throughs and README done as they stand, links followed, the reference held against the code, the site built."""

import importlib
import re
import shutil
import subprocess
import sys
from pathlib import Path
from runpy import run_path

import numpy as np
import pytest

from pellet_study.__main__ import main
from tests import ROOT
from tests.helpers.heap_photographs import draw
from tests.helpers.walking import follow

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


def answered(capsys):
    """Calls a command and holds what it prints against what the page says."""

    def call(arguments: list[str], expected: list[str]) -> None:
        assert main(arguments) == 0, capsys.readouterr().err
        met(expected, capsys.readouterr().out)

    return call


@pytest.mark.parametrize("name", WALKS)
def test_walk_through(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    page = ROOT / "docs" / f"{name}.md"
    if "angle heap_1" in page.read_text(encoding="utf-8"):
        pytest.importorskip("skimage")
        photographs()
    assert len(follow(page, answered(capsys))) >= 3


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


LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


def anchors(page: Path) -> set[str]:
    """The headings of a page as links name them."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    plain = [re.sub(r"[^\w\- ]", "", line.lower()) for line in re.findall(r"^#+ (.*)$", text, re.MULTILINE)]
    return {line.strip().replace(" ", "-") for line in plain}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page):
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    for link in LINK.findall(text):
        if "://" in link:
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        assert target.is_file(), f"{link} leads to no file"
        assert not anchor or anchor in anchors(target), f"{link} leads to no heading"


def test_reference_pages_say_what_the_code_declares():
    made = run_path(str(ROOT / "docs" / "generate" / "reference.py"))["pages"]()
    stale = [file.name for file, text in made.items() if file.read_text(encoding="utf-8") != text]
    assert not stale, f"run `make reference`: {', '.join(stale)}"
    assert {file.name for file in made} == {file.name for file in (ROOT / "docs" / "reference").iterdir()}


def test_the_site_is_built_without_a_warning(tmp_path):
    pytest.importorskip("mkdocs")
    site = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert site.returncode == 0, site.stderr
    assert (tmp_path / "site" / "method.html").is_file()
    assert (tmp_path / "site" / "results" / "wet_beads" / "figures" / "ladder.png").is_file()


def test_the_readme_is_short_and_its_commands_answer(tmp_path, monkeypatch, capsys):
    page = ROOT / "README.md"
    assert len(page.read_text(encoding="utf-8").splitlines()) <= 160
    shutil.copytree(ROOT / "results" / "wet_beads", tmp_path / "results" / "wet_beads")
    shutil.copytree(ROOT / "results" / "paper", tmp_path / "results" / "paper")
    monkeypatch.chdir(tmp_path)
    asked = follow(page, answered(capsys))
    assert {"refine", "report", "drop", "init", "check", "history", "pb", "bbd", "audit"} <= set(asked)
