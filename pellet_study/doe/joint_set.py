"""The settings at which several responses are all acceptable, the most desirable of them, and what to measure next.

With m responses that have targets and k factors, the settings that meet all targets exactly form a set of k - m
dimensions; what is acceptable around the targets, and the uncertainty of the fits, thicken it.
"""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe import coded_box
from pellet_study.doe.box_search import minimise
from pellet_study.doe.coded_box import Extent
from pellet_study.doe.desirability import AS_GOOD, Wanted, acceptable, most_desirable, overall_desirability
from pellet_study.doe.factors import Factor
from pellet_study.doe.fitted_response import FittedResponse
from pellet_study.doe.goals import Goal, overall
from pellet_study.doe.intervals import Interval
from pellet_study.doe.pieces import Pieces
from pellet_study.errors import InputError

ON_EDGE = 1e-6
"""How far beyond its limits, in parts of its range over the box, a prediction at the edge of the set may lie."""
LIMIT_REACHED = 1e-4
"""How near to its limit, in parts of its range over the box, a prediction counts as on it."""
LEAST_PIECE = 0.01
"""The least part of the set that counts as a piece of its own, if the recommended setting is not in it."""
SHRINKS = 5e-4
"""The least share of the box by which a measurement is said to shrink the set."""


@dataclass(frozen=True)
class Part:
    """One response's part in the joint set; shares of the box, 0 to 1.

    Attributes
    ----------
    response, goal
    fraction : float
        Where its prediction is acceptable.
    fraction_of_the_others : float
        Where all the others' are.
    after_replicate : float or None
        Share not excluded by all responses together if every run were made once more and this response alone
        measured in it; None where a fit leaves no residual.
    prediction : Interval
        At the recommended setting.
    desirability : float
        There.
    limit : float or None
        The limit on which the prediction there lies, where it lies on one.
    """

    response: FittedResponse
    goal: Goal
    fraction: float
    fraction_of_the_others: float
    after_replicate: float | None
    prediction: Interval
    desirability: float
    limit: float | None = None


@dataclass(frozen=True)
class Assured:
    """The most desirable setting at which every confidence interval lies within what is acceptable; predictions by response."""

    coded: np.ndarray
    physical: dict[str, float]
    desirability: float
    predicted: dict[str, float]


@dataclass(frozen=True)
class Piece:
    """A part of the set that hangs together in itself and not with the rest: its share of the box, the ranges in it."""

    fraction: float
    extents: list[Extent]


@dataclass(frozen=True)
class JointSet:
    """The settings of the box [-1, 1]^k that meet the goals of all responses.

    Attributes
    ----------
    factors : list of Factor
    alpha : float
    fraction : float
        Share of the box where all predictions are acceptable.
    fraction_not_excluded : float or None
        Share where no response's confidence interval (each at level 1 - alpha) lies wholly beyond what is
        acceptable; None where a fit leaves no residual.
    fraction_assured : float or None
        Share where every one of those intervals lies wholly within it.
    extents : list of Extent
        Range of each factor on the set; empty where there is none.
    coded, physical
        The recommended setting: see `desirability.most_desirable`.
    desirability : float
        Overall, 0 to 1.
    parts : list of Part
        In the order of the responses.
    pieces : list of Piece
        The set's pieces where it falls into several, largest first; empty where it hangs together.
    assured : Assured or None
        Where the recommended setting lies on a limit and a part of the set is assured.
    """

    factors: list[Factor]
    alpha: float
    fraction: float
    fraction_not_excluded: float | None
    fraction_assured: float | None
    extents: list[Extent]
    coded: np.ndarray
    physical: dict[str, float]
    desirability: float
    parts: list[Part]
    pieces: list[Piece]
    assured: Assured | None

    @property
    def wanted(self) -> Wanted:
        """The responses and their goals."""
        return [(part.response, part.goal) for part in self.parts]

    @property
    def met(self) -> bool:
        """Whether the recommended setting meets all goals."""
        return self.desirability > 0 or all(bool(part.goal.met(part.prediction.predicted)) for part in self.parts)

    @property
    def extrapolation(self) -> bool:
        return any(part.prediction.extrapolation for part in self.parts)

    @property
    def next_response(self) -> Part | None:
        """The response whose replicates shrink the set that is not excluded most; None where none shrinks it."""
        told = [part for part in self.parts if part.after_replicate is not None]
        best = min(told, key=lambda part: part.after_replicate, default=None)
        shrinks = best is not None and best.after_replicate < self.fraction_not_excluded - SHRINKS
        return best if shrinks else None


