"""Figures of model criticism, drawn from the answers a study folder keeps (compare.json, diagnose.json, history.json)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pellet_study.criticism.explanations import TIE
from pellet_study.criticism.facts import finding, model_name, varying
from pellet_study.criticism.verdicts import Note
from pellet_study.output import style as look
from pellet_study.output.style import DASHES, MARKERS, SERIES, label, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@styled
def ladder(steps: Sequence[dict], ax: "Axes | None" = None) -> "Figure":
    """The error after each step, on fitted and held-out rows, down to what the scatter of the readings leaves."""
    figure, axes = look.new_axes(5.4, 3.9, ax=ax)
    at = np.arange(len(steps))
    curves = [
        ("fitted rows", [s["rms_error"] for s in steps]),
        ("held-out rows", [s["holdout_rms_error"] for s in steps]),
    ]
    for place in dict.fromkeys(p for s in steps for p in (s.get("level_out_rms_error") or {})):
        name = look.words(place.split(".")[1])[0]
        curves.append(
            (
                f"each {name} predicted\nfrom the others",
                [(s.get("level_out_rms_error") or {}).get(place) for s in steps],
            )
        )
    top = 0.0
    for k, (name, errors) in enumerate(curves):
        values = np.array(errors, dtype=float)
        if not np.isnan(values).all():
            style = {"marker": MARKERS[k % 6], "linestyle": DASHES[k % 6], "color": SERIES[k % 6]}
            axes.plot(at, values, label=name, **style)
            top = max(top, np.nanmax(values))
    floors = np.array([s.get("noise_floor") for s in steps], dtype=float)
    if not np.isnan(floors).all():
        floor = floors[~np.isnan(floors)][-1]
        axes.axhspan(0, floor, color=look.BAND, zorder=0, label="noise floor (scatter of readings)")
        axes.axhline(floor, color=look.LINE, linewidth=0.8)
        top = max(top, floor)
    axes.set_xticks(at, ["base" if not s["effects"] else "+ " + "\n+ ".join(s["effects"]) for s in steps])
    axes.set_xlim(-0.3, len(steps) - 0.7)
    axes.set_ylim(0, 1.12 * top)
    axes.set_xlabel("model")
    axes.set_ylabel(f"rms error ({look.unit_in_words(steps[-1].get('rms_error_unit', '-'))})")
    look.legend_below(figure, *axes.get_legend_handles_labels(), ax=ax)
    return figure


def _panels(rows: Sequence[dict]) -> list[tuple[str, str | None]]:
    """Rig and condition of every panel; a rig whose conditions never change has one panel, its rows in order."""
    panels: list[tuple[str, str | None]] = []
    for rig, names in varying(rows).items():
        panels += [(rig, name) for name in names] or [(rig, None)]
    return panels


@styled
def residuals(steps: Sequence[dict], ax: "Axes | None" = None) -> "Figure":
    """Residual over its uncertainty against every condition: the first model, and the last where there are several.

    The band is two standard uncertainties of a row; without any known uncertainty the residual itself is shown.
    """
    shown = [steps[0]] if len(steps) == 1 else [steps[0], steps[-1]]
    known = all(r["z"] is not None for s in shown for r in s["rows"])
    panels = _panels(shown[0]["rows"])
    figure, grid = look.new_panels(len(panels), (3.4, 2.7), (4.6, 0.6), ax=ax, sharey=known)
    drawn = {}
    for axes, (rig, condition) in zip(grid, panels, strict=True):
        if known:
            drawn["± 2 standard uncertainties of a row"] = axes.axhspan(-2, 2, color=look.BAND, zorder=0)
        axes.axhline(0, color=look.LINE, linewidth=0.8, zorder=1)
        for k, step in enumerate(shown):
            in_rig = [r for r in step["rows"] if r["rig"] == rig]
            place = [m if condition is None else r["conditions"][condition] for m, r in enumerate(in_rig, start=1)]
            if isinstance(place[0], str):
                words = sorted({r["conditions"][condition] for r in shown[0]["rows"] if r["rig"] == rig})
                axes.set_xticks(range(len(words)), words)
                place = [words.index(word) for word in place]
            width = (max(place) - min(place)) or 1.0
            for split, face in (("fit", SERIES[1 - k]), ("holdout", "white")):
                numbers = [m for m, r in enumerate(in_rig) if r["split"] == split]
                if numbers:
                    name = f"{model_name(step['effects'])}{', held out' if split == 'holdout' else ''}"
                    drawn[name] = axes.scatter(
                        [place[m] + (0.012 * width if k else 0) for m in numbers],
                        [in_rig[m]["z" if known else "residual"] for m in numbers],
                        marker="so"[k], facecolors=face, edgecolors=SERIES[1 - k], s=20, linewidths=0.9, zorder=3 + k,
                    )  # fmt: skip
        axes.set_title(rig)
        axes.set_xlabel("row of this rig (-)" if condition is None else label(condition))
        axes.set_ylabel("residual / uncertainty (-)" if known else f"residual ({_unit(shown[0]['rows'], rig)})")
    look.legend_below(figure, drawn.values(), drawn.keys(), ax=ax)
    return figure


def _unit(rows: Sequence[dict], rig: str) -> str:
    return look.words(next(r["observable"] for r in rows if r["rig"] == rig))[1]


@styled
def predictions(rows: Sequence[dict], ax: "Axes | None" = None) -> "Figure":
    """Predicted against measured, a panel for each observable of each rig."""
    pairs = list(dict.fromkeys((r["rig"], r["observable"]) for r in rows))
    figure, grid = look.new_panels(len(pairs), (3.1, 2.9), (4.2, 0.4), ax=ax)
    drawn = {}
    for axes, (rig, observable) in zip(grid, pairs, strict=True):
        shown = [r for r in rows if (r["rig"], r["observable"]) == (rig, observable)]
        both = [r[k] for r in shown for k in ("value", "predicted")]
        room = 0.06 * (max(both) - min(both)) or 0.05 * abs(both[0]) or 1.0
        ends = [min(both) - room, max(both) + room]
        drawn["equal"] = axes.plot(ends, ends, color=look.LINE, linewidth=1)[0]
        for split, face in (("fit", look.MODEL), ("holdout", "white")):
            points = [r for r in shown if r["split"] == split]
            if points:
                drawn["fitted rows" if split == "fit" else "held-out rows"] = axes.scatter(
                    [r["value"] for r in points], [r["predicted"] for r in points],
                    facecolors=face, edgecolors=look.MODEL, s=20, zorder=3,
                )  # fmt: skip
        axes.set(xlim=ends, ylim=ends, aspect="equal", title=rig)
        axes.set_xlabel(f"measured {label(observable)}")
        axes.set_ylabel(f"predicted {label(observable)}")
    look.legend_below(figure, drawn.values(), drawn.keys(), columns=3, ax=ax)
    return figure


@styled
def ranking(diagnosis: dict, ax: "Axes | None" = None) -> "Figure":
    """chi2 that each candidate takes away; what lies in the band explains as well as the best, within the margin.

    Filled: explains the data. Hatched: only at a size beyond the physical range. Grey: does not explain, or these data
    cannot show it.
    """
    from matplotlib.patches import Patch

    suspects = diagnosis["ranking"][::-1]
    figure, axes = look.new_axes(6.2, 1.3 + 0.34 * len(suspects), ax=ax)
    named = set(finding(diagnosis).effects)
    best = max(s["chi2_drop"] for s in suspects)
    used = {}
    for k, s in enumerate(suspects):
        if s["effect"] in named:
            face, hatch, kind = look.MODEL, None, "tied" if diagnosis["tied"] else "missing"
        elif s["note"] == Note.IMPLAUSIBLE_SIZE:
            face, hatch, kind = "white", "////", "only at an implausible size"
        else:
            face, hatch, kind = "#C8C8C8", None, "does not explain, or cannot be seen"
        axes.barh(k, s["chi2_drop"], color=face, hatch=hatch, edgecolor="black", linewidth=0.6, height=0.62)
        used[kind] = Patch(facecolor=face, hatch=hatch, edgecolor="black", linewidth=0.6)
        axes.annotate(
            _size(s), (s["chi2_drop"], k), (5, 0), textcoords="offset points", va="center", fontsize=7.5,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85},
        )  # fmt: skip
    if named and diagnosis.get("chi2") is not None:
        top = max(s["chi2_drop"] for s in suspects if s["effect"] in named)
        axes.axvspan(top - TIE, top, facecolor=look.MEASURED, alpha=0.25, zorder=0)
        used[f"as good as the best (within {TIE:g})"] = Patch(facecolor=look.MEASURED, alpha=0.25)
    axes.set_yticks(range(len(suspects)), [s["effect"] for s in suspects])
    axes.set_xlim(0, 1.65 * max(best, 1.0))
    axes.set_xlabel("drop of chi² when the effect is fitted too (-)")
    axes.set_ylabel("candidate effect")
    look.legend_below(figure, used.values(), used.keys(), ax=ax)
    return figure


def _size(suspect: dict) -> str:
    if suspect["note"]:
        return suspect["note"]
    return ", ".join(
        f"{look.words(n)[0]} {v:.3g} {look.words(n)[1]}".removesuffix(" -") for n, v in suspect["value"].items()
    )


@styled
def constants(levels: dict, ax: "Axes | None" = None) -> "Figure":
    """The most drifting constant refitted level by level (`by_level`), with the rivals' curves over it."""
    figure, axes = look.new_axes(5.4, 3.9, ax=ax)
    error = 2 * np.array(levels["standard_errors"])
    axes.errorbar(
        levels["levels"], levels["values"], error, fmt="o", color="black", capsize=3, zorder=5,
        label="refitted at each level, ± 2 s.e.",
    )  # fmt: skip
    axes.axhline(levels["present"], color=look.LINE, linewidth=1, label="present model: one value")
    for k, (name, values) in enumerate(levels["rivals"].items()):
        axes.plot(levels["levels"], values, linestyle=DASHES[k % 6], color=SERIES[k % 6], label=f"with {name}")
    axes.set_xlabel(label(levels["condition"]))
    axes.set_ylabel(label(levels["parameter"]))
    axes.set_title(levels["rig"])
    look.legend_below(figure, *axes.get_legend_handles_labels(), ax=ax)
    return figure


@styled
def next_measurement(proposal: dict, ax: "Axes | None" = None) -> "Figure":
    """What each rival predicts for the proposed measurement, with its uncertainty."""
    names = list(proposal["predictions"])[::-1]
    figure, axes = look.new_axes(5.4, 1.0 + 0.4 * len(names), ax=ax)
    for k, name in enumerate(names):
        axes.errorbar(
            proposal["predictions"][name], k, xerr=2 * proposal["uncertainties"][name], fmt=MARKERS[k % 6], color=SERIES[k % 6],
            capsize=3,
        )  # fmt: skip
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(-0.6, len(names) - 0.4)
    axes.set_xlabel(f"predicted {label(proposal['observable'])}, ± 2 standard uncertainties")
    axes.set_ylabel("explanation")
    return figure
