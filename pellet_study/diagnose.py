"""Which absent effects would explain the misfit.

1. Signature of each candidate: the change of the predictions at the size that shows with three standard errors after
   the calibration has absorbed what it can (a small step misleads where the shape changes with the size).
2. Gate: the largest signed score of all candidates against its null distribution by Monte Carlo (max-T), in units of
   the residual scatter where that exceeds the replicates' (Birge).
3. Refit of every candidate within its physical range; ranking by chi2; a candidate explains where neither lack of fit
   nor a drifting constant is left, and where its own fitted size is one number over all sizes, conditions and rigs.
   All that explain and lie within TIE of the best are tied, or as much farther off as the scatter of their own
   simulations may have put them; pairs are looked at where no single effect explains.
4. The next measurement, which would separate the rivals (`next_measurement`).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
from scipy import special

from pellet_study.calibrate import Fit, Problem, fit_many
from pellet_study.compare import (
    DRIFT,
    LACK_IN_A_RIG,
    VISIBLE,
    Calibrated,
    Comparison,
    absorbed,
    calibrate,
    compare,
    covariance,
    drifts,
    exceedance,
    lack_by_rig,
    lack_of_fit,
    largest_null,
    standardised,
    unit_of_chi2,
    with_own_noise,
)
from pellet_study.model.model import Model
from pellet_study.next_measurement import FEW_LEVELS, NextMeasurement, next_measurement
from pellet_study.study.study import Study

GATE = 0.035  # for the first effect; lack of fit, drift and what sds found from readings cost spend the rest of 5 %
GATE_AGAIN = 0.004  # for each further one
LEFT_OVER = 0.002  # p of lack of fit that an explanation may not leave in the rigs where it acts
LEFT_DRIFT = 0.01  # p of drift that it may not leave there, in a constant or in its own amount
LEFT_OVERALL = 0.001  # p of lack of fit that it may not leave over all rigs
TIE = 4.3  # chi2 within which rivals explain alike
PAIR_GAIN = 12.0  # chi2 that each member of a pair must bring
LEFT_NAMED = 0.002  # p of another candidate's signature that an explanation may not leave
DISTINCT = 0.25  # share of a signature that must be left beside an explanation to be tested
PAIRS_REFITTED = 14
STEP = 3.0  # standard errors, the size at which signatures are taken
PLAUSIBLE = 4.0  # chi2 by which a fit beyond the physical range must be better to be called implausible


@dataclass(frozen=True)
class Signature:
    """How an effect of a size shows in the whitened residuals: `unit` freed of what the calibration absorbs."""

    effect: str
    sign: int
    size: float
    shape: dict[str, float]
    unit: np.ndarray
    length: float
    visible_share: float


@dataclass(frozen=True)
class Suspect:
    """One absent effect against the data.

    `score` is signed, in standard errors; `value` the fitted parameters; `note` is empty, or what speaks against it:
    "wrong sign", "implausible size", "these data cannot show it"; `smallest_visible` is the amount that would be
    noticed in 80 of 100 such data sets. `beyond` are the values a fit without the physical limit takes, and
    `beyond_chi2_drop` what they would gain.
    """

    effect: str
    score: float | None
    p: float | None
    p_adjusted: float | None
    chi2_drop: float
    value: dict[str, float]
    interval: tuple[float, float] | None
    visible_share: float
    smallest_visible: float | None
    lack_of_fit_p: float | None
    explains: bool
    note: str
    beyond: dict[str, float]
    beyond_chi2_drop: float | None = None


@dataclass(frozen=True)
class Rival:
    """A set of effects to add, fitted.

    `noise` is what the scatter of its predictions beyond the present model's is expected to add to its chi2.
    """

    effects: tuple[str, ...]
    fit: Fit
    explains: bool
    noise: float = 0.0


@dataclass(frozen=True)
class Diagnosis:
    """The answer to "which effect is missing?"; `missing` names what stands out, `tied` what explains alike."""

    verdict: str
    missing: tuple[str, ...]
    tied: tuple[tuple[str, ...], ...]
    ranking: tuple[Suspect, ...]
    next_measurement: NextMeasurement | None
    gate_p: float | None
    comparison: Comparison
    rivals: tuple[Rival, ...]
    warnings: tuple[str, ...]

    @property
    def alike_but_implausible(self) -> tuple[str, ...]:
        """Effects that would explain as well as what is named, at a size beyond their physical range."""
        drops = {s.effect: s.chi2_drop for s in self.ranking}
        named = [e for names in (self.missing, *self.tied) for e in names]
        best = max((drops[e] for e in named), default=None)
        if best is None:
            return ()
        return tuple(
            s.effect for s in self.ranking if s.beyond_chi2_drop is not None and s.beyond_chi2_drop > best - TIE
        )


def diagnose(
    study: Study,
    state: Calibrated | None = None,
    gate: float = GATE,
    comparison: Comparison | None = None,
    propose: bool = True,
    rank: bool = True,
    ties_only: bool = False,
) -> Diagnosis:
    """Rank the effects a study's model lacks; changes nothing.

    Without `rank` the candidates are refitted only where the verdict needs it; without `propose` no next measurement is
    looked for, with `ties_only` none that separates the only explanation from the next best.
    """
    state = state or calibrate(study)
    comparison = comparison or compare(study, state)
    evidence, fitted = state.evidence, state.fit
    warnings = list(comparison.warnings)
    names = [name for name in study.absent() if name in state.model.effects]
    basis = absorbed(fitted.jacobian[:, ~fitted.at_bound])  # a constant that sticks at its bound absorbs nothing
    spare = len(evidence.case) - absorbed(fitted.jacobian).shape[1]
    hopeless = spare < 1 or (spare < 2 and not evidence.scale_known)
    dear = state.model.levels <= FEW_LEVELS
    found = [] if hopeless and dear else signatures(state, names, basis)
    lost = [name for name in names if name in unsimulated(state)]
    names = [name for name in names if name not in lost]
    found = [s for s in found if s.effect not in lost]
    warnings += [text for text in state.model.warnings if text not in warnings]
    shown = [s for s in found if s.visible_share >= VISIBLE and s.length >= 1.0]
    if hopeless:
        warnings.append(
            "too few different cases beyond the free parameters: no effect can be shown by these data; "
            f"measure each rig under other conditions too: {what_varies(study)}"
        )
        ranking = tuple(_unjudged(state, name, found) for name in names)
        return Diagnosis(
            "adequate" if comparison.fits else "unexplained",
            (),
            (),
            ranking,
            None,
            None,
            comparison,
            (),
            tuple(warnings),
        )
    gate_p, scores, errors, null = None, np.zeros(0), np.zeros(0), np.zeros(0)
    if shown:
        unit = np.array([s.unit for s in shown])
        scores = unit @ fitted.residual
        errors = standardised(fitted.residual[None], unit, basis, evidence, two_sided=False)[0]
        null = largest_null(unit, basis, evidence, two_sided=False)
        gate_p = exceedance(null, errors.max())
    open_gate = gate_p is not None and gate_p < gate
    if not names:
        warnings.append("no absent effect acts in the rigs used: there is nothing to rank")
    needed = open_gate or not comparison.fits
    singles, beyond = refits(state, names, shown, scores) if shown and (needed or rank) else ({}, {})
    rivals = judge(state, singles.values(), shown) if needed else [Rival(k, f, False) for k, f in singles.items()]
    ranking = _ranking(state, names, found, shown, errors, null, rivals, beyond)
    ranking += tuple(replace(_unjudged(state, name, []), note="its simulations failed: not judged") for name in lost)
    plausible = {s.effect for s in ranking if not s.note}
    verdict, chosen = "adequate", []
    if needed:
        verdict = "unexplained"
        if open_gate:
            chosen = explanations(state, [r for r in rivals if set(r.effects) <= plausible], shown, scores, plausible)
    missing: tuple[str, ...] = ()
    tied: tuple[tuple[str, ...], ...] = ()
    if len(chosen) == 1:
        verdict, missing = "missing", chosen[0].effects
    elif len(chosen) > 1:
        verdict, tied = "tied", tuple(r.effects for r in chosen)
    rest = sorted((r for r in rivals if r.effects not in {c.effects for c in chosen}), key=lambda r: r.fit.chi2)
    proposal = None
    if propose and len(chosen) > (1 if ties_only else 0):
        pool = chosen if len(chosen) > 1 else [*chosen, *_runner_up(rest, beyond)]
        proposal = next_measurement(state, {r.effects: r.fit for r in pool})
        if proposal is None and len(chosen) > 1:
            warnings.append("no measurement within the possible conditions separates the tied explanations")
    if needed and not open_gate:
        warnings.append("the model fails, but in no way that one of the candidates would make it fail")
    return Diagnosis(
        verdict,
        missing,
        tied,
        ranking,
        proposal,
        gate_p,
        comparison,
        tuple([*chosen, *rest]),
        tuple(warnings),
    )


def _runner_up(rest: Sequence[Rival], beyond: dict[str, Fit]) -> list[Rival]:
    """The next best single effect, at the size it would need even if that is implausible."""
    if not rest:
        return []
    pool = [
        Rival(r.effects, min((r.fit, beyond.get(r.effects[0], r.fit)), key=lambda f: f.chi2), False)
        for r in rest
        if len(r.effects) == 1
    ]
    return sorted(pool, key=lambda r: r.fit.chi2)[:1]


def what_varies(study: Study) -> str:
    """The conditions of a study's rigs that can be set otherwise, with their ranges, in words."""
    parts = []
    for rig in study.rigs:
        ranges = study.catalogue.rigs[rig].conditions.items()
        names = [f"{name} ({q['min']:g} to {q['max']:g})" for name, q in ranges if q["min"] < q["max"]]
        parts.append(f"{rig} at other {' or '.join(names)}")
    return "; ".join(parts)


