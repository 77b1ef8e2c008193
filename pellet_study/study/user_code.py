"""A study's own rigs and effects: files loaded, declarations checked, and their mistakes told with file and line."""

import importlib.util
import logging
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import wraps
from importlib.machinery import SourceFileLoader
from pathlib import Path

import numpy as np

from pellet_study.errors import InputError, StudyError
from pellet_study.output.words import nearest
from pellet_study.rigs import on_yade
from pellet_study.rigs.catalogue import (
    Acting,
    Catalogue,
    Effect,
    Rig,
    declaring,
    effect_from,
    rig_from,
    standard,
)
from pellet_study.study.measurements import Measurement

INERT = 1e-6  # relative change of a prediction by an effect at `absent`: what a rig's solver leaves
log = logging.getLogger(__name__)


def of_study(folder: Path) -> Catalogue:
    """The package's rigs and effects and those of a study's `rigs/` and `effects/`.

    Raises
    ------
    InputError : a file cannot be run, its declaration cannot be used, or an effect would not act where it says
    """
    base = standard()
    own = [_declared(rig_from, file) for file in declaring(folder / "rigs", "RIG")]
    effects = [_declared(effect_from, file, own=file) for file in declaring(folder / "effects", "EFFECT")]
    known = {**base.rigs, **{rig.name: rig if rig.predict is None else _careful_rig(rig) for rig in own}}
    for effect in effects:
        _refuse_idle(effect, known)
    careful = {effect.name: replace(effect, closed_form=_careful_acts(effect, base.rigs)) for effect in effects}
    everything = {**base.effects, **careful}
    return Catalogue(known, dict(sorted(everything.items(), key=lambda item: item[1].order)))


def try_out(catalogue: Catalogue, rows: Sequence[Measurement], settings: Mapping[str, float]) -> None:
    """Ask closed forms that the study's own code has a part in for its rows, without effects and with each at `absent`.

    Raises
    ------
    InputError : a prediction fails, or an effect at `absent` changes it
    """
    for name in dict.fromkeys(row.rig for row in rows):
        rig, here = catalogue.rigs[name], [row for row in rows if row.rig == name]
        effects = [effect for effect in catalogue.effects.values() if effect.own and name in effect.closed_form]
        if rig.predict is None or (rig is standard().rigs.get(name) and not effects):
            continue
        shape = (2, len(here))  # two points: an answer in a wrong shape is seen
        parameters = {p: np.full((2, 1), settings.get(p, known["default"])) for p, known in rig.parameters.items()}
        conditions = {c: np.array([row.conditions[c] for row in here]) for c in rig.conditions}
        conditions["median_normal_stress_pa"] = 1.0
        without = rig.predict(parameters, conditions, {})
        for effect in effects:
            absent = {p: np.full((2, 1), value) for p, value in effect.neutral().items()}
            present = rig.predict(parameters, conditions, {effect.name: Acting(effect.closed_form[name], absent)})
            for observable in rig.observables:
                before, after = (np.broadcast_to(found[observable], shape)[0] for found in (without, present))
                worst = int(np.argmax(np.abs(after - before)))
                if abs(after[worst] - before[worst]) > INERT * np.abs(before).max():
                    raise InputError(
                        f"{effect.own}: {effect.name} is not inert where it is absent: with {effect.amount} = "
                        f"{effect.neutral()[effect.amount]:g} it makes {observable} of {name} {after[worst]:.6g} instead "
                        f"of {before[worst]:.6g}; at `absent` an effect must change nothing"
                    )


class _NoBytecode(SourceFileLoader):
    """Leaves no __pycache__ in a study."""

    def set_data(self, path, data, *, _mode=0o666):
        """Not kept."""


def _load(file: Path):
    """A file of the study's own, run as Python; it is named before, and must lie in the study itself."""
    if file.resolve() != file.parents[1].resolve() / file.parent.name / file.name:
        raise InputError(f"{file}: is a link to {file.resolve()}; code is loaded from the study's folder only, copy it")
    log.info("running %s, code of the study's own", file)
    name = f"{file.parent.name}_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file, loader=_NoBytecode(name, str(file)))
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise InputError(f"{file}: cannot be read as a rig or an effect: {type(error).__name__}: {error}") from error
    return module


def _declared(by: Callable, file: Path, **more):
    """What a file of the study's own declares; a mistake in it is named."""
    try:
        return by(_load(file), file, **more)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{file}: its declaration cannot be used: {type(error).__name__}: {error}") from error


