"""What a reader of a figure sees: text that stands inside it, tick labels that do not touch."""

import re
from itertools import pairwise

from matplotlib.text import Text


def assert_readable(figure) -> None:
    """Every visible text lies inside the figure, and no two names under an axis touch."""
    figure.canvas.draw()
    for text in figure.findobj(Text):
        if text.get_visible() and re.search(r"[^\d\s.,\u2212-]", text.get_text()):  # numbers of ticks may stand beyond
            place = text.get_window_extent()
            assert place.x0 >= -1 and place.y0 >= -1, text.get_text()
            assert place.x1 <= figure.bbox.width + 1 and place.y1 <= figure.bbox.height + 1, text.get_text()
    for axes in figure.axes:
        if not axes.get_visible() or axes.name == "3d":
            continue
        low, high = sorted(axes.get_xlim())
        shown = [
            (tick.get_loc(), tick.label1.get_window_extent())
            for tick in axes.xaxis.get_major_ticks()
            if tick.label1.get_text() and low <= tick.get_loc() <= high
        ]
        shown.sort(key=lambda item: item[1].x0)
        for (_, left), (_, right) in pairwise(shown):
            assert left.x1 <= right.x0 + 1, f"labels under {axes.get_xlabel()!r} touch"
