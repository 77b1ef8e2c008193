"""The figure of a bench sweep."""

from typing import TYPE_CHECKING

import numpy as np

from pellet_study.bench import printed
from pellet_study.bench.chain import BenchResult
from pellet_study.output import style
from pellet_study.output.style import MEASURED, MODEL, PAPER, label, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@styled
def sweep(result: BenchResult, ax: "Axes | None" = None) -> "Figure":
    """A bench sweep: level means, parabola with its 95 % band, measurement and root; the paper's rows where they are printed."""
    from scipy.stats import t

    stage, curve, paper = result.stage, result.curve, printed.sweep(result.stage)
    figure, axes = style.new_axes(5.6, 3.8, ax=ax)
    x = np.linspace(curve.low, curve.high, 200)
    band = t.ppf(0.975, curve.residual_df) * curve.standard_error(x)
    axes.fill_between(x, curve.at(x) - band, curve.at(x) + band, color=MODEL, alpha=0.2, lw=0)
    axes.plot(x, curve.at(x), color=MODEL, label=f"fit, $R^2$ = {curve.r2:.4f} (band 95 %)")
    axes.errorbar(
        result.sweep[stage.parameter],
        result.sweep[stage.observable],
        2 * result.sweep["standard_error"],
        fmt="o",
        color=MODEL,
        capsize=2,
        label="YADE, mean over seeds $\\pm$ 2 s.e.",
    )
    if paper is not None:
        axes.plot(paper.x, paper.y, "s", mfc="none", color=PAPER, label="source paper (EDEM)")
        axes.plot(x, paper.curve.at(x), ":", color=PAPER)
    axes.axhline(result.reading.value, color=MEASURED, ls="--", lw=1.2, label=f"measured {result.reading.value:g}")
    if result.value is not None:
        axes.axvline(result.value, color=MEASURED, lw=0.8)
        axes.axvspan(*result.interval, color=MEASURED, alpha=0.12, lw=0)
        axes.plot([result.value], [result.reading.value], "*", ms=13, color=MEASURED, mec="black", mew=0.5,
                label=f"root {stage.symbol} = {result.value:.4f}")  # fmt: skip
    axes.set_xlabel(label(stage.parameter))
    axes.set_ylabel(label(stage.observable))
    axes.legend()
    return figure
