"""What the pages name is there: options of the commands, files of the project, tests of the faults."""

import re

import pytest

from pellet_study import __main__ as command_line
from pellet_study.commands import COMMANDS
from tests import ROOT

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
CALL = re.compile(rf"pellet-study ({'|'.join(COMMANDS)})\b([^`\n]*)")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
OF_OTHERS = {"--host", "--interface", "--no-dashboard", "--nthreads", "--protocol", "--exclude-editable"}  # dask, pip
MADE = ("results/quick/report.html", "results/quick/powder", "docs/api", "yade_scripts/my_rig.py")  # by the reader


def options_of(command: str) -> set[str]:
    """Every option of a command, those of its verbs too."""
    found = set()
    parsers = [command_line._parser(command)]
    while parsers:
        for action in parsers.pop()._actions:
            found |= set(action.option_strings)
            if isinstance(action.choices, dict):
                parsers += [p for name, p in action.choices.items() if name == command or name not in COMMANDS]
    return found


OPTIONS = {command: options_of(command) for command in COMMANDS}


def of_scripts() -> set[str]:
    """Options of the scripts that are called by hand."""
    files = [*(ROOT / "benchmarks").rglob("*.py"), *(ROOT / "yade_scripts").glob("*.py"), ROOT / ".ci" / "debian13"]
    return {option for file in files for option in OPTION.findall(file.read_text(encoding="utf-8"))}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_options_are_those_of_the_command_that_a_page_calls(page):
    text = page.read_text(encoding="utf-8")
    for command, words in CALL.findall(text):
        given = OPTION.findall(words.split(" # ")[0].split("; ")[0].split(" && ")[0])
        unknown = set(given) - OPTIONS[command]
        assert not unknown, f"pellet-study {command} has no {', '.join(unknown)}"
    known = set().union(*OPTIONS.values(), of_scripts(), OF_OTHERS)
    assert set(OPTION.findall(re.sub(r"\]\([^)]*\)", "]", text))) <= known


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_files_of_the_project_that_a_page_names_are_there(page):
    named = re.findall(
        r"(?<![\w/.-])((?:results|benchmarks|tests|docs|yade_scripts|pellet_study|\.ci)/[\w./*-]+)",
        page.read_text(encoding="utf-8"),
    )
    for name in {name.rstrip(".") for name in named} - set(MADE):
        assert any(ROOT.glob(name.rstrip("/"))), f"{name} is not there"


def test_each_fault_names_tests_that_are_there():
    tests: dict[str, str] = {}
    for found in (ROOT / "tests").rglob("test_*.py"):  # two rooms may have a file of one name
        tests[found.name] = tests.get(found.name, "") + found.read_text(encoding="utf-8")
    for row in (ROOT / "docs" / "faults.md").read_text(encoding="utf-8").splitlines():
        file = None
        for part in re.findall(r"`([^`]*test_[^`]*)`", row):
            *before, test = part.split("::")
            file = before[0] if before else file
            if test.endswith(".py"):
                assert test.rsplit("/", 1)[-1] in tests, test
            else:
                assert file in tests and f"def {test}(" in tests[file], f"{file} has no {test}"
