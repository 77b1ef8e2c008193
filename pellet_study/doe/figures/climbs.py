"""A path of steepest climb: what it predicts, and the runs made on it."""

import numpy as np
import pandas as pd

from pellet_study.doe.factors import Factor, with_unit
from pellet_study.doe.labels import drawable, folded
from pellet_study.doe.path_turning import Turning
from pellet_study.doe.steepest_climb import Climb
from pellet_study.output import style
from pellet_study.output.style import letters_in, new_axes, styled

SHORT = 8
"""Letters of a name that still fits below a point of a path."""


@styled
def climb_path(
    climb: Climb,
    unit: str = "",
    target: float | None = None,
    names=None,
    runs: pd.DataFrame | None = None,
    turning: Turning | None = None,
    ax=None,
    response: str = "response",
):
    """Predicted response along a path with its prediction interval; `names` are those of all factors of the table.

    The levels stand below each point; long names once, below them all, in the same order. Runs made on the path (factors in
    physical units, the response last) stand where they lie along it, the best of them as `turning` found it.
    """
    name = drawable([factor.name for factor in climb.factors] if names is None else names, response)
    figure, axes = _axes(climb.factors, len(climb.predicted), name, ax)
    steps = np.arange(1, len(climb.predicted) + 1)
    axes.plot(steps, climb.predicted, "o-", color=style.MODEL, label="predicted")
    if climb.prediction_intervals[0] is not None:
        low, high = np.array(climb.prediction_intervals).T
        axes.fill_between(
            steps,
            low,
            high,
            color=style.LIGHT,
            alpha=0.5,
            label=f"{100 * climb.level:.6g} % prediction interval of a run",
        )
    if runs is not None:
        _draw_runs(axes, _along(climb, runs), runs.iloc[:, -1].to_numpy(dtype=float), turning)
    _target(axes, target)
    _levels(axes, steps, climb.points, climb.factors, name, figure.get_figwidth())
    _finish(figure, axes, name(with_unit(response, unit)), ax)
    return figure


@styled
def path_runs(
    runs: pd.DataFrame,
    turning: Turning,
    factors: list[Factor],
    unit: str = "",
    target: float | None = None,
    names=None,
    ax=None,
):
    """The runs made on a path against its points, without the fit that it came from; replicates stand above one another.

    Parameters
    ----------
    runs : DataFrame (n_runs, n_factors + 1)
        Physical levels and, last, the response.
    factors : list of Factor
        Of the screening, for their units.
    names : list of str, optional
        Of all factors of the table.
    """
    columns = list(runs.columns[:-1])
    moved = [factor for factor in factors if factor.name in columns and runs[factor.name].nunique() > 1]
    name = drawable(columns if names is None else names, str(runs.columns[-1]))
    levels = runs[[factor.name for factor in moved]].to_numpy(dtype=float)
    place, place_of = 0, np.empty(len(runs))
    for before, row in zip([None, *turning.order], turning.order, strict=False):
        scale = np.ptp(levels, axis=0)
        place += before is None or bool((np.abs(levels[row] - levels[before]) > 0.01 * scale).any())
        place_of[row] = place
    figure, axes = _axes(moved, place, name, ax)
    response = runs.iloc[:, -1].to_numpy(dtype=float)
    means = [response[place_of == k].mean() for k in range(1, place + 1)]
    axes.plot(range(1, place + 1), means, color=style.LINE, linewidth=1, label="mean of the runs of a point", zorder=1)
    _draw_runs(axes, place_of, response, turning)
    _target(axes, target)
    firsts = [int(np.flatnonzero(place_of == k)[0]) for k in range(1, place + 1)]
    points = runs.iloc[firsts][[factor.name for factor in moved]].reset_index(drop=True)
    _levels(axes, np.arange(1, place + 1), points, moved, name, figure.get_figwidth())
    _finish(figure, axes, name(with_unit(str(runs.columns[-1]), unit)), ax)
    return figure


def _axes(factors: list[Factor], points: int, name, ax):
    long = _long(factors, points, name)
    return new_axes(max(6.0, 1.0 + 0.8 * points), 4.2 + 0.16 * len(factors) * (1 + long), ax=ax)


def _long(factors: list[Factor], points: int, name) -> bool:
    width = style.page_size(max(6.0, 1.0 + 0.8 * points), 1.0)[0]
    room = min(SHORT, letters_in((width - 1.0) / points, 0.8) - 8)
    return max(len(name(factor.name)) for factor in factors) > room


def _along(climb: Climb, runs: pd.DataFrame) -> np.ndarray:
    """Where runs lie along a path, in its points from 1."""
    coded = np.column_stack([factor.coded(runs[factor.name]) for factor in climb.factors])
    step = climb.coded[1] - climb.coded[0]
    return 1 + (coded - climb.coded[0]) @ step / (step @ step)


def _draw_runs(axes, places, response, turning: Turning | None) -> None:
    axes.plot(places, response, "s", color=style.MEASURED, label="runs", zorder=4)
    if turning is not None:
        best = [place for place in turning.order if np.isclose(places[place], places[turning.best])]
        axes.plot(
            places[best[:1]], [response[best].mean()], "*", color="white", markeredgecolor="black", markersize=14,
            label="best point" if len(best) == 1 else "best point (mean)", zorder=5,
        )  # fmt: skip


def _target(axes, target: float | None) -> None:
    if target is not None:
        axes.axhline(target, color="black", linestyle="--", label=f"target {target:g}")


def _levels(axes, steps, points: pd.DataFrame, factors: list[Factor], name, width: float) -> None:
    """The physical levels below each point, and what they are of."""
    long, labels = _long(factors, len(points), name), [name(factor.label) for factor in factors]
    lines = [
        "\n".join(f"{value:.4g}" if long else f"{name(key)} {value:.4g}" for key, value in row.items())
        for row in points[[factor.name for factor in factors]].to_dict(orient="records")
    ]
    axes.set_xticks(steps, lines, fontsize="x-small")
    letters = letters_in(width - 0.8)
    if long:
        text = "points of the path; levels from above:\n" + "\n".join(folded(label, letters) for label in labels)
    else:
        text = folded("point of the path, physical levels (" + ", ".join(labels) + ")", letters)
    axes.set_xlabel(text)


def _finish(figure, axes, response: str, ax) -> None:
    axes.set_ylabel(folded(response, letters_in(figure.get_figheight() - 1.6)))
    style.legend_below(figure, *axes.get_legend_handles_labels(), ax=ax)
