"""What could be missing: the candidates' ranking, a constant level by level, what rivals predict for the next measurement."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from pellet_study.criticism.explanations import TIE
from pellet_study.criticism.verdict_facts import (
    EXPLAINS,
    IMPLAUSIBLE,
    MISSING,
    NOT_NEEDED,
    NOT_SEEN,
    PAIRED,
    REFUSED,
    TIED,
    standing,
)
from pellet_study.output import style as look
from pellet_study.output.style import styled
from pellet_study.output.words import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINE_HEIGHT = 0.15  # inches of a line of small letters


@styled
def ranking(diagnosis: dict, effects: Sequence[str] = (), ax: "Axes | None" = None) -> "Figure":
    """chi2 that each candidate takes away, and its fitted size; see `standing` for what its bar says.

    What the verdict names is filled with its own colour; the band beside the best of these is the margin of a tie.

    Parameters
    ----------
    effects : all that act in the study's rigs, for their colours
    """
    from matplotlib.patches import Patch
    from matplotlib.ticker import MaxNLocator

    suspects = diagnosis["ranking"][::-1]
    inches = look.page_size(6.2, 1.0)[0] if ax is None else look.room_for(ax.figure, ax)
    letters = look.letters_in(0.27 * inches, 0.83)
    names = [look.folded(s["effect"], letters) for s in suspects]
    sizes = [look.folded(_size(s), letters) for s in suspects]
    lines = max(1 + text.count("\n") for text in [*names, *sizes])
    figure, axes = look.new_axes(6.2, 1.5 + max(0.34, LINE_HEIGHT * lines + 0.08) * len(suspects), ax=ax)
    used: dict[str, list] = {}
    for k, s in reversed(list(enumerate(suspects))):
        kind = standing(diagnosis, s)
        face, hatch = {
            EXPLAINS: ("white", "...."),
            IMPLAUSIBLE: ("white", "////"),
            REFUSED: ("#C8C8C8", None),
            NOT_NEEDED: ("#C8C8C8", None),
            NOT_SEEN: ("white", None),
        }.get(kind, (look.look_of([s["effect"]], effects or [x["effect"] for x in suspects]).colour, None))
        if kind == PAIRED:
            hatch = "xxxx"
        axes.barh(k, s["chi2_drop"], color=face, hatch=hatch, edgecolor="black", linewidth=0.6, height=0.62)
        axes.text(1.02, k, sizes[k], transform=axes.get_yaxis_transform(), va="center", fontsize="small")
        if kind in (TIED, PAIRED) or kind not in used:
            used.setdefault(kind, []).append(Patch(facecolor=face, hatch=hatch, edgecolor="black", linewidth=0.6))
    best = [s["chi2_drop"] for s in suspects if standing(diagnosis, s) in (MISSING, TIED)]
    if best and diagnosis.get("chi2") is not None:
        axes.axvspan(max(best) - TIE, max(best), facecolor=look.LINE, alpha=0.35, zorder=0)
        used[f"within {TIE:g} of the best"] = [Patch(facecolor=look.LINE, alpha=0.35)]
    axes.set_yticks(range(len(suspects)), names)
    axes.set_xlim(0, 1.05 * max(1.0, *(s["chi2_drop"] for s in suspects)))
    axes.set_xlabel("drop of chi² when the effect is fitted too (-)")
    axes.set_ylabel("candidate effect")
    axes.set_title("fitted size", loc="right", fontsize="small")
    axes.xaxis.set_major_locator(MaxNLocator(4 if inches < 5 else 6))
    look.legend_below(figure, map(tuple, used.values()), used.keys(), ax=ax)
    return figure


def _size(suspect: dict) -> str:
    if suspect["note"]:
        return suspect["note"]
    return ", ".join(
        " ".join((name, f"{v:.3g}", unit)).removesuffix(" -")
        for n, v in suspect["value"].items()
        for name, unit in [look.words(n, look.told_unit(suspect, n))]
    )


@styled
def constants(levels: dict, effects: Sequence[str] = (), ax: "Axes | None" = None) -> "Figure":
    """The most drifting constant refitted level by level (`by_level`), with the rivals' curves over it.

    Parameters
    ----------
    effects : all that act in the study's rigs, for their colours
    """
    figure, axes = look.new_axes(5.4, 3.9, ax=ax)
    error = 2 * np.array(levels["standard_errors"])
    axes.errorbar(
        levels["levels"], levels["values"], error, fmt="o", color="black", capsize=3, zorder=5,
        label="refitted at each level, ± 2 s.e.",
    )  # fmt: skip
    axes.axhline(levels["present"], color=look.LINE, linewidth=1, label="present model: one value")
    for name, values in levels["rivals"].items():
        drawn_as = _look(name, levels["rivals"], effects)
        axes.plot(levels["levels"], values, linestyle=drawn_as.dash, color=drawn_as.colour, label=f"with {name}")
    letters = look.letters_in(look.room_for(figure, ax) - 1.0)
    axes.set_xlabel(look.folded(look.told_label(levels, levels["condition"]), letters))
    axes.set_ylabel(
        look.folded(look.told_label(levels, levels["parameter"]), look.letters_in(figure.get_figheight() - 1.6))
    )
    axes.set_title(look.folded(levels["rig"], letters))
    look.legend_below(figure, *axes.get_legend_handles_labels(), ax=ax)
    return figure


@styled
def next_measurement(proposal: dict, effects: Sequence[str] = (), ax: "Axes | None" = None) -> "Figure":
    """What each rival predicts for the proposed measurement, with its uncertainty.

    Parameters
    ----------
    effects : all that act in the study's rigs, for their colours
    """
    names = list(proposal["predictions"])[::-1]
    figure, axes = look.new_axes(5.4, 1.3 + 0.4 * len(names), ax=ax)
    for k, name in enumerate(names):
        drawn_as = _look(name, names, effects)
        axes.errorbar(
            proposal["predictions"][name], k, xerr=2 * proposal["uncertainties"][name], fmt=drawn_as.marker,
            color=drawn_as.colour, capsize=3,
        )  # fmt: skip
    letters = look.letters_in(0.3 * look.room_for(figure, ax), 0.9)
    axes.set_yticks(range(len(names)), [look.folded(name, letters) for name in names])
    axes.set_ylim(-0.6, len(names) - 0.4)
    letters = look.letters_in(0.62 * look.room_for(figure, ax))
    where = ", ".join(
        f"{look.told_label(proposal, name)} {value if isinstance(value, str) else number(value)}"
        for name, value in proposal["conditions"].items()
    )
    axes.set_title(look.folded(f"{proposal['rig']}: {where}", letters), fontsize="small")
    axes.set_xlabel(
        look.folded(
            f"predicted {look.told_label(proposal, proposal['observable'])}, ± 2 standard uncertainties", letters
        )
    )
    axes.set_ylabel("explanation")
    return figure


def _look(name: str, names: Iterable[str], effects: Sequence[str]) -> look.Look:
    """The look of an explanation by its name, `a` or `a + b`, among others."""
    known = effects or sorted({part for each in names for part in each.split(" + ")})
    return look.look_of([] if name == "base" else name.split(" + "), known)
