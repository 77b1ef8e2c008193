"""Absent effects fitted together with the constants, and which of them explain the data."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, with_own_noise
from pellet_study.criticism.constancy import DRIFT, constancy_tests
from pellet_study.criticism.lack_of_fit import LACK_IN_A_RIG, absorbed_basis, lack_by_rig, lack_of_fit
from pellet_study.criticism.least_squares import Fit, Problem, fit_many
from pellet_study.criticism.score_tests import exceedance, largest_null, standardised
from pellet_study.criticism.signatures import Signature
from pellet_study.criticism.ways import columns_of, physical
from pellet_study.model.model import Model
from pellet_study.output.words import probability

# What an explanation may not leave behind, chosen with the trials of results/hidden_effect: stricter, and the hidden effect
# itself is refused by chance; laxer, and look-alikes pass
LEFT_OVER = 0.002  # p of lack of fit in the rigs where it acts
LEFT_DRIFT = 0.01  # p of drift there, in a constant or in its own amount
LEFT_OVERALL = 0.001  # p of lack of fit over all rigs
LEFT_NAMED = 0.002  # p of another candidate's signature
DISTINCT = 0.25  # share of a signature that must be left beside an explanation to be tested; less is its own curvature


@dataclass(frozen=True)
class Rival:
    """A set of effects to add, fitted.

    `noise` is what the scatter of its predictions beyond the present model's is expected to add to its chi2; `objection`
    says why it does not explain the data, where it was judged.
    """

    effects: tuple[str, ...]
    fit: Fit
    explains: bool
    noise: float = 0.0
    objection: str = ""


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


def best_signatures(shown: Sequence[Signature], scores: np.ndarray) -> dict[str, int]:
    """The place of each effect's signature with the largest score, in the order in which the effects come."""
    best: dict[str, int] = {}
    for k, s in enumerate(shown):
        if s.effect not in best or scores[k] > scores[best[s.effect]]:
            best[s.effect] = k
    return best


def starting_at(columns: Sequence[int], amount: float, shape: Mapping[str, float]) -> dict[int, float]:
    """A start of a fit: an effect's amount and shape in its columns."""
    return {columns[0]: amount, **dict(zip(columns[1:], shape.values(), strict=True))}


def refits(
    state: CalibratedStudy, shown: Sequence[Signature], scores: np.ndarray
) -> tuple[dict[str, Fit], dict[str, Fit]]:
    """Each shown candidate refitted within its physical range, and without that limit where it ends at it: {effect: fit}."""
    model, best = state.model, best_signatures(shown, scores)
    order = sorted(best, key=lambda e: -scores[best[e]])
    problems = [rival_problem(state, [name], starts_of(model, shown, shown[best[name]])) for name in order]
    fits = dict(zip(order, fit_many(model, state.cells, problems), strict=True))
    stuck = [name for name, fitted in fits.items() if ends_at_limit(state, name, fitted)]
    wide = []
    for name in stuck:
        columns = columns_of(model, name)
        start = dict(zip(columns, fits[name].point[columns], strict=True))
        wide.append(rival_problem(state, [name], [start], wide=True))
    return fits, dict(zip(stuck, fit_many(model, state.cells, wide), strict=True))


def starts_of(model: Model, shown: Sequence[Signature], best: Signature) -> list[dict[int, float]]:
    """Where the fit of an effect starts: at its best signature, a third of the way to the limit, where it fits best of the
    amounts tried, and at its other shapes."""
    columns = columns_of(model, best.effect)
    limit = physical(model, best.effect)[0][1 if best.sign > 0 else 0]
    others = [s for s in shown if s.effect == best.effect and s.shape != best.shape and s.sign == best.sign]
    return [
        starting_at(columns, best.size, best.shape),
        starting_at(columns, best.size + 0.3 * (limit - best.size), best.shape),
        starting_at(columns, best.fitting, best.shape),
        *(starting_at(columns, other.size, other.shape) for other in others),
    ]


def ends_at_limit(state: CalibratedStudy, name: str, fitted: Fit) -> bool:
    """Whether a candidate's fit ends at a physical limit that its range goes beyond; at none of it, it does not."""
    amount = len(state.fit.problem.free)  # its place in the fit, behind the constants
    quantities = list(state.model.study.catalogue.effects[name].parameters.values())
    limited = any(q.get("physical", (q["min"], q["max"])) != (q["min"], q["max"]) for q in quantities)
    return limited and any(
        fitted.at_bound[amount + k] and not (k == 0 and fitted.values[amount] == q.get("absent"))
        for k, q in enumerate(quantities)
    )


