"""Rows that a fit has not seen: those held out, and every level of a condition left out in turn."""

from collections.abc import Sequence

import numpy as np
from scipy import special

from pellet_study.criticism.calibration import CalibratedStudy, covariance, part_of
from pellet_study.criticism.cell_means import alike_of, shared_setups
from pellet_study.criticism.least_squares import fit, problem_of
from pellet_study.criticism.residuals import RowResidual, identified_directions, misfit_unit, slopes_at
from pellet_study.model.model import key
from pellet_study.study.measurements import Measurement

MOST_LEVELS = 30  # fits of a condition
ALONE = 0.01  # share of the variance of readings of one experiment that none shares
LEAST_SHARE = 1e-12  # of a row's variance that is its own beside a set-up's: what is left of it after rounding


def holdout_p(state: CalibratedStudy, rows: Sequence[RowResidual]) -> float | None:
    """p of e' C^-1 e over the rows held out, C of their readings, their predictions and the calibrated constants.

    The constants' covariance is widened by the misfit of the rows fitted; rows of one set-up share its error, and readings of one
    simulated experiment scatter together. F with the
    degrees of freedom of the readings' scatter. None without such rows, without their scatter, or where they depend on a
    constant that the rows fitted do not tell.
    """
    held = [r for r in rows if r.row.split == "holdout" and r.uncertainty]
    if not held or not state.cells.scale_known:
        return None
    place = {key(case): k for k, case in enumerate(state.model.cases)}
    slopes = slopes_at(state, [place[key(r.row)] for r in held])
    steps, told = slopes.T * (state.fit.problem.high - state.fit.problem.low), identified_directions(state)
    if np.abs(steps - steps @ told.T @ told).max(initial=0.0) > 1e-6 * np.abs(steps).max(initial=0.0):
        return None
    error = np.array([r.residual for r in held])
    own, shared = _variance_of(state, held, np.array([place[key(r.row)] for r in held]))
    value, axes = np.linalg.eigh(misfit_unit(state) * covariance(state.fit))
    by_constants = slopes.T @ (axes * np.sqrt(np.maximum(value, 0.0)))
    squares = distance(error, own, np.hstack([shared, by_constants]))
    return float(special.fdtrc(len(held), state.cells.dof, squares / len(held)))


def distance(error: np.ndarray, own: np.ndarray, shared: np.ndarray) -> float:
    """e' C^-1 e with C = diag(own) + U U', a sum of squares along the columns of U and across them, of no more than n U's size.

    Parameters
    ----------
    error, own : (n,) arrays, e and the rows' own variances
    shared : (n, k) array, U
    """
    root = np.sqrt(own)
    along, spread, _ = np.linalg.svd(shared / root[:, None], full_matrices=False)
    scaled = error / root
    parts = along.T @ scaled
    across = scaled - along @ parts
    return float(across @ across + (parts**2 / (1 + spread**2)).sum())


def _variance_of(
    state: CalibratedStudy, held: Sequence[RowResidual], case: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Variance of rows by themselves (n,), and the standard deviations (n, k) that rows share: set-ups, simulated experiments."""
    own = np.array([r.uncertainty**2 for r in held if r.uncertainty])
    several = shared_setups([r.row for r in held])
    shared = np.zeros((len(held), len(several)))
    for column, rows in enumerate(several):
        shared[rows, column] = [held[k].row.setup_sd for k in rows]
    left = np.maximum(own - np.square(shared).sum(axis=1), LEAST_SHARE * own)
    alike = None if len(set(case)) < len(case) else alike_of(state.model, [[r.row] for r in held], case)
    if alike is None:  # rows that repeat each other do not say which of them are of one experiment
        return left, shared
    together = np.sqrt(left * (1 - ALONE))[:, None] * np.linalg.cholesky(alike)
    return ALONE * left, np.hstack([shared, together])


def _grouped(levels: Sequence) -> list[dict]:
    """Each level by itself, or of many, neighbours together in `MOST_LEVELS` groups."""
    number = min(len(levels), MOST_LEVELS)
    ends = [len(levels) * k // number for k in range(number + 1)]
    return [dict.fromkeys(levels[first:last]) for first, last in zip(ends, ends[1:], strict=False)]


def level_out_errors(state: CalibratedStudy) -> dict[str, float]:
    """Error on rows that a fit has not seen: each level of a condition kept back in turn, `rig.condition` -> rms.

    Of more than `MOST_LEVELS` levels, neighbours are kept back together, in so many groups.

    Unweighted, in the observable's unit; for conditions with at least three levels (words too), where enough cells stay to fit.
    """
    model, cells = state.model, state.cells
    rows = [row for row in state.study.rows if row.split == "fit"]
    place = {key(case): k for k, case in enumerate(model.cases)}
    measured = [model.cases[c] for c in cells.case]
    errors_of = {}
    for rig in dict.fromkeys(cell.rig for cell in measured):
        for condition in next(cell for cell in measured if cell.rig == rig).conditions:
            level = [cell.conditions[condition] if cell.rig == rig else None for cell in measured]
            levels = sorted({value for value in level if value is not None})
            if len(levels) < 3 or len({row.observable for row in rows if row.rig == rig}) > 1:
                continue
            of_level: dict[float | str, list[Measurement]] = {}
            for row in rows:
                if row.rig == rig:
                    of_level.setdefault(row.conditions[condition], []).append(row)
            errors = []
            for left_out in _grouped(levels):
                kept = np.array([value not in left_out for value in level])
                if kept.sum() < max(1, len(state.fit.problem.free)):
                    break
                fitted = fit(model, part_of(cells, kept), problem_of(model, 2, state.fit.point))
                mean = model.predict(fitted.point).mean[0]
                errors += [row.value - mean[place[key(row)]] for one in left_out for row in of_level.get(one, ())]
            else:
                errors_of[f"{rig}.{condition}"] = float(np.sqrt(np.mean(np.square(errors))))
    return errors_of
