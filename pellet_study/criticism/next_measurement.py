"""The next measurement: where the predictions of rival explanations differ most over the uncertainty of that difference.

Of the conditions that could be measured, the one with the largest sum over pairs of rivals of
w_a w_b (y_a - y_b)^2 / (s^2 + v_a + v_b): y the rivals' predictions, v their variances, s the uncertainty of a reading,
w exp(-chi2/2) (Buzzi-Ferraris & Forzatti 1983, doi:10.1016/0009-2509(83)80012-8; Box & Hill 1967,
doi:10.2307/1266318).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, covariance, reduced_chi2
from pellet_study.criticism.least_squares import Fit
from pellet_study.criticism.residuals import reading_sd
from pellet_study.model.model import Case, Model
from pellet_study.study.study import Study

LEVELS = 9  # per condition
FEW_LEVELS = 3
SEPARATES = 4.0  # squared distance of rivals in standard errors, from which a measurement is worth its while
STEP = 1e-4  # of a parameter's range, for slopes


@dataclass(frozen=True)
class NextMeasurement:
    """What to measure, and what each rival predicts there (with its own uncertainty and that of the reading)."""

    rig: str
    observable: str
    conditions: dict[str, float]
    predictions: dict[str, float]
    uncertainties: dict[str, float]
    separation: float


def possible_cases(study: Study, count: int = LEVELS, effects: Iterable[str] | None = None) -> list[Case]:
    """What could be measured next: a grid over each rig's ranges, two conditions at a time, the others as measured.

    Of the rigs in which one of some effects acts (default: all). With few levels one condition at a time, as their
    predictions are dear.
    """
    rigs = dict.fromkeys([*study.rigs, *(study.possible or {})])
    cases = []
    for name in rigs:
        if effects is not None and not set(effects) & set(study.catalogue.acting(name)):
            continue
        rig = study.catalogue.rigs[name]
        rows = [row for row in study.rows if row.rig == name]
        given = (study.possible or {}).get(name)
        if given is None and study.possible:
            continue
        usual = {
            c: float(np.median([row.conditions[c] for row in rows])) if rows else float(q["default"])
            for c, q in rig.conditions.items()
        }
        levels = {}
        for condition, quantity in rig.conditions.items():
            if given is not None:
                if condition not in given:
                    continue
                low, high = given[condition]
            elif quantity.get("of_material"):  # another material is another question
                continue
            else:
                low, high = quantity["min"], quantity["max"]
            between = np.geomspace(low, high, count) if low > 0 else np.linspace(low, high, count)
            levels[condition] = between if low < high else [low]  # to the last digit
        observables = {row.observable for row in rows} or set(list(rig.observables)[:1])
        if count <= FEW_LEVELS:
            grid = _singles_of(levels, usual)
        else:
            grid = product(*levels.values()) if len(levels) <= 3 else _pairs_of(levels, usual)
        for values in grid:
            conditions = {**usual, **dict(zip(levels, map(float, values), strict=True))}
            known = dict(rows[0].parameters) if rows else {}
            cases += [Case(name, observable, conditions, known) for observable in sorted(observables)]
    return list({(c.rig, c.observable, tuple(c.conditions.values())): c for c in cases}.values())


def _singles_of(levels: dict, usual: dict):
    for c in levels:
        for x in levels[c]:
            yield tuple(x if other == c else usual[other] for other in levels)


def _pairs_of(levels: dict, usual: dict):
    for a, b in combinations(levels, 2):
        for x, y in product(levels[a], levels[b]):
            yield tuple(x if c == a else y if c == b else usual[c] for c in levels)


def reading_uncertainty(state: CalibratedStudy, cases: Sequence[Case], predicted: np.ndarray) -> np.ndarray:
    """Expected standard uncertainty of one more mean reading at each case, from those of the rig's rows."""
    study, cells = state.study, state.cells
    spread = reading_sd(study, state.model)
    unit = np.sqrt(state.fit.chi2 / max(len(cells.case) - len(state.fit.problem.free), 1))
    fitted = [(state.model.cases[c], sd) for c, sd in zip(cells.case, cells.sd, strict=True)]
    found = np.empty(len(cases))
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
                [max(row.n, sum(r.conditions == row.conditions for r, _ in rows)) for row, _ in known[:50]]
            )
            more = cells.contradicted.get((case.rig, case.observable), 1.0) if near[0].sd is not None else 1.0
            found[k] = np.sqrt((more * near[1]) ** 2 / repeats + near[0].setup_sd ** 2)
        elif like := [s for cell, s in fitted if (cell.rig, cell.observable) == (case.rig, case.observable)]:
            found[k] = unit * np.median(like)
        else:
            found[k] = 0.05 * abs(predicted[k])
    return np.maximum(found, 1e-12)


