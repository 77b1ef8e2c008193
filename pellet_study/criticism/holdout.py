"""Rows that a fit has not seen: those held out, and every level of a condition left out in turn."""

from collections.abc import Sequence

import numpy as np
from scipy import special

from pellet_study.criticism.calibration import CalibratedStudy, covariance, part_of
from pellet_study.criticism.least_squares import fit, problem_of
from pellet_study.criticism.residuals import RowResidual, identified_directions, misfit_unit, slopes_at
from pellet_study.model.model import key


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
    error = np.array([r.residual for r in held])
    together = _covariance_of(held) + misfit_unit(state) * slopes.T @ covariance(state.fit) @ slopes
    n = len(held)
    return float(special.fdtrc(n, state.cells.dof, error @ np.linalg.solve(together, error) / n))


def _covariance_of(held: Sequence[RowResidual]) -> np.ndarray:
    """Covariance of rows: of each alone, and of the set-ups that some share."""
    own = np.diag(np.array([r.uncertainty**2 for r in held if r.uncertainty]))
    for a, first in enumerate(held):
        for b, second in enumerate(held):
            if a != b and first.row.setup and first.row.setup == second.row.setup and first.row.rig == second.row.rig:
                own[a, b] = first.row.setup_sd * second.row.setup_sd
    return own


def level_out_errors(state: CalibratedStudy) -> dict[str, float]:
    """Error on rows that a fit has not seen: each level of a condition kept back in turn, `rig.condition` -> rms.

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
            errors = []
            for left_out in levels:
                kept = np.array([value != left_out for value in level])
                if kept.sum() < max(1, len(state.fit.problem.free)):
                    break
                fitted = fit(model, part_of(cells, kept), problem_of(model, 2, state.fit.point))
                mean = model.predict(fitted.point).mean[0]
                errors += [
                    row.value - mean[place[key(row)]]
                    for row in rows
                    if row.rig == rig and row.conditions[condition] == left_out
                ]
            else:
                errors_of[f"{rig}.{condition}"] = float(np.sqrt(np.mean(np.square(errors))))
    return errors_of
