"""The one look of all figures: told apart by colour-blind readers and in grey, a unit on every axis, nothing spare.

Colours are Okabe & Ito's (2008, "Color universal design"); what matters is also said by marker, hatch or line style.
Matplotlib is imported when a figure is asked for.
"""

import io
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from pathlib import Path
from typing import Any

from pellet_study.errors import InputError
from pellet_study.output import fonts

LABEL_WIDTH = 60  # letters of a label in a legend
MODEL, MEASURED, PAPER = "#0072B2", "#D55E00", "#555555"
LIGHT, BAND, LINE = "#BBD7EA", "#EDEDED", "#8A8A8A"
SERIES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MARKERS = ("o", "s", "^", "D", "v", "P")
DASHES = ("-", "--", "-.", ":", (0, (6, 1.5, 1, 1.5, 1, 1.5)), (0, (1, 1)))

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
}
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


def styled(draw: Callable[..., Any]) -> Callable[..., Any]:
    """A function that makes a figure, run in the project's style."""

    @wraps(draw)
    def in_style(*arguments: Any, **options: Any) -> Any:
        import matplotlib

        with matplotlib.rc_context({**STYLE, "font.family": fonts.families()}):
            return draw(*arguments, **options)

    return in_style


def new_axes(width: float = 6.0, height: float = 3.8, *, ax: Any = None, **grid: Any) -> Any:
    """A figure and its axes on the file backend (no window), or given axes and theirs; `grid` goes to `Figure.subplots`."""
    if ax is not None:
        return ax.figure, ax
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(**grid)


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
    columns = min(3, count)
    lines = -(-count // columns)
    figure, axes = new_axes(
        max(size[0] * columns, room[0]), size[1] * lines + room[1], nrows=lines, ncols=columns, squeeze=False, **grid
    )
    for unused in axes.flat[count:]:
        unused.set_visible(False)
    return figure, list(axes.flat[:count])


def legend_below(figure: Any, handles: Iterable, labels: Iterable[str], columns: int = 2, *, ax: Any = None) -> None:
    """A legend under a figure's axes, in as many columns as its width has room for; long labels are folded.

    On given axes it stands in the first of them: the rest of their figure is the caller's.
    """
    labels = [textwrap.fill(text, LABEL_WIDTH) for text in labels]
    if ax is not None:
        first = ax.flat[0] if hasattr(ax, "flat") else ax[0] if isinstance(ax, list | tuple) else ax
        first.legend(handles, labels)
        return
    for number in range(min(columns, len(labels)), 0, -1):
        legend = figure.legend(handles, labels, loc="outside lower center", ncols=number)
        if number == 1 or legend.get_window_extent().width <= figure.bbox.width:
            return
        legend.remove()


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


def unit_in_words(unit: str) -> str:
    """A unit as written at the end of a name, printed: `pa` -> Pa."""
    return UNITS.get(unit, unit)


@styled
def save(figure: Any, file: Path) -> Path:
    """Write a figure as PNG, the same bytes for the same content."""
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=150, metadata={"Software": None})
    return file


@styled
def svg(figure: Any) -> str:
    """A figure as the text of an SVG file, the same for the same content."""
    stream = io.StringIO()
    figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    return stream.getvalue()
