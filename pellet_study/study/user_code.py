"""Rigs and effects of the user's own, of a study or of a library: files loaded, named when they are, and checked."""

import importlib.util
import logging
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from pellet_study.errors import InputError
from pellet_study.output.words import did_you_mean, nearest
from pellet_study.rigs.catalogue import Catalogue, declaring, standard
from pellet_study.rigs.declarations import effect_from, rig_from
from pellet_study.rigs.declared import Effect, Rig
from pellet_study.rigs.scripts import scene
from pellet_study.study.checked_code import checked_acts, checked_rig
from pellet_study.study.misplaced import refuse_misplaced

log = logging.getLogger(__name__)
Declared = TypeVar("Declared", Rig, Effect)


@dataclass(frozen=True)
class Own:
    """What the files of a folder declare, by file."""

    rigs: Mapping[Path, Rig]
    effects: Mapping[Path, Effect]


NOTHING = Own({}, {})


def catalogue_of(folder: Path | None, library: Path | None = None) -> Catalogue:
    """The package's rigs and effects and those in `rigs/` and `effects/` of a study, and of a library if one is given.

    Raises
    ------
    InputError : a file cannot be run, its declaration cannot be used, an effect would not act where it says, or a study
        and its library declare the same name
    """
    base = standard()
    study = NOTHING if folder is None else _own(folder, "code of the study's own", _refuse_link)
    shared = NOTHING if library is None else _library(library)
    if not any((study.rigs, study.effects, shared.rigs, shared.effects)):
        return base
    _refuse_both("rig", shared.rigs, study.rigs)
    _refuse_both("effect", shared.effects, study.effects)
    rigs, effects = {**shared.rigs, **study.rigs}, {**shared.effects, **study.effects}
    known = {**base.rigs, **{rig.name: rig if rig.on_yade else checked_rig(rig, file) for file, rig in rigs.items()}}
    for file, effect in effects.items():
        _refuse_idle(effect, file, known)
    checked = {e.name: replace(e, closed_form=checked_acts(e, file, base.rigs)) for file, e in effects.items()}
    everything = dict(sorted({**base.effects, **checked}.items(), key=lambda item: item[1].order))
    acting = {name: [e for e in everything.values() if e.file and name in e.rigs] for name in known}
    return Catalogue(
        {name: rig.with_effects(acting[name]) if rig.on_yade else rig for name, rig in known.items()}, everything
    )


def _own(folder: Path, whose: str, refuse: Callable[[Path], None]) -> Own:
    """The rigs and effects of a folder, loaded and named; one in the wrong place is refused."""
    refuse_misplaced(folder)
    rigs = {file: _declared(rig_from, file, whose, refuse) for file in declaring(folder / "rigs", "RIG")}
    effects = {
        file: _declared(effect_from, file, whose, refuse, file) for file in declaring(folder / "effects", "EFFECT")
    }
    _refuse_twins("rig", rigs)
    _refuse_twins("effect", effects)
    return Own(rigs, effects)


def _refuse_twins(what: str, declared: Mapping[Path, Rig] | Mapping[Path, Effect]) -> None:
    """Refuse a name that two files of a folder declare: one would silently take the other's place."""
    first: dict[str, Path] = {}
    for file, one in declared.items():
        if one.name in first:
            raise InputError(
                f"{file}: declares the {what} {one.name!r}, as {first[one.name]} does; give one of them another name, or call it "
                f"{file.name}.off if it is not meant"
            )
        first[one.name] = file


def _library(folder: Path) -> Own:
    """The rigs and effects of a library, a folder that has them as a study does."""

    def refuse(file: Path) -> None:
        if not file.resolve().is_relative_to(folder.resolve()):
            raise InputError(
                f"{file}: is a link to {file.resolve()}; code of a library is loaded from {folder} only, copy it there"
            )

    if not folder.is_dir():
        raise InputError(f"library {folder}: no such folder; expected one with effects/ and rigs/, as a study has them")
    found = _own(folder, f"code of the library {folder}", refuse)
    if not found.rigs and not found.effects:
        raise InputError(
            f"library {folder}: no file in its effects/ declares an EFFECT, none in its rigs/ a RIG; expected at least one"
        )
    return found


def _refuse_link(file: Path) -> None:
    if file.resolve() != file.parents[1].resolve() / file.parent.name / file.name:
        raise InputError(f"{file}: is a link to {file.resolve()}; code is loaded from the study's folder only, copy it")


