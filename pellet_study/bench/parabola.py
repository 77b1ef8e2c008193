"""A parabola through a sweep, and the parameter at which it meets a measurement."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Parabola:
    """Least-squares fit y = c0 + c1 x + c2 x^2 to a sweep.

    `coefficients` and `intervals` (95 %, one row a coefficient) are in the order constant, linear, quadratic;
    `covariance` is theirs; `low` and `high` bound the sweep.
    """

    coefficients: np.ndarray
    intervals: np.ndarray
    covariance: np.ndarray
    r2: float
    residual_df: int
    low: float
    high: float

    def at(self, x: ArrayLike) -> np.ndarray:
        """The curve at x."""
        return _terms(x) @ self.coefficients

    def standard_error(self, x: ArrayLike) -> np.ndarray:
        """Standard error of the curve at x."""
        terms = _terms(x)
        return np.sqrt(np.einsum("...i,ij,...j->...", terms, self.covariance, terms))

    def root(self, y: float) -> float | None:
        """Where the curve meets y inside the sweep, or None.

        Of two roots inside the sweep, the one where the curve runs the way the sweep runs from end to end.
        """
        c0, c1, c2 = self.coefficients
        roots = np.roots([c2, c1, c0 - y])
        inside = [r.real for r in roots if abs(r.imag) < 1e-12 and self.low <= r.real <= self.high]
        if len(inside) > 1:
            trend = np.sign(self.at(self.high) - self.at(self.low))
            inside = [r for r in inside if np.sign(c1 + 2 * c2 * r) == trend]
        return float(inside[0]) if inside else None

    def interval(self, y: float, uncertainty: float = 0.0, level: float = 0.95) -> tuple[float, float]:
        """Parameters that agree with a measurement: |curve - y| <= t sqrt(se^2 + u^2), within the sweep.

        Parameters
        ----------
        uncertainty : standard uncertainty of y
        level : confidence level; t has the fit's degrees of freedom
        """
        from scipy.stats import t

        x = np.linspace(self.low, self.high, 4001)
        width = t.ppf(0.5 + level / 2, self.residual_df) * np.hypot(self.standard_error(x), uncertainty)
        agree = x[np.abs(self.at(x) - y) <= width]
        return (float(agree.min()), float(agree.max())) if len(agree) else (float("nan"), float("nan"))


def _terms(x: ArrayLike) -> np.ndarray:
    x = np.asarray(x, dtype=float)
    return np.stack([np.ones_like(x), x, x * x], axis=-1)


def fit_parabola(x: ArrayLike, y: ArrayLike) -> Parabola:
    """Ordinary least squares of y on 1, x, x^2.

    Parameters
    ----------
    x, y : (n,) arrays, n >= 4

    Raises
    ------
    ValueError : fewer than four points
    """
    from statsmodels.regression.linear_model import OLS

    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if len(x) < 4:
        raise ValueError(f"a parabola with an error estimate needs at least 4 points, got {len(x)}")
    found = OLS(y, _terms(x)).fit()
    return Parabola(
        found.params,
        found.conf_int(),
        found.cov_params(),
        float(found.rsquared),
        int(found.df_resid),
        float(x.min()),
        float(x.max()),
    )