def columns_of(model: Model, effect: str) -> list[int]:
    """Columns of an effect's parameters, the amount first."""
    return [model.column[f"{effect}.{p}"] for p in model.study.catalogue.effects[effect].parameters]


def physical(model: Model, effect: str) -> list[tuple[float, float]]:
    """Physical range of each of an effect's parameters."""
    quantities = model.study.catalogue.effects[effect].parameters.values()
    return [q.get("physical", (q["min"], q["max"])) for q in quantities]


def signatures(state: Calibrated, names: Sequence[str], basis: np.ndarray) -> list[Signature]:
    """Signatures of effects at the size that shows with three standard errors, or at the physical limit.

    One for each side an effect may take and each of three shapes where it has shape parameters.
    """
    model, evidence, point = state.model, state.evidence, state.fit.point
    shares = np.geomspace(1e-4, 1, 13)
    trials, labels = [point], []
    for name in names:
        effect = model.study.catalogue.effects[name]
        columns, ranges = columns_of(model, name), physical(model, name)
        absent = effect.neutral()[effect.amount]
        shapes = [{}]
        if len(columns) > 1:
            keys = list(effect.parameters)[1:]
            shapes = [dict(zip(keys, values, strict=True)) for values in product(*[_three(*r) for r in ranges[1:]])]
        for sign in (1, -1) if effect.sides == 2 else (1,):
            reach = (ranges[0][1] if sign > 0 else ranges[0][0]) - absent
            if reach == 0:
                continue
            for shape in shapes:
                sizes = absent + reach * shares
                for size in sizes:
                    trial = point.copy()
                    trial[columns[0]] = size
                    for k, value in zip(columns[1:], shape.values(), strict=True):
                        trial[k] = value
                    trials.append(trial)
                labels.append((name, sign, shape, sizes, absent, reach))
    if not labels:
        return []
    means = model.predict(np.array(trials)).mean[:, evidence.case]
    change = evidence.whitened(means[1:] - means[0]).reshape(len(labels), len(shares), -1)
    change = np.nan_to_num(change, nan=0.0, posinf=0.0, neginf=0.0)
    seen = change - (change @ basis) @ basis.T
    length = np.linalg.norm(seen, axis=2)
    finer, sizes_at = [], []
    for k, (name, _, shape, _, absent, reach) in enumerate(labels):
        above = np.flatnonzero(length[k] >= STEP)
        share = shares[-1]
        if len(above):
            i = above[0]
            share = shares[i]
            if i > 0 and length[k, i - 1] > 0:
                slope = np.log(length[k, i] / length[k, i - 1]) / np.log(shares[i] / shares[i - 1])
                if slope > 0.05:
                    share = shares[i - 1] * (STEP / length[k, i - 1]) ** (1 / slope)
        sizes_at.append(absent + reach * min(share, 1.0))
        trial = point.copy()
        columns = columns_of(model, name)
        trial[columns[0]] = sizes_at[-1]
        for c, value in zip(columns[1:], shape.values(), strict=True):
            trial[c] = value
        finer.append(trial)
    means = model.predict(np.array([point, *finer])).mean[:, evidence.case]
    change = np.nan_to_num(evidence.whitened(means[1:] - means[0]))
    seen = change - (change @ basis) @ basis.T
    found = []
    for k, (name, sign, shape, *_) in enumerate(labels):
        size, whole = np.linalg.norm(seen[k]), np.linalg.norm(change[k])
        share = size / whole if whole > 1e-12 else 0.0
        unit = seen[k] / size if size > 1e-9 else np.zeros_like(seen[k])
        found.append(Signature(name, sign, float(sizes_at[k]), shape, unit, float(size), float(share)))
    return found


