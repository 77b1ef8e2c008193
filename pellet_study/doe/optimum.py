"""The set of settings that hit a target, one recommended point of it, and what would shrink the set.

One response and k factors: the settings that meet a target form a sheet of k - 1 dimensions, thickened by the
uncertainty of the target and of the fit. A single "optimum" is a choice among them, and its rule must be
stated.
"""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.linear_model import Interval, columns_of, interval
from pellet_study.errors import InputError

SAMPLE_POWER = 16
"""2^16 Sobol points fill the box; volume fractions are good to about 0.001."""

RULES = {
    "centre": "nearest to the centre of the box in coded units",
    "insensitive": "smallest slope of the predicted response in coded units",
}


@dataclass(frozen=True)
class Extent:
    """Range of a factor on the settings that meet the target, coded and physical (in coded order)."""

    name: str
    coded: tuple[float, float]
    physical: tuple[float, float]

    @property
    def unidentified(self) -> bool:
        """Whether the response leaves the factor anywhere in its range."""
        return self.coded[0] < -0.999 and self.coded[1] > 0.999


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
        Whether the predicted response takes the target somewhere in the box.
    lowest, highest : float
        Predicted response over the box.
    fraction : float
        Share of the box whose predicted response lies within +- uncertainty of the target.
    fraction_one_percent : float
        The same within 1 % of the target.
    fraction_not_excluded : float
        Share where target and prediction differ by no more than both uncertainties together.
    extents : list of Extent
        Empty where the target is not reachable.
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
    lowest: float
    highest: float
    fraction: float
    fraction_one_percent: float
    fraction_not_excluded: float
    extents: list[Extent]
    rule: str
    coded: np.ndarray
    physical: dict[str, float]
    prediction: Interval
    measurements: list[Measurement]

    @property
    def unidentified(self) -> list[str]:
        return [extent.name for extent in self.extents if extent.unidentified]


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
    sample = _sample(len(surface.table.names))
    predicted = surface.model.predict(sample)
    distance = np.abs(predicted - target)
    lowest, highest = (_extreme(surface, sample, predicted, sign) for sign in (1, -1))
    reachable = lowest <= target <= highest
    coded = _recommended(surface, sample, distance, target, rule, reachable)
    variance = _squared_half_width(surface, surface.model.leverage(sample))
    return TargetSet(
        surface=surface,
        target=float(target),
        uncertainty=float(uncertainty),
        reachable=reachable,
        lowest=lowest,
        highest=highest,
        fraction=float(np.mean(distance <= uncertainty)),
        fraction_one_percent=float(np.mean(distance <= 0.01 * abs(target))),
        fraction_not_excluded=float(np.mean(distance**2 <= uncertainty**2 + variance)),
        extents=_extents(surface, sample, distance, target) if reachable else [],
        rule=rule,
        coded=coded,
        physical={f.name: float(f.physical(x)) for f, x in zip(surface.table.factors, coded, strict=True)},
        prediction=interval(surface.model, coded, surface.alpha),
        measurements=_measurements(surface, sample, distance, uncertainty, coded) if reachable else [],
    )


def _sample(n_factors: int) -> np.ndarray:
    """Evenly spread points of the box: the same ones every time."""
    from scipy.stats.qmc import Sobol

    return 2 * Sobol(n_factors, scramble=False).random_base2(SAMPLE_POWER) - 1


def _minimise(surface: Surface, objective, jacobian, start, target=None) -> np.ndarray:
    """A minimum of the objective over the box, on the target's sheet where a target is given."""
    from scipy.optimize import minimize

    constraint = {
        "type": "eq",
        "fun": lambda x: surface.model.predict(x)[0] - target,
        "jac": lambda x: surface.model.gradient(x)[0],
    }
    found = minimize(
        objective,
        np.clip(start, -1, 1),
        jac=jacobian,
        bounds=[(-1, 1)] * len(start),
        constraints=[] if target is None else [constraint],
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-12},
    )
    return np.clip(found.x, -1, 1)


