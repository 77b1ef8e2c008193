"""Rigs and effects by name, read from what their files declare; a study's own are added in `own.py`."""

import importlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import yade_scripts
from pellet_study.errors import InputError
from pellet_study.output.words import nearest

SCRIPTS = Path(yade_scripts.__file__).resolve().parent
CLOSED_FORM = Path(__file__).resolve().parent / "closed_form"
SCENES = ("SEED_SCENE", "POWDER_SCENE")  # what an effect calls its places in a scene on YADE
ON_YADE = ("contact_laws", "effects", "numerics", "random", "time_limit_s")  # what a rig on YADE declares besides
FLAT_TO_UPRIGHT = (0.0, 90.0)
READABLE = {"slip_angle_deg": FLAT_TO_UPRIGHT, "repose_angle_deg": FLAT_TO_UPRIGHT}  # where the rig says nothing


class Acting(NamedTuple):
    """An effect present in a closed form: what it does, and the values of its parameters (arrays)."""

    act: Callable | None
    values: Mapping


@dataclass(frozen=True)
class Rig:
    """What turns cases into observables.

    `parameters` and `conditions` map names to {default, min, max, unit, meaning}; `predict` is None on YADE, where
    `effects` names the effects the rig's script knows. `readable` bounds what can be read of an observable.
    """

    name: str
    file: Path | None
    parameters: Mapping
    conditions: Mapping
    observables: Mapping
    predict: Callable | None = None
    normal_stress: Callable | None = None
    effects: tuple[str, ...] = ()
    readable: Mapping = field(default_factory=dict)


@dataclass(frozen=True)
class Effect:
    """A physical effect a model may lack; the first parameter is the amount, further ones its shape.

    `parameters` maps names to {absent or default, min, max, physical, unit, meaning}, `parameters_in` a rig to those
    that stand in their place there; `sides` is 1 where the amount has one sign, 2 where it may have either; `rigs` maps
    a rig to where the effect shows in it. `reading` is what an effect on nothing but the reading makes of it; `own` is
    the file of an effect of the study's own; `scenes` holds its SEED_SCENE and POWDER_SCENE, where it has them.
    """

    name: str
    means: str
    formula: str
    parameters: Mapping
    sides: int
    rigs: Mapping
    signature: str
    source: str
    parameters_in: Mapping = field(default_factory=dict)
    closed_form: Mapping = field(default_factory=dict)
    order: int = 1
    reading: Callable | None = None
    own: Path | None = None
    scenes: Mapping[str, Mapping] = field(default_factory=dict)

    @property
    def amount(self) -> str:
        """The parameter whose `absent` value means that the effect is not there."""
        return next(iter(self.parameters))

    def neutral(self) -> dict[str, float]:
        """Values that mean absent."""
        return {name: q.get("absent", q.get("default")) for name, q in self.parameters.items()}

    def within(self, rigs: Iterable[str]) -> "Effect":
        """The effect with the parameters it has in some rigs.

        Raises
        ------
        InputError : they differ from rig to rig
        """
        own = {rig: self.parameters_in.get(rig, self.parameters) for rig in rigs}
        first = next(iter(own.values()), self.parameters)
        if any(parameters != first for parameters in own.values()):
            raise InputError(
                f"the amount of {self.name} is not the same quantity in all rigs used: "
                f"{'; '.join(f'{next(iter(parameters))} in {rig}' for rig, parameters in own.items())}; "
                "make a study of each"
            )
        return replace(self, parameters=first)


@dataclass(frozen=True)
class Catalogue:
    """Rigs and effects by name."""

    rigs: Mapping[str, Rig]
    effects: Mapping[str, Effect]

    def acting(self, rig: str) -> list[str]:
        """Names of the effects that act in a rig."""
        if self.rigs[rig].predict is None:
            own = [name for name, effect in self.effects.items() if effect.own and rig in effect.rigs]
            return [name for name in self.rigs[rig].effects if name in self.effects and name not in own] + own
        return [name for name, effect in self.effects.items() if rig in effect.closed_form]

    def within(self, rigs: Sequence[str]) -> "Catalogue":
        """The same with each effect's parameters as they are in the rigs of a study.

        Raises
        ------
        InputError : an effect's parameters differ between two of these rigs
        """
        acting = {rig: self.acting(rig) for rig in rigs}
        here = {
            name: effect.within([rig for rig in rigs if name in acting[rig]]) if effect.parameters_in else effect
            for name, effect in self.effects.items()
        }
        return replace(self, effects=here)

    def rig(self, name: str, where: str = "") -> Rig:
        """The rig of that name, or InputError with the nearest name."""
        if name not in self.rigs:
            raise InputError(f"{where}rig {name!r} is unknown{nearest(name, self.rigs)}")
        return self.rigs[name]

    def effect(self, name: str, where: str = "") -> Effect:
        """The effect of that name, or InputError with the nearest name."""
        if name not in self.effects:
            raise InputError(f"{where}effect {name!r} is unknown{nearest(name, self.effects)}")
        return self.effects[name]


