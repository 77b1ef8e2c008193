"""The house: every module stands in a room, and imports go one way, between rooms and inside each.

A room is a folder of `pellet_study`; its `__init__` names its files in order, in a line such as

    cell_means < least_squares < calibration, score_tests < compare

where what stands left of a `<` may be imported by what stands right of it, and files parted by commas do not import each
other. `ROOMS` says which rooms a room may import from.
"""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import pellet_study

PACKAGE = Path(pellet_study.__file__).resolve().parent
SCRIPTS = PACKAGE.parent / "yade_scripts"
SIMULATION = "errors files output tables rigs study simulation"
ROOMS = {
    "starting": "",
    "errors": "",
    "files": "errors",
    "output": "errors files",
    "tables": "errors files",
    "rigs": "errors files output",
    "study": "errors files output tables rigs",
    "simulation": "errors files output tables rigs",
    "model": SIMULATION,
    "criticism": f"{SIMULATION} model",
    "doe": "errors files output tables",
    "paper": "errors files output doe",
    "heap": "errors files output",
    "bench": f"{SIMULATION} doe paper",
    "powder": f"{SIMULATION} doe paper heap bench",
    "report": f"{SIMULATION} model criticism doe paper heap bench powder",
    "challenge": f"{SIMULATION} model criticism",
    "api": f"{SIMULATION} model criticism doe powder",
    "commands": f"{SIMULATION} model criticism doe paper heap bench powder report challenge api",
    "__main__": "starting errors files output study commands",
}
ORDER = re.compile(r"(< )?[\w/]+(( <|,) [\w/]+)*,?")  # a line of an order: names parted by `<` or commas


def order_of(room: str) -> list[list[str]]:
    """The files of a room as its `__init__` names them: groups in order, the files of a group beside each other."""
    file = PACKAGE / room / "__init__.py"
    if not file.exists():
        return [[room]]
    text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8")), clean=False) or ""
    lines = [line.strip() for line in text.splitlines() if ORDER.fullmatch(line.strip())]
    words = " ".join(lines)
    return [[name.strip() for name in group.split(",") if name.strip()] for group in words.split("<") if group.strip()]


def files() -> dict[str, Path]:
    """Every file of the package that is no `__init__`, by its path below it without the ending."""
    found = {str(f.relative_to(PACKAGE).with_suffix("")): f for f in PACKAGE.rglob("*.py") if f.stem != "__init__"}
    return {name: f for name, f in found.items() if "/outside/" not in name}  # effects that trials hide, data to them


def places() -> dict[str, tuple[str, int]]:
    """The room of every file, and its place in it."""
    found = {}
    for room in ROOMS:
        for place, group in enumerate(order_of(room)):
            for name in group:
                found[f"{room}/{name}" if (PACKAGE / room).is_dir() else name] = room, place
    return found


def imported(file: Path) -> set[str]:
    """Files of the package, or rooms, that a file imports."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "pellet_study":
            below = node.module.split(".")[1:]
            found |= (
                {"/".join([*below, alias.name]) for alias in node.names}
                if below != []
                else {a.name for a in node.names}
            )
            found.add("/".join(below))
        if isinstance(node, ast.Import):
            found |= {
                "/".join(alias.name.split(".")[1:]) for alias in node.names if alias.name.startswith("pellet_study.")
            }
    return found - {""}


def test_every_file_stands_in_a_room():
    unknown, gone = set(files()) - set(places()), set(places()) - set(files())
    assert not unknown, f"in no room: {sorted(unknown)}; name them in their room's __init__"
    assert not gone, f"named in a room, but there is no such file: {sorted(gone)}"


@pytest.mark.parametrize("room", ROOMS)
def test_imports_go_one_way(room):
    known = places()
    for name, (there, place) in known.items():
        if there != room:
            continue
        for other in imported(files()[name]):
            if other in known:
                theirs, before = known[other]
                fine = before < place if theirs == room else theirs in ROOMS[room].split()
                assert fine or other == name, f"{name} imports {other}"
            elif (PACKAGE / other / "__init__.py").exists() and other in ROOMS:
                assert other in ROOMS[room].split() or other == room, f"{name} imports the room {other}"


def test_rooms_stand_in_order():
    seen = set()
    for room, may in ROOMS.items():
        assert set(may.split()) <= seen, room
        seen.add(room)


@pytest.mark.parametrize(
    "module, heavy",
    [
        ("criticism.refine", "pandas statsmodels matplotlib jinja2 tqdm skimage distributed"),
        ("criticism.answers", "pandas statsmodels matplotlib jinja2 tqdm skimage distributed"),
        ("commands", "numpy scipy pandas statsmodels matplotlib"),
        ("study", "scipy pandas statsmodels matplotlib"),
    ],
)
def test_light_commands_load_no_heavy_library(module, heavy):
    code = f"import sys, pellet_study.{module}; print(*{{*'{heavy}'.split()}} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert not done.stdout.strip(), f"pellet_study.{module} loads {done.stdout}"


def test_yade_scripts_know_nothing_of_the_package():
    for file in SCRIPTS.rglob("*.py"):
        assert "pellet_study" not in {
            (node.module or "").split(".")[0]
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
            if isinstance(node, ast.ImportFrom)
        }, file