def joint_set(responses: list[FittedResponse], goals: list[Goal]) -> JointSet:
    """The joint target set of responses fitted on the same factors; see `JointSet`.

    Parameters
    ----------
    responses : list of FittedResponse
        One or more.
    goals : list of Goal
        One of each response.

    Raises
    ------
    InputError
        If the responses' tables code the factors differently.
    """
    wanted = list(zip(responses, goals, strict=True))
    factors = _common_factors(responses)
    points = coded_box.sample(len(factors))
    met = np.array([goal.met(response.predict(points)) for response, goal in wanted])
    best = most_desirable(wanted)
    fitted = not any(response.surface.saturated for response in responses)
    not_excluded = np.array([_reaches(response.bounds(points), goal) for response, goal in wanted]) if fitted else None
    parts = []
    for i, (response, goal) in enumerate(wanted):
        prediction = response.interval(best)
        part = Part(
            response=response,
            goal=goal,
            fraction=float(met[i].mean()),
            fraction_of_the_others=float(np.delete(met, i, axis=0).all(axis=0).mean()),
            after_replicate=None if not_excluded is None else _after_replicate(i, response, goal, not_excluded, points),
            prediction=prediction,
            desirability=float(goal.desirability(prediction.predicted)),
            limit=_limit_at(prediction.predicted, response, goal, points),
        )
        parts.append(part)
    assured = _assured(wanted, points) if fitted else None
    on_limit = any(part.limit is not None for part in parts)
    extents = coded_box.with_alone(
        _extents(wanted, points, points[met.all(axis=0)], best),
        factors,
        best,
        lambda x: np.all([goal.met(response.predict(x)) for response, goal in wanted], axis=0),
    )
    return JointSet(
        factors=factors,
        alpha=responses[0].surface.alpha,
        fraction=float(met.all(axis=0).mean()),
        fraction_not_excluded=None if not_excluded is None else float(not_excluded.all(axis=0).mean()),
        fraction_assured=None if assured is None else float(assured.mean()),
        extents=extents,
        coded=best,
        physical={f.name: float(f.physical(x)) for f, x in zip(factors, best, strict=True)},
        desirability=float(overall([part.desirability for part in parts], [goal.exponent for goal in goals])),
        parts=parts,
        pieces=_pieces(wanted, points, points[met.all(axis=0)], best),
        assured=_best_assured(wanted, points[assured]) if on_limit and assured is not None and assured.any() else None,
    )


def _common_factors(responses: list[FittedResponse]) -> list[Factor]:
    first, *others = responses
    for response in others:
        if response.factors != first.factors:
            raise InputError(
                f"the runs with a value of {response.name!r} have other factor levels than those of {first.name!r}: give "
                "the levels of -1 and +1 of every factor with --factor NAME=LOW,HIGH"
            )
    return first.factors


# ------------------------------------------------------------------------------------------------ shares of the box
def _reaches(bounds, goal: Goal) -> np.ndarray:
    """Where a confidence interval reaches what is acceptable."""
    low, high = goal.accepted
    return (bounds[0] <= high) & (bounds[1] >= low)


def _assured(wanted: Wanted, points) -> np.ndarray:
    """Where every confidence interval lies wholly within what is acceptable."""
    ends = [(response.bounds(points), goal) for response, goal in wanted]
    return np.all([goal.met(low) & goal.met(high) for (low, high), goal in ends], axis=0)


def _best_assured(wanted: Wanted, points) -> Assured:
    """The most desirable of some points, of equally good ones the nearest to the centre."""
    values = overall_desirability(wanted, points)
    good = points[values >= values.max() - AS_GOOD]
    point = good[np.argmin((good**2).sum(axis=1))]
    return Assured(
        coded=point,
        physical={f.name: float(f.physical(x)) for f, x in zip(wanted[0][0].factors, point, strict=True)},
        desirability=float(overall_desirability(wanted, point)[0]),
        predicted={response.name: float(response.predict(point)[0]) for response, _ in wanted},
    )


def _limit_at(predicted: float, response, goal: Goal, points) -> float | None:
    """The limit of what is acceptable on which a prediction lies, within rounding."""
    near = LIMIT_REACHED * response.spread(points)
    return next((end for end in goal.accepted if np.isfinite(end) and abs(predicted - end) <= near), None)


def _after_replicate(place: int, response, goal, not_excluded: np.ndarray, points) -> float:
    """Share not excluded with twice the runs behind one response: half its leverage, its residual variance kept."""
    halved = _reaches(response.bounds(points, response.surface.model.leverage(points) / 2), goal)
    return float((np.delete(not_excluded, place, axis=0).all(axis=0) & halved).mean())


# -------------------------------------------------------------------------------------------- ranges of the factors
def _pieces(wanted: Wanted, points, inside, best) -> list[Piece]:
    """The pieces of the set that hold points of the sample; none where there is one."""
    pieces = Pieces(wanted)
    of_points, of_best = pieces.of(inside), pieces.of(best)[0]
    least = LEAST_PIECE * len(inside)
    numbers = [n for n in np.unique(of_points) if n and (n == of_best or np.sum(of_points == n) >= least)]
    if len(numbers) < 2:
        return []
    found = []
    for number in numbers:
        own = inside[of_points == number]
        start = best if number == of_best else own[0]
        extents = _extents(wanted, points, own, start, lambda x, number=number: pieces.of(x)[0] == number)
        found.append(Piece(len(own) / len(points), extents))
    return sorted(found, key=lambda piece: -piece.fraction)


def _extents(wanted: Wanted, points, inside, best, allowed=lambda x: True) -> list[Extent]:
    """Range of every factor on the set, or on the piece of it that is allowed: the sample's ends, pushed outwards."""
    scales = [response.spread(points) for response, _ in wanted]

    def fine(x) -> bool:
        pairs = zip(wanted, scales, strict=True)
        met = all(goal.miss(response.predict(x)[0]) <= ON_EDGE * scale for (response, goal), scale in pairs)
        return met and bool(allowed(x))

    known = np.vstack([inside, best]) if fine(best) else inside
    if not len(known):
        return []
    constraints = acceptable(wanted)
    extents = []
    for i, factor in enumerate(wanted[0][0].factors):
        unit = np.eye(known.shape[1])[i]
        ends = []
        for sign in (1, -1):
            start = known[np.argmin(sign * known[:, i])]
            pushed = np.clip(
                minimise(lambda x, s=sign, u=unit: s * u @ x, lambda x, s=sign, u=unit: s * u, start, constraints),
                -1,
                1,
            )
            reached = [start[i], pushed[i]] if fine(pushed) else [start[i]]
            ends.append(float(sign * min(sign * x for x in reached)))
        extents.append(coded_box.extent(factor, ends))
    return extents
