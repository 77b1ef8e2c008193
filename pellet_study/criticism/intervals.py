"""95 % intervals of the calibrated constants, and which of them the data do not pin down."""

import numpy as np
from scipy import special

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.criticism.cell_means import CellMeans
from pellet_study.criticism.lack_of_fit import lack_of_fit
from pellet_study.criticism.least_squares import Fit

IDENTIFIED = 0.5  # a constant is identified where its 95 % interval is narrower than this share of its range
WIDENED = (
    0.05  # p of lack of fit below which intervals are by the residuals: what the fit does not explain is noise to them
)


def intervals_of(state: CalibratedStudy) -> tuple[dict[str, tuple[float, float]], dict[str, float]]:
    """95 % intervals theta +- t b se, cut at the bounds, and the share of each constant's range that they take uncut.

    A constant whose share is `IDENTIFIED` or more is not pinned down by the data.
    """
    fitted, cells = state.fit, state.cells
    names = [state.model.names[c] for c in fitted.problem.free]
    if not names:
        return {}, {}
    t = _half_width(fitted, cells)
    span = fitted.problem.high - fitted.problem.low
    scaled = fitted.jacobian * span
    normal = scaled.T @ scaled
    tiny = np.linalg.eigvalsh(normal).max() * 1e-13 + 1e-300
    se = np.sqrt(np.diag(np.linalg.inv(normal + tiny * np.eye(len(names))))) * span
    intervals, shares = {}, {}
    for k, name in enumerate(names):
        half = t * se[k]
        value, low, high = fitted.values[k], fitted.problem.low[k], fitted.problem.high[k]
        shares[name] = float(min(2 * half / span[k], 1e6))  # nothing tells it: a number all the same
        intervals[name] = (float(max(low, value - half)), float(min(high, value + half)))
    return intervals, shares


def _half_width(fitted: Fit, cells: CellMeans) -> float:
    """Half of a 95 % interval in standard errors: by the readings' scatter, or by the residuals' where that is the larger."""
    dof = len(cells.case) - len(fitted.problem.free)
    if not cells.scale_known:
        return special.stdtrit(dof, 0.975) * np.sqrt(fitted.chi2 / dof) if dof > 0 else np.inf
    ratio = np.sqrt(fitted.chi2 / dof) if dof > 0 else 1.0
    p = lack_of_fit(fitted, cells)
    if p is not None and p < WIDENED and ratio > 1:
        return special.stdtrit(dof, 0.975) * ratio
    return special.stdtrit(cells.dof, 0.975)
