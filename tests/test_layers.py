"""Imports go one way: from what measures and simulates to what reports, never back."""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ORDER = ["errors", "look", "terminal", "paper", "quadratic", "yade", "rigs", "store", "dispatch", "bench", "convergence", "law_checks",
         "bench_figure", "bench_report", "commands", "__main__"]  # fmt: skip


def imported(file: Path, package: str) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == package:
            rest = node.module.split(".")[1:]
            found |= {rest[0]} if rest else {alias.name for alias in node.names}
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[1] for alias in node.names if alias.name.startswith(f"{package}.")}
    return found


def test_modules_import_only_what_stands_before_them():
    for place, name in enumerate(ORDER):
        file = ROOT / "pellet_study" / f"{name}.py"
        if file.exists():
            after = set(ORDER[place:]) - {name}
            assert not imported(file, "pellet_study") & after, name


def test_yade_scripts_know_nothing_of_the_package():
    for file in (ROOT / "yade_scripts").rglob("*.py"):
        assert "pellet_study" not in {
            (node.module or "").split(".")[0]
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
            if isinstance(node, ast.ImportFrom)
        }, file
