"""Sizes of the effects of a screening: Pareto chart and half-normal plot."""

import numpy as np

from pellet_study.doe.factors import with_unit
from pellet_study.doe.labels import LONG, drawable, folded, letter
from pellet_study.doe.lenth import Lenth
from pellet_study.doe.plackett_burman import Screening
from pellet_study.output import style
from pellet_study.output.style import legend_below, letters_in, new_axes, page_size, styled

DARK, LIGHT, ACCENT = style.MODEL, style.LIGHT, style.MEASURED


@styled
def pareto(screening: Screening, unit: str = "", ax=None):
    """Sizes of the effects with their margins: of the t test, a line each where standard errors differ, and Lenth's."""
    names = sorted(screening.effects, key=lambda name: abs(screening.effects[name]))
    shown = drawable(screening.table.names)
    width = page_size(6.0, 1.0)[0]
    written = [folded(shown(name), letters_in(0.36 * width)) for name in names]
    lines = sum(1 + name.count("\n") for name in written)
    figure, axes = new_axes(height=max(3.8, 1.6 + 0.19 * lines + 0.06 * len(names)), ax=ax)
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
    _margins(axes, screening, names)
    _legend_of_signs(axes, ax)
    axes.set_yticks(range(len(names)), written)
    axes.set_xlabel(
        folded(shown(with_unit("size of the effect (change from -1 to +1)", unit)), letters_in(width - 2.4))
    )
    axes.set_ylabel("term" if screening.interactions else "factor")
    axes.margins(x=0.12)
    return figure


def _margins(axes, screening: Screening, names: list[str]) -> None:
    if not screening.saturated:
        from scipy.special import stdtrit

        times = 2 * float(stdtrit(screening.model.df_residual, 1 - screening.alpha / 2))
        limits = [times * screening.model.standard_errors[name] for name in names]
        looks = {"color": ACCENT, "linestyle": "--", "label": f"t test, level {screening.alpha:g}"}
        if max(limits) - min(limits) <= 1e-6 * max(limits):
            axes.axvline(max(limits), **looks)
        else:
            axes.vlines(limits, [k - 0.45 for k in range(len(names))], [k + 0.45 for k in range(len(names))], **looks)
    if screening.lenth and screening.lenth.assumption_met:
        axes.axvline(screening.lenth.margin_of_error, color="black", linestyle=":", label="Lenth's margin of error")


def _legend_of_signs(axes, ax) -> None:
    from matplotlib.patches import Patch

    handles, _ = axes.get_legend_handles_labels()
    signs = [
        Patch(facecolor=DARK, edgecolor="black", label="raises the response"),
        Patch(facecolor=LIGHT, edgecolor="black", hatch="///", label="lowers the response"),
    ]
    shown = signs + handles
    legend_below(axes.figure, shown, [handle.get_label() for handle in shown], ax=ax)


def _letters(term: str, of_factor: dict[str, str]) -> str:
    """The letter of a factor, those of the factors of a product `a*b`."""
    return of_factor[term] if term in of_factor else "".join(of_factor.get(name, name) for name in term.split("*"))


@styled
def half_normal(effects: dict[str, float], lenth: Lenth | None = None, unit: str = "", noise=(), names=None, ax=None):
    """Half-normal plot: noise lies on a line through the origin, what acts stands to its right.

    `noise` are the contrasts of the design's unused columns: grey and without names, ranked with the others.
    `names` are those of the factors, where `effects` are of products too. Long names stand below, with a letter each; a
    product has the letters of its factors.
    """
    from matplotlib.lines import Line2D
    from scipy.special import ndtri

    shown = drawable(list(effects) if names is None else names)
    written = {name: shown(name) for name in effects}
    long = any(len(name) > LONG for name in written.values())
    of_factor = {name: letter(i) for i, name in enumerate(effects if names is None else names)}
    letters = {name: _letters(name, of_factor) if long else text for name, text in written.items()}
    figure, axes = new_axes(height=4.2 + 0.19 * len(of_factor) * long, ax=ax)
    ranked = sorted([(abs(size), name) for name, size in effects.items()] + [(abs(size), "") for size in noise])
    sizes, named = np.array([size for size, _ in ranked]), np.array([bool(name) for _, name in ranked])
    quantiles = ndtri(0.5 + 0.5 * (np.arange(1, len(sizes) + 1) - 0.5) / len(sizes))
    if len(noise):
        axes.plot(sizes[~named], quantiles[~named], "s", color="0.6", markersize=6, label="contrasts of no term")
    axes.plot(sizes[named], quantiles[named], "o", color=DARK, markersize=7)
    for (size, name), quantile in zip(ranked, quantiles, strict=True):
        left = size > 0.6 * sizes[-1]
        axes.annotate(
            letters.get(name, ""),
            (size, quantile),
            (-8 if left else 8, -4),
            textcoords="offset points",
            fontsize="medium",
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
    handles, labels = axes.get_legend_handles_labels()
    if long:
        labels += [f"{code}: {shown(name)}" for name, code in of_factor.items()]
        handles += [Line2D([], [], linestyle="") for _ in of_factor]
    if handles:
        legend_below(figure, handles, labels, columns=1 if long else 2, ax=ax)
    axes.set_xlabel(folded(shown(with_unit("size of the effect", unit)), letters_in(figure.get_figwidth() - 0.8)))
    axes.set_ylabel("half-normal quantile")
    axes.margins(x=0.1, y=0.08)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    return figure
