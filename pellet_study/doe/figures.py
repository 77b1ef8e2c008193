"""Figures of the designs: Pareto and half-normal plots, response surfaces, fitted against observed, a climb.

The look is that of `pellet_study.output.style`; matplotlib is imported when a figure is asked for.
"""

from itertools import combinations
from pathlib import Path

import numpy as np

from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.factors import with_unit
from pellet_study.doe.labels import LONG, drawable, folded
from pellet_study.doe.lenth import Lenth
from pellet_study.doe.optimum import TargetSet
from pellet_study.doe.plackett_burman import Screening
from pellet_study.doe.steepest_climb import Climb, places_on
from pellet_study.output import style
from pellet_study.output.style import new_axes, styled

CLIMB_LONG = 8
"""Letters of a name that still fits below a point of a path."""

DARK, LIGHT, ACCENT = style.MODEL, style.LIGHT, style.MEASURED


@styled
def pareto(screening: Screening, unit: str = ""):
    """Sizes of the effects with their 5 % margins: of the t test, and Lenth's."""
    names = sorted(screening.effects, key=lambda name: abs(screening.effects[name]))
    shown = drawable(screening.table.names)
    written = [folded(shown(name)) for name in names]
    lines = sum(1 + name.count("\n") for name in written)
    figure, axes = new_axes(height=max(3.8, 1.6 + 0.19 * lines + 0.06 * len(names)))
    sizes = [abs(screening.effects[name]) for name in names]
    positive = [screening.effects[name] > 0 for name in names]
    bars = axes.barh(
        range(len(names)),
        sizes,
        color=[DARK if is_up else LIGHT for is_up in positive],
        edgecolor="black",
        linewidth=0.8,
    )
    for bar, is_up in zip(bars, positive, strict=True):
        bar.set_hatch("" if is_up else "///")
        axes.annotate(
            f"{bar.get_width():.3g}",
            (bar.get_width(), bar.get_y() + bar.get_height() / 2),
            (3, 0),
            textcoords="offset points",
            va="center",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1},
            zorder=5,
        )
    _margins(axes, screening)
    _legend_of_signs(axes)
    axes.set_yticks(range(len(names)), written)
    axes.set_xlabel(shown(with_unit("size of the effect (change from -1 to +1)", unit)))
    axes.set_ylabel("factor")
    axes.margins(x=0.12)
    return figure


def _margins(axes, screening: Screening) -> None:
    if not screening.saturated:
        from scipy.special import stdtrit

        error = 2 * max(value for name, value in screening.model.standard_errors.items() if name in screening.effects)
        limit = float(stdtrit(screening.model.df_residual, 1 - screening.alpha / 2) * error)
        axes.axvline(limit, color=ACCENT, linestyle="--", label=f"t test, level {screening.alpha:g}")
    if screening.lenth and screening.lenth.assumption_met:
        axes.axvline(screening.lenth.margin_of_error, color="black", linestyle=":", label="Lenth's margin of error")


def _legend_of_signs(axes) -> None:
    from matplotlib.patches import Patch

    handles, _ = axes.get_legend_handles_labels()
    signs = [
        Patch(facecolor=DARK, edgecolor="black", label="raises the response"),
        Patch(facecolor=LIGHT, edgecolor="black", hatch="///", label="lowers the response"),
    ]
    axes.figure.legend(handles=signs + handles, loc="outside lower center", ncols=2)


