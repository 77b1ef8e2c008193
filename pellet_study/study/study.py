"""What a study is: its rows, its parameters and effects, fixed or free, and what it may consider."""

import ast
import hashlib
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.files import opening
from pellet_study.rigs.catalogue import Catalogue
from pellet_study.rigs.declared import Condition, Effect
from pellet_study.rigs.scripts import modules_of
from pellet_study.study.measurements import Measurement
from yade_scripts import laws

Possible = tuple[float, float] | tuple[str, ...]  # least and largest of a condition, or the words that it may be
SEEDS_BY = ("setting", "place")  # of a heap that `calibrate` asks for; by its place in the design in release 0.1
OF_BASIS = (
    "rig",
    "observable",
    "value",
    "sd",
    "n",
    "conditions",
    "parameters",
    "setup",
    "setup_sd",
    "split",
    "resolution",
    "order",
)
SCALINGS = {"bond_number": 2.0, "none": 0.0}  # exponent of the amplification in the surface energy


RESTITUTION_AT = {"centre": 0.0, "contact": 1.0}  # damping_at_contact of the bench rigs on YADE
WITHOUT_DAMPER = (laws.LOCAL_DAMPING,)


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


def means_something(quantity: Mapping, conditions: Mapping[str, Condition]) -> bool:
    """Whether a condition acts beside the others: the speed of a lifted cylinder does not where powder is poured."""
    name, words = quantity.get("under", (None, ()))
    return name is None or conditions[name] in words


