"""The tie set: which of the fitted rivals, single effects or else pairs, explain the data alike."""

from collections.abc import Collection, Sequence
from itertools import combinations

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, reduced_chi2
from pellet_study.criticism.lack_of_fit import lack_of_fit
from pellet_study.criticism.least_squares import Fit, fit_many
from pellet_study.criticism.rivals import Rival, best_signatures, judge, rival_problem, starting_at
from pellet_study.criticism.signatures import Signature
from pellet_study.criticism.ways import columns_of

# chi2 within which rivals explain alike: one at the margin is exp(-4.3/2), a ninth, as likely as the best; in the trials of
# results/hidden_effect the hidden effect is then among the tied where a smaller margin loses it
TIE = 4.3
PAIR_GAIN = 12.0  # chi2 that each member of a pair must bring: 3.5 standard errors, as the pair is the best of dozens
DOUBTFUL = 0.05  # p of the best single effect's lack of fit below which pairs are looked at
PROPORTIONAL = 0.98  # correlation of two signatures from which on they count as one effect
PAIRS_REFITTED = 14  # the others promise less, and each costs a refit


def penalised(rival: Rival, state: CalibratedStudy) -> float:
    """chi2 with 2 for each free parameter beyond the effects' amounts, so that shapes do not win by freedom alone."""
    return rival.fit.chi2 + 2.0 * (len(rival.fit.problem.free) - len(state.fit.problem.free) - len(rival.effects))


def explanations(
    state: CalibratedStudy,
    singles: Sequence[Rival],
    shown: Sequence[Signature],
    scores: np.ndarray,
    plausible: Collection[str],
) -> tuple[list[Rival], list[Rival]]:
    """The tie set: the single effects, else the pairs, that explain the data and lie within TIE of the best.

    Returns
    -------
    the tie set, and the pairs that were refused
    """
    good, refused = [r for r in singles if r.explains], []
    best = min(good, key=lambda r: penalised(r, state)) if good else None
    p = lack_of_fit(best.fit, state.cells) if best is not None else 0.0
    if p is not None and p < DOUBTFUL:
        found = judge(state, pair_rivals(state, singles, shown, scores, plausible), shown)
        pairs, refused = [r for r in found if r.explains], [r for r in found if not r.explains]
        top = min(pairs, key=lambda r: penalised(r, state), default=None)
        if top is not None:
            gain = PAIR_GAIN * reduced_chi2(state, top.fit)
            if best is None or penalised(top, state) < penalised(best, state) - gain:
                return tied(state, pairs, top), refused
    return tied(state, good, best) if best is not None else [], refused


def tied(state: CalibratedStudy, rivals: Sequence[Rival], best: Rival) -> list[Rival]:
    """The rivals that explain as well as the best, or as much worse as the scatter of their simulations may make them."""
    limit = penalised(best, state) + TIE * reduced_chi2(state, best.fit)
    return sorted((r for r in rivals if penalised(r, state) - r.noise < limit), key=lambda r: penalised(r, state))


def pair_rivals(
    state: CalibratedStudy,
    singles: Sequence[Rival],
    shown: Sequence[Signature],
    scores: np.ndarray,
    plausible: Collection[str],
) -> list[Fit]:
    """The most promising pairs by their signatures, refitted; each member must bring `PAIR_GAIN`."""
    alone = {r.effects[0]: r.fit for r in singles if len(r.effects) == 1}
    pairs = promising_pairs(shown, scores, plausible)
    problems = []
    for pair in pairs:
        starts = []
        for factor in (1.0, 0.5):
            start: dict[int, float] = {}
            for signature in (shown[k] for k in pair):
                columns = columns_of(state.model, signature.effect)
                fitted = alone.get(signature.effect)
                size = signature.size if fitted is None or factor == 1.0 else fitted.point[columns[0]]
                start |= starting_at(columns, factor * size, signature.shape)
            starts.append(start)
        problems.append(rival_problem(state, [shown[k].effect for k in pair], starts))
    fits = fit_many(state.model, state.cells, problems)
    needed = [min(alone[e].chi2 if e in alone else np.inf for e in (shown[k].effect for k in pair)) for pair in pairs]
    return [
        fit
        for fit, single in zip(fits, needed, strict=True)
        if fit.chi2 < single - PAIR_GAIN * reduced_chi2(state, fit)
    ]


def promising_pairs(
    shown: Sequence[Signature], scores: np.ndarray, plausible: Collection[str]
) -> list[tuple[int, int]]:
    """Places of the pairs of signatures that together take most of the residual, each with an amount above zero."""
    best = best_signatures(shown, scores)
    promise = []
    for i, j in combinations((k for name, k in best.items() if name in plausible), 2):
        rho = float(shown[i].unit @ shown[j].unit)
        if abs(rho) > PROPORTIONAL:
            continue
        first, second = (
            (scores[i] - rho * scores[j]) / (1 - rho**2),
            (scores[j] - rho * scores[i]) / (1 - rho**2),
        )
        if first > 0 and second > 0:
            promise.append((first * scores[i] + second * scores[j], i, j))
    return [(i, j) for _, i, j in sorted(promise, key=lambda item: -item[0])[:PAIRS_REFITTED]]
