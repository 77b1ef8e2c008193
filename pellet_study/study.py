"""A study folder: study.toml, its measurements, and effects and rigs of the user's own."""

import fcntl
import logging
import math
import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from pellet_study import own
from pellet_study.catalogue import Catalogue, Effect, nearest
from pellet_study.errors import InputError
from pellet_study.measurements import Measurement, read

log = logging.getLogger(__name__)
KEYS = (
    "title",
    "measurements",
    "contact_law",
    "candidates",
    "parameters",
    "effects",
    "possible",
    "surface_energy_scaling",
    "effort",
)
LARGEST = 1_000_000  # bytes
CONTACT_LAWS = (
    "hertz_mindlin",
    "cohesive_frictional",
    "cohesive_frictional_local_damping",
    "cohesive_frictional_restitution",
)
EFFORT = (0.5, 100.0)  # simulations of the rigs on YADE, as a multiple of the least that answers
SCALINGS = {"bond_number": 2.0, "none": 0.0}  # exponent of the amplification in the surface energy
BELONGS_TO = {
    "powder_rolling_friction": "rolling_resistance",
    "powder_steel_rolling_friction": "rolling_resistance",
    "powder_surface_energy": "cohesion",
}  # parameters that mean nothing without their effect, in the rigs that have that effect


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
    {condition: (min, max)} of what could be measured next; `effort` multiplies the number of simulations.
    """

    title: str
    rows: tuple[Measurement, ...]
    parameters: Mapping[str, Setting]
    effects: Mapping[str, Mapping[str, Setting]]
    catalogue: Catalogue
    candidates: tuple[str, ...] | None = None
    possible: Mapping[str, Mapping[str, tuple[float, float]]] | None = None
    contact_law: str | None = None
    surface_energy_scaling: str = "bond_number"
    effort: float = 1.0
    folder: Path | None = None

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
        return [name for name in names if name not in self.effects]

    def with_effect(self, name: str, values: Mapping[str, float] | None = None) -> "Study":
        """The same study with an effect present, its parameters free within their physical range."""
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


def load(folder: Path) -> Study:
    """Read and check a study folder.

    Raises
    ------
    InputError : anything in it cannot be used
    """
    folder = Path(folder)
    file = folder / "study.toml"
    given = _toml_in(file)
    for key in given:
        if key not in KEYS:
            raise InputError(f"{file}: {key!r} is unknown{nearest(key, KEYS)}")
    everything = own.of_study(folder)
    rows = read(_inside(folder, file, _text(file, given, "measurements", "measurements.csv")), everything)
    possible = _possible(file, _table(file, given, "possible"), everything)
    catalogue = everything.within(list(dict.fromkeys([*(row.rig for row in rows), *possible])))
    law = _choice(file, given, "contact_law", CONTACT_LAWS)
    study = Study(
        title=_text(file, given, "title", folder.resolve().name),
        rows=rows,
        parameters=_parameters(file, _table(file, given, "parameters"), catalogue),
        effects=_effects(file, _table(file, given, "effects"), catalogue),
        catalogue=catalogue,
        candidates=_candidates(file, given.get("candidates"), catalogue),
        possible=possible,
        contact_law=law,
        surface_energy_scaling=_choice(file, given, "surface_energy_scaling", SCALINGS) or "bond_number",
        effort=_setting(f"{file}: effort", given.get("effort", 1.0), EFFORT).value,
        folder=folder,
    )
    check(study, f"{file}: ")
    own.try_out(catalogue, rows, {name: setting.value for name, setting in study.parameters.items()})
    return study


def _toml_in(file: Path) -> dict:
    """What study.toml says."""
    try:
        if file.exists() and (not file.is_file() or file.stat().st_size > LARGEST):
            raise InputError(f"{file}: expected a text file of at most {LARGEST} bytes")
        return tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise InputError(f"{file}: no such file; a study is a folder with study.toml and measurements.csv") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{file}: no UTF-8 text ({error.reason} at byte {error.start}); save it as UTF-8") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{file}: no valid TOML: {error}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: cannot be read: {error}") from None


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
    for name, owner in BELONGS_TO.items():
        if name in study.parameters and owner not in study.effects:
            raise InputError(f"{where}parameters: {name} belongs to the effect {owner}; list {owner} in [effects] too")


def _inside(folder: Path, file: Path, name: str) -> Path:
    path = folder / name
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError) as error:  # links in a circle; no path at all
        raise InputError(f"{file}: measurements {name!r} is no path: {error}") from None
    if not inside:
        raise InputError(f"{file}: measurements {name!r} lies outside the study; copy the file into {folder}")
    return path


def _text(file: Path, given: dict, key: str, default: str) -> str:
    value = given.get(key, default)
    if not isinstance(value, str):
        raise InputError(f"{file}: {key}: expected text in quotes, got {value!r}")
    if not value.isprintable():
        raise InputError(f"{file}: {key}: expected one line of text without control characters, got {value!r}")
    return value


def _choice(file: Path, given: dict, key: str, accepted: Iterable[str]) -> str | None:
    value = given.get(key)
    if value is not None and value not in list(accepted):
        raise InputError(f"{file}: {key} {value!r} is unknown{nearest(value, accepted)}")
    return value


def _table(file: Path, given: dict, key: str) -> dict:
    value = given.get(key, {})
    if not isinstance(value, dict):
        raise InputError(f"{file}: {key}: expected a table [{key}], got {value!r}")
    return value


def _setting(where: str, given, limits: tuple[float, float] = (-math.inf, math.inf)) -> Setting:
    """A number, or {value, min, max}."""

    def number(key: str, value) -> float:
        try:
            found = float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan
        except OverflowError:
            found = math.inf
        if not math.isfinite(found):
            raise InputError(f"{where}: {key}: expected a finite number, got {str(value)[:60]!r}")
        return found

    if not isinstance(given, dict):
        setting = Setting(number("value", given))
    else:
        unknown = [key for key in given if key not in ("value", "min", "max")]
        if unknown:
            raise InputError(f"{where}: {unknown[0]!r} is unknown{nearest(unknown[0], ('value', 'min', 'max'))}")
        if ("min" in given) != ("max" in given):
            raise InputError(f"{where}: min and max make it free: give both, or neither")
        if "min" not in given:
            if "value" not in given:
                raise InputError(f"{where}: expected a number, or {{ value = ..., min = ..., max = ... }}")
            setting = Setting(number("value", given["value"]))
        else:
            low, high = number("min", given["min"]), number("max", given["max"])
            if low >= high:
                raise InputError(f"{where}: min {low:g} is not below max {high:g}")
            value = number("value", given["value"]) if "value" in given else 0.5 * (low + high)
            if not low <= value <= high:
                raise InputError(f"{where}: value {value:g} lies outside its own min {low:g} and max {high:g}")
            setting = Setting(value, low, high)
    for value in (setting.value, setting.low, setting.high):
        if value is not None and not limits[0] <= value <= limits[1]:
            raise InputError(f"{where}: {value:g} lies outside {limits[0]:g} to {limits[1]:g}, which it must be within")
    return setting


def _limits(quantity: Mapping) -> tuple[float, float]:
    return float(quantity["min"]), float(quantity["max"])


def _parameters(file: Path, given: dict, catalogue: Catalogue) -> dict[str, Setting]:
    known = {name: q for rig in catalogue.rigs.values() for name, q in rig.parameters.items()}
    found = {}
    for name, value in given.items():
        if name not in known:
            raise InputError(f"{file}: parameters: {name!r} is unknown{nearest(name, known)}")
        found[name] = _setting(f"{file}: parameters: {name}", value, _limits(known[name]))
    return found


def _effects(file: Path, given: dict, catalogue: Catalogue) -> dict[str, dict[str, Setting]]:
    found = {}
    for name, values in given.items():
        effect = catalogue.effect(name, f"{file}: effects: ")
        if not isinstance(values, dict):
            raise InputError(f"{file}: effects: {name}: expected {{ {effect.amount} = ... }}, got {values!r}")
        for key in values:
            if key not in effect.parameters:
                raise InputError(f"{file}: effects: {name}: {key!r} is unknown{nearest(key, effect.parameters)}")
        found[name] = settings(effect, {})
        for key, value in values.items():
            found[name][key] = _setting(f"{file}: effects: {name}: {key}", value, _limits(effect.parameters[key]))
    return found


def _candidates(file: Path, given, catalogue: Catalogue) -> tuple[str, ...] | None:
    if given is None:
        return None
    if not isinstance(given, list) or not all(isinstance(name, str) for name in given):
        raise InputError(f"{file}: candidates: expected a list of effect names, got {given!r}")
    for name in given:
        catalogue.effect(name, f"{file}: candidates: ")
    return tuple(dict.fromkeys(given))


def _possible(file: Path, given: dict, catalogue: Catalogue) -> dict[str, dict[str, tuple[float, float]]]:
    found = {}
    for name, ranges in given.items():
        rig = catalogue.rig(name, f"{file}: possible: ")
        if not isinstance(ranges, dict):
            raise InputError(
                f"{file}: possible.{name}: expected condition = {{ min = ..., max = ... }}, got {ranges!r}"
            )
        found[name] = {}
        for condition, limits in ranges.items():
            where = f"{file}: possible.{name}: {condition}"
            if condition not in rig.conditions:
                raise InputError(f"{where!s} is unknown{nearest(condition, rig.conditions)}")
            if isinstance(limits, dict):
                setting = _setting(where, limits)
                found[name][condition] = (setting.low, setting.high) if setting.free else (setting.value,) * 2
            else:
                found[name][condition] = (_setting(where, limits).value,) * 2
            if rig.conditions[condition].get("positive") and found[name][condition][0] <= 0:
                raise InputError(f"{where}: expected more than 0")
    return found


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Hold a study while its study.toml and history are edited; a second command that edits them waits."""
    if not folder.is_dir():
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            log.info("waiting for another command that edits %s", folder)
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def write_effect(file: Path, name: str, values: Mapping[str, Setting]) -> None:
    """Put an effect into study.toml, the other lines as they are."""
    inner = ", ".join(f"{key} = {_toml(setting)}" for key, setting in values.items())
    lines = _without(file, name)
    entry = f"{name} = {{ {inner} }}"
    header = next((k for k, line in enumerate(lines) if re.match(r"\s*\[\s*effects\s*\]", line)), None)
    if header is None:
        first_sub = next((k for k, line in enumerate(lines) if re.match(r"\s*\[\s*effects\s*\.", line)), None)
        if first_sub is None:
            lines += ([""] if lines and lines[-1].strip() else []) + ["[effects]", entry]
        else:
            lines[first_sub:first_sub] = ["[effects]", entry, ""]
    else:
        lines.insert(header + 1, entry)
    _replace(file, lines, lambda present: name in present)


