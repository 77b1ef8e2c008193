"""Sections through a model: how two factors act together, and how far each alone moves the response."""

from itertools import combinations

import numpy as np

from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.factors import Factor, with_unit
from pellet_study.doe.importance import important_pairs
from pellet_study.doe.labels import drawable, folded
from pellet_study.doe.linear_model import LinearFit
from pellet_study.doe.optimum import TargetSet
from pellet_study.doe.plackett_burman import Screening
from pellet_study.output import style
from pellet_study.output.style import letters_in, new_axes, new_panels, panels_in_a_line, room_for, styled

POINTS = 41
MOST = 3  # factors whose pairs are drawn
ENDS = ((-1.0, "-", style.MODEL, "o"), (1.0, "--", style.MEASURED, "s"))
"""Coded level of the second factor, and how its line is drawn."""


def where_words(factors: list[Factor], rest, name, left_out=(), found: TargetSet | None = None) -> str:
    """The levels of the factors that a figure does not move, and what that setting is."""
    held = [f"{name(f.name)} = {_level(f, float(rest[i]))}" for i, f in enumerate(factors) if i not in left_out]
    if not held:
        return ""
    which = "centre" if found is None else ("recommended" if found.reachable else "nearest to the target")
    return f"{', '.join(held)} ({which})"


def _level(factor: Factor, coded: float) -> str:
    return factor.word(coded) if factor.levels else f"{float(factor.physical(coded)):.4g}"


@styled
def interactions(surface: Surface, found: TargetSet | None = None, unit: str = "", ax=None):
    """Predicted response against one factor at both ends of another, for the pairs of the most important factors.

    The others are at the recommended setting, else at the centre. Parallel lines do not interact; the bands are confidence
    intervals of the mean at level 1 - alpha, the p value is that of the product of the two.
    """
    from matplotlib.ticker import MaxNLocator

    table, model = surface.table, surface.model
    name = drawable(table.names, str(table.response.name))
    rest = found.coded if found is not None else np.zeros(len(table.factors))
    pairs = important_pairs(model, MOST)
    figure, grid = new_panels(len(pairs), (3.3, 3.2), (5.0, 0.8), ax=ax, sharey=True)
    letters = letters_in(room_for(figure, ax, len(pairs)) - 0.9)
    line = np.linspace(-1, 1, POINTS)
    for axes, (i, j) in zip(grid, pairs, strict=True):
        first, second = table.factors[i], table.factors[j]
        for end, dash, colour, _ in ENDS:
            points = np.tile(np.asarray(rest, dtype=float), (POINTS, 1))
            points[:, i], points[:, j] = line, end
            predicted = model.predict(points)
            text = f"{name(second.name)} = {second.word(end)}"
            axes.plot(first.physical(line), predicted, dash, color=colour, label=folded(text, letters))
            half = half_width(model, points, surface.alpha)
            if half is not None:
                axes.fill_between(
                    first.physical(line), predicted - half, predicted + half, color=colour, alpha=0.15, lw=0
                )
        product = next((t for t, of in model.terms.items() if sorted(of) == sorted((i, j))), None)
        p = surface.p.get(product) if product else None
        said = "no product of the two in the model" if product is None else f"product: p {_p(p)}"
        others = where_words(table.factors, rest, name, (i, j), found)
        lines = [folded(text, letters_in(room_for(figure, ax, len(pairs)) - 0.9, 0.83)) for text in (said, others)]
        axes.set_title("\n".join(text for text in lines if text), fontsize="small")
        axes.set_xlabel(folded(name(first.label), letters))
        axes.xaxis.set_major_locator(MaxNLocator(4))
        axes.legend(fontsize="small")
    response = name(with_unit(str(table.response.name), unit))
    for axes in grid[:: panels_in_a_line(len(pairs))]:
        axes.set_ylabel(folded(response, letters_in(2.4)))
    return figure


