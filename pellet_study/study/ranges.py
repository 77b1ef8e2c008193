"""The ranges of declared quantities: beyond what a rig can simulate a value is refused, beyond the usual it is warned of.

A condition is usual from `min` to `max`; what its rig can simulate is `limits`, or, where none are declared, ten times
beyond. A parameter must lie from `min` to `max`, and is usual over its `physical` range where it declares one. Where another
unit, a power of ten or radians for degrees, would bring values into the usual range, it is named.
"""

import math
from collections.abc import Iterable, Mapping, Sequence

from pellet_study.errors import InputError
from pellet_study.rigs.declared import Rig
from pellet_study.study.units import an_angle, in_unit, likely_unit

BEYOND = 10.0  # times the usual range: what a rig can simulate where it declares no limits
TINY = 0.02  # of the usual range: smaller values of a quantity that may be zero are likely in another unit


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
    given, span = [value for value in values if value], within or usual(quantity)
    if an_angle(quantity, given, span):
        return f"; {given[0]:.4g} deg would be tan {given[0]:.4g} = {math.tan(math.radians(given[0])):.3g}: is it given as an angle?"
    found = likely_unit(quantity, given, span, least)
    if found is None:
        return ""
    name, size = found
    unit = in_unit(str(quantity.get("unit", "")))
    return f"; {given[0]:.4g} {name} would be {size * given[0]:.4g}{unit}: is it given in {name}?"


def range_words(quantity: Mapping, range_: tuple[float, float]) -> str:
    """`10 to 3000 mm`."""
    return f"{range_[0]:g} to {range_[1]:g}{in_unit(str(quantity.get('unit', '')))}"


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
        return f"{name} {_beyond_words(beyond, quantity, (low, high), other_unit(quantity, values))}"
    largest = max(map(abs, values), default=0.0)
    if low <= 0 < largest < TINY * high and (hint := other_unit(quantity, values, least=1.0)):
        return (
            f"{name} is at most {largest:g} where up to {high:g}{in_unit(str(quantity.get('unit', '')))} is usual{hint}"
        )
    return ""


def reading_words(low: float, high: float, unit: str) -> str:
    """`from 0 to 80 deg`, `at least 0 mm`: what can be read of an observable."""
    return f"at least {low:g}{in_unit(unit)}" if high == math.inf else f"from {low:g} to {high:g}{in_unit(unit)}"


def refuse_unreadable(where: str, rig: Rig, observable: str, text: str, value: float) -> None:
    """Refuse a reading that nobody can have read.

    Raises
    ------
    InputError : names what can be read, and the likely unit
    """
    low, high = rig.readable.get(observable, (-math.inf, math.inf))
    if low <= value <= high:
        return
    unit = rig.units.get(observable, "")
    hint = other_unit({"unit": unit, "max": high}, (value,), rig.usual.get(observable, (low, high)))
    words = reading_words(low, high, unit)
    raise InputError(f"{where}: value {text!r}: {observable} of {rig.name} can be read {words} only{hint}")


def unusual_readings(rig: Rig, observable: str, values: Sequence[float]) -> str:
    """What to say of readings beyond the usual range of their observable, or nothing.

    A few far readings among many are the business of the fit, which names rows; here the most are.
    """
    if observable not in rig.usual:
        return ""
    low, high = rig.usual[observable]
    beyond = [value for value in values if not low <= value <= high]
    if 2 * len(beyond) <= len(values):
        return ""
    quantity = {"unit": rig.units.get(observable, ""), "max": high}
    return f"{observable} {_beyond_words(beyond, quantity, (low, high), other_unit(quantity, values, (low, high)))}"


def _beyond_words(beyond: Sequence[float], quantity: Mapping, span: tuple[float, float], hint: str) -> str:
    """`0.3, 0.5, 0.6, ... lies beyond the usual 3 to 85 deg; ...`."""
    shown = ", ".join(f"{value:g}" for value in beyond[:3]) + (", ..." if len(beyond) > 3 else "")
    return f"{shown} lies beyond the usual {range_words(quantity, span)}{hint}"


def unusual_parameter(name: str, quantity: Mapping, values: Iterable[float]) -> str:
    """What to say of a parameter's values beyond its `physical` range; nothing where it declares none."""
    if "physical" not in quantity:
        return ""
    low, high = map(float, quantity["physical"])
    beyond = [value for value in values if not low <= value <= high]
    if not beyond:
        return ""
    return f"{name} {_beyond_words(beyond[:1], quantity, (low, high), other_unit(quantity, beyond, (low, high)))}"
