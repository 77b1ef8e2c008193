"""Lack of fit and constancy: score tests of what a calibrated model leaves."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import special

from pellet_study.criticism.calibration import EXCESS, CalibratedStudy
from pellet_study.criticism.cell_means import CellMeans
from pellet_study.criticism.least_squares import Fit
from pellet_study.model.model import Model

DRAWS = 5_000
SEED = 20260101
LACK_IN_A_RIG = 0.002  # the same for single rigs, shared among them: a misfit in one rig drowns in the others
DRIFT = 0.001
VISIBLE = 0.03  # share of a direction that must survive the calibration to be tested


@dataclass(frozen=True)
class Drift:
    """A calibrated constant that does not stay constant: z over one condition, p over all directions together."""

    parameter: str
    rig: str
    condition: str
    shape: str
    z: float
    p: float


def lack_of_fit(fitted: Fit, cells: CellMeans, mine: np.ndarray | None = None) -> float | None:
    """p of the chi2 of some cells (default all) over their degrees of freedom; None where there is nothing to compare.

    A rig's cells have as many degrees of freedom as cells, less their leverages, and are compared with the scatter of
    its own readings. For one rig that is F(n - p, nu); several are summed, and the sum matched in mean and variance by
    a scaled F (Satterthwaite 1946, doi:10.2307/3002019).
    """
    if not cells.scale_known:
        return None
    basis = absorbed_basis(fitted.jacobian)
    own = 1 - (basis**2).sum(axis=1)
    mine = np.ones(len(own), dtype=bool) if mine is None else mine
    dof, chi2 = float(own[mine].sum()), float((fitted.residual[mine] ** 2).sum())
    if dof < 0.5:
        return None
    group = np.array(cells.group if cells.group else np.zeros(len(own), dtype=int))
    d = np.array([own[mine & (group == g)].sum() for g in np.unique(group[mine])])
    known = cells.group_dof if cells.group else (cells.dof,)
    nu = np.array([known[g] for g in np.unique(group[mine])], dtype=float)
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
    found = {rig: lack_of_fit(state.fit, state.cells, rigs == rig) for rig in dict.fromkeys(rigs)}
    return {rig: p for rig, p in found.items() if p is not None}


def absorbed_basis(jacobian: np.ndarray) -> np.ndarray:
    """Orthonormal basis of what the free constants absorb, (n, rank)."""
    if jacobian.size == 0:
        return np.zeros((jacobian.shape[0], 0))
    size = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian / np.where(size > 0, size, 1)
    u, s, _ = np.linalg.svd(scaled, full_matrices=False)
    return u[:, s > 1e-7 * max(s.max(), 1e-300)]


def visible(directions: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """(k, n) directions less what the free constants absorb."""
    return directions - (directions @ basis) @ basis.T


@lru_cache(maxsize=8)
def _noise(group: tuple[int, ...], group_dof: tuple[int, ...]) -> np.ndarray:
    """Whitened readings that hide nothing, (DRAWS, n): Gaussian over a scale as uncertain as each group's.

    The same draws for every test, so that an answer does not depend on what ran before.
    """
    rng = np.random.default_rng(SEED)
    noise = rng.standard_normal((DRAWS, len(group)))
    for number, dof in enumerate(group_dof):
        if dof > 0:
            mine = np.array(group) == number
            noise[:, mine] /= np.sqrt(rng.chisquare(dof, (DRAWS, 1)) / dof)
    return noise.astype(np.float32)


def standardised(
    left: np.ndarray, unit: np.ndarray, basis: np.ndarray, cells: CellMeans, two_sided: bool, birge: bool = True
) -> np.ndarray:
    """Scores along unit directions, in standard errors, (sets, k).

        score = z / s,  z = u'r,  s^2 = max(sum_g w_g (nu_g + R_g) / (nu_g + d_g - w_g), b^2 / EXCESS),  w_g = |u_g|^2

    How large an error is, each rig's readings g say with nu_g degrees of freedom, and so do the residuals that the
    direction leaves there: R_g their sum of squares, d_g their number less what the calibration absorbs. Where the
    residuals of all rigs together exceed the replicates' scatter by more than chance makes likely, their Birge ratio
    b^2 = (|r|^2 - z^2)/(d - 1), z the largest, takes its place (Birge 1932, doi:10.1103/PhysRev.40.207). Without
    `birge` the replicates alone are the measure; where no scatter is stated, the residuals alone.

    Parameters
    ----------
    left : (sets, n) whitened residuals, free of what the calibration absorbs
    unit : (k, n) unit vectors, free of it too
    basis : (n, rank), what it absorbs
    """
    z = left @ unit.T
    largest = np.abs(z).max(axis=1) if two_sided else np.maximum(z.max(axis=1), 0)
    dof = unit.shape[1] - basis.shape[1]
    squares = left**2
    excess = (squares.sum(axis=1) - largest**2).clip(0) / max(dof - 1, 1)
    if not cells.scale_known:
        return z / np.sqrt(np.maximum(excess, 1e-24))[:, None]
    if not birge:
        return z
    group, known = groups_of(cells)
    inside = (group[:, None] == np.arange(len(known))).astype(unit.dtype)
    nu, share = np.array(known, dtype=unit.dtype), unit**2 @ inside  # share: (k, groups)
    part = share / (nu + (1 - (basis**2).sum(axis=1)) @ inside - share)
    variance = part @ nu + squares @ inside @ part.T - 2 * z * (left @ (unit * (part @ inside.T)).T)
    variance += z**2 * (part * share).sum(axis=1)
    if dof > 1:
        variance = np.maximum(variance, excess[:, None] / EXCESS)
    return z / np.sqrt(variance)


def groups_of(cells: CellMeans) -> tuple[np.ndarray, tuple[int, ...]]:
    """Number of each cell's group, and each group's degrees of freedom."""
    return np.array(cells.group or (0,) * len(cells.case)), cells.group_dof or (int(cells.dof),)


def largest_null(
    unit: np.ndarray, basis: np.ndarray, cells: CellMeans, two_sided: bool, birge: bool = True
) -> np.ndarray:
    """Sorted draws of the largest standardised score over readings that hide nothing."""
    group, known = groups_of(cells)
    noise, unit = _noise(tuple(group.tolist()), known), unit.astype(np.float32)
    if birge or not cells.scale_known:
        basis = basis.astype(np.float32)
        noise = noise - (noise @ basis) @ basis.T
    z = standardised(noise, unit, basis, cells, two_sided, birge)
    return np.sort((np.abs(z) if two_sided else z).max(axis=1))


def exceedance(null: np.ndarray, value: float) -> float:
    """Share of sorted null draws at or above a value, never quite zero."""
    return float((len(null) - np.searchsorted(null, value, side="left") + 1) / (len(null) + 1))


def constancy_tests(
    state: CalibratedStudy, rigs: frozenset[str] | None = None, birge: bool = True
) -> tuple[Drift, ...]:
    """Constancy of every calibrated constant over every condition, the worst first; p is over all of them together.

    Parameters
    ----------
    rigs : only in these
    birge : in units of the residual scatter where it exceeds the replicates' (`standardised`); without, in units of the
        replicates' scatter where that is known, as lack of fit is, so that misfit elsewhere excuses nothing
    """
    names = [state.model.names[c] for c in state.fit.problem.free]
    labels, directions = drift_directions(state.model, state.cells, state.fit, names)
    inside = [k for k, (_, rig, *_) in enumerate(labels) if rigs is None or rig in rigs]
    labels = [labels[k] for k in inside]
    if not labels:
        return ()
    directions, basis = directions[inside], absorbed_basis(state.fit.jacobian)
    seen = visible(directions, basis)
    size = np.linalg.norm(seen, axis=1)
    keep = size > VISIBLE * np.maximum(np.linalg.norm(directions, axis=1), 1e-300)
    if not keep.any():
        return ()
    unit = seen[keep] / size[keep, None]
    if not state.cells.scale_known and len(state.cells.case) - basis.shape[1] < 2:
        return ()
    z = standardised(state.fit.residual[None], unit, basis, state.cells, True, birge)[0]
    null = largest_null(unit, basis, state.cells, True, birge)
    kept = [label for label, k in zip(labels, keep, strict=True) if k]
    found = [Drift(*label, z=float(v), p=exceedance(null, abs(v))) for label, v in zip(kept, z, strict=True)]
    return tuple(sorted(found, key=lambda d: -abs(d.z)))


def drift_directions(model: Model, cells: CellMeans, fitted: Fit, names: Sequence[str]):
    """Labels (parameter, rig, condition, shape) and (k, n) whitened directions of drift."""
    rigs = np.array([model.cases[c].rig for c in cells.case], dtype=object)
    labels, directions = [], []
    diagonal = cells.whiten.ndim == 1
    raw = fitted.jacobian if diagonal else np.linalg.solve(cells.whiten, fitted.jacobian)

    def add(label, weights, column):
        direction = weights * raw[:, column]
        labels.append(label)
        directions.append(direction if diagonal else cells.whiten @ direction)

    for rig in dict.fromkeys(rigs):
        mine = rigs == rig
        cases = [model.cases[c] for c in cells.case[mine]]
        shapes = []
        for condition in cases[0].conditions:
            values = np.array([case.conditions[condition] for case in cases])
            levels = len(np.unique(values))
            if levels < 2:
                continue
            s = np.log(values) if (values > 0).all() else values
            s = (s - s.mean()) / s.std()
            shapes.append((condition, "rises", s))
            if levels > 2:
                shapes.append((condition, "bends", s**2 - 1))
        for column, name in enumerate(names):
            if not np.linalg.norm(fitted.jacobian[mine, column]) > 0:
                continue
            for condition, shape, s in shapes:
                weights = np.zeros(len(rigs))
                weights[mine] = s
                add((name, rig, condition, shape), weights, column)
            if np.linalg.norm(fitted.jacobian[~mine, column]) > 0:
                add((name, rig, "rig", "differs"), mine.astype(float), column)
    return labels, np.array(directions)