def _refuse_both(what: str, shared: Mapping[Path, Rig | Effect], study: Mapping[Path, Rig | Effect]) -> None:
    """Refuse a name that a study and its library both declare: which of them is meant is not known."""
    of_library = {declared.name: file for file, declared in shared.items()}
    for file, declared in study.items():
        if declared.name in of_library:
            raise InputError(
                f"{what} {declared.name!r} is declared twice, in {of_library[declared.name]} of the library and in {file} "
                "of the study; rename one of them, or take it out"
            )


class _NoBytecode(SourceFileLoader):
    """Leaves no __pycache__ in a study."""

    def set_data(self, path: str, data: Any, *, _mode: int = 0o666) -> None:
        """Not kept."""


def _load(file: Path) -> ModuleType:
    """A file of the user's own, run as Python."""
    name = f"{file.parent.name}_{file.stem}"
    loader = _NoBytecode(name, str(file))
    spec = importlib.util.spec_from_loader(name, loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    try:
        loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise InputError(f"{file}: cannot be read as a rig or an effect: {type(error).__name__}: {error}") from error
    return module


def _declared(
    by: Callable[..., Declared], file: Path, whose: str, refuse: Callable[[Path], None], *more: Path
) -> Declared:
    """What a file of the user's own declares; it is named before it is run, and so is a mistake in its declaration."""
    refuse(file)
    log.info("running %s, %s", file, whose)
    try:
        return by(_load(file), file, *more)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{file}: its declaration cannot be used: {type(error).__name__}: {error}") from error


def _refuse_idle(effect: Effect, file: Path, known: Mapping[str, Rig]) -> None:
    """Refuse an effect that would silently do nothing in a rig it names."""
    if not isinstance(effect.rigs, Mapping):
        raise InputError(f"{file}: rigs: expected {{rig: where the effect shows in it}}, got {effect.rigs!r}")
    strange = [name for name in effect.rigs if name not in known]
    for name in strange:  # a file may be shared with a study that has a rig of its own
        if len(strange) == len(effect.rigs) or did_you_mean(name, known):
            raise InputError(
                f"{file}: rigs names {name!r}, a rig that comes neither with the package nor with a file of rigs/: put the rig's "
                f"file there (rigs/{name}.py), or name another{nearest(name, known)}"
            )
    formulas = [name for name, rig in known.items() if not rig.on_yade]
    for name in effect.closed_form:
        if name not in formulas and name not in strange:
            raise InputError(f"{file}: CLOSED_FORM: {name!r} is no closed-form rig{nearest(name, formulas)}")
    for name in set(effect.rigs) - set(strange):
        if name in formulas and name not in effect.closed_form:
            raise InputError(
                f"{file}: rigs names {name}, a closed-form rig, but CLOSED_FORM does not say what happens there; "
                f'add CLOSED_FORM = {{"{name}": act}}, or take {name} out of rigs'
            )
    if there := [name for name in effect.parameters_in if name in known and known[name].on_yade]:
        raise InputError(
            f"{file}: parameters_in names {', '.join(there)}, which runs on YADE, where an effect of your own has "
            "one set of parameters; make one file for each of its quantities"
        )
    on_yade = [name for name in effect.rigs if name in known and known[name].on_yade]
    _refuse_no_place(effect, file, {name: scene(known[name].script) for name in on_yade}, strange)


def _refuse_no_place(
    effect: Effect, file: Path, asked: Mapping[str, tuple[str, set[str]] | None], strange: Iterable[str]
) -> None:
    """Refuse an effect without a place in the scene of a rig on YADE it names, or with one that no such rig asks."""
    scenes = {name: found for name, found in asked.items() if found is not None}
    if len(scenes) < len(asked):
        return  # a rig with a scene of its own making, which may use the effect in any way
    for kind, given in effect.scenes.items():
        places: set[str] = set().union(*(some for of_rig, some in scenes.values() if of_rig == kind))
        if not places and strange:
            continue
        if not places:
            raise InputError(f"{file}: {kind} acts in none of the rigs it names ({', '.join(effect.rigs)})")
        for place in given:
            if place not in places:
                raise InputError(f"{file}: {kind}: place {place!r} is unknown{nearest(place, places)}")
    for name, (kind, places) in scenes.items():
        if not places & set(effect.scenes.get(kind, ())):
            raise InputError(
                f"{file}: rigs names {name}, which runs on YADE, but no {kind} says what happens there; add "
                f"{kind} = {{place: function}} with a place of {', '.join(sorted(places))}, or take {name} out of rigs"
            )
