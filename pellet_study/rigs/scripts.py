"""What the scripts of rigs on YADE import and ask, read from their text: nothing is run."""

import ast
import hashlib
import sys
import sysconfig
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


def modules_of(file: Path) -> list[Path]:
    """Modules of the user's own that a file of theirs imports, and those that these do, in the order of their names.

    They stand beside it, or on the path outside Python's own folders; what comes with Python, or was installed, is none.
    """
    seen: list[Path] = []
    waiting = [file]
    while waiting:
        source = waiting.pop()
        for one in _beside(source):
            if one not in seen and one != file:
                seen.append(one)
                waiting.append(one)
    return sorted(seen)


def _beside(file: Path) -> list[Path]:
    """The user's own modules that one file's imports name."""
    names: dict[str, None] = {}
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Import):
            names |= dict.fromkeys(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {node.module: None} | dict.fromkeys(f"{node.module}.{alias.name}" for alias in node.names)
    places = [file.parent, *(Path(p) for p in sys.path if p and _of_user(Path(p)))]
    found = []
    for name in names:
        if name.split(".")[0] in {*sys.stdlib_module_names, "yade_scripts", "pellet_study"}:
            continue
        stems = [place.joinpath(*name.split(".")) for place in places]
        tried = [option for stem in stems for option in (stem.with_suffix(".py"), stem / "__init__.py")]
        found += [option.resolve() for option in tried if option.is_file()][:1]
    return found


def _of_user(place: Path) -> bool:
    """Whether a folder of the path is none of Python's own, with what is installed there."""
    resolved = place.resolve()
    python = (Path(p).resolve() for p in {sys.prefix, sys.base_prefix, *sysconfig.get_paths().values()})
    return not any(resolved.is_relative_to(own) for own in python if own != Path("/"))


def _sources(files: Sequence[Path]) -> dict[Path, bytes]:
    """Some scripts and all that they import of yade_scripts."""
    seen: dict[Path, bytes] = {}
    waiting = list(files)
    while waiting:
        source = waiting.pop()
        if source not in seen and source.exists():
            seen[source] = source.read_bytes()
            waiting += imported(seen[source])
            waiting += [] if source.is_relative_to(SCRIPTS) else modules_of(source)
    return seen
