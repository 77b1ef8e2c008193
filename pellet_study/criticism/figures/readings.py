"""The readings with their uncertainty against the condition, and the models through them."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pellet_study.criticism.curves import CURVE, LEVELS, ROWS
from pellet_study.criticism.facts import model_name
from pellet_study.output import style as look
from pellet_study.output.style import styled
from pellet_study.output.words import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, HEIGHT = 3.4, 2.9  # inches of a panel
ALONE = 5.4  # inches of a figure with one panel
SIDE = 0.012  # of the range of a condition, between readings of one level
BARS = 2.0  # standard uncertainties of a reading that an error bar has to either side
OWN = ("_", "x", "+", "1", "2", "3")  # markers of models that have a value for each row only
SPLITS = (("fit", "o", "black"), ("holdout", "s", "white"))


@styled
def readings(
    rows: Sequence[dict], curves: Sequence[dict], effects: Sequence[str] = (), ax: "Axes | Sequence[Axes] | None" = None
) -> "Figure":
    """Readings with their uncertainty against the condition, a panel a rig, and every model given.

    Parameters
    ----------
    rows : of a comparison
    curves : of models of these rows, as `curves.curves_of` makes them; the first of each name counts
    effects : all that act in the study's rigs, for their colours
    ax : as many axes as there are panels
    """
    models: dict[tuple[str, ...], dict] = {}
    for model in curves:
        models.setdefault(tuple(model["effects"]), model)
    panels = next(iter(models.values()))["panels"]
    width = ALONE if len(panels) == 1 else WIDTH
    figure, grid = look.new_panels(len(panels), (width, HEIGHT), (ALONE, 0.8), ax=ax)
    inches = look.room_for(figure, ax, len(panels))
    drawn: dict[str, Any] = {}
    for k, (axes, told) in enumerate(zip(grid, panels, strict=True)):
        panel = _placed(told)
        for m, (names, model) in enumerate(models.items()):
            drawn[model_name(names)] = _draw_model(axes, _placed(model["panels"][k]), look.look_of(names, effects), m)
        if panel is not told:
            axes.set_xticks(panel["levels"], told["levels"])
        _draw_readings(axes, panel, rows, drawn)
        lines = [
            look.folded(line, look.letters_in(inches - 0.6, 0.83)) for line in (panel["rig"], _said(panel)) if line
        ]
        axes.set_title("\n".join(lines), fontsize="small")
        name = "row of this rig (-)" if panel["condition"] is None else look.told_label(panel, panel["condition"])
        axes.set_xlabel(look.folded(name, look.letters_in(inches - 0.6)))
        height = figure.get_figheight() / -(-len(panels) // 3)
        axes.set_ylabel(look.folded(look.told_label(panel, panel["observable"]), look.letters_in(height - 1.0)))
    look.legend_below(figure, drawn.values(), drawn.keys(), ax=ax)
    return figure


def _placed(panel: dict) -> dict:
    """A panel whose condition is a number; of one that is a word, with the places of the words instead of these."""
    if not isinstance(panel["levels"][0], str):
        return panel
    words = sorted(set(panel["levels"]))
    places = {name: [words.index(word) for word in panel[name]] for name in ("levels", "at")}
    return {**panel, **places}


def _draw_model(axes: Any, panel: dict, drawn_as: look.Look, place: int) -> Any:
    """A model's values; what stands for it in the legend."""
    if panel["drawn"] == ROWS:
        return axes.plot(
            _side_by_side(panel["levels"]), panel["predicted"], OWN[place % len(OWN)], color=drawn_as.colour, markersize=6, markeredgewidth=1.6,
            zorder=4,
        )[0]  # fmt: skip
    marker = "." if panel["drawn"] == LEVELS else ""
    return axes.plot(
        panel["at"], panel["predicted"], color=drawn_as.colour, linestyle=drawn_as.dash, marker=marker, zorder=3
    )[0]


def _draw_readings(axes: Any, panel: dict, rows: Sequence[dict], drawn: dict[str, Any]) -> None:
    """The readings of a panel, those held out with an open marker; bars where their scatter is known."""
    told = zip(_side_by_side(panel["levels"]), panel["rows"], panel["uncertainties"], strict=True)
    readings = [(x, rows[k], spread) for x, k, spread in told]
    for split, marker, face in SPLITS:
        for known in (True, False):
            shown = [r for r in readings if r[1]["split"] == split and (r[2] is not None) == known]
            if not shown:
                continue
            kind = "readings" if split == "fit" else "readings held out"
            name = f"{kind}, ± {BARS:g} standard uncertainties" if known else f"{kind}, scatter unknown"
            drawn[name] = axes.errorbar(
                [x for x, _, _ in shown], [row["value"] for _, row, _ in shown],
                [BARS * (spread or 0.0) for _, _, spread in shown] if known else None,
                fmt=marker, color="black", markerfacecolor=face, markersize=4.5, capsize=2, linewidth=0.9, zorder=5,
            )  # fmt: skip


def _side_by_side(levels: Sequence[float]) -> list[float]:
    """Places of readings whose bars do not hide each other: readings of one level side by side about it."""
    step, placed = SIDE * ((max(levels) - min(levels)) or 1.0), []
    for k, level in enumerate(levels):
        before, all_of_it = levels[:k].count(level), levels.count(level)
        placed.append(level + step * (before - (all_of_it - 1) / 2))
    return placed


def _said(panel: dict) -> str:
    """The other conditions of a panel, and how the model is drawn where that is not at any value."""
    names = [look.words(name, look.told_unit(panel, name)) for name in panel["others"]]
    values = panel["others"].values()
    said = [
        f"{name} {v if isinstance(v, str) else number(v, 6)} {unit}".removesuffix(" -")
        for (name, unit), v in zip(names, values, strict=True)
    ]
    if panel["condition"] is not None and panel["drawn"] == ROWS:
        said.append("the rest as in each row")
    if panel["drawn"] != CURVE:
        said.append("model at the rows only" if panel["drawn"] == ROWS else "model at the dots")
    return ", ".join(words.replace(" ", "\N{NO-BREAK SPACE}") for words in said)
