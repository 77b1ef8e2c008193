"""The figure of a bench sweep: colour-blind safe, readable in grey, units on every axis."""

from pathlib import Path

import numpy as np

COLOURS = {"model": "#0072B2", "measured": "#D55E00", "paper": "#555555"}  # Okabe & Ito's palette
LABELS = {
    "rebound_height_mm": "rebound height (mm)",
    "slip_angle_deg": "slip angle (deg)",
    "roll_distance_mm": "rolling distance (mm)",
    "seed_powder_restitution": "restitution seed-powder $a_1$ (-)",
    "seed_powder_static_friction": "static friction seed-powder $a_2$ (-)",
    "seed_powder_rolling_friction": "rolling friction seed-powder $a_3$ (-)",
}


def axes(width: float = 5.2, height: float = 3.8):
    """A figure with one pair of axes in the project's look."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    ax = figure.add_subplot()
    ax.spines[["top", "right"]].set_visible(False)
    return figure, ax


def save(figure, file: Path) -> Path:
    """Write a figure as PNG, the same bytes for the same content."""
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=150, metadata={"Software": None})
    return file


def sweep(result, paper_x=None, paper_y=None, paper_curve=None):
    """A bench sweep: level means, parabola with its 95 % band, measurement and root, the paper's curve beside.

    Parameters
    ----------
    result : bench.Calibrated
    paper_x, paper_y : the paper's printed rows, where there are any
    paper_curve : quadratic.Quadratic through them
    """
    from scipy.stats import t

    stage, curve = result.stage, result.curve
    figure, ax = axes()
    x = np.linspace(curve.low, curve.high, 200)
    band = t.ppf(0.975, curve.residual_df) * curve.standard_error(x)
    ax.fill_between(x, curve.at(x) - band, curve.at(x) + band, color=COLOURS["model"], alpha=0.2, lw=0)
    ax.plot(x, curve.at(x), color=COLOURS["model"], label=f"fit, $R^2$ = {curve.r2:.4f} (band 95 %)")
    ax.errorbar(
        result.sweep[stage.parameter],
        result.sweep[stage.observable],
        2 * result.sweep["standard_error"],
        fmt="o",
        color=COLOURS["model"],
        capsize=2,
        label="YADE, mean over seeds $\\pm$ 2 s.e.",
    )
    if paper_curve is not None:
        ax.plot(paper_x, paper_y, "s", mfc="none", color=COLOURS["paper"], label="source paper (EDEM)")
        ax.plot(x, paper_curve.at(x), ":", color=COLOURS["paper"])
    ax.axhline(
        result.reading.value, color=COLOURS["measured"], ls="--", lw=1.2, label=f"measured {result.reading.value:g}"
    )
    if result.value is not None:
        ax.axvline(result.value, color=COLOURS["measured"], lw=0.8)
        ax.axvspan(*result.interval, color=COLOURS["measured"], alpha=0.12, lw=0)
        ax.plot([result.value], [result.reading.value], "*", ms=13, color=COLOURS["measured"], mec="black", mew=0.5,
                label=f"root {stage.symbol} = {result.value:.4f}")  # fmt: skip
    ax.set_xlabel(LABELS[stage.parameter])
    ax.set_ylabel(LABELS[stage.observable])
    ax.legend(fontsize=7.5, frameon=False)
    return figure
