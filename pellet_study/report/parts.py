"""The parts a report page is made of: tables of text, and pictures that travel inside the page."""

import base64
import io
from collections.abc import Iterable, Sequence

import numpy as np

from pellet_study.output import style

DOTS_PER_INCH = 96  # of a page on the screen


def table(head: Sequence[str], rows: Iterable[Sequence], numbers: Iterable[int] = (), caption: str = "") -> dict:
    """A table; `numbers` are the columns set flush right."""
    return {"head": list(head), "rows": [list(row) for row in rows], "numbers": set(numbers), "caption": caption}


def picture(figure, alt: str, caption: str) -> dict:
    """A figure as SVG inside the page; `alt` says what it shows, `caption` how to read it."""
    data = base64.b64encode(style.svg(figure).encode()).decode()
    width, height = (round(DOTS_PER_INCH * inches) for inches in figure.get_size_inches())
    source = f"data:image/svg+xml;base64,{data}"
    return {"source": source, "alt": alt, "caption": caption, "width": width, "height": height}


def rendering(image: np.ndarray, alt: str, caption: str) -> dict:
    """An array of colours, 0 to 1, as PNG inside the page, shown at half its size so that it stays crisp."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.round(255 * image).astype(np.uint8)).save(stream, "PNG", optimize=True)
    source = f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"
    height, width = image.shape[:2]
    return {"source": source, "alt": alt, "caption": caption, "width": width // 2, "height": height // 2}
