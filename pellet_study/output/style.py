"""The one look of all figures: told apart by colour-blind readers and in grey, a unit on every axis, nothing spare.

Colours are Okabe & Ito's (2008, "Color universal design"); what matters is also said by marker, hatch or line style.
Within `column(width_mm)` figures are made for a column of a journal: as wide as asked to the millimetre, set in 7 to 8 points.
Matplotlib is imported when a figure is asked for.
"""

import io
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any

from pellet_study.errors import InputError
from pellet_study.files import writing
from pellet_study.output import fonts

LABEL_WIDTH = 60  # letters of a label in a legend
MODEL, MEASURED, PAPER = "#0072B2", "#D55E00", "#555555"
LIGHT, BAND, LINE = "#BBD7EA", "#EDEDED", "#8A8A8A"
SERIES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
EFFECTS = (*SERIES, "#882255", "#999933", "#332288", "#661100")  # the last four are Paul Tol's (2021, "muted")
MARKERS = ("o", "s", "^", "D", "v", "P")
DASHES = ("-", "--", "-.", ":", (0, (6, 1.5, 1, 1.5, 1, 1.5)), (0, (1, 1)))
UNDOTTED = ("-", "--", "-.", (0, (6, 1.5, 1, 1.5, 1, 1.5)), (0, (10, 3)))  # of effects: the base model is dotted

STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "lines.markersize": 5,
    "hatch.linewidth": 0.6,
    "svg.hashsalt": "pellet_study",
    "pdf.fonttype": 42,  # letters stay letters, which journals ask for
}
JOURNAL: dict[Any, Any] = {
    "font.size": 7.5,
    "axes.labelsize": 7.5,
    "axes.titlesize": 7.5,
    "axes.linewidth": 0.6,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "lines.linewidth": 1.2,
    "lines.markersize": 4,
}
FORMATS = ("png", "svg", "pdf")
COLUMNS = {"single": 85.0, "double": 175.0}
"""Widths of a journal's columns, mm: what most of them take."""
NARROWEST, WIDEST = 40.0, 400.0
MM_PER_INCH = 25.4
LEGEND = 0.5  # inches of a legend that a figure's height has room for; a taller one makes it taller
PANEL = 2.1  # inches, below which a panel's labels do not fit
_width_mm: ContextVar[float | None] = ContextVar("width_mm", default=None)
_ending: ContextVar[str | None] = ContextVar("ending", default=None)
UNITS = {
    "mm": "mm",
    "um": "µm",
    "m": "m",
    "mg": "mg",
    "g": "g",
    "deg": "deg",
    "pa": "Pa",
    "mpa": "MPa",
    "kg_m3": "kg/m³",
    "m_s": "m/s",
    "n_m": "N/m",
    "j_m2": "J/m²",
    "percent": "%",
    "s": "s",
}
SYMBOLS = {
    "seed_powder_restitution": "$a_1$",
    "seed_powder_static_friction": "$a_2$",
    "seed_powder_rolling_friction": "$a_3$",
}  # the source paper's


@dataclass(frozen=True)
class Look:
    """How a series is drawn: told apart by colour, and in grey by marker and dash."""

    colour: str
    marker: str
    dash: Any


BASE = Look("#404040", "o", (0, (1, 1.2)))
"""The look of a model to which no effect was added."""


def look_of(effects: Sequence[str], known: Sequence[str] = ()) -> Look:
    """The look of a model with some effects, the same in every figure of a study.

    Parameters
    ----------
    effects : effects of the model; the last one's colour is taken, of a pair with the first one's marker and dash
    known : every effect that may be drawn, by whose order the colours are given; effects that are not among them follow
    """
    if not effects:
        return BASE
    order = [*dict.fromkeys([*known, *sorted(effects)])]
    first, last = order.index(effects[0]), order.index(effects[-1])
    sign = first + first // len(EFFECTS)
    return Look(EFFECTS[last % len(EFFECTS)], MARKERS[sign % len(MARKERS)], UNDOTTED[sign % len(UNDOTTED)])


@contextmanager
def column(width_mm: float | None, ending: str | None = None) -> Iterator[None]:
    """Figures made within are that wide, with a journal's letters; None: as on a screen. They are saved in that format whatever
    the ending of their names; None: as these say.

    Raises
    ------
    InputError : a width that no page has
    """
    if width_mm is not None and not NARROWEST <= width_mm <= WIDEST:
        raise InputError(
            f"a figure {width_mm:g} mm wide was asked for: expected {NARROWEST:g} to {WIDEST:g} mm, such as "
            f"{' or '.join(f'{mm:g} ({name} column)' for name, mm in COLUMNS.items())}"
        )
    width, form = _width_mm.set(width_mm), _ending.set(ending or _ending.get())
    try:
        yield
    finally:
        _width_mm.reset(width)
        _ending.reset(form)