def _refuse_idle(effect: Effect, known: Mapping[str, Rig]) -> None:
    """Refuse an effect that would silently do nothing in a rig it names."""
    if not isinstance(effect.rigs, Mapping):
        raise InputError(f"{effect.own}: rigs: expected {{rig: where the effect shows in it}}, got {effect.rigs!r}")
    strange = [name for name in effect.rigs if name not in known]
    for name in strange:  # a file may be shared with a study that has a rig of its own
        if len(strange) == len(effect.rigs) or get_close_matches(name, known):
            raise InputError(f"{effect.own}: rigs: rig {name!r} is unknown{nearest(name, known)}")
    formulas = [name for name, rig in known.items() if rig.predict is not None]
    for name in effect.closed_form:
        if name not in formulas and name not in strange:
            raise InputError(f"{effect.own}: CLOSED_FORM: {name!r} is no closed-form rig{nearest(name, formulas)}")
    for name in set(effect.rigs) - set(strange):
        if name in formulas and name not in effect.closed_form:
            raise InputError(
                f"{effect.own}: rigs names {name}, a closed-form rig, but CLOSED_FORM does not say what happens there; "
                f'add CLOSED_FORM = {{"{name}": act}}, or take {name} out of rigs'
            )
    if there := [name for name in effect.parameters_in if name in known and known[name].predict is None]:
        raise InputError(
            f"{effect.own}: parameters_in names {', '.join(there)}, which runs on YADE, where an effect of your own has "
            "one set of parameters; make one file for each of its quantities"
        )
    asked = {name: on_yade.scene(known[name].file) for name in effect.rigs if name in known and name not in formulas}
    if None in asked.values():
        return  # a rig with a scene of its own making, which may use the effect in any way
    for scene, given in effect.scenes.items():
        places = set().union(*(some for of_rig, some in asked.values() if of_rig == scene))
        if not places and strange:
            continue
        if not places:
            raise InputError(f"{effect.own}: {scene} acts in none of the rigs it names ({', '.join(effect.rigs)})")
        for place in given:
            if place not in places:
                raise InputError(f"{effect.own}: {scene}: place {place!r} is unknown{nearest(place, places)}")
    for name, (scene, places) in asked.items():
        if not places & set(effect.scenes.get(scene, ())):
            raise InputError(
                f"{effect.own}: rigs names {name}, which runs on YADE, but no {scene} says what happens there; add "
                f"{scene} = {{place: function}} with a place of {', '.join(sorted(places))}, or take {name} out of rigs"
            )


def _careful_rig(rig: Rig) -> Rig:
    """A closed-form rig whose mistakes are told: what is raised, names, shapes, numbers that are none."""

    def predict(parameters, conditions, effects):
        found = _called(rig.predict, rig.file, parameters, conditions, effects)
        if not isinstance(found, Mapping) or set(rig.observables) - set(found):
            given = ", ".join(map(str, found)) if isinstance(found, Mapping) else type(found).__name__
            raise InputError(
                f"{rig.file}: predict returned {given or 'nothing'}; expected a dictionary with {', '.join(rig.observables)}"
            )
        values = {f"{e}.{p}": v for e, (_, of_effect) in effects.items() for p, v in of_effect.items()}
        given = {**parameters, **conditions, **values}
        return {o: _checked(found[o], f"{rig.file}: predict: {o}", given) for o in rig.observables}

    def normal_stress(conditions, values):
        return _called(rig.normal_stress, rig.file, conditions, values)

    return replace(rig, predict=predict, normal_stress=rig.normal_stress and normal_stress)


def _careful_acts(effect: Effect, package: Mapping[str, Rig]) -> dict[str, Callable]:
    """What an effect does in closed forms, its mistakes told; in the package's rigs also shapes and what is no number."""

    def careful(act: Callable, rig: str) -> Callable:
        @wraps(act)
        def called(*given):
            found = _called(act, effect.own, *given)
            if rig not in package:
                return found
            shear, normal, conditions, values = given
            stresses = {"shear stress": shear, "normal stress": normal}
            return _checked(found, f"{effect.own}: {_name(act)}", {**stresses, **conditions, **values})

        return called

    return {rig: careful(act, rig) for rig, act in effect.closed_form.items()}


def _name(function: Callable) -> str:
    return getattr(function, "__name__", "act")


def _called(function: Callable, file: Path, *given):
    """What a function of a study's own answers; InputError with file and line where it raises."""
    try:
        with np.errstate(all="ignore"):  # what is no number is told by `_checked`
            return function(*given)
    except StudyError:
        raise
    except Exception as error:
        frames = traceback.extract_tb(error.__traceback__)
        lines = [frame.lineno for frame in frames if Path(frame.filename).resolve() == file.resolve()]
        place = f"line {lines[-1]}: " if lines else ""
        names = [name for one in given if isinstance(one, Mapping) for name in one]
        hint = nearest(error.args[0], names) if isinstance(error, KeyError) and error.args else ""
        raise InputError(f"{file}: {place}{_name(function)} failed: {type(error).__name__}: {error}{hint}") from error


def _checked(found, what: str, given: Mapping) -> np.ndarray:
    """An array of numbers, none of them NaN, of the shape that what was given has together, or InputError."""
    shape = np.broadcast_shapes(*(np.shape(value) for value in given.values()))
    kind = type(found).__name__
    try:
        array = np.asarray(found, dtype=float if found is not None else object)
        kind = f"an array of shape {array.shape}" if array.shape else f"a single {kind}"
        everywhere = np.broadcast_to(array, shape)
    except (TypeError, ValueError):
        everywhere = None
    if everywhere is None or array.dtype == object or (shape and not array.shape):
        raise InputError(f"{what}: expected an array of shape {shape}, a number for each case, got {kind}")
    if np.isnan(everywhere).any():
        where = tuple(np.argwhere(np.isnan(everywhere))[0])
        at = ", ".join(f"{name} {np.broadcast_to(value, shape)[where]:.4g}" for name, value in given.items())
        raise InputError(f"{what}: is not a number at {at}; it must be one everywhere between min and max")
    return array
