"""Rigs and effects of the user's own as they are called: their mistakes are told with file and line."""

import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np

from pellet_study.errors import InputError, StudyError
from pellet_study.output.words import nearest, number
from pellet_study.rigs.catalogue import Catalogue, standard
from pellet_study.rigs.declared import Acting, Effect, Rig
from pellet_study.study.continuity import refuse_idle, refuse_jumps
from pellet_study.study.measurements import Measurement
from pellet_study.study.scene_trials import refuse_jumps_in_scenes

INERT = 1e-6  # relative change of a prediction by an effect at `absent`: what a rig's solver leaves


def refuse_reads(effect: Effect, catalogue: Catalogue) -> None:
    """Refuse an effect on readings that names an observable which none of its rigs gives.

    Raises
    ------
    InputError : names it, and what there is
    """
    known = {o for rig in effect.rigs if rig in catalogue.rigs for o in catalogue.rigs[rig].observables}
    for name in effect.reads or ():
        if effect.file and known and name not in known:
            raise InputError(
                f"{effect.file}: reads: {name!r} is no observable of {', '.join(effect.rigs)}{nearest(name, known)}"
            )


def check_on_rows(catalogue: Catalogue, rows: Sequence[Measurement], settings: Mapping[str, float]) -> None:
    """Ask closed forms that the user's own code has a part in for a study's rows, without effects and with each at `absent`.

    Effects in the scenes of bench rigs on YADE are asked for what they answer there; nothing is simulated.

    Raises
    ------
    InputError : a prediction fails, or an effect at `absent` changes it, jumps from there, or moves in steps
    """
    used = [catalogue.rigs[name] for name in dict.fromkeys(row.rig for row in rows)]
    for effect in catalogue.effects.values():
        refuse_reads(effect, catalogue)
    for effect in catalogue.effects.values():
        if effect.file and (on_yade := [rig for rig in used if rig.on_yade and rig.name in effect.rigs]):
            refuse_jumps_in_scenes(effect, on_yade)
    for name in dict.fromkeys(row.rig for row in rows):
        rig, in_rig = catalogue.rigs[name], [row for row in rows if row.rig == name]
        effects = [effect for effect in catalogue.effects.values() if effect.file and name in effect.closed_form]
        if rig.predict is None or (rig is standard().rigs.get(name) and not effects):
            continue
        shape = (2, len(in_rig))  # two points: an answer in a wrong shape is seen
        parameters = {p: np.full((2, 1), settings.get(p, known["default"])) for p, known in rig.parameters.items()}
        conditions: dict[str, Any] = {c: np.array([row.conditions[c] for row in in_rig]) for c in rig.conditions}
        stresses = [rig.normal_stress(row.conditions, row.value) for row in in_rig] if rig.normal_stress else [1.0]
        conditions["median_normal_stress_pa"] = float(np.median(stresses))
        without = rig.predict(parameters, conditions, {})
        for effect in effects:
            absent = {p: np.full((2, 1), value) for p, value in effect.neutral().items()}
            with _blaming(effect):
                present = rig.predict(parameters, conditions, {effect.name: Acting(effect.closed_form[name], absent)})
            for observable in rig.observables:
                before, after = (np.broadcast_to(found[observable], shape)[0] for found in (without, present))
                worst = int(np.argmax(np.abs(after - before)))
                if abs(after[worst] - before[worst]) > INERT * np.abs(before).max():
                    raise InputError(
                        f"{effect.file}: {effect.name} is not inert where it is absent: with {effect.amount} = "
                        f"{effect.neutral()[effect.amount]:g} it makes {observable} of {name} {after[worst]:.6g} instead "
                        f"of {before[worst]:.6g}; at `absent` an effect must change nothing"
                    )
            with _blaming(effect):
                refuse_jumps(rig, effect, conditions, settings)
            refuse_idle(rig, effect)


@contextmanager
def _blaming(effect: Effect) -> Iterator[None]:
    """Where a rig fails with an effect that it has no fault without, the effect's file is named first."""
    try:
        yield
    except InputError as error:
        if str(error).startswith(str(effect.file)):
            raise
        raise InputError(f"{effect.file}: with {effect.name}, and not without it, {error}") from error


def checked_rig(rig: Rig, file: Path) -> Rig:
    """A closed-form rig whose mistakes are told: what is raised, names, shapes, numbers that are none."""

    def predict(parameters: Mapping, conditions: Mapping, effects: Mapping) -> dict[str, np.ndarray]:
        found = _called(rig.predict, file, parameters, conditions, effects)
        if not isinstance(found, Mapping) or set(rig.observables) - set(found):
            returned = ", ".join(map(str, found)) if isinstance(found, Mapping) else type(found).__name__
            raise InputError(
                f"{file}: predict returned {returned or 'nothing'}; expected a dictionary with {', '.join(rig.observables)}"
            )
        values = {f"{e}.{p}": v for e, (_, of_effect) in effects.items() for p, v in of_effect.items()}
        own = {name: value for name, value in conditions.items() if name in rig.conditions or np.ndim(value)}
        given = {**parameters, **own, **values}
        return {o: _numbers(found[o], f"{file}: predict: {o}", given) for o in rig.observables}

    def normal_stress(conditions: Mapping, value: float) -> Any:
        return _called(rig.normal_stress, file, conditions, value)

    return replace(rig, predict=predict, normal_stress=rig.normal_stress and normal_stress)


def checked_acts(effect: Effect, file: Path, package: Mapping[str, Rig]) -> dict[str, Callable]:
    """What an effect does in closed forms, its mistakes told; in the package's rigs also shapes and what is no number."""

    def checked(act: Callable, rig: str) -> Callable:
        @wraps(act)
        def called(*given: Any) -> Any:
            found = _called(act, file, *given)
            if rig not in package:
                return found
            shear, normal, conditions, values = given
            stresses = {"shear stress": shear, "normal stress": normal}
            return _numbers(found, f"{file}: {_name(act)}", {**stresses, **conditions, **values})

        return called

    return {rig: checked(act, rig) for rig, act in effect.closed_form.items()}


def _name(function: object) -> str:
    return getattr(function, "__name__", "act")


def _called(function: Any, file: Path, *given: Any) -> Any:
    """What a function of the user's own answers; InputError with file and line where it raises."""
    try:
        with np.errstate(all="ignore"):  # what is no number is told by `_numbers`
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


def _numbers(found: Any, what: str, given: Mapping) -> np.ndarray:
    """An array of numbers, none of them NaN, of the shape that what was given has together, or InputError."""
    shape = np.broadcast_shapes(*(np.shape(value) for value in given.values()))
    kind = type(found).__name__
    try:
        array = np.asarray(found, dtype=float if found is not None else object)
        kind = f"an array of shape {array.shape}" if array.shape else f"a single {kind}"
        everywhere = None if array.dtype == object or (shape and not array.shape) else np.broadcast_to(array, shape)
    except (TypeError, ValueError):
        everywhere = None
    if everywhere is None:
        raise InputError(f"{what}: expected an array of shape {shape}, a number for each case, got {kind}")
    if np.isnan(everywhere).any():
        where = tuple(np.argwhere(np.isnan(everywhere))[0])
        at = ", ".join(f"{name} {number(np.broadcast_to(value, shape)[where])}" for name, value in given.items())
        raise InputError(f"{what}: is not a number at {at}; it must be one everywhere between min and max")
    return array