def styled(draw: Callable[..., Any]) -> Callable[..., Any]:
    """A function that makes a figure, run in the project's style."""

    @wraps(draw)
    def in_style(*arguments: Any, **options: Any) -> Any:
        from matplotlib import style

        journal = {} if _width_mm.get() is None else JOURNAL
        own = {**STYLE, **journal, "font.family": fonts.families()}
        with style.context(["default", own]):  # the user's own settings change nothing
            return draw(*arguments, **options)

    return in_style


def new_axes(width: float = 6.0, height: float = 3.8, *, ax: Any = None, **grid: Any) -> Any:
    """A figure and its axes on the file backend (no window), or given axes and theirs; `grid` goes to `Figure.subplots`.

    Width and height are inches; in a journal's column the width is the column's and the height shrinks with the letters.
    """
    if ax is not None:
        return ax.figure, ax
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=page_size(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(**grid)


def page_size(width: float, height: float) -> tuple[float, float]:
    """Width and height of a figure, inches: as given, or in a journal's column its width and a height for its letters."""
    asked = _width_mm.get()
    return (
        (width, height) if asked is None else (asked / MM_PER_INCH, height * JOURNAL["font.size"] / STYLE["font.size"])
    )


def room_for(figure: Any, ax: Any = None, panels: int = 1) -> float:
    """Width that a panel of a figure has with the labels beside it, inches; of given axes that of the first and an inch."""
    if ax is None:
        return figure.get_figwidth() / panels_in_a_line(panels)
    first = ax.flat[0] if hasattr(ax, "flat") else ax[0] if isinstance(ax, list | tuple) else ax
    return first.get_position().width * figure.get_figwidth() + 1.0


def panels_in_a_line(count: int, most: int = 3) -> int:
    """How many panels stand beside each other: no more than a journal's column has room for."""
    asked = _width_mm.get()
    return max(1, min(most, count, count if asked is None else int(asked / MM_PER_INCH / PANEL)))


def new_panels(count: int, size: tuple[float, float], room: tuple[float, float], *, ax: Any = None, **grid: Any) -> Any:
    """A figure and `count` axes, three in a line, the rest of the last line hidden; or given axes and their figure.

    Parameters
    ----------
    size : width and height of a panel, inches
    room : least width of the figure, and height besides the panels
    ax : axes to draw on, as many as there are panels

    Raises
    ------
    InputError : their number is another
    """
    if ax is not None:
        given = list(ax.flat) if hasattr(ax, "flat") else list(ax) if isinstance(ax, list | tuple) else [ax]
        if len(given) != count:
            raise InputError(f"ax: this figure has {count} panels, got {len(given)} axes; give a list of {count}")
        return given[0].figure, given
    columns = panels_in_a_line(count)
    lines = -(-count // columns)
    figure, axes = new_axes(
        max(size[0] * columns, room[0]), size[1] * lines + room[1], nrows=lines, ncols=columns, squeeze=False, **grid
    )
    for unused in axes.flat[count:]:
        unused.set_visible(False)
    return figure, list(axes.flat[:count])


def folded(text: str, letters: float) -> str:
    """A text in lines of at most so many letters, broken at spaces and behind `_` where it has any; Chinese and its like count double."""
    lines, line = [], ""
    for word in re.findall(r"[^ _]*_|[^ _]+ *| +", text):
        if line and _letters(line + word.rstrip()) > letters:
            lines.append(line.rstrip())
            line = ""
        for letter in word:
            if _letters(line + letter) > letters and letter != " ":
                lines.append(line.rstrip())
                line = ""
            line += letter
    return "\n".join([*lines, line.rstrip()])


def _letters(text: str) -> int:
    return sum(2 if unicodedata.east_asian_width(letter) in "WF" else 1 for letter in text)


def letters_in(inches: float, share: float = 1.0) -> int:
    """How many letters fit into a length, of `share` times the usual size; within a `styled` function."""
    import matplotlib

    return max(8, int(inches * 72 / (0.6 * share * matplotlib.rcParams["font.size"])))


def legend_below(figure: Any, handles: Iterable, labels: Iterable[str], columns: int = 2, *, ax: Any = None) -> None:
    """A legend under a figure's axes, in as many columns as its width has room for; long labels are folded.

    On given axes it stands in the first of them: the rest of their figure is the caller's.
    """
    letters = min(LABEL_WIDTH, letters_in(figure.get_figwidth() - 0.8, 0.9))
    handles, labels = list(handles), [folded(text, letters) for text in labels]  # tried in several columns
    if ax is not None:
        first = ax.flat[0] if hasattr(ax, "flat") else ax[0] if isinstance(ax, list | tuple) else ax
        first.legend(handles, labels, handler_map=_beside())
        return
    for number in range(min(columns, len(labels)), 0, -1):
        legend = figure.legend(handles, labels, loc="outside lower center", ncols=number, handler_map=_beside())
        if number == 1 or legend.get_window_extent().width <= 0.97 * figure.bbox.width:
            tall = legend.get_window_extent().height / figure.dpi
            figure.set_figheight(figure.get_figheight() + max(0.0, tall - LEGEND))
            return
        legend.remove()


def _beside() -> dict[type, Any]:
    """Several handles of one label, given as a tuple, stand beside each other."""
    from matplotlib.legend_handler import HandlerTuple

    return {tuple: HandlerTuple(ndivide=None, pad=0)}


def words(name: str, unit: str | None = None) -> tuple[str, str]:
    """A column's name in words, and its unit: `layer_height_mm` -> ("layer height", "mm"); no unit: "-".

    With a declared unit (`s/m`, "1" for a number) nothing is read off the name but that unit's spelling: `slowness_s_m` ->
    ("slowness", "s/m"). Names of the package's own tables end with their unit, and need none declared.
    """
    if unit is not None:
        spelt = re.sub("[^a-z0-9]+", "_", unit.lower()).strip("_")
        text = name.removesuffix("_" + spelt) if unit != "1" and spelt else name
        return text.replace("_", " "), "-" if unit in ("1", "") else UNITS.get(spelt, unit)
    for suffix in sorted(UNITS, key=len, reverse=True):
        if name.endswith("_" + suffix):
            return name[: -len(suffix) - 1].replace("_", " "), UNITS[suffix]
    return name.replace("_", " "), "-"


def label(name: str, unit: str | None = None) -> str:
    """A column's name as written on an axis: `layer height (mm)`; a parameter of the paper with its symbol."""
    text, unit = words(name, unit)
    return f"{text} {SYMBOLS[name]} ({unit})" if name in SYMBOLS else f"{text} ({unit})"


def declared(name: str, units: Mapping[str, str]) -> str:
    """A name as written in a table, with its unit where one is declared; verbatim where none is."""
    return label(name, units[name]) if name in units else name


def told_unit(told: Mapping, name: str) -> str | None:
    """The unit that an answer declares of a name, "" where it declares none; None where an older version wrote it."""
    return told["units"].get(name, "") if "units" in told else None


def told_label(told: Mapping, name: str) -> str:
    """A column's name as written on an axis, with the unit that an answer declares of it; verbatim where it declares none."""
    unit = told_unit(told, name)
    return name if unit == "" else label(name, unit)


def unit_in_words(unit: str) -> str:
    """A unit as written at the end of a name, printed: `pa` -> Pa."""
    return UNITS.get(unit, unit)


@styled
def save(figure: Any, file: Path) -> Path:
    """Write a figure in the format that its name ends with, or `column` says; the same bytes for the same content.

    Returns the path, which ends as the format does.
    """
    if (ending := _ending.get()) is not None:
        file = file.with_suffix(f".{ending}")
    metadata: dict[str, dict[str, None]] = {
        ".png": {"Software": None},
        ".svg": {"Date": None, "Creator": None},
        ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    }
    dpi = writing.SCREEN_DPI if _width_mm.get() is None else writing.JOURNAL_DPI
    stream = io.BytesIO()
    figure.savefig(stream, format=file.suffix[1:], dpi=dpi, metadata=metadata[file.suffix])
    return writing.data(file, stream.getvalue())


def save_all(figures: dict[str, Any], folder: Path) -> list[Path]:
    """Write {name: figure} as files of one format; returns their paths."""
    return [save(figure, folder / f"{name}.png") for name, figure in figures.items()]


@styled
def svg(figure: Any) -> str:
    """A figure as the text of an SVG file, the same for the same content."""
    stream = io.StringIO()
    figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    return stream.getvalue()