@styled
def half_normal(effects: dict[str, float], lenth: Lenth | None = None, unit: str = "", noise=(), names=None):
    """Half-normal plot: noise lies on a line through the origin, what acts stands to its right.

    `noise` are the contrasts of the design's unused columns: grey and without names, ranked with the others.
    `names` are those of the factors, where `effects` are of products too. Long names stand below, with a letter each.
    """
    from scipy.special import ndtri

    shown = drawable(list(effects) if names is None else names)
    written = {name: shown(name) for name in effects}
    long = any(len(name) > LONG for name in written.values())
    letters = {name: _letter(i) if long else text for i, (name, text) in enumerate(written.items())}
    figure, axes = new_axes(height=3.8 + 0.19 * len(effects) * long)
    ranked = sorted([(abs(size), name) for name, size in effects.items()] + [(abs(size), "") for size in noise])
    sizes, named = np.array([size for size, _ in ranked]), np.array([bool(name) for _, name in ranked])
    quantiles = ndtri(0.5 + 0.5 * (np.arange(1, len(sizes) + 1) - 0.5) / len(sizes))
    if len(noise):
        axes.plot(
            sizes[~named], quantiles[~named], "s", color="0.6", markersize=6, label="unused columns of the design"
        )
    axes.plot(sizes[named], quantiles[named], "o", color=DARK, markersize=7)
    for (size, name), quantile in zip(ranked, quantiles, strict=True):
        left = size > 0.6 * sizes[-1]
        axes.annotate(
            letters.get(name, ""),
            (size, quantile),
            (-8 if left else 8, -4),
            textcoords="offset points",
            fontsize=9,
            ha="right" if left else "left",
        )
    if lenth and lenth.pseudo_standard_error and lenth.assumption_met:
        spread = lenth.pseudo_standard_error
        top = quantiles[-1] * 1.1
        axes.plot(
            [0, spread * top],
            [0, top],
            color="black",
            linewidth=1,
            label="noise of Lenth's pseudo standard error",
        )
        axes.axvline(lenth.margin_of_error, color=ACCENT, linestyle="--", label="Lenth's margin of error")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8, loc="lower right")
    if long:
        _key(figure, {letters[name]: text for name, text in written.items()})
    axes.set_xlabel(shown(with_unit("size of the effect", unit)))
    axes.set_ylabel("half-normal quantile")
    axes.margins(x=0.1, y=0.08)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    return figure