def rig_from(module, file: Path | None = None) -> Rig:
    """The rig a module declares.

    Raises
    ------
    InputError : a key or a number is missing, or there is nothing that turns cases into observables
    """
    declared = module.RIG
    simulated = not hasattr(module, "predict")
    if simulated and not hasattr(module, "simulate"):
        raise InputError(f"{file}: has neither predict(parameters, conditions, effects) nor, on YADE, simulate(case)")
    wanted = ("name", "parameters", "conditions", "observables", *(ON_YADE if simulated else ()))
    missing = [key for key in wanted if key not in declared]
    if missing:
        raise InputError(f"{file}: RIG lacks {', '.join(missing)}")
    if not isinstance(declared["observables"], Mapping):
        raise InputError(f"{file}: observables: expected {{name: meaning}}, got {declared['observables']!r}")
    for name, quantity in [*declared["parameters"].items(), *declared["conditions"].items()]:
        if absent := [key for key in ("default", "min", "max") if key not in quantity]:
            raise InputError(f"{file}: {name} lacks {', '.join(absent)}")
        if not quantity["min"] <= quantity["default"] <= quantity["max"]:
            raise InputError(f"{file}: {name}: expected min <= default <= max, got {quantity}")
    return Rig(
        **{key: declared[key] for key in ("name", "parameters", "conditions", "observables")},
        file=file,
        predict=getattr(module, "predict", None),
        normal_stress=getattr(module, "normal_stress", None),
        effects=tuple(declared.get("effects", ())),
        readable={o: READABLE[o] for o in declared["observables"] if o in READABLE} | declared.get("readable", {}),
    )


def effect_from(module, file: Path | None = None, own: Path | None = None) -> Effect:
    """The effect a module declares.

    Raises
    ------
    InputError : a key is missing, the amount has no `absent` value, or a range is empty
    """
    declared = module.EFFECT
    wanted = ("name", "means", "formula", "parameters", "sides", "rigs", "signature", "source")
    missing = [key for key in wanted if key not in declared]
    if missing:
        raise InputError(f"{file}: EFFECT lacks {', '.join(missing)}")
    parameters_in = declared.get("parameters_in", {})
    for parameters in (declared["parameters"], *parameters_in.values()):
        for k, (name, quantity) in enumerate(parameters.items()):
            needed = ("default" if k else "absent", "min", "max", "unit", "meaning")
            absent = [key for key in needed if key not in quantity]
            if absent:
                raise InputError(f"{file}: parameter {name} lacks {', '.join(absent)}")
            low, high = quantity.get("physical", (quantity["min"], quantity["max"]))
            if not quantity["min"] <= low < high <= quantity["max"]:
                raise InputError(f"{file}: parameter {name}: expected min <= physical range <= max, got {quantity}")
    scenes = {name: getattr(module, name) for name in SCENES if hasattr(module, name)}
    seed = scenes.get("SEED_SCENE", {})
    return Effect(
        **{key: declared[key] for key in wanted},
        parameters_in=parameters_in,
        closed_form=getattr(module, "CLOSED_FORM", {}),
        order=getattr(module, "ORDER", 1),
        reading=seed["reading"] if set(seed) == {"reading"} else None,
        own=own,
        scenes=scenes,
    )


def declaring(folder: Path, what: str) -> list[Path]:
    """The files of a folder that declare a RIG or an EFFECT."""
    return [
        file
        for file in sorted(folder.glob("*.py"))
        if f"\n{what} = {{" in "\n" + file.read_text(encoding="utf-8", errors="replace")
    ]


@cache
def standard() -> Catalogue:
    """The rigs and effects that come with the package."""
    rigs = [rig_from(importlib.import_module(f"yade_scripts.{f.stem}"), f) for f in declaring(SCRIPTS, "RIG")]
    rigs += [
        rig_from(importlib.import_module(f"pellet_study.rigs.closed_form.{f.stem}"), f)
        for f in declaring(CLOSED_FORM, "RIG")
    ]
    effects = [
        effect_from(importlib.import_module(f"yade_scripts.effects.{f.stem}"), f)
        for f in declaring(SCRIPTS / "effects", "EFFECT")
    ]
    return Catalogue({rig.name: rig for rig in rigs}, {e.name: e for e in sorted(effects, key=lambda e: e.order)})
