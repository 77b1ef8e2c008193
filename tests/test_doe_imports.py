"""The modules of `doe` import one way, as its docstring says."""

import ast
from pathlib import Path

import pellet_study.doe

ORDER = [
    "factors",
    "design_table",
    "linear_model",
    "plackett_burman",
    "box_behnken",
    "steepest_climb",
    "optimum",
    "validation",
    "answers",
    "figures",
    "text",
]


def test_imports_go_one_way():
    folder = Path(pellet_study.doe.__file__).parent
    assert sorted(path.stem for path in folder.glob("*.py")) == sorted([*ORDER, "__init__"])
    for position, name in enumerate(ORDER):
        for node in ast.walk(ast.parse((folder / f"{name}.py").read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module.startswith("pellet_study."):
                imported = node.module.split(".")[-1]
                assert imported in ("errors", "look", *ORDER[:position]), f"{name} imports {imported}"
