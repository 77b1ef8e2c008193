"""The parts a report page is made of: tables of text, and pictures that travel inside the page."""

import base64
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from pellet_study.output import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 96  # of a page on the screen


@dataclass(frozen=True)
class Table:
    """A table; `numbers` are the columns set flush right."""

    head: list[str]
    rows: list[list[str]]
    numbers: frozenset[int]
    caption: str


@dataclass(frozen=True)
class Picture:
    """A picture as an address with its data in it; `alt` says what it shows, `caption` how to read it; pixels."""

    source: str
    alt: str
    caption: str
    width: int
    height: int


@dataclass(frozen=True)
class Stage:
    """A stage of a calibration: which (`kind`), what it found in words, pictures and tables; `short` is for the first box."""

    kind: str
    heading: str
    words: list[str]
    pictures: list[Picture] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    short: str = ""


def table(
    head: Sequence[str], rows: Iterable[Sequence[object]], numbers: Iterable[int] = (), caption: str = ""
) -> Table:
    """A table; `numbers` are the columns set flush right."""
    return Table(list(head), [[str(cell) for cell in row] for row in rows], frozenset(numbers), caption)


def picture(figure: "Figure", alt: str, caption: str) -> Picture:
    """A figure as SVG inside the page; `alt` says what it shows, `caption` how to read it."""
    data = base64.b64encode(style.svg(figure).encode()).decode()
    width, height = (round(DOTS_PER_INCH * inches) for inches in figure.get_size_inches())
    return Picture(f"data:image/svg+xml;base64,{data}", alt, caption, width, height)


def rendering(image: np.ndarray, alt: str, caption: str) -> Picture:
    """An array of colours, 0 to 1, as PNG inside the page, shown at half its size so that it stays crisp."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.round(255 * image).astype(np.uint8)).save(stream, "PNG", optimize=True)
    height, width = image.shape[:2]
    data = base64.b64encode(stream.getvalue()).decode()
    return Picture(f"data:image/png;base64,{data}", alt, caption, width // 2, height // 2)
