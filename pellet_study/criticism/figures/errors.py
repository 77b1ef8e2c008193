"""How far the models are off: the error ladder, residuals against the conditions, predicted against measured."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pellet_study.criticism.facts import model_name, varying
from pellet_study.criticism.figures.readings import BARS
from pellet_study.output import style as look
from pellet_study.output.style import MARKERS, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ORDER = "order"
FITTED, HELD_OUT = "fitted rows", "held-out rows"

LETTERS_ASLANT = 18  # of a model's name in a line, where names stand aslant


def tied_errors(diagnosis: dict) -> list[dict]:
    """What each of the explanations that a diagnosis leaves tied would do to the error; empty where nothing is tied."""
    return diagnosis.get("rivals") or [] if diagnosis["tied"] else []


@styled
def ladder(
    steps: Sequence[dict], tied: Sequence[dict] = (), effects: Sequence[str] = (), ax: "Axes | None" = None
) -> "Figure":
    """The error after each step, on fitted and held-out rows, down to what the uncertainty of a row leaves.

    Parameters
    ----------
    steps : comparisons
    tied : explanations that the last step leaves alike, {effects, rms_error, holdout_rms_error} of each: what it would do
    effects : all that act in the study's rigs, for their colours
    """
    figure, axes = look.new_axes(max(5.4, 1.4 + 1.0 * (len(steps) + len(tied))), 3.9, ax=ax)
    at, last = np.arange(len(steps)), steps[-1]
    curves = [(FITTED, [s["rms_error"] for s in steps]), (HELD_OUT, [s["holdout_rms_error"] for s in steps])]
    one_observable = last.get("rms_error_unit") != "standard uncertainties"  # as levels left out are always in its unit
    for place in dict.fromkeys(p for s in steps if one_observable for p in (s.get("level_out_rms_error") or {})):
        name = look.words(place.split(".")[1], look.told_unit(last, place.split(".")[1]))[0]
        errors = [(s.get("level_out_rms_error") or {}).get(place) for s in steps]
        curves.append((f"each {name} predicted from the others", errors))
    top = 0.0
    for k, (name, errors) in enumerate(curves):
        values = np.array(errors, dtype=float)
        if not np.isnan(values).all():
            axes.plot(at, values, label=name, **_kind(k))
            top = max(top, np.nanmax(values))
    if last.get("noise_floor") is not None:
        axes.axhspan(
            0, last["noise_floor"], color=look.BAND, zorder=0, label="within the uncertainty of a row (median)"
        )
        axes.axhline(last["noise_floor"], color=look.LINE, linewidth=0.8)
        top = max(top, last["noise_floor"])
    models = [step["effects"] for step in steps] + [[*last["effects"], *rival["effects"]] for rival in tied]
    for place, rival in enumerate(tied, start=len(steps)):
        drawn_as = look.look_of(models[place], effects)
        for k, error in enumerate(("rms_error", "holdout_rms_error")):
            if rival[error] is None or last[error] is None:
                continue
            kind = {**_kind(k), "color": drawn_as.colour, "linewidth": 0.9}
            axes.plot([len(steps) - 1, place], [last[error], rival[error]], markevery=[1], **kind)
            top = max(top, rival[error])
    if tied:
        axes.axvline(len(steps) - 0.5, color=look.LINE, linestyle=":", linewidth=0.8)
        axes.annotate(
            "tied: each alone", (len(steps) - 0.5, 1), (4, -2), xycoords=("data", "axes fraction"), textcoords="offset points",
            va="top", fontsize="small",
        )  # fmt: skip
    letters = look.letters_in((look.room_for(figure, ax) - 1.0) / len(models), 0.9)
    _name_models(axes, models, last["effects"], len(steps), effects, letters)
    axes.set_ylim(0, (1.2 if tied else 1.12) * top or 1.0)
    axes.set_xlabel("model")
    unit = look.unit_in_words(last.get("rms_error_unit", "-"))
    axes.set_ylabel(look.folded(f"rms error ({unit})", look.letters_in(figure.get_figheight() - 2.0)))
    look.legend_below(figure, *axes.get_legend_handles_labels(), ax=ax)
    return figure


def _kind(k: int) -> dict[str, Any]:
    """How the error of the k-th kind of rows is drawn: in grey, as colours stand for effects."""
    return {
        "marker": MARKERS[k % 6],
        "linestyle": ("-", "--", ":", "-.")[k % 4],
        "color": ("black", "#404040", "#808080", "#A0A0A0")[k % 4],
        "markerfacecolor": "white" if k == 1 else None,
    }


def _name_models(
    axes: Any, models: Sequence[Sequence[str]], last: Sequence[str], steps: int, effects: Sequence[str], letters: int
) -> None:
    """The models under the axis, each in its effect's colour; of the tied ones what each adds to the last step.

    Aslant where a word of letters would be broken.
    """
    added = [model[len(last) :] if place >= steps else model for place, model in enumerate(models)]
    words = [word for each in added for name in each for word in name.split("_") if word.isascii()]
    aslant = (
        {"rotation": 35, "ha": "right", "rotation_mode": "anchor"} if max(map(len, words), default=0) >= letters else {}
    )
    letters = LETTERS_ASLANT if aslant else letters
    names = ["\n".join(look.folded(f"+ {name}", letters) for name in each) or "base" for each in added]
    axes.set_xticks(range(len(models)), names, **aslant)
    axes.set_xlim(-0.4, len(models) - 0.6)
    for text, model in zip(axes.get_xticklabels(), models, strict=True):
        text.set_color(look.look_of(model, effects).colour)


def _panels(rows: Sequence[dict]) -> list[tuple[str, str | None]]:
    """Rig and condition of every panel; a rig whose conditions never change has one panel, its rows in order.

    Where all rows of a rig say when they were taken, their order has a panel too.
    """
    panels: list[tuple[str, str | None]] = []
    for rig, names in varying(rows).items():
        ordered = all(row.get("order") is not None for row in rows if row["rig"] == rig)
        panels += [(rig, name) for name in [*names, *([ORDER] if ordered else [])]] or [(rig, None)]
    return panels


def _places(rows: Sequence[dict], condition: str | None) -> list:
    """Where rows of a rig stand along a condition."""
    if condition == ORDER:
        return [row[ORDER] for row in rows]
    return [m if condition is None else row["conditions"][condition] for m, row in enumerate(rows, start=1)]


@styled
def residuals(steps: Sequence[dict], effects: Sequence[str] = (), ax: "Axes | None" = None) -> "Figure":
    """Residual over its uncertainty against every condition, and the order of the readings: the first model, and the last where there are several.

    The band is two standard uncertainties of a row; without any known uncertainty the residual itself is shown.
    """
    shown = [steps[0]] if len(steps) == 1 else [steps[0], steps[-1]]
    known = all(r["z"] is not None for s in shown for r in s["rows"])
    panels = _panels(shown[0]["rows"])
    figure, grid = look.new_panels(len(panels), (3.4, 2.7), (4.6, 0.6), ax=ax, sharey=known)
    inches = look.room_for(figure, ax, len(panels)) - 0.6
    drawn = {}
    for axes, (rig, condition) in zip(grid, panels, strict=True):
        if known:
            drawn["± 2 standard uncertainties of a row"] = axes.axhspan(-2, 2, color=look.BAND, zorder=0)
        axes.axhline(0, color=look.LINE, linewidth=0.8, zorder=1)
        for k, step in enumerate(shown):
            colour = look.look_of(step["effects"], effects).colour
            in_rig = [r for r in step["rows"] if r["rig"] == rig]
            place = _places(in_rig, condition)
            if isinstance(place[0], str):
                words = sorted({r["conditions"][condition] for r in shown[0]["rows"] if r["rig"] == rig})
                axes.set_xticks(range(len(words)), words)
                place = [words.index(word) for word in place]
            width = (max(place) - min(place)) or 1.0
            for split, face in (("fit", colour), ("holdout", "white")):
                numbers = [m for m, r in enumerate(in_rig) if r["split"] == split]
                if numbers:
                    name = f"{model_name(step['effects'])}{', held out' if split == 'holdout' else ''}"
                    drawn[name] = axes.scatter(
                        [place[m] + (0.012 * width if k else 0) for m in numbers],
                        [in_rig[m]["z" if known else "residual"] for m in numbers],
                        marker="so"[k], facecolors=face, edgecolors=colour, s=20, linewidths=0.9, zorder=3 + k,
                    )  # fmt: skip
        axes.set_title(look.folded(rig, look.letters_in(inches)))
        name = "row of this rig (-)" if condition is None else look.told_label(shown[0], condition)
        name = "order of the reading (-)" if condition == ORDER else name
        axes.set_xlabel(look.folded(name, look.letters_in(inches)))
        axes.set_ylabel("residual / uncertainty (-)" if known else f"residual ({_unit(shown[0]['rows'], rig)})")
    look.legend_below(figure, drawn.values(), drawn.keys(), ax=ax)
    return figure


def _unit(rows: Sequence[dict], rig: str) -> str:
    row = next(r for r in rows if r["rig"] == rig)
    return look.words(row["observable"], look.told_unit(row, row["observable"]))[1]


@styled
def predictions(
    rows: Sequence[dict], model: Sequence[str] = (), effects: Sequence[str] = (), ax: "Axes | None" = None
) -> "Figure":
    """Predicted against measured, a panel for each observable of each rig; bars where the rows' scatter is known.

    Parameters
    ----------
    model : effects of the model that predicts
    effects : all that act in the study's rigs, for their colours
    """
    pairs = list(dict.fromkeys((r["rig"], r["observable"]) for r in rows))
    figure, grid = look.new_panels(len(pairs), (3.1, 2.9), (4.2, 0.4), ax=ax)
    letters = look.letters_in(min(look.room_for(figure, ax, len(pairs)), 3.4) - 1.3)
    colour = look.look_of(model, effects).colour
    drawn: dict[str, Any] = {}
    for axes, (rig, observable) in zip(grid, pairs, strict=True):
        shown = [r for r in rows if (r["rig"], r["observable"]) == (rig, observable)]
        bars = [BARS * (r.get("uncertainty") or (abs(r["residual"] / r["z"]) if r["z"] else 0.0)) for r in shown]
        name = look.told_label(shown[0], observable)
        both = [r["value"] + side * bar for r, bar in zip(shown, bars, strict=True) for side in (-1, 1)]
        both += [r["predicted"] for r in shown]
        room = 0.06 * (max(both) - min(both)) or 0.05 * abs(both[0]) or 1.0
        ends = [min(both) - room, max(both) + room]
        drawn["equal"] = axes.plot(ends, ends, color=look.LINE, linewidth=1)[0]
        said = f", ± {BARS:g} standard uncertainties" if any(bars) else ""
        for split, marker, face in (("fit", "o", colour), ("holdout", "s", "white")):
            places = [k for k, r in enumerate(shown) if r["split"] == split]
            if places:
                drawn[(FITTED if split == "fit" else HELD_OUT) + said] = axes.errorbar(
                    [shown[k]["value"] for k in places], [shown[k]["predicted"] for k in places],
                    xerr=[bars[k] for k in places] if any(bars) else None,
                    fmt=marker, color=colour, markerfacecolor=face, markersize=4.5, capsize=2, linewidth=0.8, zorder=3,
                )  # fmt: skip
        axes.set(xlim=ends, ylim=ends, aspect="equal", title=look.folded(rig, letters))
        axes.set_xlabel(look.folded(f"measured {name}", letters))
        axes.set_ylabel(look.folded(f"predicted {name}", letters))
    look.legend_below(figure, drawn.values(), drawn.keys(), columns=3, ax=ax)
    return figure
