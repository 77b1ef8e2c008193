"""Absent effects fitted, one by one and in pairs: which of them explain the data, and which are tied."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, reduced_chi2, with_own_noise
from pellet_study.criticism.least_squares import Fit, Problem, fit_many
from pellet_study.criticism.score_tests import (
    DRIFT,
    LACK_IN_A_RIG,
    absorbed_basis,
    constancy_tests,
    exceedance,
    lack_by_rig,
    lack_of_fit,
    largest_null,
    standardised,
)
from pellet_study.criticism.signatures import Signature, columns_of, physical

LEFT_OVER = 0.002  # p of lack of fit that an explanation may not leave in the rigs where it acts
LEFT_DRIFT = 0.01  # p of drift that it may not leave there, in a constant or in its own amount
LEFT_OVERALL = 0.001  # p of lack of fit that it may not leave over all rigs
TIE = 4.3  # chi2 within which rivals explain alike
PAIR_GAIN = 12.0  # chi2 that each member of a pair must bring
LEFT_NAMED = 0.002  # p of another candidate's signature that an explanation may not leave
DISTINCT = 0.25  # share of a signature that must be left beside an explanation to be tested
PAIRS_REFITTED = 14


@dataclass(frozen=True)
class Rival:
    """A set of effects to add, fitted.

    `noise` is what the scatter of its predictions beyond the present model's is expected to add to its chi2.
    """

    effects: tuple[str, ...]
    fit: Fit
    explains: bool
    noise: float = 0.0


def rival_problem(
    state: CalibratedStudy, effects: Sequence[str], starts: Sequence[dict[int, float]], wide: bool = False
) -> Problem:
    """The fit of a study's free constants together with those of some absent effects."""
    model, base = state.model, state.fit.problem
    columns = [c for e in effects for c in columns_of(model, e)]
    quantities = [q for e in effects for q in model.study.catalogue.effects[e].parameters.values()]
    ranges = [(q["min"], q["max"]) if wide else q.get("physical", (q["min"], q["max"])) for q in quantities]
    point = state.fit.point.copy()
    rows = []
    for start in starts:
        at = point.copy()
        for c, value in start.items():
            at[c] = value
        rows.append(at[[*base.free, *columns]])
    return Problem(
        point,
        (*base.free, *columns),
        np.concatenate([base.low, [r[0] for r in ranges]]),
        np.concatenate([base.high, [r[1] for r in ranges]]),
        np.array(rows),
    )


def refits(state: CalibratedStudy, names: Sequence[str], shown: Sequence[Signature], scores: np.ndarray):
    """Each shown candidate refitted within its physical range, and without that limit where it ends at it."""
    model = state.model
    best: dict[str, int] = {}
    for k, s in enumerate(shown):
        if s.effect not in best or scores[k] > scores[best[s.effect]]:
            best[s.effect] = k
    order = sorted(best, key=lambda e: -scores[best[e]])
    problems = []
    for name in order:
        s = shown[best[name]]
        columns = columns_of(model, name)
        limit = physical(model, name)[0][1 if s.sign > 0 else 0]
        first = {columns[0]: s.size, **dict(zip(columns[1:], s.shape.values(), strict=True))}
        far = {**first, columns[0]: s.size + 0.3 * (limit - s.size)}
        starts = [first, far]
        for other in shown:
            if other.effect == name and other.shape != s.shape and other.sign == s.sign:
                starts.append({columns[0]: other.size, **dict(zip(columns[1:], other.shape.values(), strict=True))})
        problems.append(rival_problem(state, [name], starts))
    fits = dict(zip([(name,) for name in order], fit_many(model, state.cells, problems), strict=True))
    stuck = []
    for (name,), fitted in fits.items():
        own = len(state.fit.problem.free)
        quantities = list(model.study.catalogue.effects[name].parameters.values())
        limited = any(q.get("physical", (q["min"], q["max"])) != (q["min"], q["max"]) for q in quantities)
        at_limit = any(
            fitted.at_bound[own + k] and not (k == 0 and fitted.values[own] == q.get("absent"))
            for k, q in enumerate(quantities)
        )
        if limited and at_limit:
            stuck.append(name)
    wide = [
        rival_problem(
            state,
            [name],
            [dict(zip(columns_of(model, name), fits[(name,)].point[columns_of(model, name)], strict=True))],
            True,
        )
        for name in stuck
    ]
    beyond = dict(zip(stuck, fit_many(model, state.cells, wide), strict=True))
    return fits, beyond


def judge(state: CalibratedStudy, fits: Iterable[Fit], shown: Sequence[Signature] = ()) -> list[Rival]:
    """Whether each fitted rival explains the data.

    It may leave neither lack of fit nor a drifting constant behind, first of all where it acts, nor the signature of
    another candidate; and its own amount must be one number: the same in all rigs where it acts, drifting with none of
    their conditions. A look-alike seldom is.
    """
    rig_of = np.array([state.model.cases[c].rig for c in state.cells.case], dtype=object)
    failing = failing_rigs(state)
    found = []
    for fit in fits:
        here, fitted = with_own_noise(state, fit)
        free = fitted.problem.free
        names = tuple(dict.fromkeys(state.model.names[c].split(".")[0] for c in free[len(state.fit.problem.free) :]))
        rigs = frozenset(rig for rig, acting in state.model.acting.items() if set(names) & set(acting))
        rigs |= failing
        mine = np.array([rig in rigs for rig in rig_of])
        overall = lack_of_fit(fitted, here.cells)
        local = lack_of_fit(fitted, here.cells, mine)
        explains = (overall is None or overall >= LEFT_OVERALL) and (local is None or local >= LEFT_OVER)
        if explains:
            left = constancy_tests(replace(here, fit=fitted), rigs, birge=False)
            explains = not left or left[0].p >= LEFT_DRIFT
        if explains:
            explains = signature_left(here, fitted, names, shown) >= LEFT_NAMED
        noise = float((np.square(here.cells.sd / state.cells.sd) - 1).sum())
        found.append(Rival(names, fit, explains, noise))
    return found


