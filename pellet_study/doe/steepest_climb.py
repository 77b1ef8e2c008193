"""The path of steepest climb along a fitted first-order model.

References
----------
Box, Wilson, On the experimental attainment of optimum conditions, J. Roy. Statist. Soc. B 13 (1951) 1,
doi:10.1111/j.2517-6161.1951.tb00067.x. The equal steps are those of the source paper's Table 10.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from pellet_study.doe.factors import Factor, factor_meant, rounded
from pellet_study.doe.intervals import interval
from pellet_study.doe.linear_model import LinearFit, fit
from pellet_study.doe.plackett_burman import Screening
from pellet_study.doe.terms import linear_terms
from pellet_study.errors import InputError


@dataclass(frozen=True)
class Climb:
    """A path in physical units.

    Attributes
    ----------
    factors : list of Factor
    points : DataFrame (n_points, n_factors)
        Physical levels of the runs to make.
    coded : ndarray (n_points, n_factors)
    predicted : ndarray (n_points,)
    prediction_intervals : list of (float, float) or None
        Of a single run at level 1 - alpha; None where the model leaves no residual.
    points_asked : int
        More than there are where a limit stopped the path.
    angle_to_gradient_deg : float
        Between the path and the fitted gradient in coded units; 0 unless equal steps were asked for.
    level : float
        Of the prediction intervals.
    """

    factors: list[Factor]
    points: pd.DataFrame
    coded: np.ndarray
    predicted: np.ndarray
    prediction_intervals: list[tuple[float, float] | None]
    equal_steps: bool
    points_asked: int
    angle_to_gradient_deg: float
    level: float = 0.95


def first_order_model(screening: Screening, names: list[str] | None = None) -> tuple[LinearFit, list[Factor]]:
    """The main-effects model of the named factors (default: those significant at the screening's level).

    Raises
    ------
    InputError
        If a name is no factor, or none was named and none is significant.
    """
    if names is None:
        words = {factor.name for factor in screening.table.factors if factor.levels}
        names = [name for name in significant(screening) if name not in words]
        if not names:
            raise InputError(
                "no factor is significant, so the climb has no direction: name the factors to move with --climb-factors"
            )
    table = screening.table
    names = [factor_meant(name, table.names) for name in names]
    categorical = [factor for factor in table.factors if factor.levels and factor.name in names]
    if categorical:
        raise InputError(
            f"{categorical[0].name!r} is categorical, so there is no path along it: leave it out of --climb-factors and "
            "run the path at its better level"
        )
    model = fit(names, linear_terms(names), table.coded[names], table.response, screening.model.extra, table.blocks)
    return model, [factor for name in names for factor in table.factors if factor.name == name]


def significant(screening: Screening) -> list[str]:
    """Factors whose main effect is significant at the screening's level."""
    return [name for name in significant_terms(screening) if name in screening.table.names]


def acting(screening: Screening) -> list[str]:
    """Factors that stand in any significant term."""
    terms, names = screening.model.terms, screening.table.names
    places = {i for name in significant_terms(screening) for i in terms[name]}
    return [name for i, name in enumerate(names) if i in places]


def significant_terms(screening: Screening) -> list[str]:
    """Terms significant at the screening's level; beyond Lenth's margin where the design is saturated."""
    if screening.saturated:
        margin = screening.lenth.margin_of_error if screening.lenth else np.inf
        return [name for name, effect in screening.effects.items() if abs(effect) > margin]
    return [name for name, p in screening.p.items() if p is not None and p < screening.alpha]


def path(
    model: LinearFit,
    factors: list[Factor],
    points: int = 6,
    equal_steps: bool = False,
    start: str | dict[str, float] = "centre",
    step: tuple[str, float] | None = None,
    limits: dict[str, tuple[float, float]] | None = None,
    ascend: bool = True,
    alpha: float = 0.05,
) -> Climb:
    r"""The runs to make: :math:`x_k = x_0 + k\,s\,d`, d the fitted gradient, or its signs.

    Parameters
    ----------
    model, factors
        See `first_order_model`.
    points : int
        At most as many runs, the start counted; the path ends where a factor meets its limit.
    equal_steps : bool
        Every factor moves by the same coded step (the source paper's way) rather than in proportion to its
        slope.
    start : "centre", "worst" or dict
        The centre of the design, its corner of lowest (descending: highest) predicted response, or {factor:
        physical level}.
    step : (str, float), optional
        A factor and its physical step (its size; the sign follows from the fit). Default: equal parts from
        the start to the first limit.
    limits : dict, optional
        {factor: (lowest, highest) physical level}; default: the design's own range.
    ascend : bool
        Climb, or descend.

    Raises
    ------
    InputError
        If all slopes are zero, the start lies outside the limits, or the step's factor does not move.
    """
    slopes = np.array([model.coefficients[factor.name] for factor in factors])
    if not np.any(slopes):
        raise InputError("all slopes of the fit are zero: the climb has no direction")
    if points < 2:
        raise InputError(f"a path of {points} points was asked for: expected 2 or more")
    uphill = (1 if ascend else -1) * slopes
    direction = np.sign(uphill) if equal_steps else uphill / np.abs(uphill).max()
    origin = _origin(start, direction, factors)
    room = _room(origin, direction, factors, limits or {})
    size = room / (points - 1) if step is None else _step_size(step, direction, factors)
    count = min(points, int(np.floor(room / size + 1e-9)) + 1)
    coded = origin + size * np.arange(count)[:, None] * direction
    physical = {factor.name: factor.physical(coded[:, i]) for i, factor in enumerate(factors)}
    cosine = direction @ uphill / np.linalg.norm(direction) / np.linalg.norm(uphill)
    return Climb(
        factors=list(factors),
        points=pd.DataFrame(
            {factor.name: rounded(physical[factor.name], max(abs(factor.low), abs(factor.high))) for factor in factors}
        ),
        coded=coded,
        predicted=model.predict(coded),
        prediction_intervals=[interval(model, point, alpha).prediction for point in coded],
        equal_steps=equal_steps,
        points_asked=points,
        angle_to_gradient_deg=float(np.degrees(np.arccos(np.clip(cosine, -1, 1)))),
        level=1 - alpha,
    )


def _origin(start, direction: np.ndarray, factors: list[Factor]) -> np.ndarray:
    if start == "centre":
        return np.zeros(len(factors))
    if start == "worst":
        return -np.sign(direction)
    missing = [factor.name for factor in factors if factor.name not in start]
    if missing:
        raise InputError(f"the start of the climb gives no level of {missing[0]!r}: expected one of every factor moved")
    return np.array([float(factor.coded(start[factor.name])) for factor in factors])


def _room(origin, direction, factors, limits) -> float:
    """How many times the direction fits between the origin and the first limit."""
    room = np.inf
    for x, d, factor in zip(origin, direction, factors, strict=True):
        low, high = sorted(factor.coded(limits.get(factor.name, (factor.low, factor.high))))
        if not low - 1e-9 <= x <= high + 1e-9:
            raise InputError(
                f"the climb starts at {factor.name} = {factor.physical(x):g}, outside its limits "
                f"{factor.physical(low):g} to {factor.physical(high):g}: start inside, or widen the limits"
            )
        if d:
            room = min(room, ((high if d > 0 else low) - x) / d)
    if room < 1e-9:
        raise InputError("the climb starts at a limit it would cross at once: start elsewhere, or widen the limits")
    return float(room)


def _step_size(step: tuple[str, float], direction, factors) -> float:
    name, size = step
    index = next((i for i, factor in enumerate(factors) if factor.name == name), None)
    if index is None or not direction[index] or not size:
        moved = ", ".join(factor.name for factor in factors)
        raise InputError(f"a step of {size:g} of {name!r} was asked for: expected a factor that moves ({moved}), not 0")
    return float(abs(size / (factors[index].half_range * direction[index])))
