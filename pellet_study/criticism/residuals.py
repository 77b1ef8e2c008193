"""Rows beside their predictions, those held out and levels left out among them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from pellet_study.criticism.calibration import CalibratedStudy, covariance, part_of
from pellet_study.criticism.least_squares import fit, problem_of
from pellet_study.criticism.scatter import pooled_sd
from pellet_study.model.model import Model, key
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Study


@dataclass(frozen=True)
class RowResidual:
    """One row of the file beside its prediction; `z` in units of the row's standard uncertainty, None if unknown."""

    row: Measurement
    predicted: float
    residual: float
    z: float | None


def row_residuals(state: CalibratedStudy, sd: dict[int, float]) -> tuple[RowResidual, ...]:
    """Every row beside its prediction; z by the uncertainty of the row itself (not of its cell)."""
    model, study = state.model, state.study
    place = {key(case): k for k, case in enumerate(model.cases)}
    predicted = model.predict(state.fit.point)
    reading = reading_sd(study, model)
    found = []
    for k, row in enumerate(study.rows):
        c = place[key(row)]
        value = float(predicted.mean[0, c])
        spread = reading[k]
        z = None
        if spread is not None:
            if row.sd is not None:
                spread *= state.cells.contradicted.get((row.rig, row.observable), 1.0)
            total = np.sqrt(spread**2 / row.n + row.setup_sd**2 + predicted.variance[0, c])
            z = float((row.value - value) / total)
        found.append(RowResidual(row, value, row.value - value, z))
    return tuple(found)


def holdout_p(state: CalibratedStudy, rows: Sequence[RowResidual]) -> float | None:
    """p of e' C^-1 e over the rows held out, C of their readings, their predictions and the calibrated constants.

    The constants' covariance is widened by the misfit of the rows fitted; rows of one set-up share its error. F with the
    degrees of freedom of the readings' scatter. None without such rows, without their scatter, or where they depend on a
    constant that the rows fitted do not tell.
    """
    held = [r for r in rows if r.row.split == "holdout" and r.z]
    if not held or not state.cells.scale_known:
        return None
    model, fitted = state.model, state.fit
    place = {key(case): k for k, case in enumerate(model.cases)}
    cases = [place[key(r.row)] for r in held]
    problem, span = fitted.problem, fitted.problem.high - fitted.problem.low
    points = np.repeat(fitted.point[None], 1 + len(problem.free), axis=0)
    step = np.where(fitted.values + model.step * span <= problem.high, model.step, -model.step) * span
    points[1 + np.arange(len(problem.free)), list(problem.free)] += step
    mean = model.predict(points).mean[:, cases]
    slopes = (mean[1:] - mean[0]) / step[:, None]
    unit = max(1.0, fitted.chi2 / max(len(state.cells.case) - len(problem.free), 1))
    jacobian = fitted.jacobian * span
    _, size, rows_of = np.linalg.svd(jacobian, full_matrices=False)
    told = rows_of[size > 1e-6 * max(size.max(initial=0.0), 1e-300)]
    steps = slopes.T * span
    if np.abs(steps - steps @ told.T @ told).max(initial=0.0) > 1e-6 * np.abs(steps).max(initial=0.0):
        return None
    own = np.diag([(r.residual / r.z) ** 2 for r in held])
    for a, first in enumerate(held):
        for b, second in enumerate(held):
            if a != b and first.row.setup and first.row.setup == second.row.setup and first.row.rig == second.row.rig:
                own[a, b] = first.row.setup_sd * second.row.setup_sd
    error = np.array([r.residual for r in held])
    together, n = own + unit * slopes.T @ covariance(fitted) @ slopes, len(held)
    return float(special.fdtrc(n, state.cells.dof, error @ np.linalg.solve(together, error) / n))


def reading_sd(study: Study, model: Model) -> list[float | None]:
    """Standard deviation of one reading for each row: as stated, else pooled from replicates, else None."""
    pooled: dict[tuple[str, str], tuple] = {}
    for group in {(row.rig, row.observable) for row in study.rows}:
        replicates: dict[tuple, list[Measurement]] = {}
        for row in study.rows:
            if (row.rig, row.observable) == group and row.sd is None and row.split == "fit":
                replicates.setdefault((key(row), row.setup), []).append(row)
        means = np.array([np.average([r.value for r in c], weights=[r.n for r in c]) for c in replicates.values()])
        dof = np.array([len(c) - 1.0 for c in replicates.values()])
        if not len(means) or dof.sum() == 0:
            continue
        within = np.array(
            [sum(r.n * (r.value - m) ** 2 for r in c) for c, m in zip(replicates.values(), means, strict=True)]
        )
        sd = np.sqrt(within / np.maximum(dof, 1))
        pooled[group] = (means, pooled_sd(means, sd, dof))
    found: list[float | None] = []
    for row in study.rows:
        spread = row.sd
        if spread is None and (row.rig, row.observable) in pooled:
            means, sd = pooled[row.rig, row.observable]
            spread = float(sd[np.argmin(np.abs(means - row.value))])
            spread = spread if spread > 0 else None
        if spread is None:
            others = [
                r.sd for r in study.rows if (r.rig, r.observable) == (row.rig, row.observable) and r.sd is not None
            ]
            spread = float(np.sqrt(np.mean(np.square(others)))) if others else None
        found.append(spread)
    return found


def level_out_errors(state: CalibratedStudy) -> dict[str, float]:
    """Error on rows that a fit has not seen: each level of a condition kept back in turn, `rig.condition` -> rms.

    Unweighted, in the observable's unit; for conditions with at least three levels, where enough cells stay to fit.
    """
    model, cells = state.model, state.cells
    rows = [row for row in state.study.rows if row.split == "fit"]
    place = {key(case): k for k, case in enumerate(model.cases)}
    measured = [model.cases[c] for c in cells.case]
    found = {}
    for rig in dict.fromkeys(cell.rig for cell in measured):
        for condition in next(cell for cell in measured if cell.rig == rig).conditions:
            level = np.array([cell.conditions[condition] if cell.rig == rig else np.nan for cell in measured])
            levels = np.unique(level[~np.isnan(level)])
            if len(levels) < 3 or len({row.observable for row in rows if row.rig == rig}) > 1:
                continue
            errors = []
            for left_out in levels:
                kept = level != left_out
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
                found[f"{rig}.{condition}"] = float(np.sqrt(np.mean(np.square(errors))))
    return found
