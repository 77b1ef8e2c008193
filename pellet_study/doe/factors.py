"""A factor and the one crossing between its physical and its coded levels."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pellet_study.errors import InputError
from pellet_study.output.words import nearest
from pellet_study.tables.headers import found_in, split_unit
from pellet_study.tables.numbers import SIZES, fits, number, number_given

LEVEL = re.compile(r"([^=]+?|.+?)=([^=,]*\d[^=,]*)(,|$)")
"""NAME=LEVEL with the comma or the end behind it."""


@dataclass(frozen=True)
class Factor:
    """One factor of a design.

    Parameters
    ----------
    name : str
    low, high : float
        The physical levels coded -1 and +1. `low` may be the larger number (the source paper's Table 11 codes
        its factor B so: -1 is 0.90 and +1 is 0.82).
    unit : str
        Unit of the physical levels; empty for a pure number.
    levels : tuple of str
        Names of the levels of a categorical factor, two or more; of two the first is -1 and the second +1.

    Raises
    ------
    InputError
        If the two levels are equal or not finite.
    """

    name: str
    low: float = -1.0
    high: float = 1.0
    unit: str = ""
    levels: tuple[str, ...] = ()

    def __post_init__(self):
        if not (np.isfinite(self.low) and np.isfinite(self.high)) or self.low == self.high:
            raise InputError(
                f"factor {self.name!r} has the levels {self.low:g} and {self.high:g}: expected two different "
                "finite numbers; give the physical values of -1 and +1"
            )
        if not (fits(self.low) and fits(self.high)):
            raise InputError(
                f"factor {self.name!r} has the levels {self.low:g} and {self.high:g}: expected {SIZES}; give them in another unit"
            )

    @property
    def centre(self) -> float:
        return (self.low + self.high) / 2

    @property
    def half_range(self) -> float:
        """Physical change of one coded unit; negative where -1 is the higher physical level."""
        return (self.high - self.low) / 2

    def coded(self, physical):
        r"""Coded level :math:`x = (u - u_0)/\Delta`, `u_0` the centre, `\Delta` the half range."""
        return (np.asarray(physical, dtype=float) - self.centre) / self.half_range

    def physical(self, coded):
        r"""Physical level :math:`u = u_0 + x \Delta` of a coded one."""
        return self.centre + np.asarray(coded, dtype=float) * self.half_range

    def word(self, coded: float) -> str:
        """A level as it is written in a table."""
        return self.levels[int(coded > 0)] if self.levels else f"{float(self.physical(coded)):.6g}"

    @property
    def declaration(self) -> str:
        """As `parse_factor` reads it."""
        if self.levels:
            return f"{self.name}={','.join(self.levels)}"
        return f"{self.name}={self.low:.12g},{self.high:.12g}" + (f",{self.unit}" if self.unit else "")

    @property
    def label(self) -> str:
        """Name with unit, as written on an axis."""
        return with_unit(self.name, self.unit)


def with_unit(name: str, unit: str) -> str:
    """A quantity and its unit as written on an axis: `angle (deg)`, `G (J/m2)`; once where the name has it already."""
    return f"{name} ({unit})" if unit and split_unit(name)[1] != unit else name


def parse_factor(text: str) -> Factor:
    """A factor from `NAME=LOW,HIGH` or `NAME=LOW,HIGH,UNIT`, LOW being the physical value of -1.

    `NAME=WORD,WORD,...`, none of them a number, is a categorical factor.
    """
    name, _, levels = text.rpartition("=")  # a name may have the sign itself
    words = [word.strip() for word in levels.split(",")]
    if name.strip() and len(words) > 1 and all(words) and not any(map(_numeric, words)):
        if len(set(words)) < len(words):
            raise InputError(
                f"the factor {text!r} names a level twice: expected different words, such as {name}=old,new"
            )
        return Factor(name.strip(), levels=tuple(words))
    low, high, unit, *surplus = [*words, "", ""][: max(3, len(words))]
    if surplus or _numeric(unit):
        raise InputError(
            f"the factor {text!r} has {len(words)} fields, of which {', '.join(filter(_numeric, words))} are numbers: expected "
            "NAME=LOW,HIGH or NAME=LOW,HIGH,UNIT; a comma separates, so write decimal points, for example B=0.90,0.82"
        )
    try:
        if not name.strip():
            raise ValueError
        return Factor(name.strip(), number_given(low), number_given(high), unit)
    except ValueError:
        raise InputError(
            f"the factor {text!r} was not understood: expected NAME=LOW,HIGH or NAME=LOW,HIGH,UNIT with LOW "
            "the physical value of -1, for example B=0.90,0.82"
        ) from None


def _numeric(word: str) -> bool:
    try:
        number(word)
    except ValueError:
        return False
    return True


def parse_factors(words: list[str]) -> list[Factor]:
    """Several factors; see `parse_factor`.

    Raises
    ------
    InputError
        If two have the same name.
    """
    factors = [parse_factor(word) for word in words]
    names = [factor.name for factor in factors]
    repeated = [name for name in names if names.count(name) > 1]
    if repeated:
        raise InputError(f"the factor {repeated[0]!r} was given {names.count(repeated[0])} times: expected each once")
    return factors


def parse_levels(text: str) -> dict[str, float]:
    """{name: level} from `A=1.5,B=2`; a name may hold `=` and commas itself."""
    try:
        pairs = LEVEL.findall(text)
        whole = "".join(f"{name}={level}{end}" for name, level, end in pairs) == text
        before = ["."] + [level for _, level, _ in pairs]  # a level with a point has no rest behind its comma
        rests = [re.match(r"\s*\d+,", n) and "." not in b for (n, *_), b in zip(pairs, before, strict=False)]
        if not whole or any(rests):  # the rest of a decimal comma
            raise ValueError
        levels = {name.strip(): number_given(level) for name, level, _ in pairs}
    except ValueError:
        raise InputError(
            f"{text!r} was not understood: expected NAME=LEVEL,NAME=LEVEL, with decimal points, such as B=0.887,C=0.319; "
            "before a name that begins with a number and a comma too: B=1.0,2,4-D=3"
        ) from None
    if len(levels) < len(pairs):
        raise InputError(f"{text!r} gives a level twice: expected each name once")
    return levels


def factor_meant(name: str, names: Sequence[str]) -> str:
    """The name of the factor that is meant, its unit said or not.

    Raises
    ------
    InputError
        If it is no factor: names those that are, and the one that is near.
    """
    found = found_in(name.strip(), list(names))
    if found is None:
        raise InputError(f"{name!r} is no factor of the table{nearest(name, names)}")
    return found


def factors_meant(text: str, names: Sequence[str]) -> list[str]:
    """Several of them from `A,B`; a name may hold commas itself.

    Raises
    ------
    InputError
        See `factor_meant`.
    """
    parts, found = text.split(","), []
    while parts:
        sizes = [n for n in range(len(parts), 0, -1) if found_in(",".join(parts[:n]).strip(), list(names))]
        size = sizes[0] if sizes else 1
        found.append(factor_meant(",".join(parts[:size]), names))
        parts = parts[size:]
    return found


def parse_range(text: str) -> tuple[str, tuple[float, float]]:
    """(name, (low, high)) from `A=1,2`."""
    factor = parse_factor(text)
    if factor.levels:
        raise InputError(f"{text!r} was not understood: expected NAME=LOW,HIGH with numbers, for example B=0.90,0.82")
    return factor.name, (factor.low, factor.high)


def rounded(values, scale: float):
    """Levels without the noise of their computation: ten decimals, of a quantity below 0.1 ten digits, whatever its unit."""
    decimals = 10 if scale >= 0.1 or scale <= 0 else 9 - int(np.floor(np.log10(scale)))
    whole = np.round(np.asarray(values, dtype=float), decimals)
    return whole if decimals < 17 else np.vectorize(lambda value: float(f"{value:.12g}"), otypes=[float])(whole)


def physical_design(coded, factors: list[Factor]):
    """The design in physical units: a table (n_runs, n_factors) with one column per factor."""
    import pandas as pd

    coded = np.asarray(coded, dtype=float)
    return pd.DataFrame({factor.name: _as_written(factor, coded[:, i]) for i, factor in enumerate(factors)})


def _as_written(factor: Factor, coded):
    """Physical levels of a column, without the last digits of rounding; of a categorical factor its words."""
    if factor.levels:
        return [factor.levels[int(level > 0)] for level in coded]
    return rounded(factor.physical(coded), max(abs(factor.low), abs(factor.high)))