def half_width(model: LinearFit, points, alpha: float) -> np.ndarray | None:
    """Half width of the confidence interval of the mean at coded points; None where the fit leaves no residual."""
    if model.mean_square_error is None:
        return None
    from scipy.special import stdtrit

    return stdtrit(model.df_residual, 1 - alpha / 2) * np.sqrt(model.mean_square_error * model.leverage(points))


def _p(p: float | None) -> str:
    return "not known" if p is None else ("< 0.001" if p < 0.001 else f"{p:.3f}")


@styled
def observed_interactions(screening: Screening, unit: str = "", ax=None):
    """Means of the runs at both ends of two factors, for the pairs of the factors of the largest effects.

    A screening does not fit products, and its main effects carry shares of them (`Screening.aliases`): lines that are not
    parallel say where to look, not what acts.
    """
    table = screening.table
    name = drawable(table.names, str(table.response.name))
    ranked = sorted(range(len(table.names)), key=lambda i: -abs(screening.effects[table.names[i]]))[:MOST]
    pairs = list(combinations(ranked, 2))
    coded, response = table.coded.to_numpy(dtype=float), table.response.to_numpy(dtype=float)
    figure, grid = new_panels(len(pairs), (3.3, 3.0), (5.0, 0.8), ax=ax, sharey=True)
    letters = letters_in(room_for(figure, ax, len(pairs)) - 0.9)
    for axes, (i, j) in zip(grid, pairs, strict=True):
        first, second = table.factors[i], table.factors[j]
        for end, dash, colour, marker in ENDS:
            chosen = [np.isclose(coded[:, i], x, atol=0.2) & np.isclose(coded[:, j], end, atol=0.2) for x in (-1, 1)]
            means = [response[rows].mean() if rows.any() else np.nan for rows in chosen]
            text = f"{name(second.name)} = {second.word(end)}"
            axes.plot([-1, 1], means, linestyle=dash, marker=marker, color=colour, label=folded(text, letters))
        axes.set_xticks([-1, 1], [folded(first.word(x), letters // 2) for x in (-1, 1)])
        axes.set_xlim(-1.25, 1.25)
        said = "means of the runs" + (
            "; main effects carry shares of products" if any(screening.aliases.values()) else ""
        )
        axes.set_title(folded(said, letters), fontsize="small")
        axes.set_xlabel(folded(name(first.label), letters))
        axes.legend(fontsize="small")
    for axes in grid[:: panels_in_a_line(len(pairs))]:
        axes.set_ylabel(folded(name(with_unit(str(table.response.name), unit)), letters_in(2.4)))
    return figure


@styled
def perturbation(surface: Surface, found: TargetSet | None = None, unit: str = "", ax=None):
    """Predicted response as each factor alone leaves the recommended setting (else the centre), in coded units."""
    table, model = surface.table, surface.model
    name = drawable(table.names, str(table.response.name))
    rest = np.asarray(found.coded if found is not None else np.zeros(len(table.factors)), dtype=float)
    figure, axes = new_axes(5.6, 4.4, ax=ax)
    for i, factor in enumerate(table.factors):
        look = style.look_of([factor.name], table.names)
        points = np.tile(rest, (POINTS, 1))
        points[:, i] = np.linspace(-1, 1, POINTS)
        axes.plot(
            points[:, i] - rest[i],
            model.predict(points),
            color=look.colour,
            linestyle=look.dash,
            label=name(factor.label),
        )
    axes.axvline(0, color=style.LINE, linewidth=0.8)
    axes.plot(0, model.predict(rest[None])[0], "*", color="white", markeredgecolor="black", markersize=12, zorder=5)
    letters = letters_in(figure.get_figwidth() - 1.0)
    axes.set_xlabel(folded("deviation from the reference (coded units)", letters))
    axes.set_ylabel(folded(name(with_unit(str(table.response.name), unit)), letters_in(2.8)))
    said = "reference: " + where_words(table.factors, rest, name, (), found)
    axes.set_title(folded(said, letters_in(figure.get_figwidth() - 0.9, 0.83)), fontsize="small")
    handles, labels = axes.get_legend_handles_labels()
    style.legend_below(figure, handles, labels, columns=3, ax=ax)
    return figure
