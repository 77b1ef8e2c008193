"""The set of settings that hit a target, one recommended point of it, and what would shrink the set.

One response and k factors: the settings that meet a target form a sheet of k - 1 dimensions, thickened by the
uncertainty of the target and of the fit. A single "optimum" is a choice among them, and its rule must be
stated.
"""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe import coded_box
from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.box_search import between, lowest_and_highest, minimise
from pellet_study.doe.intervals import Interval, interval
from pellet_study.doe.terms import columns_of
from pellet_study.errors import InputError

RULES = {
    "centre": "nearest to the centre of the box in coded units",
    "insensitive": "smallest slope of the predicted response in coded units",
}


@dataclass(frozen=True)
class Measurement:
    """A further measurement and the fraction of the box that would be left."""

    what: str
    coded: np.ndarray | None
    fraction: float


@dataclass(frozen=True)
class TargetSet:
    """The settings of the box that hit a target.

    Attributes
    ----------
    target, uncertainty : float
        In the response's unit.
    reachable : bool
        Whether the predicted response takes the target itself somewhere in the box.
    reachable_within_uncertainty : bool
        Whether it comes as near to it as the uncertainty.
    lowest, highest : float
        Predicted response over the box.
    fraction : float
        Share of the box whose predicted response lies within +- uncertainty of the target.
    fraction_one_percent : float
        The same within 1 % of the target.
    fraction_not_excluded : float or None
        Share where target and prediction differ by no more than both uncertainties together; None where the fit
        leaves no residual and so has no uncertainty.
    extents : list of Extent
        Of the settings within +- uncertainty (the sheet where it is 0); empty where there are none.
    sheet_extents : list of Extent
        Of the settings that take the target exactly; empty where it is not reachable.
    rule : str
        A key of `RULES`.
    coded : ndarray (n_factors,)
        The recommended point; where the target is not reachable the setting that comes nearest to it.
    physical : dict
        {factor: level} of it.
    prediction : Interval
    measurements : list of Measurement
        What could be measured next, best first.
    """

    surface: Surface
    target: float
    uncertainty: float
    reachable: bool
    reachable_within_uncertainty: bool
    lowest: float
    highest: float
    fraction: float
    fraction_one_percent: float
    fraction_not_excluded: float | None
    extents: list[coded_box.Extent]
    sheet_extents: list[coded_box.Extent]
    rule: str
    coded: np.ndarray
    physical: dict[str, float]
    prediction: Interval
    measurements: list[Measurement]

    @property
    def unidentified(self) -> list[str]:
        """Factors whose whole range meets the target within its uncertainty."""
        return [extent.name for extent in self.extents if extent.unidentified]

    @property
    def rule_in_words(self) -> str:
        """How the recommended point was picked."""
        return RULES[self.rule] if self.reachable else "nearest to the target in predicted response"


