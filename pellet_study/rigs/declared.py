"""What a rig and an effect are, as their files declare them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from pellet_study.errors import InputError
from pellet_study.rigs.scripts import fingerprint
from yade_scripts import acting
from yade_scripts import case as case_file

Condition = float | str  # a condition's value: a number, or a word of its options


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
    `readable` bounds what can be read of an observable at all, `usual` what is read as a rule. Only on YADE: `effects` maps each effect the script knows to its
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
    usual: Mapping[str, tuple[float, float]] = field(default_factory=dict)
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
            raise takes_none(self.file, f"module '{self.script.stem}' has no attribute 'EFFECTS'")
        files = (effect.file.resolve() for effect in effects if effect.file)  # YADE runs in another folder
        extra = tuple(dict.fromkeys((*self.extra, *files)))  # of two with one name the later takes its place there too
        known = {**self.effects, **{effect.name: effect.parameters for effect in effects}}
        return refuse_clash(replace(self, effects=known, extra=extra))


def takes_none(file: Path | None, why: object) -> InputError:
    """What is said of a rig whose script can take no effects."""
    return InputError(f"{file}: {why}; a rig with effects has EFFECTS, a tuple of modules, () where it has none")


def refuse_clash(rig: Rig) -> Rig:
    """The rig, or InputError where a column of its table would be both an input and an observable."""
    clash = set(rig.observables) & set(case_file.flat(case_file.example(vars(rig))))
    if clash:
        raise InputError(f"{rig.file}: {', '.join(sorted(clash))} is both an input and an observable; rename one")
    return rig
