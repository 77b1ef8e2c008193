"""Is the fit to be trusted: fitted against observed, residuals against fitted, run order and normal scores."""

import numpy as np

from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.design_table import DesignTable
from pellet_study.doe.factors import with_unit
from pellet_study.doe.labels import drawable, folded
from pellet_study.doe.linear_model import LinearFit
from pellet_study.doe.run_diagnostics import Runs
from pellet_study.output import style
from pellet_study.output.style import letters_in, new_axes, new_panels, room_for, styled


@styled
def predicted_observed(surface: Surface, unit: str = "", ax=None):
    """Fitted against observed response, replicated centre points marked."""
    name = drawable(surface.table.names, str(surface.table.response.name))
    figure, axes = new_axes(4.8, 4.4, ax=ax)
    observed, fitted = surface.model.response, surface.runs.fitted
    centre = (np.abs(surface.table.coded.to_numpy()) < 0.05).all(axis=1)
    ends = [min(observed.min(), fitted.min()), max(observed.max(), fitted.max())]
    axes.plot(ends, ends, color="black", linewidth=1, label="equal")
    axes.plot(observed[~centre], fitted[~centre], "o", color=style.MODEL, label="runs")
    if centre.any():
        axes.plot(
            observed[centre], fitted[centre], "s", color=style.LIGHT, markeredgecolor="black", label="centre runs"
        )
    letters = letters_in(min(figure.get_figwidth(), figure.get_figheight()) - 1.0)
    axes.set_xlabel(folded(name(with_unit(f"observed {surface.table.response.name}", unit)), letters))
    axes.set_ylabel(folded(name(with_unit(f"fitted {surface.table.response.name}", unit)), letters))
    axes.legend()
    return figure


@styled
def residual_plots(table: DesignTable, model: LinearFit, runs: Runs, unit: str = "", alpha: float = 0.05, ax=None):
    """Residuals against fitted, against the order of the runs where the table has one, and against normal scores.

    They are studentized externally where the fit leaves two degrees of freedom or more; then the limits are those that the
    largest of all n exceeds by chance with probability alpha (Bonferroni: Student's t on one degree less, alpha / 2n). Normal
    scores are Blom's, (i - 3/8)/(n + 1/4).
    """
    from scipy.special import ndtri, stdtrit

    name = drawable(table.names, str(table.response.name))
    studentized = runs.studentized is not None
    values = np.asarray(runs.studentized if studentized else runs.residuals, dtype=float)
    shown = np.isfinite(values)
    limit = float(stdtrit(model.df_residual - 1, 1 - alpha / (2 * shown.sum()))) if studentized else None
    centre = (np.abs(table.coded.to_numpy(dtype=float)) < 0.05).all(axis=1)
    ordered = table.order is not None
    figure, grid = new_panels(2 + ordered, (3.3, 3.0), (5.0, 0.7), ax=ax)
    letters = letters_in(room_for(figure, ax, len(grid)) - 0.9)
    response = str(table.response.name)
    sideways = [(name(with_unit(f"fitted {response}", unit)), runs.fitted)]
    sideways += [(f"order of the runs ({name(table.order.name)})", table.order.to_numpy())] if ordered else []
    drawn = {}
    for axes, (label, x) in zip(grid, sideways, strict=False):
        axes.axhline(0, color=style.LINE, linewidth=0.8)
        for sign in (1, -1) if limit is not None else ():
            drawn[f"limit of the largest of {shown.sum()}, level {alpha:g}"] = axes.axhline(
                sign * limit, color=style.MEASURED, linestyle="--", linewidth=1
            )
        if label.startswith("order"):
            along = np.argsort(x)
            axes.plot(x[along], values[along], color=style.LINE, linewidth=0.8, zorder=1)
        _draw(axes, x, values, centre, drawn)
        axes.set_xlabel(folded(label, letters))
    ranked = np.argsort(values[shown])
    scores = ndtri((np.arange(1, shown.sum() + 1) - 0.375) / (shown.sum() + 0.25))
    last = grid[-1]
    scale = 1.0 if studentized else float(np.std(values[shown])) or 1.0
    ends = np.array([scores[0], scores[-1]])
    drawn["normal"] = last.plot(ends, scale * ends, color="black", linewidth=1)[0]
    _draw(last, scores, values[shown][ranked], centre[shown][ranked], drawn)
    last.set_xlabel("normal score (-)")
    what = "studentized residual (-)" if studentized else name(with_unit("residual", unit))
    for axes in grid:
        axes.set_ylabel(folded(what, letters_in(2.4)))
        axes.margins(y=0.1)
    style.legend_below(figure, drawn.values(), drawn.keys(), columns=4, ax=ax)
    return figure


def _draw(axes, x, y, centre, drawn: dict) -> None:
    drawn["runs"] = axes.plot(x[~centre], y[~centre], "o", color=style.MODEL)[0]
    if centre.any():
        drawn["centre runs"] = axes.plot(x[centre], y[centre], "s", color=style.LIGHT, markeredgecolor="black")[0]
