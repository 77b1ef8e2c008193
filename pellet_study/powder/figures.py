"""Figures of the powder calibration."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from pellet_study.output import style
from pellet_study.output.style import LIGHT, MEASURED, MODEL, folded, letters_in, room_for, styled
from pellet_study.powder.decisions import PathSetting
from pellet_study.powder.plan import NAMES, OBSERVABLE
from pellet_study.powder.posterior import LEVEL, Posterior

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BINS = 30  # of a factor's range, in `corner`


@styled
def climb(
    runs: pd.DataFrame, names: list[str], measured: tuple[float, float | None] | None, ax: "Axes | None" = None
) -> "Figure":
    """Angles of the heaps along a path in several factors, the measured angle beside."""
    at = runs.groupby(names).ngroup() + 1
    figure, axes = style.new_axes(max(6.0, 0.8 + 0.72 * at.nunique()), 4.0, ax=ax)
    axes.errorbar(
        at, runs[OBSERVABLE], runs["direction_error_deg"], fmt="o", color=MODEL, capsize=3, label="simulated heap"
    )
    mean = runs[OBSERVABLE].groupby(at).mean()
    if len(mean) < len(runs):
        axes.plot(mean.index, mean, "_-", color=MODEL, markersize=14, label="their mean")
    if measured:
        value, sd = measured
        if sd:
            axes.axhspan(value - sd, value + sd, color=LIGHT, alpha=0.5, zorder=0, label=f"±{sd:g} deg, its sd")
        axes.axhline(value, color=MEASURED, linestyle="--", label=f"measured {value:g} deg")
    points = runs.drop_duplicates(names).sort_values(names)
    axes.set_xticks(mean.index, ["\n".join(f"{n} {row[n]:.3g}" for n in names) for _, row in points.iterrows()])
    axes.set_xlabel(folded(f"point of the path (levels of {', '.join(names)})", letters_in(room_for(figure, ax) - 0.8)))
    axes.set_ylabel("repose angle (deg)")
    axes.legend()
    return figure


@styled
def path(runs: pd.DataFrame, setting: PathSetting, measured: tuple[float, float], ax: "Axes | None" = None) -> "Figure":
    """Angles of the heaps of a calibration in few heaps against their place on the path, with the line and what was found."""
    value, sd = measured
    figure, axes = style.new_axes(6.0, 4.0, ax=ax)
    axes.errorbar(
        runs["place"],
        runs[OBSERVABLE],
        runs["direction_error_deg"],
        fmt="o",
        color=MODEL,
        capsize=3,
        label="simulated heap",
    )
    t = setting.place
    ends = np.array([min(runs["place"].min(), t), max(runs["place"].max(), t)]) + [-0.1, 0.1]
    axes.plot(ends, setting.predicted_deg + setting.slope_deg * (ends - t), color="black", label="straight line")
    axes.axhspan(value - sd, value + sd, color=LIGHT, alpha=0.5, zorder=0, label=f"±{sd:g} deg, its sd")
    axes.axhline(value, color=MEASURED, linestyle="--", label=f"measured {value:g} deg")
    name = "setting found" if setting.met else "nearest setting"
    interval = [[half] for half in np.abs(np.array(setting.validation.interval_deg) - setting.predicted_deg)]
    axes.errorbar(t, setting.predicted_deg, interval, fmt="none", color="black", capsize=5, label="its 95 % interval")
    axes.plot(t, setting.predicted_deg, "*", color="white", markeredgecolor="black", markersize=14, label=name)
    said = f"place on the path of {', '.join(setting.factors)} (-1 to 1: the box of the screening)"
    axes.set_xlabel(folded(said, letters_in(room_for(figure, ax) - 0.8)))
    axes.set_ylabel("repose angle (deg)")
    handles, labels = axes.get_legend_handles_labels()
    style.legend_below(figure, handles, labels, columns=3, ax=ax)
    return figure


@styled
def heaps(
    angles: np.ndarray, mean: float, interval: Sequence[float], measured: float, margin: float, ax: "Axes | None" = None
) -> "Figure":
    """Angles of heaps of different seeds beside the measured angle and its margin."""
    figure, axes = style.new_axes(5.6, 3.2, ax=ax)
    axes.axhspan(measured - margin, measured + margin, color=style.BAND, zorder=0, label=f"margin ±{margin:g}")
    axes.axhline(measured, color=MEASURED, linestyle="--", label=f"measured {measured:g}")
    axes.axhspan(*interval, color=LIGHT, alpha=0.7, zorder=1)
    axes.axhline(mean, color=MODEL, label=f"mean {mean:.2f}, 95 %")
    axes.plot(np.arange(1, len(angles) + 1), angles, "o", color=MODEL, markeredgecolor="black", zorder=3)
    axes.set_xticks(np.arange(1, len(angles) + 1)[:: 1 + len(angles) // 15])
    axes.set_xlabel("heap (-)")
    axes.set_ylabel("repose angle (deg)")
    handles, labels = axes.get_legend_handles_labels()
    style.legend_below(figure, handles, labels, columns=3, ax=ax)
    return figure


@styled
def corner(found: Posterior, first: Posterior, alone: str, setting: np.ndarray) -> "Figure":
    """Each factor's posterior, and each pair's region that holds 95 % of it; paler those of the first reading, `alone`.

    The star is a setting (coded), that recommended.
    """
    factors, size = found.factors, len(found.factors)
    figure, panels = style.new_axes(2.2 * size, 2.0 * size + 0.5, nrows=size, ncols=size, squeeze=False)
    each = [(found, MODEL)] if found is first else [(first, LIGHT), (found, MODEL)]
    for i, j in np.ndindex(size, size):
        axes = panels[i, j]
        if j > i:
            axes.set_visible(False)
            continue
        axes.set_xlim(factors[j].low, factors[j].high)
        if i == j:
            for one, color in each:
                axes.stairs(*_histogram(one, [i]), color=color, fill=one is not found)
            axes.set_ylim(0, None)
            axes.set_yticks([])
        else:
            for one, color in each:
                height, across, up = _histogram(one, [j, i])
                level = _level(height)
                middle = [(edges[1:] + edges[:-1]) / 2 for edges in (across, up)]
                axes.contourf(*middle, height.T, levels=[level, height.max() + level], colors=[color], alpha=0.75)
            star = [factors[k].physical(setting[k]) for k in (j, i)]
            axes.plot(*star, "*", color="white", markeredgecolor="black", clip_on=False)
            axes.set_ylim(factors[i].low, factors[i].high)
        axes.tick_params(labelbottom=i == size - 1, labelleft=j == 0 and i > 0)
        if i == size - 1:
            axes.set_xlabel(folded(f"{factors[j].name}, {NAMES[factors[j].name]} ({factors[j].unit or '-'})", 18))
        if j == 0 and i > 0:
            axes.set_ylabel(folded(f"{factors[i].name}, {NAMES[factors[i].name]} ({factors[i].unit or '-'})", 18))
    from matplotlib.patches import Patch

    names = ["by all readings"] if found is first else [f"by {alone} alone", "by all readings"]
    style.legend_below(figure, [Patch(color=color) for _, color in each], names)
    return figure


def _histogram(one: Posterior, which: list[int]) -> tuple[np.ndarray, ...]:
    """Weight in each bin of one or two factors, and the edges of the bins, physical."""
    edges = [np.linspace(one.factors[k].low, one.factors[k].high, BINS + 1) for k in which]
    points = np.column_stack([one.factors[k].physical(one.coded[:, k]) for k in which])
    height, _ = np.histogramdd(points, edges, weights=one.weights)
    return height, *edges


def _level(height: np.ndarray) -> float:
    """The least height of those bins which hold 95 % of the weight, highest first."""
    ordered = np.sort(height, axis=None)[::-1]
    return float(ordered[np.searchsorted(np.cumsum(ordered), LEVEL * ordered.sum())])
