"""A study folder read and checked: study.toml, its measurements, and effects and rigs of the user's own."""

import math
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.output.words import nearest
from pellet_study.rigs.catalogue import Catalogue
from pellet_study.study import user_code
from pellet_study.study.measurements import Measurement, read
from pellet_study.study.study import SCALINGS, Setting, Study, check, settings

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
CONTACT_LAWS = ("hertz_mindlin", "cohesive_frictional")
EFFORT = (0.5, 100.0)  # simulations of the rigs on YADE, as a multiple of the least that answers


def load(folder: Path) -> Study:
    """Read and check a study folder.

    Raises
    ------
    InputError : anything in it cannot be used
    """
    folder = Path(folder)
    file = folder / "study.toml"
    given = _toml_in(file)
    refuse_unknown(given, file)
    everything = user_code.of_study(folder)
    rows = read(_inside(folder, file, _text(file, given, "measurements", "measurements.csv")), everything)
    return assembled(given, rows, everything, file, folder)


def refuse_unknown(given: Mapping, file: Path | str) -> None:
    """Refuse keys that study.toml does not have."""
    for key in given:
        if key not in KEYS:
            raise InputError(f"{file}: {key!r} is unknown{nearest(key, KEYS)}")


def assembled(
    given: dict, rows: tuple[Measurement, ...], everything: Catalogue, file: Path | str, folder: Path | None
) -> Study:
    """A checked study of what study.toml says, given as tables, and of measured rows; `file` is named in errors."""
    possible = _possible(file, _table(file, given, "possible"), everything)
    catalogue = everything.within(list(dict.fromkeys([*(row.rig for row in rows), *possible])))
    law = _choice(file, given, "contact_law", CONTACT_LAWS)
    study = Study(
        title=_text(file, given, "title", folder.resolve().name if folder else "study"),
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
    user_code.try_out(catalogue, rows, {name: setting.value for name, setting in study.parameters.items()})
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


def _inside(folder: Path, file: Path, name: str) -> Path:
    path = folder / name
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError) as error:  # links in a circle; no path at all
        raise InputError(f"{file}: measurements {name!r} is no path: {error}") from None
    if not inside:
        raise InputError(f"{file}: measurements {name!r} lies outside the study; copy the file into {folder}")
    return path


def _text(file: Path | str, given: dict, key: str, default: str) -> str:
    value = given.get(key, default)
    if not isinstance(value, str):
        raise InputError(f"{file}: {key}: expected text in quotes, got {value!r}")
    if not value.isprintable():
        raise InputError(f"{file}: {key}: expected one line of text without control characters, got {value!r}")
    return value


def _choice(file: Path | str, given: dict, key: str, accepted: Iterable[str]) -> str | None:
    value = given.get(key)
    if value is not None and value not in list(accepted):
        raise InputError(f"{file}: {key} {value!r} is unknown{nearest(value, accepted)}")
    return value


def _table(file: Path | str, given: dict, key: str) -> dict:
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


def _parameters(file: Path | str, given: dict, catalogue: Catalogue) -> dict[str, Setting]:
    known = {name: q for rig in catalogue.rigs.values() for name, q in rig.parameters.items()}
    found = {}
    for name, value in given.items():
        if name not in known:
            raise InputError(f"{file}: parameters: {name!r} is unknown{nearest(name, known)}")
        found[name] = _setting(f"{file}: parameters: {name}", value, _limits(known[name]))
    return found


def _effects(file: Path | str, given: dict, catalogue: Catalogue) -> dict[str, dict[str, Setting]]:
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


def _candidates(file: Path | str, given, catalogue: Catalogue) -> tuple[str, ...] | None:
    if given is None:
        return None
    if not isinstance(given, list) or not all(isinstance(name, str) for name in given):
        raise InputError(f"{file}: candidates: expected a list of effect names, got {given!r}")
    for name in given:
        catalogue.effect(name, f"{file}: candidates: ")
    return tuple(dict.fromkeys(given))


def _possible(file: Path | str, given: dict, catalogue: Catalogue) -> dict[str, dict[str, tuple[float, float]]]:
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
