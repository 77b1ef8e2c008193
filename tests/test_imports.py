"""Imports of model criticism go one way: a module imports only what stands before it."""

import ast
from pathlib import Path

import pellet_study
from tests.make_study import command, folder

ORDER = (
    "errors rigs catalogue measurements own study engine response simulated model evidence calibrate compare diagnose levels refine terminal pages answers figures "
    "challenge commands"
).split()
PACKAGE = Path(pellet_study.__file__).resolve().parent


def imported(file: Path) -> set[str]:
    """First names below pellet_study that a file imports."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "pellet_study":
            below = node.module.split(".")[1:2]
            found |= set(below) if below else {alias.name for alias in node.names}
    return found


def test_one_way():
    for k, name in enumerate(ORDER):
        path = PACKAGE / f"{name}.py"
        for file in [path] if path.exists() else sorted((PACKAGE / name).glob("*.py")):
            later = imported(file) & set(ORDER[k + 1 :])
            assert not later, f"{file.name} imports {later}, which stand after it"


def test_closed_forms_do_without_heavy_libraries(tmp_path):
    import subprocess
    import sys

    code = (
        "import sys, pellet_study.refine, pellet_study.answers\n"
        "assert not {'pandas', 'statsmodels', 'matplotlib'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_without_yade_its_rigs_cannot_be_compared(tmp_path, capsys, monkeypatch):
    from pellet_study import yade

    monkeypatch.setenv("PELLET_STUDY_YADE", str(tmp_path / "nowhere"))
    yade.executable.cache_clear()
    yade.version.cache_clear()
    study = folder(tmp_path, ["rig,observable,value,drop_height_mm", "rebound,rebound_height_mm,8,120"])
    status, _ = command("compare", study)
    yade.executable.cache_clear()
    yade.version.cache_clear()
    assert status == 2 and "nowhere" in capsys.readouterr().err
