"""Where the runs made on a path turned, and the levels of the next design there."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from pellet_study.doe.factors import Factor, rounded
from pellet_study.doe.plackett_burman import Screening
from pellet_study.errors import InputError

SAME_POINT = 0.01
"""Runs nearer to each other than this share of the path are replicates of one point."""


@dataclass(frozen=True)
class Turning:
    """Where a path turned.

    Attributes
    ----------
    order : list of int
        Rows of the runs in the order along the path; replicates of a point stand together.
    best : int
        Row of the best run; of replicates, which count by their mean, the first.
    turned : bool
        False where the best run is the last (go on) or the first (the path never improved).
    at_start : bool
    centre : dict
        {factor: physical level} around which the next design should stand.
    next_factors : list of Factor
        Its levels: one step of the path to either side, -1 on the side of the start.
    point, points : int
        Place of the best point along the path, from 1, and how many distinct points there are.
    replicates : int
        Runs at the best point.
    fall, needed : float or None
        How far the response falls from the best point to the worst after it, and how far two points of one mean differ
        at most in 95 of 100 paths (one-sided t); None where the best is an end of the path or the scatter is not known.
    """

    order: list[int]
    best: int
    turned: bool
    at_start: bool
    centre: dict[str, float]
    next_factors: list[Factor]
    point: int = 0
    points: int = 0
    replicates: int = 1
    fall: float | None = None
    needed: float | None = None

    @property
    def within_scatter(self) -> bool:
        """Whether the points after the best are no worse than scatter explains."""
        return self.fall is not None and self.needed is not None and self.fall <= self.needed


def scatter_of(screening: Screening) -> tuple[float, int] | None:
    """Standard deviation of a run and its degrees of freedom: of the residual, of the replicates where the fit lacks something."""
    rows = {row["source"]: row for row in screening.anova}
    lacks = screening.lack_of_fit_p is not None and screening.lack_of_fit_p < screening.alpha
    for row in (rows.get("pure error") if lacks else None, rows["residual"]):
        if row and row["df"] and row["sum_of_squares"]:
            return float(np.sqrt(row["sum_of_squares"] / row["df"])), int(row["df"])
    return None


def turning(
    runs: pd.DataFrame,
    target: float | None = None,
    ascend: bool = True,
    units=None,
    scatter: tuple[float, int] | None = None,
) -> Turning:
    """Read the runs of a path back.

    Parameters
    ----------
    runs : DataFrame (n_runs, n_factors + 1)
        Physical levels and, last, the response; rows in any order along the line, the first row at its start.
        Replicates of a point are averaged.
    target : float, optional
        The response wanted: the best run is the nearest to it. Without it the highest (`ascend`) or lowest,
        as for a column of errors.
    units : dict, optional
        {factor: unit}.
    scatter : (float, int), optional
        Standard deviation of a run and its degrees of freedom (see `scatter_of`); a path has turned only where it falls by
        more than that explains. Without it any fall counts.

    Raises
    ------
    InputError
        If there are fewer than three distinct points, or they do not lie on one line.
    """
    names = list(runs.columns[:-1])
    levels, response = runs[names].to_numpy(dtype=float), runs.iloc[:, -1].to_numpy(dtype=float)
    if len(runs) < 3:
        raise InputError(f"the climb has {len(runs)} runs: expected 3 or more to tell whether it turned")
    scale = np.where(np.ptp(levels, axis=0) > 0, np.ptp(levels, axis=0), 1.0)
    along = _along(levels / scale, names)
    order = np.argsort(along, kind="stable")
    apart = np.diff(along[order]) > SAME_POINT * np.ptp(along)
    groups = np.split(order, np.flatnonzero(apart) + 1)
    if len(groups) < 3:
        raise InputError(
            f"the climb has runs at {len(groups)} points: expected 3 points or more to tell whether it turned"
        )
    means = np.array([response[group].mean() for group in groups])
    score = -np.abs(means - target) if target is not None else (means if ascend else -means)
    place = int(np.argmax(score))
    fall, needed = _fall(score, place, [len(group) for group in groups], scatter)
    best = int(groups[place][0])
    step = (levels[order[-1]] - levels[order[0]]) / (len(groups) - 1)
    return Turning(
        order=order.tolist(),
        best=best,
        turned=0 < place < len(groups) - 1 and not (needed is not None and fall <= needed),
        at_start=place == 0,
        centre={name: float(levels[best, i]) for i, name in enumerate(names)},
        next_factors=[
            Factor(
                name,
                float(rounded(levels[best, i] - step[i], np.abs(levels[:, i]).max())),
                float(rounded(levels[best, i] + step[i], np.abs(levels[:, i]).max())),
                (units or {}).get(name, ""),
            )
            for i, name in enumerate(names)
            if step[i]
        ],
        point=place + 1,
        points=len(groups),
        replicates=len(groups[place]),
        fall=fall,
        needed=needed,
    )


def _fall(score, place: int, sizes: list[int], scatter) -> tuple[float, float | None] | tuple[None, None]:
    """The largest fall after the best point, and what scatter explains of it."""
    if not 0 < place < len(score) - 1:
        return None, None
    last = place + 1 + int(np.argmin(score[place + 1 :]))
    fall = float(score[place] - score[last])
    if scatter is None:
        return fall, None
    from scipy.special import stdtrit

    sd, df = scatter
    return fall, float(stdtrit(df, 0.95) * sd * np.sqrt(1 / sizes[place] + 1 / sizes[last]))


def _along(levels: np.ndarray, names: list[str]) -> np.ndarray:
    """Positions of the runs along their line."""
    offsets = levels - levels[0]
    _, singular, directions = np.linalg.svd(offsets, full_matrices=False)
    if singular[0] == 0 or (len(singular) > 1 and singular[1] > 0.05 * singular[0]):
        raise InputError(
            f"the runs do not lie on one line in {', '.join(names)}: expected the points of one path, one "
            "run a row, the response in the last column"
        )
    along = offsets @ directions[0]
    return along if along.sum() >= 0 else -along
