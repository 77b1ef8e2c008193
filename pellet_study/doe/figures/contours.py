"""Response surfaces: contours over every pair of factors, and the surface in 3-D beside labelled contours."""

from itertools import combinations

import numpy as np

from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.factors import with_unit
from pellet_study.doe.figures.sections import where_words
from pellet_study.doe.importance import important_pairs
from pellet_study.doe.labels import LONG, drawable, folded, letter
from pellet_study.doe.optimum import TargetSet
from pellet_study.errors import InputError
from pellet_study.output.style import (
    legend_below,
    letters_in,
    new_panels,
    page_size,
    panels_in_a_line,
    room_for,
    styled,
)


@styled
def surface_contours(surface: Surface, found: TargetSet | None = None, unit: str = "", shown=None, ax=None):
    """The response over every pair of factors, the others at the recommended point (else at the centre).

    With a target its contour is drawn, and the band of its uncertainty hatched. `shown` picks pairs of places among the
    factors; the colours are those of all pairs, so that figures of some can stand side by side. `ax` are as many axes as pairs.
    """
    from matplotlib.ticker import MaxNLocator

    name = drawable(surface.table.names, str(surface.table.response.name))
    factors, pairs = surface.table.factors, list(combinations(range(len(surface.table.factors)), 2))
    shown = pairs if shown is None else list(shown)
    rest = found.coded if found is not None else np.zeros(len(factors))
    columns = panels_in_a_line(len(shown))
    figure, grid = new_panels(len(shown), (3.9 + 0.8 / columns, 3.9), (4.7, 0.0), ax=ax)
    letters = letters_in(room_for(figure, ax, len(shown)) - 0.7 - 0.8 / columns)
    planes = [_plane(surface, pair, rest) for pair in pairs]
    levels = MaxNLocator(12).tick_values(min(z.min() for *_, z in planes), max(z.max() for *_, z in planes))
    for axes, pair in zip(grid, shown, strict=True):
        x, y, z = planes[pairs.index(pair)]
        colours = axes.contourf(x, y, z, levels=levels, cmap="cividis")
        axes.contour(x, y, z, levels=levels, colors="white", linewidths=0.4, alpha=0.6)
        _draw_target(axes, x, y, z, found)
        _draw_runs(axes, surface, pair, rest, found)
        axes.set_xlabel(folded(name(factors[pair[0]].label), letters))
        axes.set_ylabel(folded(name(factors[pair[1]].label), letters))
        axes.set_title(folded(where_words(factors, rest, name, pair, found), letters), fontsize="medium")
        axes.xaxis.set_major_locator(MaxNLocator(5))
    figure.colorbar(
        colours,
        ax=grid,
        label=folded(name(with_unit(str(surface.table.response.name), unit)), letters_in(0.7 * figure.get_figheight())),
    )
    drawn = [planes[pairs.index(pair)][2] for pair in shown]
    _surface_legend(figure, found, unit, min(z.min() for z in drawn), max(z.max() for z in drawn), ax)
    return figure


def _plane(surface: Surface, pair, rest):
    """Physical grid of two factors and the predicted response on it."""
    line = np.linspace(-1, 1, 81)
    x, y = np.meshgrid(line, line)
    points = np.tile(rest, (x.size, 1)).astype(float)
    points[:, pair[0]], points[:, pair[1]] = x.ravel(), y.ravel()
    first, second = (surface.table.factors[i] for i in pair)
    return first.physical(x), second.physical(y), surface.model.predict(points).reshape(x.shape)


def _draw_target(axes, x, y, z, found: TargetSet | None) -> None:
    if found is None:
        return
    band = [found.target - found.uncertainty, found.target + found.uncertainty]
    if found.uncertainty and z.min() <= band[1] and z.max() >= band[0]:
        axes.contourf(x, y, z, levels=band, colors="none", hatches=["//"])
        inside = [level for level in band if z.min() <= level <= z.max()]
        if inside:
            axes.contour(x, y, z, levels=inside, colors="white", linewidths=1.0, linestyles="--")
    if not z.min() <= found.target <= z.max():
        return
    axes.contour(x, y, z, levels=[found.target], colors="white", linewidths=5)
    axes.contour(x, y, z, levels=[found.target], colors="black", linewidths=2.4)


def _draw_runs(axes, surface: Surface, pair, rest, found: TargetSet | None) -> None:
    factors = [surface.table.factors[i] for i in pair]
    coded = surface.table.coded.to_numpy()[:, list(pair)]
    axes.plot(
        factors[0].physical(coded[:, 0]),
        factors[1].physical(coded[:, 1]),
        "o",
        color="white",
        markeredgecolor="black",
        markersize=5,
        clip_on=False,
        zorder=5,
    )
    if found is not None:
        point = [float(factor.physical(rest[i])) for i, factor in zip(pair, factors, strict=True)]
        axes.plot(*point, "*", color="white", markeredgecolor="black", markersize=15, zorder=6, clip_on=False)


