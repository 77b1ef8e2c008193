"""What fitted explanations predict for cases not measured yet, and how uncertain that and a reading there are."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, covariance, reduced_chi2
from pellet_study.criticism.least_squares import Fit
from pellet_study.criticism.used_sd import reading_sd
from pellet_study.model.model import Case, Model

STEP = 1e-4  # of a parameter's range, for slopes
UNMEASURED = 0.05  # of the prediction, the sd of a reading in a rig that was not used yet
ENOUGH = 50  # rows that tell how often a reading is repeated


def predictions(state: CalibratedStudy, cases: Sequence[Case], fits: Sequence[Fit]) -> tuple[np.ndarray, np.ndarray]:
    """Predictions of some fits for cases not measured yet, and the variances of these predictions, (fits, cases).

    A case of a measured rig that simulations must answer is simulated at the fits themselves, not over the ranges of the
    parameters: how it goes with them is taken from the nearest measured case of that rig, in proportion to the prediction.
    """
    means, variances = np.empty((len(fits), len(cases))), np.empty((len(fits), len(cases)))
    engines = state.model.engines
    measured = {(c.rig, c.observable) for c in state.model.cases if engines[c.rig].simulates}
    simulated = np.array([(c.rig, c.observable) in measured for c in cases])
    if not simulated.all():
        others = Model(state.study, [c for c, at in zip(cases, simulated, strict=True) if not at], engines)
        for k, (mean, slopes, variance) in enumerate(_slopes(state, others, fits)):
            means[k, ~simulated] = mean
            variances[k, ~simulated] = variance + _by_fit(state, fits[k], slopes)
    if simulated.any():
        asked = [c for c, at in zip(cases, simulated, strict=True) if at]
        model, like = Model(state.study, asked, engines), nearest_case(state, asked)
        for k, (mean, slopes, _) in enumerate(_slopes(state, state.model, fits)):
            there = model.directly(_in(model, state.model, fits[k].point))
            means[k, simulated] = there.mean[0]
            relative = _by_fit(state, fits[k], slopes / np.where(mean == 0, np.inf, mean))[like]
            variances[k, simulated] = there.variance[0] + there.mean[0] ** 2 * relative
    return means, variances


def nearest_case(state: CalibratedStudy, cases: Sequence[Case]) -> np.ndarray:
    """Place of the measured case of the same rig and observable that is nearest to each case, in shares of the ranges.

    One with another word is farther than any whose words are the same.
    """
    places = []
    for case in cases:
        declared = state.study.catalogue.rigs[case.rig].conditions
        away = [
            sum(_apart(q, other.conditions[c], case.conditions[c], len(declared)) for c, q in declared.items())
            if (other.rig, other.observable) == (case.rig, case.observable)
            else np.inf
            for other in state.model.cases
        ]
        places.append(int(np.argmin(away)))
    return np.array(places)


def _apart(declared: Mapping, a: Any, b: Any, of_words: int) -> float:
    """How far two values of a condition are apart, in shares of its range; different words by a number."""
    if "options" in declared:
        return of_words * (a != b)
    return abs(a - b) / ((declared["max"] - declared["min"]) or 1.0)


def _slopes(
    state: CalibratedStudy, model: Model, fits: Sequence[Fit]
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Of each fit: (k,) predictions, their (free, k) slopes in its free columns, and their own (k,) variances."""
    points, steps = [], []
    for fit in fits:
        span = STEP * (fit.problem.high - fit.problem.low)
        values = fit.point[list(fit.problem.free)]
        steps.append(np.where(values + span <= fit.problem.high, span, -span))
        points.append(_in(model, state.model, fit.point))
        for column, h in zip(fit.problem.free, steps[-1], strict=True):
            moved = fit.point.copy()
            moved[column] += h
            points.append(_in(model, state.model, moved))
    predicted, place = model.predict(np.array(points)), 0
    for h in steps:
        mean, moved = predicted.mean[place], predicted.mean[place + 1 : place + 1 + len(h)]
        yield mean, (moved - mean) / h[:, None], predicted.variance[place]
        place += 1 + len(h)


def _by_fit(state: CalibratedStudy, fit: Fit, slopes: np.ndarray) -> np.ndarray:
    """(k,) variances of predictions with some slopes that come from the uncertainty of a fit."""
    return np.einsum("ka,kl,la->a", slopes, covariance(fit) * reduced_chi2(state, fit), slopes)


def _in(model: Model, source: Model, point: np.ndarray) -> np.ndarray:
    """A point of one model in the columns of another."""
    moved = model.base.copy()
    for name, column in source.column.items():
        if name in model.column:
            moved[model.column[name]] = point[column]
    return moved


def reading_uncertainty(state: CalibratedStudy, cases: Sequence[Case], predicted: np.ndarray) -> np.ndarray:
    """Expected standard uncertainty of one more mean reading at each case, from those of the rig's rows."""
    study, cells = state.study, state.cells
    spread = reading_sd(study.rows)
    unit = np.sqrt(state.fit.chi2 / max(len(cells.case) - len(state.fit.problem.free), 1))
    fitted = [(state.model.cases[c], sd) for c, sd in zip(cells.case, cells.sd, strict=True)]
    uncertainty = np.empty(len(cases))
    for k, case in enumerate(cases):
        rows = [
            (row, s)
            for row, s in zip(study.rows, spread, strict=True)
            if (row.rig, row.observable) == (case.rig, case.observable)
        ]
        known = [(row, s) for row, s in rows if s]
        if known:
            near = min(known, key=lambda item: abs(abs(item[0].value) - abs(predicted[k])))
            repeats = np.median(
                [max(row.n, sum(r.conditions == row.conditions for r, _ in rows)) for row, _ in known[:ENOUGH]]
            )
            more = cells.contradicted.get((case.rig, case.observable), 1.0) if near[0].sd is not None else 1.0
            uncertainty[k] = np.sqrt((more * near[1]) ** 2 / repeats + near[0].setup_sd ** 2)
        elif like := [s for cell, s in fitted if (cell.rig, cell.observable) == (case.rig, case.observable)]:
            uncertainty[k] = unit * np.median(like)
        else:
            uncertainty[k] = UNMEASURED * abs(predicted[k])
    return np.maximum(uncertainty, 1e-12)
