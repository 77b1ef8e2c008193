"""The setting of the box at which several responses are together most desirable (Derringer and Suich 1980, see `goals`)."""

import numpy as np

from pellet_study.doe import coded_box
from pellet_study.doe.box_search import between, minimise
from pellet_study.doe.fitted_response import FittedResponse
from pellet_study.doe.goals import Goal, overall

Wanted = list[tuple[FittedResponse, Goal]]

STARTS = 5
FARTHEST_APART = 0.4
"""Starts of the search differ by this much, coded, in a factor at least."""
LOWEST_LOG = -60.0
"""Below e^-60 a desirability counts as 0."""
AS_GOOD = 1e-6
"""How far below the largest overall desirability a setting still counts as equally good."""


def overall_desirability(wanted: Wanted, coded) -> np.ndarray:
    """D (n_points,) of coded points (n_points, n_factors), 0 to 1."""
    each = [goal.desirability(response.predict(coded)) for response, goal in wanted]
    return overall(each, [goal.exponent for _, goal in wanted])


def most_desirable(wanted: Wanted) -> np.ndarray:
    """The setting (n_factors,) of largest overall desirability; of several equally good ones one nearest to the centre.

    Where no setting is acceptable in every response, the one whose worst response misses by least, in parts of its
    range over the box.
    """
    points = coded_box.sample(len(wanted[0][0].factors))
    values = overall_desirability(wanted, points)
    if values.max() > 0:
        starts = _apart(points[np.argsort(-values)[:2000]])
    else:
        starts = [_least_miss(wanted, points)]
        if not overall_desirability(wanted, starts)[0] > 0:
            return starts[0]
    found = np.vstack([*(_polished(wanted, start) for start in starts), *starts])
    return _most_central(wanted, found[np.argmax(overall_desirability(wanted, found))])


def acceptable(wanted: Wanted, n_more: int = 0) -> list[dict]:
    """SLSQP's constraints that every prediction is acceptable, on (x, further variables)."""
    return [c for response, goal in wanted for c in between(response, *goal.accepted, len(response.factors), n_more)]


def _apart(points: np.ndarray) -> list[np.ndarray]:
    """The first point, and those after it that are far from all before."""
    chosen = [points[0]]
    for point in points:
        if len(chosen) < STARTS and min(np.abs(point - other).max() for other in chosen) > FARTHEST_APART:
            chosen.append(point)
    return chosen


def _polished(wanted: Wanted, start) -> np.ndarray:
    r"""A maximum of :math:`\sum w_i q_i` over x and :math:`q_i = \ln d_i`, every flank at least :math:`e^{q_i/r_i}`.

    So written the problem is smooth, kinks at the targets included.
    """
    k, m = len(start), len(wanted)
    exponents = np.array([goal.exponent for _, goal in wanted])
    first = [goal.desirability(response.predict(start))[0] for response, goal in wanted]
    limits = [pair for pair in wanted if not pair[1].flanks]
    constraints = acceptable(limits, m) + [
        _flank(i, response, *flank, k, m) for i, (response, goal) in enumerate(wanted) for flank in goal.flanks
    ]
    return np.clip(
        minimise(
            lambda z: -float(exponents @ z[k:]),
            lambda z: np.concatenate([np.zeros(k), -exponents]),
            np.concatenate([start, np.log(np.maximum(first, np.exp(LOWEST_LOG)))]),
            constraints,
            [(-1, 1)] * k + [(LOWEST_LOG, 0)] * m,
        )[:k],
        -1,
        1,
    )


def _flank(i: int, response, zero: float, one: float, weight: float, k: int, m: int) -> dict:
    """That the flank of response i stands at least as high as its desirability e^q wants."""
    unit, span = np.eye(m)[i] / weight, one - zero
    return {
        "type": "ineq",
        "fun": lambda z: (response.predict(z[:k])[0] - zero) / span - np.exp(z[k + i] / weight),
        "jac": lambda z: np.concatenate([response.gradient(z[:k])[0] / span, -unit * np.exp(z[k + i] / weight)]),
    }


def _most_central(wanted: Wanted, best) -> np.ndarray:
    """Of the settings no less desirable in any response, which may form a set, one nearest to the centre."""
    constraints = acceptable([pair for pair in wanted if not pair[1].flanks])
    for response, goal in wanted:
        y = float(response.predict(best)[0])
        for zero, one, _ in goal.flanks:
            reached = y if (y - one) * (one - zero) < 0 else one  # beyond the best end is no better than there
            constraints += between(response, *((reached, np.inf) if one > zero else (-np.inf, reached)), len(best))
    point = np.clip(minimise(lambda x: float(x @ x), lambda x: 2 * x, best, constraints), -1, 1)
    values = overall_desirability(wanted, np.vstack([point, best]))
    return point if values[0] > values[1] - AS_GOOD and point @ point < best @ best else best


def _least_miss(wanted: Wanted, points) -> np.ndarray:
    """The setting whose worst response misses by least, in parts of its range over the box."""
    predicted = [response.predict(points) for response, _ in wanted]
    scales = [response.spread(points) for response, _ in wanted]
    misses = [goal.miss(values) / scale for (_, goal), values, scale in zip(wanted, predicted, scales, strict=True)]
    worst = np.max(misses, axis=0)
    start, k = points[np.argmin(worst)], points.shape[1]
    unit = np.eye(k + 1)[k]
    constraints = [
        {
            "type": "ineq",
            "fun": lambda z, c=c, scale=scale: c["fun"](z) / scale + z[k],
            "jac": lambda z, c=c, scale=scale: c["jac"](z) / scale + unit,
        }
        for pair, scale in zip(wanted, scales, strict=True)
        for c in acceptable([pair], 1)
    ]
    found = minimise(
        lambda z: z[k],
        lambda z: unit,
        np.append(start, worst.min()),
        constraints,
        [(-1, 1)] * k + [(None, None)],
    )
    return np.clip(found[:k], -1, 1)