def _letter(i: int) -> str:
    """A, B, ..., Z, A1, B1, ..."""
    return chr(ord("A") + i % 26) + (str(i // 26) if i >= 26 else "")


def _key(figure, names: dict[str, str]) -> None:
    """What the letters of a figure stand for, below its axes."""
    from matplotlib.lines import Line2D

    labels = [f"{letter}: {text}" for letter, text in names.items()]
    handles = [Line2D([], [], linestyle="") for _ in labels]
    figure.legend(handles, labels, loc="outside lower center", handlelength=0, handletextpad=0, fontsize=8)


@styled
def surface_contours(surface: Surface, found: TargetSet | None = None, unit: str = "", shown=None):
    """The response over every pair of factors, the others at the recommended point (else at the centre).

    With a target its contour is drawn, and the band of its uncertainty hatched. `shown` picks pairs of places among the
    factors; the colours are those of all pairs, so that figures of some can stand side by side.
    """
    from matplotlib.ticker import MaxNLocator

    name = drawable(surface.table.names, str(surface.table.response.name))
    factors, pairs = surface.table.factors, list(combinations(range(len(surface.table.factors)), 2))
    shown = pairs if shown is None else list(shown)
    rest = found.coded if found is not None else np.zeros(len(factors))
    columns = min(3, len(shown))
    rows = -(-len(shown) // columns)
    figure, grid = new_axes(3.9 * columns + 0.8, 3.9 * rows, nrows=rows, ncols=columns, squeeze=False)
    planes = [_plane(surface, pair, rest) for pair in pairs]
    levels = MaxNLocator(12).tick_values(min(z.min() for *_, z in planes), max(z.max() for *_, z in planes))
    for axes, pair in zip(grid.flat, shown, strict=False):
        x, y, z = planes[pairs.index(pair)]
        colours = axes.contourf(x, y, z, levels=levels, cmap="cividis")
        axes.contour(x, y, z, levels=levels, colors="white", linewidths=0.4, alpha=0.6)
        _draw_target(axes, x, y, z, found)
        _draw_runs(axes, surface, pair, rest, found)
        axes.set_xlabel(folded(name(factors[pair[0]].label), 42))
        axes.set_ylabel(folded(name(factors[pair[1]].label), 42))
        others = [f"{name(f.name)} = {float(f.physical(rest[i])):.4g}" for i, f in enumerate(factors) if i not in pair]
        axes.set_title(folded(", ".join(others), 46), fontsize=9)
        axes.xaxis.set_major_locator(MaxNLocator(5))
    for axes in grid.flat[len(shown) :]:
        axes.set_visible(False)
    figure.colorbar(colours, ax=grid, label=folded(name(with_unit(str(surface.table.response.name), unit)), 50))
    drawn = [planes[pairs.index(pair)][2] for pair in shown]
    _surface_legend(figure, found, unit, min(z.min() for z in drawn), max(z.max() for z in drawn))
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


def _surface_legend(figure, found: TargetSet | None, unit: str, lowest: float, highest: float) -> None:
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
    ncols = len(handles) if figure.get_figwidth() > 8 else 2
    figure.legend(handles=handles, loc="outside lower center", ncols=ncols)


@styled
def predicted_observed(surface: Surface, unit: str = ""):
    """Fitted against observed response, replicated centre points marked."""
    name = drawable(surface.table.names, str(surface.table.response.name))
    figure, axes = new_axes(4.8, 4.4)
    observed, fitted = surface.model.response, surface.runs.fitted
    centre = (np.abs(surface.table.coded.to_numpy()) < 0.05).all(axis=1)
    ends = [min(observed.min(), fitted.min()), max(observed.max(), fitted.max())]
    axes.plot(ends, ends, color="black", linewidth=1, label="equal")
    axes.plot(observed[~centre], fitted[~centre], "o", color=DARK, label="runs")
    axes.plot(observed[centre], fitted[centre], "s", color=LIGHT, markeredgecolor="black", label="centre runs")
    axes.set_xlabel(folded(name(with_unit(f"observed {surface.table.response.name}", unit)), 48))
    axes.set_ylabel(folded(name(with_unit(f"fitted {surface.table.response.name}", unit)), 48))
    axes.legend(fontsize=8)
    return figure


@styled
def climb_path(climb: Climb, unit: str = "", target: float | None = None, names=None, runs=None):
    """Predicted response along a path with its prediction interval; `names` are those of all factors of the table.

    `runs` are those made on the path (levels, then the response); each is drawn at its place between the points.

    The levels stand below each point; long names once, below them all, in the same order.
    """
    name = drawable([factor.name for factor in climb.factors] if names is None else names)
    labels = [name(factor.label) for factor in climb.factors]
    long = max(len(name(factor.name)) for factor in climb.factors) > CLIMB_LONG
    figure, axes = new_axes(height=3.8 + 0.16 * len(labels) * long)
    steps = np.arange(1, len(climb.predicted) + 1)
    axes.plot(steps, climb.predicted, "o-", color=DARK, label="predicted")
    if climb.prediction_intervals[0] is not None:
        low, high = np.array(climb.prediction_intervals).T
        axes.fill_between(
            steps, low, high, color=LIGHT, alpha=0.5, label=f"{100 * climb.level:.6g} % prediction interval of a run"
        )
    if runs is not None:
        axes.plot(1 + places_on(climb, runs), runs.iloc[:, -1], "s", color="black", label="measured")
    if target is not None:
        axes.axhline(target, color="black", linestyle="--", label=f"target {target:g}")
    lines = [
        "\n".join(f"{value:.4g}" if long else f"{name(key)} {value:.4g}" for key, value in row.items())
        for row in climb.points.to_dict(orient="records")
    ]
    axes.set_xticks(steps, lines, fontsize=7)
    if long:
        axes.set_xlabel("points of the path; levels from above:\n" + "\n".join(folded(label, 80) for label in labels))
    else:
        axes.set_xlabel("point of the path, physical levels (" + ", ".join(labels) + ")")
    axes.set_ylabel(name(with_unit("response", unit)))
    axes.legend(fontsize=8)
    return figure


def save(figures: dict, folder: Path) -> list[Path]:
    """Write {name: figure} as PNG files without a date in them; returns the paths."""
    return [style.save(figure, folder / f"{name}.png") for name, figure in figures.items()]
