"""Figures of the powder calibration."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from pellet_study.output import style
from pellet_study.output.style import LIGHT, MEASURED, MODEL, folded, letters_in, room_for, styled
from pellet_study.powder.decisions import PathSetting
from pellet_study.powder.plan import OBSERVABLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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
