"""A printed climb beside the first-order fit it was made from."""

import numpy as np

from pellet_study.doe.design_table import read_numbers
from pellet_study.doe.intervals import interval
from pellet_study.doe.linear_model import LinearFit, fit
from pellet_study.doe.terms import linear_terms
from pellet_study.errors import InputError
from pellet_study.paper.described.analyses import Fit
from pellet_study.paper.described.description import Climb
from pellet_study.paper.judging.path import steps_as_gradient
from pellet_study.paper.verdicts import CONSISTENT, LEVEL, Item, judged


def climb(path: Climb, screening: Fit, target: float | None = None, lowest: bool = False) -> list[Item]:
    """Direction of the path, its runs beside the fit, and its best row.

    Parameters
    ----------
    target : float, optional
        The response wanted; without it the highest, or with `lowest` the lowest.

    Raises
    ------
    InputError
        If a column is no factor of the analysis, there are fewer than two points, or the best row is none of them.
    """
    frame, names = _read(path, screening)
    table = screening.table
    factors = [factor for name in names for factor in table.factors if factor.name == name]
    points = np.column_stack([factor.coded(frame[factor.name]) for factor in factors])
    model = fit(names, linear_terms(names), table.coded[names], table.response, screening.model.extra, table.blocks)
    slopes = np.array([model.coefficients[name] for name in names])
    kept = int(np.argmax(np.abs(slopes) * (points[1] != points[0])))
    items = [steps_as_gradient(path.name, model, factors, points, kept)] if slopes[kept] else []
    last = frame.iloc[:, -1].to_numpy(dtype=float)
    score = -last if path.holds == "error" or (lowest and target is None) else last
    if path.holds == "response":
        items += _beside_fit(path, model, points, last)
        if target is not None:
            score = -np.abs(last - target)
    return items + _best(path, last, int(np.argmax(score)))


def _read(path: Climb, screening: Fit):
    """The points and the names of their factors."""
    frame, _, _ = read_numbers(path.table)
    names, known = list(frame.columns[:-1]), screening.table.names
    if set(names) - set(known) or len(frame) < 2:
        raise InputError(
            f"{path.table}: expected columns of {path.analysis} ({', '.join(known)}), the {path.holds} last, and two "
            f"points or more; found {', '.join(map(str, frame.columns))} and {len(frame)} points"
        )
    if path.best is not None and not 1 <= path.best <= len(frame):
        raise InputError(f"[[climb]] {path.name}, key 'best': expected a row from 1 to {len(frame)}; found {path.best}")
    return frame, names


def _best(path: Climb, last: np.ndarray, best: int) -> list[Item]:
    """The row from which the paper goes on, where it says so."""
    if path.best is None:
        return []
    turned = 0 < best < len(last) - 1
    reason = f"{path.holds} {last[best]:g}; " + (
        "the path turns there" if turned else "that is an end of the path, which has not turned: it should go on"
    )
    fine = path.best == best + 1 and turned
    return [judged(path.name, "best row", f"{path.best}", f"{best + 1}", fine, reason)]


def _beside_fit(path: Climb, model: LinearFit, points: np.ndarray, last: np.ndarray) -> list[Item]:
    """How far along the path the plane holds; no printed number, so nothing to contradict."""
    found = [interval(model, [point], LEVEL) for point in points]
    if found[0].prediction is None:
        return []
    inside = [one.prediction[0] <= y <= one.prediction[1] for one, y in zip(found, last, strict=True)]
    rows = "; ".join(
        f"row {k} {y:g}, predicted {one.predicted:.4g} ({one.prediction[0]:.4g} to {one.prediction[1]:.4g})"
        for k, (one, y) in enumerate(zip(found, last, strict=True), start=1)
    )
    value = f"{sum(inside)} of {len(inside)} rows"
    item = "rows inside the 95 % prediction interval of the first-order fit"
    reason = rows if all(inside) else f"the plane does not describe the path; {rows}"
    return [Item(path.name, item, "", value, None, CONSISTENT, reason)]
