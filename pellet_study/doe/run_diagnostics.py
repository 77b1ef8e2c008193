"""How far single runs lie from a fitted model and how much it hangs on them; what the residuals say.

References
----------
Cook, Detection of influential observation in linear regression, Technometrics 19 (1977) 15,
doi:10.1080/00401706.1977.10489493.
Myers, Montgomery, Anderson-Cook, Response Surface Methodology, 4th ed., Wiley 2016, ch. 5: adequate precision.
"""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe.linear_model import LinearFit


@dataclass(frozen=True)
class Runs:
    """Diagnostics of each run, arrays of shape (n_runs,); studentized residuals are external (R-student)."""

    fitted: np.ndarray
    residuals: np.ndarray
    studentized: np.ndarray | None
    leverage: np.ndarray
    cooks_distance: np.ndarray | None


def adequate_precision_of(model: LinearFit) -> float | None:
    r""":math:`(\max\hat y - \min\hat y) / \sqrt{p s^2 / n}`, signal to noise; above 4 is wanted."""
    if not model.mean_square_error:
        return None
    runs, size = model.matrix.shape
    return float(np.ptp(model.fitted) / np.sqrt(size * model.mean_square_error / runs))


def diagnostics(model: LinearFit) -> Runs:
    r"""Leverage h, R-student :math:`e/(s_{(i)}\sqrt{1-h})`, Cook's D :math:`e^2 h/(p s^2 (1-h)^2)`.

    A run with leverage 1 is fitted exactly whatever it reads, and has neither R-student nor Cook's D (NaN).
    """
    leverage, residuals = model.run_leverage, model.residuals
    variance, df = model.mean_square_error, model.df_residual
    if not variance or df < 2:
        return Runs(model.fitted, residuals, None, leverage, None)
    left = np.where(leverage > 1 - 1e-9, np.nan, 1 - leverage)
    cook = residuals**2 * leverage / (len(model.columns) * variance * left**2)
    return Runs(model.fitted, residuals, model.studentized, leverage, cook)


def normality_of(model: LinearFit) -> tuple[float, float] | None:
    """Shapiro-Wilk W and p of the residuals."""
    if not model.mean_square_error:
        return None
    from scipy.stats import shapiro

    statistic, p = shapiro(model.residuals)
    return float(statistic), float(p)
