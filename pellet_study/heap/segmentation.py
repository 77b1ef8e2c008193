"""Heap told from background: what stands out above the plate's edge, and the one connected heap in it.

The background is a smooth surface through the picture's margin (uneven light), and Otsu's threshold (1979,
doi:10.1109/TSMC.1979.4310076) parts what differs from it.
"""

from types import ModuleType
from typing import NamedTuple

import numpy as np

from pellet_study.errors import InputError
from pellet_study.heap.plate import MARGIN, LevelLine
from yade_scripts import heap

LEAST_CONTRAST = 5.0  # of heap to background, in CIELAB units; 2.3 is the least one can see
LEAST_CLEARNESS = 4.0  # contrast over the background's own unevenness
SECOND_HEAP = 0.05  # share of the largest heap's area from which on another one counts


class Apart(NamedTuple):
    """A mask, the tone it was cut from at 0, the picture's difference from its background, and the contrast (CIELAB)."""

    mask: np.ndarray
    tone: np.ndarray
    difference: np.ndarray
    contrast: float


def smooth_lab(pixels: np.ndarray) -> np.ndarray:
    """A picture in CIELAB, its noise smoothed.

    Raises
    ------
    InputError : scikit-image is not installed
    """
    color, filters = _skimage()
    smooth = filters.gaussian(pixels, sigma=max(1.0, 0.0025 * max(pixels.shape)), channel_axis=2)
    return color.rgb2lab(smooth)


def _skimage() -> tuple[ModuleType, ModuleType]:
    try:
        from skimage import color, filters
    except ImportError:
        raise InputError("angle needs scikit-image: pip install 'pellet-study[angle]'") from None
    return color, filters


def apart(lab: np.ndarray, edge: LevelLine | None) -> Apart:
    """What stands out from the background above the plate's edge.

    Raises
    ------
    heap.NoHeap : nothing stands out
    """
    _, filters = _skimage()
    rows, columns, _ = lab.shape
    y, x = np.mgrid[:rows, :columns]
    gap = max(3.0, 0.012 * rows)  # the edge itself is blurred
    above = np.ones((rows, columns), dtype=bool) if edge is None else y < edge.at(x) - gap
    frame = round(MARGIN * columns)
    margin = above & ((x < frame) | (x >= columns - frame) | (y < 0.5 * frame))
    if edge is None:
        margin |= y >= rows - 0.5 * frame
    behind, mask = margin, np.zeros_like(above)
    for last in (False, False, True):
        difference = lab - _surface(lab, behind)
        if mask.any():  # along the colour in which heap and background differ most; at last so that shades count little
            direction = difference[mask].mean(axis=0) - difference[above & ~mask].mean(axis=0)
            if last:
                direction = _discriminant(difference[mask], difference[above & ~mask], direction)
            tone = difference @ (direction / np.linalg.norm(direction))
        else:
            tone = np.linalg.norm(difference, axis=2)
        cut = filters.threshold_otsu(tone[above])
        mask = above & (tone > cut)
        if not mask.any() or not (above & ~mask).any():
            raise heap.NoHeap("no heap: the picture is of one tone")
        behind = above & ~_grown(mask, 3)
        if behind.sum() < 0.05 * behind.size:
            behind = margin
    rest = above & ~_grown(mask, 3)
    clear, uneven, contrast = 0.0, 1.0, 0.0
    if rest.any():
        clear = float(np.median(tone[mask]) - np.median(tone[rest]))
        uneven = float(1.4826 * np.median(np.abs(tone[rest] - np.median(tone[rest]))))
        contrast = float(np.linalg.norm(np.median(difference[mask], axis=0) - np.median(difference[rest], axis=0)))
    if contrast < LEAST_CONTRAST or clear < LEAST_CLEARNESS * uneven:
        raise heap.NoHeap(
            f"no heap stands out: the contrast is {contrast:.1f} CIELAB units, {clear / max(uneven, 1e-9):.1f} times what the "
            f"background itself varies by; expected {LEAST_CONTRAST:g} and {LEAST_CLEARNESS:g} times. Light the heap from the "
            "front before a background of another tone"
        )
    return Apart(mask, tone - cut, difference, contrast)


def _discriminant(one: np.ndarray, other: np.ndarray, apart: np.ndarray) -> np.ndarray:
    """Fisher's linear discriminant of two sets of tones whose means lie apart so far, its noise at least a CIELAB unit.

    A heap whose shaded grains are as bright as the wall still has its own colour (1936, doi:10.1111/j.1469-1809.1936.tb02137.x).
    """
    within = (np.cov(one, rowvar=False) + np.cov(other, rowvar=False)) / 2 + np.eye(len(apart))
    return np.linalg.solve(within, apart)


def _surface(lab: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Quadratic surface through the known pixels of each channel, outliers weighed down (Huber, three rounds)."""
    rows, columns, channels = lab.shape
    x, y = np.meshgrid(np.linspace(-1, 1, columns), np.linspace(-1, 1, rows))
    terms = np.stack([np.ones_like(x), x, y, x * x, y * y, x * y], axis=-1)
    at = np.flatnonzero(known.ravel())
    at = at[:: max(1, len(at) // 5_000)]
    some, values = terms.reshape(-1, 6)[at], lab.reshape(-1, channels)[at]
    weight = np.ones(len(at))
    for _ in range(4):
        weighed = some.T * weight
        found = np.linalg.solve(weighed @ some + 1e-9 * len(at) * np.eye(6), weighed @ values)
        off = np.linalg.norm(values - some @ found, axis=1)
        weight = np.minimum(1, 1.5 * np.median(off) / np.maximum(off, 1e-9))
    return terms @ found


def _grown(mask: np.ndarray, by: int) -> np.ndarray:
    from scipy.ndimage import binary_dilation

    return binary_dilation(mask, iterations=by)


def one_heap(mask: np.ndarray, edge: LevelLine | None) -> np.ndarray:
    """The one connected heap of a mask, its holes filled.

    Raises
    ------
    heap.NoHeap : none, two, or cut off by the border
    """
    from scipy.ndimage import binary_fill_holes, binary_opening, generate_binary_structure, label, sum_labels

    rows, columns = mask.shape
    around = generate_binary_structure(2, 1)
    opened = binary_opening(mask, around, iterations=max(1, round(0.004 * columns)))
    if edge is not None:  # holes that reach down to the plate are closed too
        y, x = np.mgrid[:rows, :columns]
        low = y >= edge.at(x) - max(3.0, 0.012 * rows)
        opened = binary_fill_holes(opened | low) & ~low
    else:
        opened = binary_fill_holes(opened)
    parts, count = label(opened, around)
    if count == 0:
        raise heap.NoHeap("no heap: nothing larger than a speck stands out from the background")
    sizes = sum_labels(opened, parts, np.arange(1, count + 1))
    order = np.argsort(-sizes)
    body = parts == order[0] + 1
    if sizes[order[0]] < 0.005 * mask.size:
        raise heap.NoHeap("no heap: nothing larger than half a percent of the picture stands out from the background")
    sides = {"left": body[:, :2], "right": body[:, -2:], "upper": body[:2], "lower": body[-2:]}
    cut = [name for name, strip in sides.items() if strip.any()]
    if cut:
        raise heap.NoHeap(
            f"the heap is cut off at the {' and the '.join(cut)} border of the picture; expected the whole heap with "
            "background on both sides and above it, and the plate's edge or background below"
        )
    if count > 1 and sizes[order[1]] > SECOND_HEAP * sizes[order[0]]:
        raise heap.NoHeap("two heaps, or a heap and something else of its size, stand out; expected one in a picture")
    return body