def judge(state: CalibratedStudy, fits: Iterable[Fit], shown: Sequence[Signature] = ()) -> list[Rival]:
    """Whether each fitted rival explains the data.

    It may leave neither lack of fit nor a drifting constant behind, first of all where it acts, nor the signature of
    another candidate; and its own amount must be one number: the same in all rigs where it acts, drifting with none of
    their conditions. A look-alike seldom is.
    """
    failing = failing_rigs(state)
    rivals = []
    for fit in fits:
        noisy, fitted = with_own_noise(state, fit)
        added = fitted.problem.free[len(state.fit.problem.free) :]
        names = tuple(dict.fromkeys(state.model.names[c].split(".")[0] for c in added))
        noise = float((np.square(noisy.cells.sd / state.cells.sd) - 1).sum())
        objection = objection_to(noisy, fitted, names, failing, shown)
        rivals.append(Rival(names, fit, not objection, noise, objection))
    return rivals


def objection_to(
    state: CalibratedStudy, fitted: Fit, names: Sequence[str], failing: frozenset[str], shown: Sequence[Signature]
) -> str:
    """What a fit with some effects leaves: lack of fit, drift, or another candidate's signature; empty where it explains.

    Parameters
    ----------
    state : the present model, with the noise of the rival's predictions in its cells
    failing : rigs that must be mended, besides those where the effects act
    """
    rigs = failing | {rig for rig, acting in state.model.acting.items() if set(names) & set(acting)}
    concerned = np.array([state.model.cases[c].rig in rigs for c in state.cells.case])
    overall = lack_of_fit(fitted, state.cells)
    local = lack_of_fit(fitted, state.cells, concerned)
    if overall is not None and overall < LEFT_OVERALL:
        return f"it leaves lack of fit, p {probability(overall)} (refused below {LEFT_OVERALL:g})"
    if local is not None and local < LEFT_OVER:
        where = ", ".join(sorted(rigs))
        return f"it leaves lack of fit in {where}, p {probability(local)} (refused below {LEFT_OVER:g})"
    left = constancy_tests(replace(state, fit=fitted), rigs, birge=False)
    if left and left[0].p < LEFT_DRIFT:
        worst = left[0]
        return (
            f"with it {worst.parameter} still drifts with {worst.condition} ({worst.rig}), p {probability(worst.p)} "
            f"(refused below {LEFT_DRIFT:g})"
        )
    p, other = signature_left(state, fitted, names, shown)
    if p < LEFT_NAMED:
        return f"it leaves the signature of {other}, p {probability(p)} (refused below {LEFT_NAMED:g})"
    return ""


@lru_cache(maxsize=1)  # each question of a diagnosis asks it of the same model
def failing_rigs(state: CalibratedStudy) -> frozenset[str]:
    """Rigs in which the present model fails, by lack of fit or a drifting constant; an explanation must mend them."""
    drifting = {d.rig for d in constancy_tests(state) if d.p < DRIFT}
    return frozenset(drifting | {rig for rig, p in lack_by_rig(state).items() if p < LACK_IN_A_RIG})


def signature_left(
    state: CalibratedStudy, fitted: Fit, names: Sequence[str], shown: Sequence[Signature]
) -> tuple[float, str]:
    """p of the largest score of the other candidates' signatures on what a fit leaves, and whose it is."""
    others = [s for s in shown if s.effect not in names]
    if not others:
        return 1.0, ""
    units, basis = np.array([s.unit for s in others]), absorbed_basis(fitted.jacobian)
    seen = units - (units @ basis) @ basis.T
    size = np.linalg.norm(seen, axis=1)
    tested = np.flatnonzero(size > DISTINCT)
    dof = len(fitted.residual) - basis.shape[1]
    if not len(tested) or dof < 2:
        return 1.0, ""
    unit = seen[tested] / size[tested, None]
    z = standardised(fitted.residual[None], unit, basis, state.cells, two_sided=False)[0]
    return exceedance(largest_null(unit, basis, state.cells, two_sided=False), z.max()), others[
        tested[z.argmax()]
    ].effect
