"""What the scripts of rigs on YADE import and ask, read from their text: nothing is run."""

import ast
import hashlib
from collections.abc import Sequence
from pathlib import Path

import yade_scripts
from yade_scripts.acting import READING
from yade_scripts.effects import acting_in

SCRIPTS = Path(yade_scripts.__file__).resolve().parent


def fingerprint(file: Path, extra: Sequence[Path] = ()) -> str:
    """Hash of every script the answer depends on: the rig's file, effects beyond its own, case.py, and their imports."""
    seen = _sources([file, *extra, SCRIPTS / "case.py"])
    digest = hashlib.sha256()
    for source in sorted(seen, key=lambda path: (path != file, path.name)):
        digest.update(seen[source])
    return digest.hexdigest()


def scene(file: Path) -> tuple[str, set[str]] | None:
    """What an effect in a rig calls its places, and the places that the rig's scripts ask; None without any of them.

    An effect on readings acts on what any rig has observed (`case.run`).
    """
    sources = _sources([file])
    asked = {
        str(node.args[0].value)
        for source in sources.values()
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "at"
        if node.args and isinstance(node.args[0], ast.Constant)
    }
    if not asked or SCRIPTS / "acting.py" not in sources:
        return None
    return "POWDER_SCENE" if SCRIPTS / "powder_scene.py" in sources else "SEED_SCENE", asked | {READING}


def imported(source: bytes) -> list[Path]:
    """Files of yade_scripts that a script's imports name, and the effects that it finds by their declarations."""
    found: list[Path] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "acting_in":
            found += [Path(str(effect.__file__)) for effect in acting_in(*map(ast.literal_eval, node.args))]
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "yade_scripts":
            folder = SCRIPTS.joinpath(*node.module.split(".")[1:])
            found += [folder.with_suffix(".py"), *(folder / f"{alias.name}.py" for alias in node.names)]
    return found


def _sources(files: Sequence[Path]) -> dict[Path, bytes]:
    """Some scripts and all that they import of yade_scripts."""
    seen: dict[Path, bytes] = {}
    waiting = list(files)
    while waiting:
        source = waiting.pop()
        if source not in seen and source.exists():
            seen[source] = source.read_bytes()
            waiting += imported(seen[source])
    return seen