def _surface_legend(figure, found: TargetSet | None, unit: str, lowest: float, highest: float, ax=None) -> None:
    """The legend of panes that show responses from lowest to highest: of what is drawn in them only."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list = [
        Line2D([], [], marker="o", color="white", markeredgecolor="black", linestyle="", label="runs (projected)")
    ]
    if found is not None:
        if lowest <= found.target <= highest:
            handles.append(
                Line2D([], [], color="black", linewidth=2.4, label=f"target {found.target:g} {unit}".strip())
            )
        if (
            found.uncertainty
            and lowest <= found.target + found.uncertainty
            and highest >= found.target - found.uncertainty
        ):
            handles.append(Patch(facecolor="0.85", hatch="//", label=f"within ±{found.uncertainty:g} {unit}".strip()))
        handles.append(
            Line2D(
                [],
                [],
                marker="*",
                color="white",
                markeredgecolor="black",
                markersize=13,
                linestyle="",
                label="recommended" if found.reachable else f"nearest to {found.target:g} {unit}".strip(),
            )
        )
    legend_below(figure, handles, [handle.get_label() for handle in handles], columns=len(handles), ax=ax)


@styled
def surface_3d(surface: Surface, found: TargetSet | None = None, unit: str = "", pairs=None, ax=None):
    """The surface in 3-D beside its labelled contours, for each pair of the three most important factors.

    The others are at the recommended setting, else at the centre; the star is that setting. `pairs` are other pairs of places
    among the factors. `ax` are two axes for each pair, of which the first is one of projection "3d".
    """
    from matplotlib.ticker import MaxNLocator

    table = surface.table
    name = drawable(table.names, str(table.response.name))
    pairs = important_pairs(surface.model) if pairs is None else list(pairs)
    rest = found.coded if found is not None else np.zeros(len(table.factors))
    figure, grid, inches = _solids_and_flats(len(pairs), ax)
    letters = letters_in(inches - 1.1)
    response = folded(name(with_unit(str(table.response.name), unit)), letters_in(inches - 0.8, 0.83))
    planes = [_plane(surface, pair, rest) for pair in pairs]
    levels = MaxNLocator(9).tick_values(min(z.min() for *_, z in planes), max(z.max() for *_, z in planes))
    for solid, flat, pair, (x, y, z) in zip(grid[::2], grid[1::2], pairs, planes, strict=True):
        labels = [name(table.factors[i].label) for i in pair]
        tags = list(labels)
        if max(map(len, labels)) > LONG:  # the edges of a solid have room for a letter
            tags = [letter(i) for i in pair]
            labels = [f"{tag}: {label}" for tag, label in zip(tags, labels, strict=True)]
        labels = [folded(label, letters) for label in labels]
        solid.plot_surface(x, y, z, cmap="cividis", vmin=levels[0], vmax=levels[-1], rcount=25, ccount=25, linewidth=0.2,
                           edgecolor=(1, 1, 1, 0.4))  # fmt: skip
        solid.set(xlabel=tags[0], ylabel=tags[1])
        solid.set_title(response, fontsize="small")
        solid.set_zlim(levels[0], levels[-1])
        solid.view_init(elev=25, azim=-130)
        solid.set_box_aspect(None, zoom=0.95)
        for axis in (solid.xaxis, solid.yaxis, solid.zaxis):
            axis.set_major_locator(MaxNLocator(4))
        flat.contourf(x, y, z, levels=levels, cmap="cividis", alpha=0.35)
        drawn = flat.contour(x, y, z, levels=levels, colors="black", linewidths=0.7)
        flat.clabel(drawn, fontsize="small", fmt="%g")
        _draw_target(flat, x, y, z, found)
        _draw_runs(flat, surface, pair, rest, found)
        flat.set(xlabel=labels[0], ylabel=labels[1])
        flat.xaxis.set_major_locator(MaxNLocator(5))
        others = where_words(table.factors, rest, name, pair, found)
        flat.set_title(folded(others, letters_in(inches - 0.8, 0.83)), fontsize="small")
    _surface_legend(figure, found, unit, min(z.min() for *_, z in planes), max(z.max() for *_, z in planes), ax)
    return figure


def _solids_and_flats(pairs: int, ax):
    """A figure, its axes, a solid and a flat one for each pair, and the inches of width of one; in a column below each other."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    if ax is not None:
        given = list(np.ravel(ax))
        if len(given) != 2 * pairs:
            raise InputError(
                f"ax: this figure has {2 * pairs} panels, got {len(given)} axes; give a list of {2 * pairs}"
            )
        return given[0].figure, given, room_for(given[0].figure, given)
    width, height = page_size(8.4, 3.7)
    columns = 2 if width > 5 else 1
    lines = 2 * pairs // columns
    figure = Figure(figsize=(width, height * lines + 0.4), layout="constrained")
    FigureCanvasAgg(figure)
    projections = ("3d", None) * pairs
    grid = [figure.add_subplot(lines, columns, k, projection=kind) for k, kind in enumerate(projections, start=1)]
    return figure, grid, width / columns
