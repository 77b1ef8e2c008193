"""The ranges of declared quantities: beyond what a rig can simulate a value is refused, beyond the usual it is warned of.

A condition is usual from `min` to `max`; what its rig can simulate is `limits`, or, where none are declared, ten times
beyond. A parameter must lie from `min` to `max`, and is usual over its `physical` range where it declares one. Where another
unit, a power of ten or radians for degrees, would bring values into the usual range, it is named.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence

from pellet_study.errors import InputError

BEYOND = 10.0  # times the usual range: what a rig can simulate where it declares no limits
TINY = 0.02  # of the usual range: smaller values of a quantity that may be zero are likely in another unit
PREFIXES = {"": 1.0, "k": 1e3, "m": 1e-3, "M": 1e6, "u": 1e-6, "c": 1e-2, "G": 1e9, "n": 1e-9}  # the likelier first
BASES = ("m", "g", "Pa", "N", "J", "s", "Hz", "m/s", "J/m2")
FORMS = {  # units that are no prefix and base: {the unit meant instead: its size in the declared unit}
    "deg": {"rad": math.degrees(1.0)},
    "rad": {"deg": math.radians(1.0)},
    "kg/m3": {"g/cm3": 1e3, "mg/cm3": 1.0},
    "g/cm3": {"kg/m3": 1e-3},
    "percent": {"a share of one": 100.0},
    "%": {"a share of one": 100.0},
    "1": {"percent": 0.01},
}


def usual(quantity: Mapping) -> tuple[float, float]:
    """The usual range of a condition, `min` to `max`."""
    return float(quantity["min"]), float(quantity["max"])


def limits(quantity: Mapping) -> tuple[float, float]:
    """What a rig can simulate of a condition: `limits`, else ten times beyond the usual, an angle up to the upright."""
    if "limits" in quantity:
        low, high = quantity["limits"]
        return float(low), float(high)
    low, high = usual(quantity)
    wide = BEYOND * high if high > 0 else high / BEYOND
    if quantity.get("unit") == "deg" and high <= 90.0:
        wide = min(wide, 90.0)
    return (low / BEYOND if low > 0 else BEYOND * low), wide


def other_unit(
    quantity: Mapping, values: Iterable[float], within: tuple[float, float] | None = None, least: float = 0.0
) -> str:
    """`; 0.3 m would be 300 mm: is it given in m?`, or nothing where no other unit brings the values into the usual range.

    Parameters
    ----------
    within : default the usual range
    least : the smallest size, in the declared unit, of the units looked at
    """
    low, high = within or usual(quantity)
    given = [value for value in values if value]
    unit = str(quantity.get("unit", ""))
    for name, size in other_units(unit).items():
        if given and size >= least and all(low <= size * value <= high for value in given):
            first = f"{given[0]:.4g}"
            return f"; {first} {name} would be {size * given[0]:.4g}{_of(unit)}: is it given in {name}?"
    return ""


def other_units(unit: str) -> dict[str, float]:
    """Units that may have been meant for a declared one, with their size in it, the likelier first."""
    if unit in FORMS:
        return FORMS[unit]
    found = re.fullmatch(rf"([kmuMGcn]?)({'|'.join(sorted(map(re.escape, BASES), key=len, reverse=True))})", unit)
    if found is None:
        return {}
    own = PREFIXES[found[1]]
    sensible = [prefix for prefix in PREFIXES if prefix != found[1] and (prefix != "c" or found[2].startswith("m"))]
    return {prefix + found[2]: PREFIXES[prefix] / own for prefix in sensible}


def _of(unit: str) -> str:
    return "" if unit in ("", "1") else f" {unit}"


def range_words(quantity: Mapping, range_: tuple[float, float]) -> str:
    """`10 to 3000 mm`."""
    return f"{range_[0]:g} to {range_[1]:g}{_of(str(quantity.get('unit', '')))}"


def refuse_beyond(where: str, name: str, value: float, quantity: Mapping, column: Sequence[float] = ()) -> None:
    """Refuse a value of a condition that its rig cannot simulate.

    Parameters
    ----------
    column : all values that the rig's rows have there, which tell the unit better than one

    Raises
    ------
    InputError : names the range, the usual range, and the likely unit
    """
    low, high = limits(quantity)
    if low <= value <= high:
        return
    hint = other_unit(quantity, column or (value,)) or other_unit(quantity, (value,))
    raise InputError(
        f"{where}: {name} {value:g}: the rig can simulate {range_words(quantity, (low, high))} "
        f"(usual: {range_words(quantity, usual(quantity))}){hint}"
    )


def unusual(name: str, quantity: Mapping, values: Sequence[float]) -> str:
    """What to say of a condition's values that are beyond the usual, or so small that they may be in another unit."""
    low, high = usual(quantity)
    beyond = [value for value in values if not low <= value <= high]
    if beyond:
        hint = other_unit(quantity, values)
        shown = ", ".join(f"{value:g}" for value in beyond[:3]) + (", ..." if len(beyond) > 3 else "")
        return f"{name} {shown} lies beyond the usual {range_words(quantity, (low, high))}{hint}"
    largest = max(map(abs, values), default=0.0)
    if low <= 0 < largest < TINY * high and (hint := other_unit(quantity, values, least=1.0)):
        return f"{name} is at most {largest:g} where up to {high:g}{_of(str(quantity.get('unit', '')))} is usual{hint}"
    return ""


def unusual_parameter(name: str, quantity: Mapping, values: Iterable[float]) -> str:
    """What to say of a parameter's values beyond its `physical` range; nothing where it declares none."""
    if "physical" not in quantity:
        return ""
    low, high = map(float, quantity["physical"])
    beyond = [value for value in values if not low <= value <= high]
    if not beyond:
        return ""
    return (
        f"{name} {beyond[0]:g} lies beyond the usual {range_words(quantity, (low, high))}"
        f"{other_unit(quantity, beyond, (low, high))}"
    )