def target_set(surface: Surface, target: float, uncertainty: float = 0.0, rule: str = "centre") -> TargetSet:
    """All settings of the box [-1, 1]^k that meet a target, and one recommended among them.

    Parameters
    ----------
    surface : Surface
    target, uncertainty : float
        Response wanted and its uncertainty (0 or more), response unit.
    rule : str
        "centre" or "insensitive", see `RULES`.

    Raises
    ------
    InputError
        If the rule is unknown or the uncertainty negative or not finite.
    """
    if rule not in RULES:
        raise InputError(f"the rule {rule!r} is unknown: expected {' or '.join(RULES)}")
    if not np.isfinite(target) or not np.isfinite(uncertainty) or uncertainty < 0:
        raise InputError(f"target {target} +- {uncertainty}: expected finite numbers, the uncertainty 0 or more")
    sample = coded_box.sample(len(surface.table.names))
    predicted = surface.model.predict(sample)
    distance = np.abs(predicted - target)
    lowest, highest = lowest_and_highest(surface.model, sample)
    reachable = lowest <= target <= highest
    within = lowest <= target + uncertainty and highest >= target - uncertainty
    coded = _recommended(surface, sample, distance, target, rule, reachable)
    sheet = _extents(surface, sample, distance, target) if reachable else []
    extents = _widened(surface, sample, distance, target, uncertainty, coded, sheet) if within else []
    if uncertainty:
        extents = coded_box.with_alone(
            extents, surface.table.factors, coded, lambda x: np.abs(surface.model.predict(x) - target) <= uncertainty
        )
    not_excluded = None
    if not surface.saturated:
        variance = _squared_half_width(surface, surface.model.leverage(sample))
        not_excluded = _fraction(distance, uncertainty**2 + variance)
    return TargetSet(
        surface=surface,
        target=float(target),
        uncertainty=float(uncertainty),
        reachable=reachable,
        reachable_within_uncertainty=within,
        lowest=lowest,
        highest=highest,
        fraction=float(np.mean(distance <= uncertainty)),
        fraction_one_percent=float(np.mean(distance <= 0.01 * abs(target))),
        fraction_not_excluded=not_excluded,
        extents=extents,
        sheet_extents=sheet,
        rule=rule,
        coded=coded,
        physical={f.name: float(f.physical(x)) for f, x in zip(surface.table.factors, coded, strict=True)},
        prediction=interval(surface.model, coded, surface.alpha),
        measurements=_measurements(surface, sample, distance, uncertainty, coded) if within else [],
    )


def _least(surface: Surface, objective, jacobian, start, target=None, uncertainty: float = 0.0) -> np.ndarray:
    """A minimum of the objective over the box, within +- uncertainty of the target where one is given."""
    low, high = (-np.inf, np.inf) if target is None else (target - uncertainty, target + uncertainty)
    return np.clip(minimise(objective, jacobian, start, between(surface.model, low, high, len(start))), -1, 1)


