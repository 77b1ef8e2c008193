"""The angle along a path: a straight line whose level is told by the heaps on the path alone, its slope by the screening too."""

from dataclasses import dataclass

import numpy as np

from pellet_study.powder.uphill import Uphill


@dataclass(frozen=True)
class Line:
    """Angle along the path, a + b t: estimates (2,), their covariance (2, 2), the scatter of a heap (deg), `freedom` of it."""

    estimates: np.ndarray
    covariance: np.ndarray
    scatter: float
    freedom: int

    def meets(self, target: float) -> float:
        """Where on the path the line meets an angle (deg); infinite where it is flat."""
        level, slope = self.estimates
        return float((target - level) / slope) if slope else float("inf")

    def at(self, t: float) -> float:
        """The angle at t, deg."""
        return float(self.estimates @ (1, t))

    def error(self, t: float) -> float:
        """Standard error of the angle at t, deg."""
        return float(np.sqrt((1, t) @ self.covariance @ (1, t)))


def fit_line(path: Uphill, t: np.ndarray, angle: np.ndarray) -> Line:
    """Least squares of a + b t with the slope of the screening as one reading more, of b alone; all have one scatter.

    Parameters
    ----------
    t, angle : (n,) places and angles (deg) of the heaps on the path, two or more

    Returns
    -------
    The line; its scatter has n - 1 degrees of freedom.
    """
    weight = path.slope_variance**-0.5
    middle, mean = t.mean(), angle.mean()
    precision = ((t - middle) ** 2).sum() + weight**2
    slope = (((t - middle) * (angle - mean)).sum() + weight**2 * path.slope) / precision
    squares = ((angle - mean - slope * (t - middle)) ** 2).sum() + (weight * (path.slope - slope)) ** 2
    variance = squares / (len(t) - 1)
    of_level = 1 / len(t) + middle**2 / precision
    covariance = variance * np.array([[of_level, -middle / precision], [-middle / precision, 1 / precision]])
    return Line(np.array([mean - slope * middle, slope]), covariance, float(np.sqrt(variance)), len(t) - 1)