def failing_rigs(state: CalibratedStudy) -> frozenset[str]:
    """Rigs in which the present model fails, by lack of fit or a drifting constant; an explanation must mend them."""
    found = {d.rig for d in constancy_tests(state) if d.p < DRIFT}
    return frozenset(found | {rig for rig, p in lack_by_rig(state).items() if p < LACK_IN_A_RIG})


def signature_left(state: CalibratedStudy, fitted: Fit, names: Sequence[str], shown: Sequence[Signature]) -> float:
    """p of the largest score of the other candidates' signatures on what a fit leaves."""
    units = np.array([s.unit for s in shown if s.effect not in names])
    if not len(units):
        return 1.0
    basis = absorbed_basis(fitted.jacobian)
    seen = units - (units @ basis) @ basis.T
    size = np.linalg.norm(seen, axis=1)
    seen, size = seen[size > DISTINCT], size[size > DISTINCT]
    dof = len(fitted.residual) - basis.shape[1]
    if not len(seen) or dof < 2:
        return 1.0
    unit = seen / size[:, None]
    z = standardised(fitted.residual[None], unit, basis, state.cells, two_sided=False)[0]
    return exceedance(largest_null(unit, basis, state.cells, two_sided=False), z.max())


def penalised(rival: Rival, state: CalibratedStudy) -> float:
    """chi2 with 2 for each free parameter beyond the effects' amounts, so that shapes do not win by freedom alone."""
    return rival.fit.chi2 + 2.0 * (len(rival.fit.problem.free) - len(state.fit.problem.free) - len(rival.effects))


def explanations(
    state: CalibratedStudy,
    singles: Sequence[Rival],
    shown: Sequence[Signature],
    scores: np.ndarray,
    plausible: set,
) -> list[Rival]:
    """The tie set: the single effects, else the pairs, that explain the data and lie within TIE of the best."""
    good = [r for r in singles if r.explains]
    best = min(good, key=lambda r: penalised(r, state)) if good else None
    doubtful = best is None
    if best is not None:
        p = lack_of_fit(best.fit, state.cells)
        doubtful = p is not None and p < 0.05
    if doubtful:
        pairs = pair_rivals(state, singles, shown, scores, plausible)
        pairs = [r for r in judge(state, pairs, shown) if r.explains]
        if pairs:
            top = min(pairs, key=lambda r: penalised(r, state))
            if best is None or penalised(top, state) < penalised(best, state) - PAIR_GAIN * reduced_chi2(
                state, top.fit
            ):
                return _tied(state, pairs, top)
    return _tied(state, good, best) if best is not None else []


def _tied(state: CalibratedStudy, rivals: Sequence[Rival], best: Rival) -> list[Rival]:
    limit = penalised(best, state) + TIE * reduced_chi2(state, best.fit)
    return sorted((r for r in rivals if penalised(r, state) - r.noise < limit), key=lambda r: penalised(r, state))


def pair_rivals(
    state: CalibratedStudy, singles: Sequence[Rival], shown, scores: np.ndarray, plausible: set
) -> list[Fit]:
    """The most promising pairs by their signatures, refitted; each member must bring at least 4."""
    best: dict[str, int] = {}
    for k, s in enumerate(shown):
        if s.effect in plausible and (s.effect not in best or scores[k] > scores[best[s.effect]]):
            best[s.effect] = k
    alone = {r.effects[0]: r.fit.chi2 for r in singles if len(r.effects) == 1}
    promise = []
    for (a, i), (b, j) in combinations(best.items(), 2):
        rho = float(shown[i].unit @ shown[j].unit)
        if abs(rho) > 0.98:
            continue
        first, second = (
            (scores[i] - rho * scores[j]) / (1 - rho**2),
            (scores[j] - rho * scores[i]) / (1 - rho**2),
        )
        if first > 0 and second > 0:
            promise.append((first * scores[i] + second * scores[j], a, b, i, j))
    promise = sorted(promise, key=lambda item: -item[0])[:PAIRS_REFITTED]
    problems = []
    for _, a, b, i, j in promise:
        rows = []
        for factor in (1.0, 0.5):
            start = {}
            for name, k in ((a, i), (b, j)):
                columns = columns_of(state.model, name)
                fitted = next((r.fit.point for r in singles if r.effects == (name,)), None)
                amount = factor * (shown[k].size if fitted is None or factor == 1.0 else fitted[columns[0]])
                start |= {columns[0]: amount, **dict(zip(columns[1:], shown[k].shape.values(), strict=True))}
            rows.append(start)
        problems.append(rival_problem(state, [a, b], rows))
    fits = fit_many(state.model, state.cells, problems)
    return [
        f
        for f, (_, a, b, _, _) in zip(fits, promise, strict=True)
        if f.chi2 < min(alone.get(a, np.inf), alone.get(b, np.inf)) - PAIR_GAIN * reduced_chi2(state, f)
    ]
