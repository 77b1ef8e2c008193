"""The box of coded settings, -1 to 1 in every factor: points spread over it, and the range of a factor on a part of it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

SAMPLE_POWER = 16
"""2^16 Sobol points fill the box; volume fractions are good to about 0.001."""

ON_A_LINE = 2001
"""Levels of a factor that are tried by themselves: its range is good to a thousandth of its half."""


@dataclass(frozen=True)
class Extent:
    """Range of a factor on the settings that meet the target, coded and physical (in coded order).

    `alone` is its physical range about the recommended setting with all other factors as recommended; None where that
    setting does not meet the target, or the factor is the only one.
    """

    name: str
    coded: tuple[float, float]
    physical: tuple[float, float]
    alone: tuple[float, float] | None = None

    @property
    def unidentified(self) -> bool:
        """Whether the target is met at both ends of its range, the other factors set to suit."""
        return self.coded[0] < -0.999 and self.coded[1] > 0.999


def extent(factor, ends) -> Extent:
    """The range of a factor between two coded levels."""
    low, high = ends
    return Extent(factor.name, (low, high), (float(factor.physical(low)), float(factor.physical(high))))


def with_alone(
    extents: list[Extent], factors, point: np.ndarray, met: Callable[[np.ndarray], np.ndarray]
) -> list[Extent]:
    """Ranges with what each factor may do by itself: `met` says of coded points (n, n_factors) whether they will do."""
    if len(factors) < 2 or not bool(met(point[None, :])[0]):
        return extents
    found = []
    for i, (known, factor) in enumerate(zip(extents, factors, strict=True)):
        line = np.unique([*np.linspace(-1, 1, ON_A_LINE), point[i]])
        points = np.tile(point, (len(line), 1))
        points[:, i] = line
        missed = line[~met(points)]
        low = line[line > missed[missed < point[i]].max(initial=-np.inf)][0]
        high = line[line < missed[missed > point[i]].min(initial=np.inf)][-1]
        found.append(replace(known, alone=(float(factor.physical(low)), float(factor.physical(high)))))
    return found


def sample(n_factors: int) -> np.ndarray:
    """Evenly spread points (65536, n_factors) of the box: the same ones every time."""
    from scipy.stats.qmc import Sobol

    return 2 * Sobol(n_factors, scramble=False).random_base2(SAMPLE_POWER) - 1
