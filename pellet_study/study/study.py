"""What a study is: its rows, its parameters and effects, fixed or free, and what it may consider."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.rigs.catalogue import Catalogue
from pellet_study.rigs.declared import Effect
from pellet_study.study.measurements import Measurement

Possible = tuple[float, float] | tuple[str, ...]  # least and largest of a condition, or the words that it may be
SEEDS_BY = ("setting", "place")  # of a heap that `calibrate` asks for; by its place in the design in release 0.1
SCALINGS = {"bond_number": 2.0, "none": 0.0}  # exponent of the amplification in the surface energy


@dataclass(frozen=True)
class Setting:
    """A parameter's value; free to be calibrated between `low` and `high` unless these are None."""

    value: float
    low: float | None = None
    high: float | None = None

    @property
    def free(self) -> bool:
        """Whether calibration may change it."""
        return self.low is not None


@dataclass(frozen=True)
class Study:
    """Everything a study's files say, checked.

    `parameters` holds those named in [parameters]; `effects` those present, each with a Setting for every parameter;
    `candidates` is None where any effect that acts in the rigs may be considered; `possible` maps a rig to
    {condition: (min, max) or words} of what could be measured next; `effort` multiplies the number of simulations; `seeds_by`
    says what the seeds of `calibrate` belong to; `library` is the folder of shared effects and rigs that it was loaded with.
    """

    title: str
    rows: tuple[Measurement, ...]
    parameters: Mapping[str, Setting]
    effects: Mapping[str, Mapping[str, Setting]]
    catalogue: Catalogue
    candidates: tuple[str, ...] | None = None
    possible: Mapping[str, Mapping[str, Possible]] | None = None
    contact_law: str | None = None
    surface_energy_scaling: str = "bond_number"
    effort: float = 1.0
    seeds_by: str = "setting"
    folder: Path | None = None
    library: Path | None = None

    @property
    def rigs(self) -> tuple[str, ...]:
        """Rigs that have rows, in the order of the file."""
        return tuple(dict.fromkeys(row.rig for row in self.rows))

    def acting(self) -> list[str]:
        """Effects that act in the rigs used."""
        return list(dict.fromkeys(e for rig in self.rigs for e in self.catalogue.acting(rig)))

    def absent(self) -> list[str]:
        """Effects that diagnose may consider: not present, acting in a rig used, and listed if there is a list."""
        names = self.acting() if self.candidates is None else self.candidates
        return [name for name in names if name not in self.effects and not self.refusal(name)]

    def refusal(self, effect: str) -> str:
        """Why the study's contact law cannot have an effect in a rig used; "" where it can."""
        not_with = self.catalogue.effects[effect].not_with
        return next(filter(None, (not_with.get(rig, {}).get(self.contact_law or "", "") for rig in self.rigs)), "")

    def with_effect(self, name: str, values: Mapping[str, float] | None = None) -> "Study":
        """The same study with an effect present, its parameters free within their physical range.

        Raises
        ------
        InputError : its contact law cannot have it
        """
        if why := self.refusal(name):
            raise InputError(f"{name}: {why}")
        return replace(self, effects={**self.effects, name: settings(self.catalogue.effect(name), values or {})})

    def without_effect(self, name: str) -> "Study":
        """The same study without an effect."""
        return replace(self, effects={k: v for k, v in self.effects.items() if k != name})


def settings(effect: Effect, values: Mapping[str, float]) -> dict[str, Setting]:
    """Free settings of all parameters of an effect, from given starting values."""
    found = {}
    for name, quantity in effect.parameters.items():
        low, high = quantity.get("physical", (quantity["min"], quantity["max"]))
        value = values.get(name, quantity.get("default", 0.5 * (low + high) if effect.sides == 1 else 0.5 * high))
        found[name] = Setting(min(max(float(value), low), high), float(low), float(high))
    return found


def check(study: Study, where: str = "") -> None:
    """Refuse what no answer can come from: effects that act nowhere, parameters without their effect.

    Raises
    ------
    InputError : says which
    """
    acting = study.acting()
    for kind, names in (("effects", study.effects), ("candidates", study.candidates or ())):
        for name in names:
            if name not in acting:
                raise InputError(
                    f"{where}{kind}: {name} acts in none of the rigs used ({', '.join(study.rigs)}); it acts in "
                    f"{', '.join(study.catalogue.effects[name].rigs)}. Acting here: {', '.join(acting) or 'no effect'}"
                )
    refuse_by_law(study, where)
    owners = {name: effect.name for effect in study.catalogue.effects.values() for name in effect.owns}
    for name in study.parameters:
        owner = owners.get(name)
        if owner is not None and owner not in study.effects:
            raise InputError(f"{where}parameters: {name} belongs to the effect {owner}; list {owner} in [effects] too")


def refuse_by_law(study: Study, where: str = "") -> None:
    """Refuse what a contact law cannot have: effects that are there or may be, what they own, and candidates.

    Raises
    ------
    InputError : says which, and why
    """
    for name in study.candidates or ():
        if why := study.refusal(name):
            raise InputError(f"{where}candidates: {name}: {why}")
    for name in study.acting():
        if not (why := study.refusal(name)):
            continue
        effect = study.catalogue.effects[name]
        given = [(f"parameters: {p}", study.parameters[p], 0.0) for p in effect.owns if p in study.parameters]
        given += [
            (f"measurements, line {r.line}: {p}", Setting(v), 0.0)
            for r in study.rows
            for p, v in r.parameters.items()
            if p in effect.owns
        ]
        if name in study.effects:
            given.append((f"effects: {name}", study.effects[name][effect.amount], effect.neutral()[effect.amount]))
        for place, setting, absent in given:
            if setting.free or setting.value != absent:
                raise InputError(f"{where}{place}: {why}")