def erase_effect(file: Path, name: str) -> None:
    """Take an effect out of study.toml, the other lines as they are."""
    _replace(file, _without(file, name), lambda present: name not in present)


def _without(file: Path, name: str) -> list[str]:
    """The lines of study.toml less those that make an effect present."""
    kept, section, dropping = [], "", False
    for line in file.read_text(encoding="utf-8").splitlines():
        header = re.match(r"\s*\[\s*([^\]]+?)\s*\]", line)
        if header:
            section = header.group(1).replace(" ", "")
            dropping = section == f"effects.{name}"
        own = section == "effects" and re.match(rf"\s*{re.escape(name)}\s*[.=]", line)
        if not dropping and not own:
            kept.append(line)
    return kept


def _toml(setting: Setting) -> str:
    if not setting.free:
        return repr(float(setting.value))
    return f"{{ value = {float(f'{setting.value:.6g}')!r}, min = {setting.low!r}, max = {setting.high!r} }}"


def _replace(file: Path, lines: list[str], right) -> None:
    """Write study.toml anew, whole or not at all, after checking that it says what it should."""
    text = "\n".join(lines) + "\n"
    try:
        fine = right(tomllib.loads(text).get("effects", {}))
    except tomllib.TOMLDecodeError:
        fine = False
    if not fine:
        raise InputError(f"{file}: [effects] is written in a way that cannot be edited here; edit it by hand")
    temporary = file.with_suffix(".toml.new")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(file)
