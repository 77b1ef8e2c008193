"""The YADE rigs: what each declares, and complete cases for them."""

import ast
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from pathlib import Path

import yade_scripts
from pellet_study.errors import InputError
from yade_scripts import case as case_file
from yade_scripts.effects import acting_in

SCRIPTS = Path(yade_scripts.__file__).resolve().parent
FOLDERS = [SCRIPTS, SCRIPTS / "checks"]
# Numerics that a law needs in a rig where the rig's own default is another law's: a dense fill of Mindlin contacts gives wrong
# angles, or blows up, at 0.18 of the Rayleigh step (docs/heap_checks.md).
OF_LAW = {("repose", law): {"time_step_fraction": 0.09} for law in ("hertz_mindlin", "cohesive_frictional_restitution")}
_used: dict[str, tuple[Path, tuple[Path, ...]]] = {}


@dataclass(frozen=True)
class YadeRig:
    """What the file of a rig that runs on YADE declares; `catalogue.Rig` is any rig as the model sees it.

    `parameters`, `conditions` and `numerics` map names to {default, min, max, unit, meaning}; `effects` maps an
    effect's name to its parameters with the value that means absent; `random` rigs scatter over the seed, and `seeds`
    of them make a mean; in `paired` ones the same seed ends nearly alike in nearly the same case; `extra` are files of
    effects beyond the rig's own.
    """

    name: str
    file: Path
    contact_laws: tuple[str, ...]
    parameters: dict
    conditions: dict
    effects: dict
    numerics: dict
    observables: dict
    random: bool
    time_limit_s: float
    fingerprint: str
    seeds: int = 1
    paired: bool = False
    extra: tuple[Path, ...] = ()


def fingerprint(file: Path, extra: Sequence[Path] = ()) -> str:
    """Hash of every script the answer depends on: the rig's file, effects beyond its own, case.py, and their imports."""
    seen = _sources([file, *extra, SCRIPTS / "case.py"])
    digest = hashlib.sha256()
    for source in sorted(seen, key=lambda path: (path != file, path.name)):
        digest.update(seen[source])
    return digest.hexdigest()


def scene(file: Path) -> tuple[str, set[str]] | None:
    """What an effect in a rig calls its places, and the places that the rig's scripts ask; None without any of them."""
    sources = _sources([file])
    asked = {
        node.args[0].value
        for source in sources.values()
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "at"
        if node.args and isinstance(node.args[0], ast.Constant)
    }
    if not asked or SCRIPTS / "acting.py" not in sources:
        return None
    return "POWDER_SCENE" if SCRIPTS / "powder_scene.py" in sources else "SEED_SCENE", asked


def _sources(files: Sequence[Path]) -> dict[Path, bytes]:
    """Some scripts and all that they import of yade_scripts."""
    seen: dict[Path, bytes] = {}
    waiting = list(files)
    while waiting:
        source = waiting.pop()
        if source not in seen and source.exists():
            seen[source] = source.read_bytes()
            waiting += _imported(seen[source])
    return seen


def _imported(source: bytes) -> list[Path]:
    """Files of yade_scripts that a script's import statements name, and the effects that it finds by their declarations."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "acting_in":
            found += [Path(effect.__file__) for effect in acting_in(*map(ast.literal_eval, node.args))]
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "yade_scripts":
            folder = SCRIPTS.joinpath(*node.module.split(".")[1:])
            found += [folder.with_suffix(".py"), *(folder / f"{alias.name}.py" for alias in node.names)]
    return found


def _files() -> dict[str, tuple[Path, tuple[Path, ...]]]:
    """Rigs by name, with effects beyond their own: files in FOLDERS that declare a RIG, and those in use."""
    files = [file for folder in FOLDERS for file in sorted(folder.glob("*.py"))]
    return {file.stem: (file, ()) for file in files if "\nRIG = {" in file.read_text(encoding="utf-8")} | _used


def use(name: str, file: Path, effects: Sequence[Path] = ()) -> None:
    """From here on the rig of that name is the one in a file, and also knows the effects in some files."""
    files = (file.resolve(), tuple(effect.resolve() for effect in effects))  # YADE runs in another folder
    if _used.get(name) != files:
        _used[name] = files
        rig.cache_clear()


@cache
def rig(name: str) -> YadeRig:
    """The rig of that name.

    Raises
    ------
    InputError : no such rig, or it cannot be used with the effects beyond its own
    """
    files = _files()
    if name not in files:
        near = get_close_matches(name, files, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise InputError(f"rig {name!r} is unknown; there are {', '.join(sorted(files))}{hint}")
    file, extra = files[name]
    try:
        declaration = case_file.load(file, extra).RIG
    except AttributeError as error:
        raise InputError(
            f"{file}: {error}; a rig with effects has EFFECTS, a tuple of modules, () where it has none"
        ) from None
    clash = set(declaration["observables"]) & set(case_file.flat(case_file.example(declaration)))
    if clash:
        raise InputError(f"{file}: {', '.join(sorted(clash))} is both an input and an observable; rename one")
    return YadeRig(
        file=file,
        extra=extra,
        fingerprint=fingerprint(file, extra),
        **{k: tuple(v) if k == "contact_laws" else v for k, v in declaration.items() if k != "readable"},
    )


def case(
    name: str,
    *,
    contact_law: str | None = None,
    seed: int = 0,
    parameters: Mapping[str, float] | None = None,
    conditions: Mapping[str, float] | None = None,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    numerics: Mapping[str, float] | None = None,
) -> dict:
    """A complete case of a rig: what is not given keeps the rig's default.

    Raises
    ------
    InputError : a name the rig does not know
    """
    declared = rig(name)
    complete = {"rig": name, "contact_law": contact_law or declared.contact_laws[0], "seed": int(seed)}
    given = {"parameters": parameters, "conditions": conditions, "numerics": numerics}
    for group, values in given.items():
        known = getattr(declared, group)
        defaults = {key: quantity["default"] for key, quantity in known.items()}
        if group == "numerics":
            defaults |= OF_LAW.get((name, complete["contact_law"]), {})
        complete[group] = defaults | _known(name, group, values or {}, known)
    complete["effects"] = {
        effect: absent | _known(name, effect, (effects or {}).get(effect, {}), absent)
        for effect, absent in case_file.absent(vars(declared)).items()
    }
    _known(name, "effects", effects or {}, declared.effects)
    return complete


def _known(rig_name: str, group: str, values: Mapping, known: Mapping) -> dict:
    for key in values:
        if key not in known:
            near = get_close_matches(key, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise InputError(f"rig {rig_name} has no {group[:-1] if group.endswith('s') else group} {key!r}{hint}")
    return {key: float(value) if isinstance(value, (int, float)) else value for key, value in values.items()}
