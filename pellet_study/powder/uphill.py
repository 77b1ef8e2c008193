"""The path of a powder calibration in few heaps: along the effects of a saturated screening."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pellet_study.doe.factors import Factor
from pellet_study.doe.lenth import lenth
from pellet_study.powder.heaps import point_at
from pellet_study.powder.plan import RIG, SYMBOLS
from pellet_study.rigs import on_yade

FARTHEST = 2.0  # half ranges of the screening, of the factor that moves most


@dataclass(frozen=True)
class Uphill:
    """The point at t has the coded levels t `direction`, for t from `low` to `high`.

    What the screening tells of the angle along it: the `level` at t = 0 and the `slope`, deg; the variance of the slope is
    `slope_variance` times that of a heap.
    """

    factors: list[Factor]
    direction: np.ndarray
    low: float
    high: float
    level: float
    slope: float
    slope_variance: float

    @property
    def moved(self) -> list[str]:
        """The factors that the path moves, in the order of the plan."""
        return [f.name for f, u in zip(self.factors, self.direction, strict=True) if u]

    def point(self, t: float) -> dict[str, float]:
        """{factor: physical level} at t."""
        return point_at(self.factors, t * self.direction)

    def within(self, t: float) -> float:
        """t, or the end of the path that is nearest to it."""
        return float(np.clip(t, self.low, self.high))


def uphill(factors: Sequence[Factor], coded: np.ndarray, angle: np.ndarray, idle: Sequence[str] = ()) -> Uphill:
    r"""The path of a screening.

    By least squares :math:`y = b_0 + \sum b_i x_i`; the path has the direction :math:`b_i (1 - e^2/b_i^2)_+`, largest part 1:
    effects that are not clear are shrunk, those below e to nothing. e is Lenth's pseudo standard error of the b, as a
    saturated design leaves no residuals. Where all are below it, the path has the largest alone.

    Parameters
    ----------
    coded : (n, k) levels of the heaps that gave an angle, -1 to 1
    angle : (n,) their angles, deg
    idle : factors that the contact law does not have: they are not moved

    References
    ----------
    Breiman, Better subset regression using the nonnegative garrote, Technometrics 37 (1995) 373,
    doi:10.1080/00401706.1995.10484371. Lenth, Technometrics 31 (1989) 469, doi:10.1080/00401706.1989.10488595.
    """
    level = float(angle.mean())  # taken off first: where a heap is lost, the smallest b that fit are meant
    terms = np.column_stack([np.ones(len(angle)), coded])
    inverse = np.linalg.pinv(terms)
    shift, *b = inverse @ (angle - level)
    covariance = (inverse @ inverse.T)[1:, 1:]
    slopes = np.where([f.name in idle for f in factors], 0.0, b)
    direction = _shrunk(slopes, np.asarray(b))
    direction /= np.abs(direction).max()
    low, high = _ends(factors, direction)
    return Uphill(
        list(factors),
        direction,
        low,
        high,
        level=level + float(shift),
        slope=float(direction @ slopes),
        slope_variance=float(direction @ covariance @ direction),
    )


def _shrunk(slopes: np.ndarray, every: np.ndarray) -> np.ndarray:
    """Slopes without their unclear part; the largest alone where nothing is clear."""
    noise = lenth(list(every))
    error = noise.pseudo_standard_error if noise else 0.0
    squares = np.maximum(slopes**2, np.finfo(float).tiny)
    shrunk = slopes * np.maximum(1 - error**2 / squares, 0)
    return (
        shrunk
        if shrunk.any()
        else np.where(np.abs(slopes) == np.abs(slopes).max(), np.sign(slopes) + (slopes == 0), 0.0)
    )


def _ends(factors: Sequence[Factor], direction: np.ndarray) -> tuple[float, float]:
    """How far the path goes: `FARTHEST`, as far as the rig takes the levels."""
    known = on_yade.rig(RIG).parameters
    low, high = -FARTHEST, FARTHEST
    for f, u in zip(factors, direction, strict=True):
        if u:
            ends = sorted(f.coded(known[SYMBOLS[f.name]][side]) / u for side in ("min", "max"))
            low, high = max(low, ends[0]), min(high, ends[1])
    return low, high
