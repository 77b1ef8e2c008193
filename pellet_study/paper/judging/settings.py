"""A printed optimum: what the surface predicts there, whether the target can be met, by how many settings, and at the centre."""

from itertools import product

import numpy as np

from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.design_table import DesignTable
from pellet_study.doe.intervals import Interval, interval
from pellet_study.doe.optimum import TargetSet
from pellet_study.paper.verdicts import INCONSISTENT, LEVEL, REPRODUCED, Item, compare, judged

Span = tuple[float, float]


def at_point(surface: Surface, point: dict[str, float], halves: dict[str, float], level: float = LEVEL):
    """Prediction at a printed setting and its span over the rounding of its levels.

    Parameters
    ----------
    point, halves : dict
        {factor: physical level}, {factor: half a unit of its last printed digit}.

    Returns
    -------
    coded, predicted, span : list of float, Interval, (float, float)
    """
    factors = surface.table.factors
    corners = [
        [float(f.coded(point[f.name] + sign * halves[f.name])) for f, sign in zip(factors, signs, strict=True)]
        for signs in product((-1, 1), repeat=len(factors))
    ]
    coded = [float(f.coded(point[f.name])) for f in factors]
    span = surface.model.predict(corners)
    return coded, interval(surface.model, [coded], level), (float(span.min()), float(span.max()))


def prediction(section: str, item: str, printed: str, coded: list[float], predicted: Interval, span: Span) -> Item:
    """The printed response at a setting beside the prediction there."""
    reason = f"coded {', '.join(f'{x:.3f}' for x in coded)}; "
    if predicted.confidence:
        reason += (
            f"95 % confidence {predicted.confidence[0]:.4f} to {predicted.confidence[1]:.4f}, "
            f"prediction {predicted.prediction[0]:.4f} to {predicted.prediction[1]:.4f}; "
        )
    reason += f"rounding of the optimum spans {span[0]:.4f} to {span[1]:.4f}"
    return compare(section, item, printed, predicted.predicted, reason, span)


def reach(section: str, found: TargetSet, unit: str = "") -> list[Item]:
    """Whether the target can be met in the box, and by one setting only."""
    extents = "; ".join(f"{e.name} {e.coded[0]:.3f} to {e.coded[1]:.3f}" for e in found.sheet_extents)
    unique = not found.sheet_extents or all(e.coded[1] - e.coded[0] < 1e-3 for e in found.sheet_extents)
    unidentified = [e.name for e in found.sheet_extents if e.unidentified]
    return [
        Item(
            section,
            f"{found.target} reachable in the box",
            "yes",
            found.highest,
            None,
            REPRODUCED if found.reachable else INCONSISTENT,
            f"highest predicted response {found.highest:.6f}{_stationary(found.surface)}",
        ),
        judged(
            section,
            "the best combination is unique",
            "yes",
            f"{len(found.sheet_extents) - 1}-dimensional sheet" if found.sheet_extents else "no setting",
            unique,
            f"one equation, {len(found.sheet_extents)} unknowns; coded extents {extents}; "
            f"{100 * found.fraction:.1f} % of the box lies within +-{found.uncertainty} {unit} of "
            f"{found.target}, {100 * found.fraction_one_percent:.1f} % within 1 %; not identified: "
            f"{', '.join(unidentified) or 'none'}"
            if found.sheet_extents
            else f"predicted responses run from {found.lowest:.6g} to {found.highest:.6g}: none is {found.target}",
        ),
    ]


def _stationary(surface: Surface) -> str:
    """Where the surface is flat, in words."""
    top = surface.stationary
    if top is None:
        return ""
    inside = bool(np.all(np.abs(top.coded) <= 1))
    return (
        f"; the stationary point {', '.join(f'{x:.4f}' for x in top.coded)} is a {top.kind} "
        f"{'inside' if inside else 'outside'} the box"
    )


def new_run(runs, values) -> tuple[list[float], list[float]]:
    """t and p of each value as one new run beside replicated ones."""
    from scipy.special import stdtr

    n = len(runs)
    width = np.std(runs, ddof=1) * np.sqrt(1 + 1 / n)
    statistics = [float(abs(value - np.mean(runs)) / width) for value in values]
    return statistics, [float(2 * stdtr(n - 1, -t)) for t in statistics]


def centre(section: str, table: DesignTable, target: float, verified: float | None = None) -> list[Item]:
    """The centre runs beside the target; none where the centre was not replicated.

    A verified optimum counts as closer where it gains more than the centre runs scatter.
    """
    runs = table.response[(table.coded == 0).all(axis=1)]
    if len(runs) < 2 or runs.std() == 0:
        return []
    mean, p = runs.mean(), new_run(runs, [target])[1][0]
    off = f"{100 * abs(mean - target) / abs(target):.3f} % off" if target else f"{abs(mean - target):.3g} off"
    reason = f"centre runs {mean:.3f} +- {runs.std():.4f}: {off}"
    if verified is not None:
        gain = abs(mean - target) - abs(verified - target)
        words = f"closer by {gain:.4g}" if gain > runs.std() else "no closer"
        reason += f"; the verified optimum ({verified}) is {words}"
    return [judged(section, "centre of the box and target", f"{target}", mean, p > LEVEL, reason, mean - target)]