def _near(distance: np.ndarray) -> np.ndarray:
    """Sample points next to the sheet: the hundredth of the box nearest to the target."""
    return np.argsort(distance)[: len(distance) // 100]


def _on_target(surface: Surface, point, target: float, uncertainty: float = 0.0) -> bool:
    scale = max(1e-9, float(np.ptp(surface.model.response)))
    return abs(surface.model.predict(point)[0] - target) < uncertainty + 1e-5 * scale


def _extents(surface: Surface, sample, distance, target: float) -> list[coded_box.Extent]:
    """Exact range of every factor on the sheet, optimised from the outermost sample points."""
    near = sample[_near(distance)]
    extents = []
    for i, factor in enumerate(surface.table.factors):
        ends = []
        for sign in (1, -1):
            values = _ends(surface, near, i, sign, target) or [sign * (sign * near[:, i]).min()]
            ends.append(float(sign * min(sign * x for x in values)))
        extents.append(coded_box.extent(factor, ends))
    return extents


def _ends(surface: Surface, points, i: int, sign: int, target: float, uncertainty: float = 0.0) -> list[float]:
    """Lowest (sign 1) or highest (sign -1) levels of factor i on the target, from several outermost points."""
    unit = np.eye(len(surface.table.factors))[i]
    places = np.minimum([0, 1, 2, len(points) // 20], len(points) - 1)
    starts = points[np.argsort(sign * points[:, i])[places]]
    found = [_least(surface, lambda x: sign * x[i], lambda x: sign * unit, x, target, uncertainty) for x in starts]
    return [float(x[i]) for x in found if _on_target(surface, x, target, uncertainty)]


def _widened(surface: Surface, sample, distance, target, uncertainty, recommended, sheet) -> list[coded_box.Extent]:
    """Range of every factor on the settings within +- uncertainty; at least the sheet and the sample points."""
    if not uncertainty:
        return sheet
    inside = np.vstack([sample[distance <= uncertainty], recommended])
    extents = []
    for i, factor in enumerate(surface.table.factors):
        known = [*inside[:, i], *(sheet[i].coded if sheet else ())]
        low = min([*known, *_ends(surface, inside, i, 1, target, uncertainty)])
        high = max([*known, *_ends(surface, inside, i, -1, target, uncertainty)])
        extents.append(coded_box.extent(factor, [float(low), float(high)]))
    return extents


def _recommended(surface: Surface, sample, distance, target: float, rule: str, reachable: bool) -> np.ndarray:
    """The point of the sheet that the rule picks; where there is no sheet the point nearest in response."""
    if not reachable:
        start = sample[np.argmin(distance)]
        return _least(
            surface,
            lambda x: (surface.model.predict(x)[0] - target) ** 2,
            lambda x: 2 * (surface.model.predict(x)[0] - target) * surface.model.gradient(x)[0],
            start,
        )
    objective, jacobian = _objective(surface, rule)
    near = sample[_near(distance)]
    starts = near[np.argsort([objective(x) for x in near])[[0, 1, 5, 20]]]
    found = [
        x for x in (_least(surface, objective, jacobian, x, target) for x in starts) if _on_target(surface, x, target)
    ]
    return min(found or [starts[0]], key=objective)


def _objective(surface: Surface, rule: str):
    """What the rule makes small, and its gradient (None: by differences)."""
    if rule == "centre":
        return lambda x: float(x @ x), lambda x: 2 * x
    return lambda x: float(np.sum(surface.model.gradient(x)[0] ** 2)), None


def _squared_half_width(surface: Surface, leverage) -> np.ndarray:
    """Squared half width of the confidence interval of the mean; for a model that leaves a residual."""
    variance, df = surface.model.mean_square_error, surface.model.df_residual
    from scipy.special import stdtrit

    return stdtrit(df, 1 - surface.alpha / 2) ** 2 * variance * leverage


def _measurements(surface: Surface, sample, distance, uncertainty: float, recommended) -> list[Measurement]:
    """What is left of the box after a better target, or after the best further run; best first.

    Nothing can be said where the model leaves no residual.
    """
    if surface.saturated:
        return []
    now = surface.model.leverage(sample)
    options = []
    if uncertainty:
        squared = uncertainty**2 / 4 + _squared_half_width(surface, now)
        options.append(
            Measurement(
                "halve the uncertainty of the target (4 times the readings)",
                None,
                _fraction(distance, squared),
            )
        )
    if surface.model.mean_square_error:
        point, leverage = _best_run(surface, sample, now, distance, recommended)
        squared = uncertainty**2 + _squared_half_width(surface, leverage)
        options.append(Measurement("one more run", point, _fraction(distance, squared)))
    return sorted(options, key=lambda option: option.fraction)


def _fraction(distance, squared) -> float:
    return float(np.mean(distance**2 <= squared))


def _best_run(surface: Surface, sample, leverage, distance, recommended) -> tuple[np.ndarray, np.ndarray]:
    r"""The run that lowers the variance on the sheet most, and the leverages after it.

    A run at c lowers the leverage at x by :math:`(x'(X'X)^{-1}c)^2 / (1 + c'(X'X)^{-1}c)`. Candidates are the
    design's own points, the recommended one and a spread of points next to the sheet.
    """
    near = sample[_near(distance)]
    candidates = np.vstack(
        [np.unique(surface.table.coded.to_numpy(), axis=0), recommended, near[:: max(1, len(near) // 60)]]
    )
    model, size = surface.model, len(surface.model.terms)
    inverse = model.inverse[:size, :size]
    points, runs = columns_of(near, model.terms), columns_of(candidates, model.terms)
    gain = (points @ inverse @ runs.T) ** 2 / (1 + model.leverage(candidates))
    best = int(np.argmax(gain.mean(axis=0)))
    lowered = (columns_of(sample, model.terms) @ inverse @ runs[best]) ** 2 / (1 + model.leverage(candidates[best])[0])
    return candidates[best], leverage - lowered
