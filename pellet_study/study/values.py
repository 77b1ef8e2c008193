"""Values of study.toml, each checked for its kind: text, a choice, words, a table, a number or {value, min, max}.

Each function raises InputError, which says where the value stands, what was given and what was expected.
"""

import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from pellet_study.errors import InputError
from pellet_study.output.words import nearest
from pellet_study.study.ranges import other_unit, usual
from pellet_study.study.study import Setting
from pellet_study.tables.numbers import SIZES, fits

KEYS_OF_SETTING = ("value", "min", "max")


def text(file: Path | str, given: Mapping, key: str, default: str) -> str:
    """One line of text."""
    value = given.get(key, default)
    if not isinstance(value, str):
        raise InputError(f"{file}: {key}: expected text in quotes, got {value!r}")
    if not value.isprintable():
        raise InputError(f"{file}: {key}: expected one line of text without control characters, got {value!r}")
    return value


def choice(file: Path | str, given: Mapping, key: str, accepted: Collection[str]) -> str | None:
    """One of the accepted words, None where it is not given."""
    value = given.get(key)
    if value is not None and value not in list(accepted):
        raise InputError(f"{file}: {key} {value!r} is unknown{nearest(value, accepted)}")
    return value


def words(where: str, given: Any, accepted: Collection[str]) -> tuple[str, ...]:
    """One of the accepted words, or a list of them."""
    listed = [given] if isinstance(given, str) else given
    if not isinstance(listed, list) or not listed:
        raise InputError(
            f"{where}: expected a word in quotes or a list of words, got {given!r}{nearest(given, accepted)}"
        )
    for word in listed:
        if word not in list(accepted):
            raise InputError(f"{where}: {word!r} is unknown{nearest(word, accepted)}")
    return tuple(dict.fromkeys(listed))


def table(file: Path | str, given: Mapping, key: str) -> dict:
    """A table, empty where it is not given."""
    value = given.get(key, {})
    if not isinstance(value, dict):
        raise InputError(f"{file}: {key}: expected a table [{key}], got {value!r}")
    return value


def setting(where: str, given: Any, quantity: Mapping | None = None) -> Setting:
    """A number, or {value, min, max}, all of them from `min` to `max` of the quantity, where that is declared."""
    found = _of_table(where, given) if isinstance(given, dict) else Setting(_number(where, "value", given))
    if quantity is None:
        return found
    low, high = usual(quantity)
    values = [value for value in (found.low, found.high, found.value) if value is not None]
    for value in values:
        if not low <= value <= high:
            hint = other_unit(quantity, values) or other_unit(quantity, (value,))
            raise InputError(f"{where}: {value:g} lies outside {low:g} to {high:g}, which it must be within{hint}")
    return found


def _of_table(where: str, given: Mapping) -> Setting:
    unknown = [key for key in given if key not in KEYS_OF_SETTING]
    if unknown:
        raise InputError(f"{where}: {unknown[0]!r} is unknown{nearest(unknown[0], KEYS_OF_SETTING)}")
    if ("min" in given) != ("max" in given):
        raise InputError(f"{where}: min and max make it free: give both, or neither")
    if "min" not in given:
        if "value" not in given:
            raise InputError(f"{where}: expected a number, or {{ value = ..., min = ..., max = ... }}")
        return Setting(_number(where, "value", given["value"]))
    low, high = _number(where, "min", given["min"]), _number(where, "max", given["max"])
    if low >= high:
        raise InputError(f"{where}: min {low:g} is not below max {high:g}")
    value = _number(where, "value", given["value"]) if "value" in given else 0.5 * (low + high)
    if not low <= value <= high:
        raise InputError(f"{where}: value {value:g} lies outside its own min {low:g} and max {high:g}")
    return Setting(value, low, high)


def _number(where: str, key: str, value: Any) -> float:
    try:
        found = float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise InputError(f"{where}: {key}: expected a finite number, got {str(value)[:60]!r}")
    if not fits(found):
        raise InputError(f"{where}: {key}: expected {SIZES}, got {str(value)[:60]!r}; is the unit right?")
    return found