def next_measurement(state: CalibratedStudy, rivals: Mapping[tuple[str, ...], Fit]) -> NextMeasurement | None:
    """The condition that separates rival explanations, {effects: fit}, best; None where none does."""
    if len(rivals) < 2:
        return None
    levels = FEW_LEVELS if needs_simulation(state.study) else state.model.levels
    cases = possible_cases(state.study, levels, {e for names in rivals for e in names})
    if not cases:
        return None
    fits = list(rivals.values())
    means, variances = predicted(state, cases, fits)
    chi2 = np.array([fit.chi2 for fit in fits])
    weights = np.exp(-0.5 * np.minimum((chi2 - chi2.min()) / reduced_chi2(state, fits[chi2.argmin()]), 8.0))
    weights /= weights.sum()
    sigma = reading_uncertainty(state, cases, means[0])
    gain, separation = np.zeros(len(cases)), np.zeros(len(cases))
    for a, b in combinations(range(len(fits)), 2):
        d = np.nan_to_num((means[a] - means[b]) ** 2 / (sigma**2 + variances[a] + variances[b]))
        gain += weights[a] * weights[b] * d
        separation = np.maximum(separation, d)
    limits = [state.study.catalogue.rigs[c.rig].readable.get(c.observable, (-np.inf, np.inf)) for c in cases]
    readable = [all(low <= m <= high for m in means[:, k]) for k, (low, high) in enumerate(limits)]
    gain = np.where(readable, gain, -1.0)
    best = int(np.argmax(gain))
    if gain[best] < 0 or separation[best] < SEPARATES:
        return None
    labels = [" + ".join(names) for names in rivals]
    return NextMeasurement(
        rig=cases[best].rig,
        observable=cases[best].observable,
        conditions=dict(cases[best].conditions),
        predictions=dict(zip(labels, map(float, means[:, best]), strict=True)),
        uncertainties=dict(zip(labels, map(float, np.sqrt(variances[:, best] + sigma[best] ** 2)), strict=True)),
        separation=float(np.sqrt(separation[best])),
    )


def needs_simulation(study: Study) -> bool:
    """Whether simulations must tell what one of the possible measurements would show."""
    return any(study.catalogue.rigs[rig].predict is None for rig in (*study.rigs, *(study.possible or {})))


def predicted(state: CalibratedStudy, cases: Sequence[Case], fits: Sequence[Fit]) -> tuple[np.ndarray, np.ndarray]:
    """Predictions of some fits for cases not measured yet, and the variances of these predictions, (fits, cases).

    A case of a measured rig that simulations must answer is simulated at the fits themselves, not over the ranges of the
    parameters: how it goes with them is taken from the nearest measured case of that rig, in proportion to the prediction.
    """
    means, variances = np.empty((len(fits), len(cases))), np.empty((len(fits), len(cases)))
    engines = state.model.engines
    measured = {(c.rig, c.observable) for c in state.model.cases if engines[c.rig].simulates}
    here = np.array([(c.rig, c.observable) in measured for c in cases])
    if not here.all():
        other = [c for c, near in zip(cases, here, strict=True) if not near]
        for k, (mean, slopes, variance) in enumerate(
            _slopes(state, Model(state.study, other, state.model.engines), fits)
        ):
            means[k, ~here] = mean
            variances[k, ~here] = variance + _by_fit(state, fits[k], slopes)
    if here.any():
        mine = [c for c, near in zip(cases, here, strict=True) if near]
        model, like = Model(state.study, mine, state.model.engines), nearest_case(state, mine)
        for k, (mean, slopes, _) in enumerate(_slopes(state, state.model, fits)):
            there = model.directly(_in(model, state.model, fits[k].point))
            means[k, here] = there.mean[0]
            relative = _by_fit(state, fits[k], slopes / np.where(mean == 0, np.inf, mean))[like]
            variances[k, here] = there.variance[0] + there.mean[0] ** 2 * relative
    return means, variances


def nearest_case(state: CalibratedStudy, cases: Sequence[Case]) -> np.ndarray:
    """Place of the measured case of the same rig and observable that is nearest to each case, in shares of the ranges."""
    found = []
    for case in cases:
        ranges = {c: (q["max"] - q["min"]) or 1.0 for c, q in state.study.catalogue.rigs[case.rig].conditions.items()}
        away = [
            sum(abs(other.conditions[c] - case.conditions[c]) / span for c, span in ranges.items())
            if (other.rig, other.observable) == (case.rig, case.observable)
            else np.inf
            for other in state.model.cases
        ]
        found.append(int(np.argmin(away)))
    return np.array(found)


def _slopes(state: CalibratedStudy, model: Model, fits: Sequence[Fit]):
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
    found, place = model.predict(np.array(points)), 0
    for h in steps:
        mean, moved = found.mean[place], found.mean[place + 1 : place + 1 + len(h)]
        yield mean, (moved - mean) / h[:, None], found.variance[place]
        place += 1 + len(h)


def _by_fit(state: CalibratedStudy, fit: Fit, slopes: np.ndarray) -> np.ndarray:
    """(k,) variances of predictions with some slopes that come from the uncertainty of a fit."""
    return np.einsum("ka,kl,la->a", slopes, covariance(fit) * reduced_chi2(state, fit), slopes)


def _in(model: Model, source: Model, point: np.ndarray) -> np.ndarray:
    """A point of one model in the columns of another."""
    found = model.base.copy()
    for name, column in source.column.items():
        if name in model.column:
            found[model.column[name]] = point[column]
    return found