def _extreme(surface: Surface, sample, predicted, sign: int) -> float:
    """Lowest (sign 1) or highest (sign -1) predicted response of the box."""
    starts = sample[np.argsort(sign * predicted)[:3]]
    found = [
        _minimise(
            surface,
            lambda x: sign * surface.model.predict(x)[0],
            lambda x: sign * surface.model.gradient(x)[0],
            x,
        )
        for x in starts
    ]
    values = surface.model.predict(np.vstack([found, starts]))
    return float(values.min() if sign > 0 else values.max())


def _near(distance: np.ndarray) -> np.ndarray:
    """Sample points next to the sheet: the hundredth of the box nearest to the target."""
    return np.argsort(distance)[: len(distance) // 100]


def _on_target(surface: Surface, point, target: float) -> bool:
    scale = max(1e-9, float(np.ptp(surface.model.response)))
    return abs(surface.model.predict(point)[0] - target) < 1e-5 * scale


def _extents(surface: Surface, sample, distance, target: float) -> list[Extent]:
    """Exact range of every factor on the sheet, optimised from the outermost sample points."""
    near = sample[_near(distance)]
    extents = []
    for i, factor in enumerate(surface.table.factors):
        unit = np.eye(len(surface.table.factors))[i]
        ends = []
        for sign in (1, -1):
            starts = near[np.argsort(sign * near[:, i])[[0, 1, 2, len(near) // 20]]]
            found = [
                _minimise(surface, lambda x, s=sign, j=i: s * x[j], lambda x, s=sign, e=unit: s * e, x, target)
                for x in starts
            ]
            values = [x[i] for x in found if _on_target(surface, x, target)] or [starts[0, i]]
            ends.append(float(min(values) if sign > 0 else max(values)))
        extents.append(Extent(factor.name, tuple(ends), tuple(float(factor.physical(end)) for end in ends)))
    return extents


def _recommended(surface: Surface, sample, distance, target: float, rule: str, reachable: bool) -> np.ndarray:
    """The point of the sheet that the rule picks; where there is no sheet the point nearest in response."""
    if not reachable:
        start = sample[np.argmin(distance)]
        return _minimise(
            surface,
            lambda x: (surface.model.predict(x)[0] - target) ** 2,
            lambda x: 2 * (surface.model.predict(x)[0] - target) * surface.model.gradient(x)[0],
            start,
        )
    objective, jacobian = _objective(surface, rule)
    near = sample[_near(distance)]
    starts = near[np.argsort([objective(x) for x in near])[[0, 1, 5, 20]]]
    found = [
        x
        for x in (_minimise(surface, objective, jacobian, x, target) for x in starts)
        if _on_target(surface, x, target)
    ]
    return min(found or [starts[0]], key=objective)


def _objective(surface: Surface, rule: str):
    """What the rule makes small, and its gradient (None: by differences)."""
    if rule == "centre":
        return lambda x: float(x @ x), lambda x: 2 * x
    return lambda x: float(np.sum(surface.model.gradient(x)[0] ** 2)), None


def _squared_half_width(surface: Surface, leverage) -> np.ndarray:
    """Squared half width of the confidence interval of the mean; 0 where the model leaves no residual."""
    variance, df = surface.model.mean_square_error, surface.model.df_residual
    if not variance:
        return np.zeros_like(leverage)
    from scipy.special import stdtrit

    return stdtrit(df, 1 - surface.alpha / 2) ** 2 * variance * leverage


def _measurements(surface: Surface, sample, distance, uncertainty: float, recommended) -> list[Measurement]:
    """What is left of the box after a better target, or after the best further run; best first."""
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
    model, inverse = surface.model, surface.model.inverse
    points, runs = columns_of(near, model.terms), columns_of(candidates, model.terms)
    gain = (points @ inverse @ runs.T) ** 2 / (1 + model.leverage(candidates))
    best = int(np.argmax(gain.mean(axis=0)))
    lowered = (columns_of(sample, model.terms) @ inverse @ runs[best]) ** 2 / (1 + model.leverage(candidates[best])[0])
    return candidates[best], leverage - lowered
