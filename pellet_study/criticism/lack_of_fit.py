"""Lack of fit: is a model farther off than its readings scatter, over all cells and rig by rig?"""

import numpy as np
from scipy import special

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.criticism.cell_means import CellMeans
from pellet_study.criticism.least_squares import Fit

# p of single rigs below which a model fails, shared among them: over all rigs the misfit of one drowns in the others
LACK_IN_A_RIG = 0.002


def absorbed_basis(jacobian: np.ndarray) -> np.ndarray:
    """Orthonormal basis of what the free constants absorb, (n, rank)."""
    if jacobian.size == 0:
        return np.zeros((jacobian.shape[0], 0))
    size = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian / np.where(size > 0, size, 1)
    u, s, _ = np.linalg.svd(scaled, full_matrices=False)
    return u[:, s > 1e-7 * max(s.max(), 1e-300)]


def lack_of_fit(fitted: Fit, cells: CellMeans, some: np.ndarray | None = None) -> float | None:
    """p of the chi2 of some cells (default all) over their degrees of freedom; None where there is nothing to compare.

    A rig's cells have as many degrees of freedom as cells, less their leverages, and are compared with the scatter of
    its own readings. For one rig that is F(n - p, nu); several are summed, and the sum matched in mean and variance by
    a scaled F (Satterthwaite 1946, doi:10.2307/3002019).
    """
    if not cells.scale_known:
        return None
    basis = absorbed_basis(fitted.jacobian)
    own = 1 - (basis**2).sum(axis=1)
    some = np.ones(len(own), dtype=bool) if some is None else some
    dof, chi2 = float(own[some].sum()), float((fitted.residual[some] ** 2).sum())
    if dof < 0.5:
        return None
    group = np.array(cells.group if cells.group else np.zeros(len(own), dtype=int))
    d = np.array([own[some & (group == g)].sum() for g in np.unique(group[some])])
    known = cells.group_dof if cells.group else (cells.dof,)
    nu = np.array([known[g] for g in np.unique(group[some])], dtype=float)
    if len(nu) == 1 or (nu <= 5).any():
        return float(special.fdtrc(dof, nu.sum(), chi2 / dof))
    mean = d * nu / (nu - 2)
    variance = 2 * mean**2 * (d + nu - 2) / (np.maximum(d, 1e-9) * (nu - 4))
    relative = dof * variance.sum() / mean.sum() ** 2
    matched = (4 * relative + 2 * dof - 4) / (relative - 2) if relative > 2 else 1e9
    return float(special.fdtrc(dof, matched, chi2 / mean.sum() * matched / (matched - 2)))


def lack_by_rig(state: CalibratedStudy) -> dict[str, float]:
    """p of each rig's own cells; rigs whose cells leave nothing to compare are left out."""
    rigs = np.array([state.model.cases[c].rig for c in state.cells.case], dtype=object)
    p_of = {rig: lack_of_fit(state.fit, state.cells, rigs == rig) for rig in dict.fromkeys(rigs)}
    return {rig: p for rig, p in p_of.items() if p is not None}


def needed_setup(state: CalibratedStudy) -> dict[str, float]:
    """Set-up scatter, percent of the reading, that each rig's cells would need for chi2 = cells - their share of p."""
    cells, fitted = state.cells, state.fit
    if not cells.scale_known:
        return {}
    rigs = np.array([state.model.cases[c].rig for c in cells.case], dtype=object)
    count, free = len(cells.case), len(fitted.problem.free)
    residual = cells.mean - state.model.predict(fitted.point).mean[0, cells.case]
    percent = {}
    for rig in dict.fromkeys(rigs):
        in_rig = rigs == rig
        share = in_rig.sum() * max(count - free, 1) / count
        percent[rig] = 100 * _excuse(residual[in_rig], cells.sd[in_rig] ** 2, np.abs(cells.mean[in_rig]), share)
    return percent


def _excuse(residual: np.ndarray, variance: np.ndarray, size: np.ndarray, wanted: float) -> float:
    """tau with sum residual^2 / (variance + (tau size)^2) = wanted, by bisection; 0 where it is less without."""

    def chi2(tau: float) -> float:
        return (residual**2 / (variance + (tau * size) ** 2)).sum()

    if chi2(0.0) <= wanted:
        return 0.0
    low, high = 0.0, 10.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if chi2(middle) > wanted else (low, middle)
    return high
