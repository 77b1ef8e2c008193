"""Reads what the file of a rig or of an effect declares, and refuses what cannot be used."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

from pellet_study.errors import InputError
from pellet_study.rigs.declared import Effect, Rig, refuse_clash, takes_none
from pellet_study.rigs.known import OBSERVABLES
from yade_scripts import acting
from yade_scripts import case as case_file

WORD = re.compile(r"[A-Za-z_]\w*")  # so that no table takes it for a number
SCENES = ("SEED_SCENE", "POWDER_SCENE")  # what an effect calls its places in a scene on YADE
OF_EVERY_RIG = ("name", "parameters", "conditions", "observables")
ON_YADE = ("contact_laws", "effects", "numerics", "random", "time_limit_s")  # what a rig on YADE declares besides


def rig_in(file: Path, effects: Sequence[Path] = ()) -> Rig:
    """The rig on YADE in a file, with the effects in some other files.

    Raises
    ------
    InputError : it declares no rig, or cannot take effects beyond its own
    """
    file = file.resolve()
    try:
        module = case_file.load(file, effects)
    except AttributeError as error:
        raise takes_none(file, error) from None
    return replace(rig_from(module, file), extra=tuple(effect.resolve() for effect in effects))


def rig_from(module: ModuleType, file: Path) -> Rig:
    """The rig a module declares.

    Raises
    ------
    InputError : a key or a number is missing, or there is nothing that turns cases into observables
    """
    declared = module.RIG
    simulated = not hasattr(module, "predict")
    if simulated and not hasattr(module, "simulate"):
        raise InputError(f"{file}: has neither predict(parameters, conditions, effects) nor, on YADE, simulate(case)")
    missing = [key for key in (*OF_EVERY_RIG, *(ON_YADE if simulated else ())) if key not in declared]
    if missing:
        raise InputError(f"{file}: RIG lacks {', '.join(missing)}")
    if not isinstance(declared["observables"], Mapping):
        raise InputError(
            f'{file}: observables: expected {{name: {{"unit": ..., "meaning": ...}}}}, or {{name: meaning}}, got '
            f"{declared['observables']!r}"
        )
    for name, quantity in [*declared["parameters"].items(), *declared["conditions"].items()]:
        if "options" in quantity and name in declared["conditions"]:
            _check_options(file, name, quantity)
            continue
        if absent := [key for key in ("default", "min", "max") if key not in quantity]:
            raise InputError(f"{file}: {name} lacks {', '.join(absent)}")
        if not quantity["min"] <= quantity["default"] <= quantity["max"]:
            raise InputError(f"{file}: {name}: expected min <= default <= max, got {quantity}")
        for key in ("limits", "physical"):
            _check_range(file, name, quantity, key)
    readable = _of_observables(file, declared["observables"], "possible") | declared.get("readable", {})
    usual = _of_observables(file, declared["observables"], "usual")
    of_all = {key: declared[key] for key in OF_EVERY_RIG} | {"observables": _meanings(declared["observables"])}
    rig = Rig(**of_all, units=_units(file, declared["observables"]), file=file, readable=readable, usual=usual)
    if not simulated:
        return replace(rig, predict=module.predict, normal_stress=getattr(module, "normal_stress", None))
    return refuse_clash(
        replace(
            rig,
            file=file.resolve(),  # YADE runs in another folder
            contact_laws=tuple(declared["contact_laws"]),
            effects=dict(declared["effects"]),
            takes_effects=hasattr(module, "EFFECTS"),
            normal_stress=getattr(module, "normal_stress", None),
            **{key: declared[key] for key in ("numerics", "random", "time_limit_s")},
            **{key: declared[key] for key in ("seeds", "paired") if key in declared},
        )
    )


def _meanings(observables: Mapping[str, Any]) -> dict[str, str]:
    """What each observable means."""
    return {name: o.get("meaning", "") if isinstance(o, Mapping) else str(o) for name, o in observables.items()}


def _units(file: Path, observables: Mapping[str, Any]) -> dict[str, str]:
    """The unit of each observable that has one declared, as text ("mm"; "1" where it is a number)."""
    found = {name: OBSERVABLES[name].unit for name in observables if name in OBSERVABLES}
    for name, given in observables.items():
        if isinstance(given, Mapping):
            if not isinstance(given.get("unit"), str) or not given["unit"]:
                raise InputError(
                    f'{file}: observables: {name}: expected {{"unit": "mm", "meaning": ...}}, "1" for a number, got {given!r}'
                )
            found[name] = given["unit"]
    return found


def _of_observables(file: Path, observables: Mapping[str, Any], key: str) -> dict[str, tuple[float, float]]:
    """The `possible` or `usual` range of each observable: as declared, else what is known of one of that name and unit."""
    found = {}
    for name, given in observables.items():
        known, declared = OBSERVABLES.get(name), given if isinstance(given, Mapping) else {}
        if key in declared:
            try:
                low, high = map(float, declared[key])
            except (TypeError, ValueError):
                low, high = 1.0, 0.0
            if not low < high:
                raise InputError(f"{file}: observables: {name}: {key}: expected (low, high), got {declared[key]!r}")
            found[name] = low, high
        elif known is not None and declared.get("unit", known.unit) == known.unit:
            found[name] = getattr(known, key)
    return found


def _check_range(file: Path, name: str, quantity: Mapping, key: str) -> None:
    """Refuse a second range of a quantity that is none: `limits` holds the first, `physical` lies inside it."""
    if key not in quantity:
        return
    try:
        low, high = map(float, quantity[key])
    except (TypeError, ValueError):
        raise InputError(f"{file}: {name}: {key}: expected (low, high), got {quantity[key]!r}") from None
    inner, outer = (low, high), (quantity["min"], quantity["max"])
    if key == "limits":
        inner, outer = outer, inner
    if not outer[0] <= inner[0] <= inner[1] <= outer[1]:
        way = "min and max inside them" if key == "limits" else "a range inside min and max"
        raise InputError(
            f"{file}: {name}: {key} {low:g} to {high:g}: expected {way}, {quantity['min']:g} to {quantity['max']:g}"
        )


def _check_options(file: Path, name: str, declared: Mapping) -> None:
    """Refuse a condition whose options are no list of different words with its default among them."""
    options = declared["options"]
    words = not isinstance(options, str) and all(isinstance(word, str) and WORD.fullmatch(word) for word in options)
    if not words or len(set(options)) < max(len(options), 1):
        raise InputError(
            f"{file}: {name}: expected options to be different words (letters, digits, _), got {options!r}"
        )
    if declared.get("default") not in options:
        raise InputError(
            f"{file}: {name}: expected a default among {', '.join(options)}, got {declared.get('default')!r}"
        )


def effect_from(module: ModuleType, where: Path, file: Path | None = None) -> Effect:
    """The effect a module declares; `where` it was read, and its `file` where it is the user's own.

    Raises
    ------
    InputError : a key is missing, the amount has no `absent` value, or a range is empty
    """
    declared: Mapping[str, Any] = module.EFFECT
    wanted = ("name", "means", "formula", "parameters", "sides", "rigs", "signature", "source")
    missing = [key for key in wanted if key not in declared]
    if missing:
        raise InputError(f"{where}: EFFECT lacks {', '.join(missing)}")
    reads = declared.get("reads", ())
    if isinstance(reads, str) or not all(isinstance(name, str) for name in reads):
        raise InputError(f"{where}: reads: expected a list of observables, got {reads!r}")
    parameters_in = declared.get("parameters_in", {})
    for parameters in (declared["parameters"], *parameters_in.values()):
        _check_parameters(where, parameters)
    scenes = {name: getattr(module, name) for name in SCENES if hasattr(module, name)}
    readings = [scene[acting.READING] for scene in scenes.values() if set(scene) == {acting.READING}]
    return Effect(
        **{key: declared[key] for key in wanted},
        parameters_in=parameters_in,
        closed_form=getattr(module, "CLOSED_FORM", {}),
        order=getattr(module, "ORDER", 1),
        reading=readings[0] if readings and len(readings) == len(scenes) else None,
        reads=tuple(declared["reads"]) if "reads" in declared else None,
        file=file,
        scenes=scenes,
        owns=tuple(declared.get("owns", ())),
        not_with=declared.get("not_with", {}),
    )


def _check_parameters(where: Path, parameters: Mapping[str, Mapping]) -> None:
    for k, (name, quantity) in enumerate(parameters.items()):
        needed = ("default" if k else "absent", "min", "max", "unit", "meaning")
        absent = [key for key in needed if key not in quantity]
        if absent:
            raise InputError(f"{where}: parameter {name} lacks {', '.join(absent)}")
        low, high = quantity.get("physical", (quantity["min"], quantity["max"]))
        if not quantity["min"] <= low < high <= quantity["max"]:
            raise InputError(f"{where}: parameter {name}: expected min <= physical range <= max, got {quantity}")
