"""What the file of a rig or of an effect declares, checked."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from pellet_study.errors import InputError
from pellet_study.rigs.scripts import fingerprint
from yade_scripts import acting
from yade_scripts import case as case_file

WORD = re.compile(r"[A-Za-z_]\w*")  # so that no table takes it for a number
SCENES = ("SEED_SCENE", "POWDER_SCENE")  # what an effect calls its places in a scene on YADE
OF_EVERY_RIG = ("name", "parameters", "conditions", "observables")
ON_YADE = ("contact_laws", "effects", "numerics", "random", "time_limit_s")  # what a rig on YADE declares besides
Condition = float | str  # a condition's value: a number, or a word of its options
FLAT_TO_UPRIGHT = (0.0, 90.0)
READABLE = {  # where the rig says nothing
    "slip_angle_deg": FLAT_TO_UPRIGHT,
    **{f"repose_{reading}_deg": FLAT_TO_UPRIGHT for reading in ("angle", "flank", "triangle", "moment")},
}
# units of the package's own observables on YADE; their scripts are hashed with every result and say only what they mean
UNITS = {
    "rebound_height_mm": "mm",
    "tangential_restitution": "1",
    "slip_angle_deg": "deg",
    "roll_distance_mm": "mm",
    "repose_angle_deg": "deg",
    "repose_flank_deg": "deg",
    "repose_triangle_deg": "deg",
    "repose_moment_deg": "deg",
    "discharge_time_s": "s",
    "fill_bulk_density_kg_m3": "kg/m3",
    "dynamic_angle_deg": "deg",
    "shear_stress_pa": "Pa",
    "direction_error_deg": "deg",
    "bond_number": "1",
    "grains": "1",
    "over_edge_share": "1",
    "heap_height_mm": "mm",
    "flow_time_s": "s",
    "end_time_s": "s",
    "largest_overlap": "1",
}


class Acting(NamedTuple):
    """An effect present in a closed form: what it does, and the values of its parameters (arrays)."""

    act: Callable | None
    values: Mapping


@dataclass(frozen=True)
class Effect:
    """A physical effect a model may lack; the first parameter is the amount, further ones its shape.

    `parameters` maps names to {absent or default, min, max, physical, unit, meaning}, `parameters_in` a rig to those
    that stand in their place there; `sides` is 1 where the amount has one sign, 2 where it may have either; `rigs` maps
    a rig to where the effect shows in it. `reading` is what an effect on nothing but readings makes of one, `reads` the
    observables it acts on (None: a rig's first); `file` is that of an effect of the user's own, None where it comes with the package; `scenes` holds its SEED_SCENE and
    POWDER_SCENE, where it has them; `owns` names parameters of rigs that mean nothing without it; `not_with` maps a rig to
    the contact laws that cannot have the effect, and why.
    """

    name: str
    means: str
    formula: str
    parameters: Mapping[str, Mapping]
    sides: int
    rigs: Mapping[str, str]
    signature: str
    source: str
    parameters_in: Mapping[str, Mapping[str, Mapping]] = field(default_factory=dict)
    closed_form: Mapping[str, Callable] = field(default_factory=dict)
    order: int = 1
    reading: Callable | None = None
    reads: tuple[str, ...] | None = None
    file: Path | None = None
    scenes: Mapping[str, Mapping] = field(default_factory=dict)
    owns: tuple[str, ...] = ()
    not_with: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    @property
    def amount(self) -> str:
        """The parameter whose `absent` value means that the effect is not there."""
        return next(iter(self.parameters))

    def reads_it(self, observable: str, observables: Iterable[str]) -> bool:
        """Whether an effect on nothing but readings acts on one of a rig's observables, as in the simulations."""
        given = {} if self.reads is None else {"reads": self.reads}
        return acting.reads(given, observable, observables)

    def neutral(self) -> dict[str, float]:
        """Values that mean absent."""
        return {name: q["absent" if "absent" in q else "default"] for name, q in self.parameters.items()}

    def within(self, rigs: Iterable[str]) -> "Effect":
        """The effect with the parameters it has in some rigs.

        Raises
        ------
        InputError : they differ from rig to rig
        """
        of_rig = {rig: self.parameters_in.get(rig, self.parameters) for rig in rigs}
        first = next(iter(of_rig.values()), self.parameters)
        if any(parameters != first for parameters in of_rig.values()):
            raise InputError(
                f"the amount of {self.name} is not the same quantity in all rigs used: "
                f"{'; '.join(f'{next(iter(parameters))} in {rig}' for rig, parameters in of_rig.items())}; "
                "make a study of each"
            )
        return replace(self, parameters=first)


@dataclass(frozen=True)
class Rig:
    """What turns cases into observables: a formula (`predict`), or a script that runs in YADE.

    `parameters`, `conditions` and `numerics` map names to {default, min, max, unit, meaning}; a condition is usual from
    `min` to `max` and may also have `limits`, what the rig can simulate (default: ten times beyond), and `required`, true
    where it has to be given; one that is a word out of a list has `options` in place of min and max, and nothing is
    interpolated over it. A parameter must lie from `min` to `max` and may have a `physical` range, where it usually does.
    `observables` maps names to what they mean, `units` to the units they are read in, as far as these are declared;
    `readable` bounds what can be read of an observable. Only on YADE: `effects` maps each effect the script knows to its
    parameters with the value
    that means absent; `random` rigs scatter over the seed, and `seeds` of them make a mean; in `paired` ones the same
    seed ends nearly alike in nearly the same case; `extra` are files of effects beyond the rig's own, which it can take
    where `takes_effects` is true.
    """

    name: str
    file: Path | None
    parameters: Mapping[str, Mapping]
    conditions: Mapping[str, Mapping]
    observables: Mapping[str, str]
    predict: Callable | None = None
    normal_stress: Callable | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    readable: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    effects: Mapping[str, Mapping] = field(default_factory=dict)
    contact_laws: tuple[str, ...] = ()
    numerics: Mapping[str, Mapping] = field(default_factory=dict)
    random: bool = False
    time_limit_s: float = 0.0
    seeds: int = 1
    paired: bool = False
    takes_effects: bool = True
    extra: tuple[Path, ...] = ()

    @property
    def on_yade(self) -> bool:
        """Whether it is a script that runs in YADE."""
        return self.predict is None

    @cached_property
    def fingerprint(self) -> str:
        """Hash of every script that an answer of YADE depends on, as the scripts were when it was first asked for."""
        return fingerprint(self.script, self.extra)

    @property
    def script(self) -> Path:
        """The file that runs in YADE."""
        if self.file is None:
            raise InputError(f"rig {self.name} has no script to run in YADE")
        return self.file

    def options(self, condition: str) -> tuple[str, ...]:
        """The words that a condition may be; () where it is a number."""
        return tuple(self.conditions.get(condition, {}).get("options", ()))

    def default_conditions(self) -> dict[str, Condition]:
        """Every condition at its default."""
        return {
            name: declared["default"] if "options" in declared else float(declared["default"])
            for name, declared in self.conditions.items()
        }

    def with_effects(self, effects: Sequence[Effect]) -> "Rig":
        """The rig with some effects of other files; one with the name of an effect it has takes its place.

        Raises
        ------
        InputError : the rig's script cannot take any
        """
        if not effects:
            return self
        if not self.takes_effects:
            raise _takes_none(self.file, f"module '{self.script.stem}' has no attribute 'EFFECTS'")
        extra = tuple(effect.file.resolve() for effect in effects if effect.file)  # YADE runs in another folder
        known = {**self.effects, **{effect.name: effect.parameters for effect in effects}}
        return _refuse_clash(replace(self, effects=known, extra=extra))


def _takes_none(file: Path | None, why: object) -> InputError:
    return InputError(f"{file}: {why}; a rig with effects has EFFECTS, a tuple of modules, () where it has none")


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
        raise _takes_none(file, error) from None
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
    readable = {o: READABLE[o] for o in declared["observables"] if o in READABLE} | declared.get("readable", {})
    of_all = {key: declared[key] for key in OF_EVERY_RIG} | {"observables": _meanings(declared["observables"])}
    rig = Rig(**of_all, units=_units(file, declared["observables"]), file=file, readable=readable)
    if not simulated:
        return replace(rig, predict=module.predict, normal_stress=getattr(module, "normal_stress", None))
    return _refuse_clash(
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
    found = {name: UNITS[name] for name in observables if name in UNITS}
    for name, given in observables.items():
        if isinstance(given, Mapping):
            if not isinstance(given.get("unit"), str) or not given["unit"]:
                raise InputError(
                    f'{file}: observables: {name}: expected {{"unit": "mm", "meaning": ...}}, "1" for a number, got {given!r}'
                )
            found[name] = given["unit"]
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


def _refuse_clash(rig: Rig) -> Rig:
    """The rig, or InputError where a column of its table would be both an input and an observable."""
    clash = set(rig.observables) & set(case_file.flat(case_file.example(vars(rig))))
    if clash:
        raise InputError(f"{rig.file}: {', '.join(sorted(clash))} is both an input and an observable; rename one")
    return rig


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
