"""The box of coded settings, -1 to 1 in every factor: points spread over it, and the range of a factor on a part of it."""

from dataclasses import dataclass

import numpy as np

SAMPLE_POWER = 16
"""2^16 Sobol points fill the box; volume fractions are good to about 0.001."""


@dataclass(frozen=True)
class Extent:
    """Range of a factor on the settings that meet the target, coded and physical (in coded order)."""

    name: str
    coded: tuple[float, float]
    physical: tuple[float, float]

    @property
    def unidentified(self) -> bool:
        """Whether the response leaves the factor anywhere in its range."""
        return self.coded[0] < -0.999 and self.coded[1] > 0.999


def extent(factor, ends) -> Extent:
    """The range of a factor between two coded levels."""
    low, high = ends
    return Extent(factor.name, (low, high), (float(factor.physical(low)), float(factor.physical(high))))


def sample(n_factors: int) -> np.ndarray:
    """Evenly spread points (65536, n_factors) of the box: the same ones every time."""
    from scipy.stats.qmc import Sobol

    return 2 * Sobol(n_factors, scramble=False).random_base2(SAMPLE_POWER) - 1