def _three(low: float, high: float) -> tuple[float, float, float]:
    return (low, float(np.sqrt(low * high)) if low > 0 else 0.5 * (low + high), high)


def rival_problem(
    state: Calibrated, effects: Sequence[str], starts: Sequence[dict[int, float]], wide: bool = False
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


def refits(state: Calibrated, names: Sequence[str], shown: Sequence[Signature], scores: np.ndarray):
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
    fits = dict(zip([(name,) for name in order], fit_many(model, state.evidence, problems), strict=True))
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
    beyond = dict(zip(stuck, fit_many(model, state.evidence, wide), strict=True))
    return fits, beyond


def judge(state: Calibrated, fits: Iterable[Fit], shown: Sequence[Signature] = ()) -> list[Rival]:
    """Whether each fitted rival explains the data.

    It may leave neither lack of fit nor a drifting constant behind, first of all where it acts, nor the signature of
    another candidate; and its own amount must be one number: the same in all rigs where it acts, drifting with none of
    their conditions. A look-alike seldom is.
    """
    rig_of = np.array([state.model.cases[c].rig for c in state.evidence.case], dtype=object)
    failing = failing_rigs(state)
    found = []
    for fit in fits:
        here, fitted = with_own_noise(state, fit)
        free = fitted.problem.free
        names = tuple(dict.fromkeys(state.model.names[c].split(".")[0] for c in free[len(state.fit.problem.free) :]))
        rigs = frozenset(rig for rig, acting in state.model.acting.items() if set(names) & set(acting))
        rigs |= failing
        mine = np.array([rig in rigs for rig in rig_of])
        overall = lack_of_fit(fitted, here.evidence)
        local = lack_of_fit(fitted, here.evidence, mine)
        explains = (overall is None or overall >= LEFT_OVERALL) and (local is None or local >= LEFT_OVER)
        if explains:
            left = drifts(replace(here, fit=fitted), rigs, birge=False)
            explains = not left or left[0].p >= LEFT_DRIFT
        if explains:
            explains = signature_left(here, fitted, names, shown) >= LEFT_NAMED
        noise = float((np.square(here.evidence.sd / state.evidence.sd) - 1).sum())
        found.append(Rival(names, fit, explains, noise))
    return found


def failing_rigs(state: Calibrated) -> frozenset[str]:
    """Rigs in which the present model fails, by lack of fit or a drifting constant; an explanation must mend them."""
    found = {d.rig for d in drifts(state) if d.p < DRIFT}
    return frozenset(found | {rig for rig, p in lack_by_rig(state).items() if p < LACK_IN_A_RIG})


def signature_left(state: Calibrated, fitted: Fit, names: Sequence[str], shown: Sequence[Signature]) -> float:
    """p of the largest score of the other candidates' signatures on what a fit leaves."""
    units = np.array([s.unit for s in shown if s.effect not in names])
    if not len(units):
        return 1.0
    basis = absorbed(fitted.jacobian)
    seen = units - (units @ basis) @ basis.T
    size = np.linalg.norm(seen, axis=1)
    seen, size = seen[size > DISTINCT], size[size > DISTINCT]
    dof = len(fitted.residual) - basis.shape[1]
    if not len(seen) or dof < 2:
        return 1.0
    unit = seen / size[:, None]
    z = standardised(fitted.residual[None], unit, basis, state.evidence, two_sided=False)[0]
    return exceedance(largest_null(unit, basis, state.evidence, two_sided=False), z.max())


def penalised(rival: Rival, state: Calibrated) -> float:
    """chi2 with 2 for each free parameter beyond the effects' amounts, so that shapes do not win by freedom alone."""
    return rival.fit.chi2 + 2.0 * (len(rival.fit.problem.free) - len(state.fit.problem.free) - len(rival.effects))


def explanations(
    state: Calibrated,
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
        p = lack_of_fit(best.fit, state.evidence)
        doubtful = p is not None and p < 0.05
    if doubtful:
        pairs = pair_rivals(state, singles, shown, scores, plausible)
        pairs = [r for r in judge(state, pairs, shown) if r.explains]
        if pairs:
            top = min(pairs, key=lambda r: penalised(r, state))
            if best is None or penalised(top, state) < penalised(best, state) - PAIR_GAIN * unit_of_chi2(
                state, top.fit
            ):
                return _tied(state, pairs, top)
    return _tied(state, good, best) if best is not None else []


def _tied(state: Calibrated, rivals: Sequence[Rival], best: Rival) -> list[Rival]:
    limit = penalised(best, state) + TIE * unit_of_chi2(state, best.fit)
    return sorted((r for r in rivals if penalised(r, state) - r.noise < limit), key=lambda r: penalised(r, state))


def pair_rivals(state: Calibrated, singles: Sequence[Rival], shown, scores: np.ndarray, plausible: set) -> list[Fit]:
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
    fits = fit_many(state.model, state.evidence, problems)
    return [
        f
        for f, (_, a, b, _, _) in zip(fits, promise, strict=True)
        if f.chi2 < min(alone.get(a, np.inf), alone.get(b, np.inf)) - PAIR_GAIN * unit_of_chi2(state, f)
    ]


def _ranking(state, names, found, shown, scores, null, rivals, beyond) -> tuple[Suspect, ...]:
    evidence, base = state.evidence, len(state.fit.problem.free)
    known = evidence.dof or max(len(evidence.case) - base - 1, 1)
    fitted = {r.effects[0]: r for r in rivals if len(r.effects) == 1}
    critical = null[int(0.95 * len(null))] if len(null) else 2.6
    ranking = []
    for name in names:
        effect = state.model.study.catalogue.effects[name]
        mine = [k for k, s in enumerate(shown) if s.effect == name]
        if not mine:
            ranking.append(_unjudged(state, name, found))
            continue
        k = max(mine, key=lambda i: scores[i])
        score, signature = float(scores[k]), shown[k]
        absent = effect.neutral()[effect.amount]
        smallest = absent + (signature.size - absent) * (critical + 0.84) / signature.length
        reach = physical(state.model, name)[0][1 if signature.sign > 0 else 0]
        visible_size = float(smallest) if abs(smallest - absent) <= abs(reach - absent) else None
        rival = fitted.get(name)
        value, interval, drop, p_left, note, wide, gained = {}, None, 0.0, None, "", {}, None
        if rival is not None:
            own = rival.fit.values[base:]
            value = dict(zip(effect.parameters, map(float, own), strict=True))
            unit = 1.0 if evidence.scale_known else unit_of_chi2(state, rival.fit)
            drop = max(0.0, (state.fit.chi2 - rival.fit.chi2) / unit)
            se = float(np.sqrt(covariance(rival.fit)[base, base] * unit_of_chi2(state, rival.fit)))
            low, high = rival.fit.problem.low[base], rival.fit.problem.high[base]
            interval = (float(max(low, own[0] - 2 * se)), float(min(high, own[0] + 2 * se)))
            p_left = lack_of_fit(rival.fit, evidence)
            if name in beyond:
                better = rival.fit.chi2 - beyond[name].chi2
                if better > PLAUSIBLE * unit_of_chi2(state, beyond[name]):
                    note = "implausible size"
                    gained = float((state.fit.chi2 - beyond[name].chi2) / unit)
                    wide = dict(zip(effect.parameters, map(float, beyond[name].values[base:]), strict=True))
        if score <= 0 and drop < 1.0:
            note = "wrong sign" if effect.sides == 1 else ""
        p = special.stdtr(known, -score)
        ranking.append(
            Suspect(
                effect=name,
                score=score,
                p=float(min(1.0, p * effect.sides)),
                p_adjusted=exceedance(null, score),
                chi2_drop=float(drop),
                value=value or {effect.amount: float(absent)},
                interval=interval,
                visible_share=signature.visible_share,
                smallest_visible=visible_size,
                lack_of_fit_p=p_left,
                explains=bool(rival and rival.explains),
                note=note,
                beyond=wide,
                beyond_chi2_drop=gained,
            )
        )
    return tuple(sorted(ranking, key=lambda s: (bool(s.note), -s.chi2_drop, -(s.score or 0.0))))


def unsimulated(state: Calibrated) -> set[str]:
    """Effects whose simulations failed in some row: what they would do is not known."""
    dead = [key for engine in state.model.engines.values() for key in getattr(engine, "dead", ())]
    return {key[1] for key in dead if isinstance(key, tuple)}


def _unjudged(state: Calibrated, name: str, found: Sequence[Signature]) -> Suspect:
    effect = state.model.study.catalogue.effects[name]
    share = max((s.visible_share for s in found if s.effect == name), default=0.0)
    neutral = {effect.amount: float(effect.neutral()[effect.amount])}
    note = "these data cannot show it"
    return Suspect(name, None, None, None, 0.0, neutral, None, share, None, None, False, note, {})