@dataclass(frozen=True)
class Study:
    """Everything a study's files say, checked.

    `parameters` holds those named in [parameters]; `effects` those present, each with a Setting for every parameter;
    `candidates` is None where any effect that acts in the rigs may be considered; `possible` maps a rig to
    {condition: (min, max) or words} of what could be measured next; `restitution_at` is "centre" where the
    damper of a seed takes its whole mass, so that e holds for central impacts, "contact" where it takes the mass effective at
    the contact, so that e holds at each; `effort` multiplies the number of simulations; `seeds_by`
    says what the seeds of `calibrate` belong to; `library` is the folder of shared effects and rigs that it was loaded with.
    `left_out` are rows of split `leave_out`, each with its reason: they are shown and used for nothing, so that `rows` does
    not have them. `remarks` are what to know of the rows and values before anything is computed.
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
    restitution_at: str = "centre"
    effort: float = 1.0
    seeds_by: str = "setting"
    folder: Path | None = None
    library: Path | None = None
    left_out: tuple[Measurement, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def rigs(self) -> tuple[str, ...]:
        """Rigs that have rows, in the order of the file."""
        return tuple(dict.fromkeys(row.rig for row in self.rows))

    @property
    def units(self) -> dict[str, str]:
        """Units as declared: of parameters, conditions and observables of the rigs used and of those possible, and of effects as
        `effect.parameter`."""
        found: dict[str, str] = {}
        for rig in (*(self.possible or {}), *self.rigs):
            found |= self.units_of(rig)
        for effect in self.catalogue.effects.values():
            found |= {f"{effect.name}.{name}": q["unit"] for name, q in effect.parameters.items() if q.get("unit")}
        return found

    @cached_property
    def basis(self) -> str:
        """A hash of the rows and of the code of the rigs of one's own: answers of another basis do not belong beside this study's."""
        own = [place.resolve() for place in (self.folder, self.library) if place is not None]
        files = [self.catalogue.rigs[rig].file for rig in self.rigs]
        mine = [f for f in files if f and any(f.resolve().is_relative_to(place) for place in own)]
        code = [opening.text(one) for f in mine for one in (f, *modules_of(f))]
        rows = [{name: getattr(row, name) for name in OF_BASIS} for row in self.rows]
        text = repr((rows, [ast.dump(ast.parse(one)) for one in code]))
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def units_of(self, rig: str) -> dict[str, str]:
        """Units of a rig's parameters, conditions and observables, as it declares them: two rigs may differ in a name's."""
        known = self.catalogue.rigs[rig]
        declared = {**known.parameters, **known.conditions}
        return {name: q["unit"] for name, q in declared.items() if q.get("unit")} | dict(known.units)

    @property
    def assumed_conditions(self) -> dict[str, dict[str, Condition]]:
        """{rig: {condition: default}} of the conditions that no row of a rig gives, and that mean something in some row."""
        found: dict[str, dict[str, Condition]] = {}
        for row in self.rows:
            known = self.catalogue.rigs[row.rig].conditions
            meant = {name: row.conditions[name] for name in row.assumed if means_something(known[name], row.conditions)}
            found.setdefault(row.rig, {}).update(meant)
        return {rig: names for rig, names in found.items() if names}

    @property
    def assumed_parameters(self) -> dict[str, float]:
        """Parameters of the rigs used that neither study.toml nor every row gives, with their defaults.

        One that means nothing without an effect, where that effect is absent, is none of them, nor one that only another
        contact law has.
        """
        meaningless = {
            name for e in self.catalogue.effects.values() if e.name not in self.effects for name in e.owns
        } | set(self.parameters)
        found: dict[str, float] = {}
        for rig in self.rigs:
            known = {id(row.parameters): row.parameters for row in self.rows if row.rig == rig}.values()
            for name, quantity in self.catalogue.rigs[rig].parameters.items():
                if quantity.get("only_law") not in (None, self.contact_law):
                    continue
                if name not in meaningless and not all(name in given for given in known):
                    found[name] = float(quantity["default"])
        return found

    @property
    def assumed(self) -> dict[str, Condition]:
        """{condition or parameter: default} of all that no file of the study says.

        A condition that two rigs have with different defaults is called `rig.condition`.
        """
        found: dict[str, Condition] = {}
        by_rig = self.assumed_conditions
        for rig, names in by_rig.items():
            for name, value in names.items():
                alike = all(other.get(name, value) == value for other in by_rig.values())
                found[name if alike else f"{rig}.{name}"] = value
        return {**found, **self.assumed_parameters}

    def assumed_without(self, varied: Collection[str]) -> dict[str, Condition]:
        """The same without parameters that a command varies over a range of its own."""
        return {name: value for name, value in self.assumed.items() if name not in varied}

    def acting(self) -> list[str]:
        """Effects that act in the rigs used."""
        return list(dict.fromkeys(e for rig in self.rigs for e in self.catalogue.acting(rig)))

    def absent(self) -> list[str]:
        """Effects that diagnose may consider: not present, acting in a rig used, and listed if there is a list."""
        names = self.acting() if self.candidates is None else self.candidates
        return [name for name in names if name not in self.effects and not self.refusal(name)]

    def why_none_absent(self) -> str:
        """Why diagnose has no effect to consider, in words; "" where it has one."""
        if self.absent():
            return ""
        left = [name for name in self.acting() if name not in self.effects]
        if not self.acting():
            return "no effect acts in the rigs used: put what the model may lack into effects/, a file an effect"
        if not left:
            return "every effect that acts in the rigs used is in the model already"
        return f"`candidates` in study.toml leaves out every effect that could be asked for: {', '.join(left)}"

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
    refuse_no_damper(study, where)
    owners = {name: effect.name for effect in study.catalogue.effects.values() for name in effect.owns}
    for name in study.parameters:
        owner = owners.get(name)
        if owner is not None and owner not in study.effects:
            raise InputError(f"{where}parameters: {name} belongs to the effect {owner}; list {owner} in [effects] too")


def refuse_no_damper(study: Study, where: str = "") -> None:
    """Refuse a restitution at the contact where the law of a rig that asks for it has no damper.

    Raises
    ------
    InputError : says which law, and what to do
    """
    asking = [r for r in study.rigs if "damping_at_contact" in study.catalogue.rigs[r].numerics]
    if study.restitution_at == "contact" and study.contact_law in WITHOUT_DAMPER and asking:
        raise InputError(
            f'{where}restitution_at "contact": the contact law {study.contact_law} of {", ".join(asking)} has no damper that could '
            'take a mass; expected restitution_at = "centre" with it, or another contact_law'
        )


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
