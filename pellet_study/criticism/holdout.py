"""Rows that a fit has not seen: those held out, and every level of a condition left out in turn."""

from collections.abc import Sequence

import numpy as np
from scipy import special

from pellet_study.criticism.calibration import CalibratedStudy, covariance, part_of
from pellet_study.criticism.least_squares import fit, problem_of
from pellet_study.criticism.residuals import RowResidual, identified_directions, misfit_unit, slopes_at
from pellet_study.model.model import key
from pellet_study.study.measurements import Measurement

MOST_LEVELS = 30  # fits of a condition


def holdout_p(state: CalibratedStudy, rows: Sequence[RowResidual]) -> float | None:
    """p of e' C^-1 e over the rows held out, C of their readings, their predictions and the calibrated constants.

    The constants' covariance is widened by the misfit of the rows fitted; rows of one set-up share its error. F with the
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
    error, n = np.array([r.residual for r in held]), len(held)
    own, shared = _variance_of(held)
    together = np.hstack([shared, slopes.T])
    width = shared.shape[1]
    weight = np.zeros((together.shape[1], together.shape[1]))
    weight[:width, :width], weight[width:, width:] = np.eye(width), misfit_unit(state) * covariance(state.fit)
    # Woodbury: (D + U K U')^-1 = D^-1 - D^-1 U (1 + K U' D^-1 U)^-1 K U' D^-1, of the size of U's columns, not of the rows
    scaled = together / own[:, None]
    along = scaled.T @ error
    inner = np.eye(len(weight)) + weight @ (together.T @ scaled)
    squares = error @ (error / own) - along @ np.linalg.solve(inner, weight @ along)
    return float(special.fdtrc(n, state.cells.dof, max(squares, 0.0) / n))


def _variance_of(held: Sequence[RowResidual]) -> tuple[np.ndarray, np.ndarray]:
    """Variance of rows by themselves (n,), and the standard deviation (n, set-ups) that those of one set-up share."""
    own = np.array([r.uncertainty**2 for r in held if r.uncertainty])
    of_setup: dict[tuple[str, str], list[int]] = {}
    for k, r in enumerate(held):
        if r.row.setup and r.row.setup_sd > 0:
            of_setup.setdefault((r.row.rig, r.row.setup), []).append(k)
    several = [rows for rows in of_setup.values() if len(rows) > 1]
    shared = np.zeros((len(held), len(several)))
    for column, rows in enumerate(several):
        shared[rows, column] = [held[k].row.setup_sd for k in rows]
    return own - np.square(shared).sum(axis=1), shared


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
