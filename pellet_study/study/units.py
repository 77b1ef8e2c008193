"""Units that may have been meant for a declared one: those in which people write such quantities, nothing else.

A hint names a unit only where the number, as it stands, is one that people write: 400 um of a grain, not 20,000 um of a
drop height.
"""

import math
import re
from collections.abc import Iterable, Mapping

PREFIXES = {"": 1.0, "k": 1e3, "m": 1e-3, "M": 1e6, "u": 1e-6, "c": 1e-2, "G": 1e9}
WRITTEN = {  # the prefixes with which a unit is written in a laboratory, the likelier first
    "m": ("", "m", "c", "u"),
    "g": ("", "k", "m"),
    "Pa": ("", "k", "M", "G"),
    "N": ("", "k", "m"),
    "J": ("", "m", "k"),
    "W": ("", "m", "k"),
    "V": ("", "m", "k"),
    "A": ("", "m", "u"),
    "L": ("", "m", "u"),
    "l": ("", "m", "u"),
    "s": ("", "m"),
    "Hz": ("", "k"),
    "m/s": ("", "m", "c"),
    "J/m2": ("", "m"),
}
FORMS = {  # units that are no prefix and base: {the unit meant instead: its size in the declared unit}
    "deg": {"rad": math.degrees(1.0)},
    "rad": {"deg": math.radians(1.0)},
    "kg/m3": {"g/cm3": 1e3},
    "g/cm3": {"kg/m3": 1e-3},
    "percent": {"a share of one": 100.0},
    "%": {"a share of one": 100.0},
}
PERCENT = {"percent": 0.01}  # of a number that is a share
NATURAL = (1e-3, 2e4)  # sizes of numbers that people write in a unit of their choice
SPLIT = re.compile(rf"([kmuMcG]?)({'|'.join(sorted(map(re.escape, WRITTEN), key=len, reverse=True))})")


def other_units(unit: str, share: bool = False) -> dict[str, float]:
    """Units that may have been meant for a declared one, with their size in it, the likelier first.

    Parameters
    ----------
    share : the quantity is a number of at most one, so that percent may be meant
    """
    if unit in ("", "1"):
        return PERCENT if share else {}
    if unit in FORMS:
        return FORMS[unit]
    found = SPLIT.fullmatch(unit)
    if found is None:
        return {}
    own = PREFIXES[found[1]]
    return {p + found[2]: PREFIXES[p] / own for p in WRITTEN[found[2]] if p != found[1]}


def likely_unit(
    quantity: Mapping, values: Iterable[float], within: tuple[float, float], least: float = 0.0
) -> tuple[str, float] | None:
    """The unit, and its size in the declared one, that brings values into a range; None where none does.

    Parameters
    ----------
    least : the smallest size of the units looked at
    """
    low, high = within
    given = [value for value in values if value]
    largest = max(map(abs, given), default=0.0)
    share = float(quantity.get("max", high)) <= 1.0
    if not NATURAL[0] <= largest <= NATURAL[1]:
        return None
    for name, size in other_units(str(quantity.get("unit", "")), share).items():
        if size >= least and all(low <= size * value <= high for value in given):
            return name, size
    return None


def an_angle(quantity: Mapping, values: Iterable[float], within: tuple[float, float]) -> bool:
    """Whether values of a tangent are likely the angles themselves, in degrees."""
    low, high = within
    given = list(values)
    return bool(
        quantity.get("tangent")
        and given
        and all(1 < v < 90 and low <= math.tan(math.radians(v)) <= high for v in given)
    )


def in_unit(unit: str) -> str:
    """` mm`, or nothing where it is a number."""
    return "" if unit in ("", "1") else f" {unit}"
