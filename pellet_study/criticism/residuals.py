"""Rows beside their predictions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, covariance
from pellet_study.criticism.used_sd import reading_sd
from pellet_study.model.model import key
from pellet_study.study.measurements import Measurement


@dataclass(frozen=True)
class RowResidual:
    """One row of the file beside its prediction.

    `uncertainty` is the row's own standard uncertainty, None if unknown. `z` is the residual over it, in a row held out over
    the root of the sum of its square and that of what the calibrated constants leave open of the prediction. `simulations` is
    the part of the uncertainty that comes from simulations, 0 where none predict it. `units` are those that its rig declares
    for its observable and conditions.
    """

    row: Measurement
    predicted: float
    residual: float
    z: float | None
    uncertainty: float | None
    simulations: float = 0.0
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def readings(self) -> float | None:
        """The part of the uncertainty that comes from the readings; None where unknown."""
        return None if self.uncertainty is None else float(np.sqrt(max(self.uncertainty**2 - self.simulations**2, 0.0)))


def row_residuals(state: CalibratedStudy) -> tuple[RowResidual, ...]:
    """Every row beside its prediction; z by the uncertainty of the row itself (not of its cell)."""
    model, study = state.model, state.study
    place = {key(case): k for k, case in enumerate(model.cases)}
    predicted = model.predict(state.fit.point)
    at = {id(row): float(predicted.mean[0, place[key(row)]]) for row in study.rows if row.split == "holdout"}
    reading = reading_sd(study.rows, at)
    held = [place[key(row)] for row in study.rows if row.split == "holdout"]
    left_open = dict(zip(held, variance_by_constants(state, held), strict=True))
    residuals = []
    units = {rig: study.units_of(rig) for rig in study.rigs}
    for k, row in enumerate(study.rows):
        c = place[key(row)]
        value = float(predicted.mean[0, c])
        spread = reading[k]
        z = total = None
        if spread is not None:
            if row.sd is not None:
                spread *= state.cells.contradicted.get((row.rig, row.observable), 1.0)
            total = float(np.sqrt(spread**2 / row.n + row.setup_sd**2 + predicted.variance[0, c]))
            more = left_open[c] if row.split == "holdout" else 0.0
            z = float((row.value - value) / np.sqrt(total**2 + more))
        simulated = float(np.sqrt(predicted.variance[0, c]))
        own = {n: units[row.rig][n] for n in (row.observable, *row.conditions) if n in units[row.rig]}
        residuals.append(RowResidual(row, value, row.value - value, z, total, simulated, own))
    return tuple(residuals)


def noise_shares(rows: Sequence[RowResidual]) -> dict[str, float]:
    """Variance of the simulations over that of the readings, {rig: median of its rows fitted}, of rigs that simulate."""
    shares: dict[str, list[float]] = {}
    for r in rows:
        if r.row.split == "fit" and r.simulations and r.readings:
            shares.setdefault(r.row.rig, []).append((r.simulations / r.readings) ** 2)
    return {rig: float(np.median(of_rig)) for rig, of_rig in shares.items()}


def slopes_at(state: CalibratedStudy, cases: Sequence[int]) -> np.ndarray:
    """Derivatives of the predictions for some of the model's cases by the fitted constants, (free, cases)."""
    model, fitted = state.model, state.fit
    problem, span = fitted.problem, fitted.problem.high - fitted.problem.low
    points = np.repeat(fitted.point[None], 1 + len(problem.free), axis=0)
    step = np.where(fitted.values + model.step * span <= problem.high, model.step, -model.step) * span
    points[1 + np.arange(len(problem.free)), list(problem.free)] += step
    mean = model.predict(points).mean[:, list(cases)]
    return (mean[1:] - mean[0]) / step[:, None]


def identified_directions(state: CalibratedStudy) -> np.ndarray:
    """Orthonormal directions, in shares of the constants' ranges, that the rows fitted tell something of, (k, free)."""
    fitted = state.fit
    _, size, rows_of = np.linalg.svd(fitted.jacobian * (fitted.problem.high - fitted.problem.low), full_matrices=False)
    return rows_of[size > 1e-6 * max(size.max(initial=0.0), 1e-300)]


def misfit_unit(state: CalibratedStudy) -> float:
    """By how much the misfit of the rows fitted widens the constants' variance: chi2 over its degrees of freedom, at least 1."""
    return max(1.0, state.fit.chi2 / max(len(state.cells.case) - len(state.fit.problem.free), 1))


def variance_by_constants(state: CalibratedStudy, cases: Sequence[int]) -> np.ndarray:
    """(cases,) variances of predictions that come from the uncertainty of the calibrated constants.

    The constants' covariance is widened by the misfit of the rows fitted; along what these rows do not tell, a constant is
    anywhere in its range, with the variance of a uniform distribution.
    """
    if not len(cases) or not state.fit.problem.free:
        return np.zeros(len(cases))
    slopes, span = slopes_at(state, cases), state.fit.problem.high - state.fit.problem.low
    known = np.einsum("ka,kl,la->a", slopes, covariance(state.fit), slopes) * misfit_unit(state)
    told, steps = identified_directions(state), slopes.T * span
    unknown = steps - steps @ told.T @ told
    size = np.linalg.norm(steps, axis=1, keepdims=True)
    unknown = np.where(np.abs(unknown) > 1e-6 * size, unknown, 0.0)
    return known + (unknown**2).sum(axis=1) / 12
