"""The repose angle of a heap in a photograph: heap told from background, profile, both flanks and a triangle fitted.

The plate's edge is looked for at both sides of the picture, where no heap is (`plate`): it gives the camera's tilt and the
line the heap stands on. Above it are only background and heap (`segmentation`). The profile and its lines are those of
yade_scripts/heap.py. The camera should look along the plate, at the height of the heap.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from pellet_study.errors import InputError
from pellet_study.heap.doubts import of_light, of_view
from pellet_study.heap.pixels import read
from pellet_study.heap.plate import LevelLine, plate_edges
from pellet_study.heap.segmentation import Apart, apart, one_heap, smooth_lab
from yade_scripts import heap

SECOND_TOP = 0.2  # share of its height by which a second top must stand out
UNSURE_DEG = 3.5  # uncertainty from which on the lines miss the flanks; level views of heaps stay below
UNLIKE_DEG, UNLIKE = 3.0, 4.0  # difference of the flanks that counts, and in standard errors of its half
FOOT = "heap's foot"  # what the level is taken from where no plate's edge is seen
PLACED = 0.25  # pixels to which an end of a fitted line is known at best


class Photograph(NamedTuple):
    """What was found: `outline` (n, 2) in pixels of `pixels` (rows, columns, 3; 0 to 1), `flanks`, `triangle` along `base`;
    `doubts` say what in the picture speaks against the reading."""

    pixels: np.ndarray
    outline: np.ndarray
    base: LevelLine
    base_is: str
    flanks: heap.Flanks
    triangle: heap.Triangle
    flank_error_deg: float
    triangle_error_deg: float
    doubts: tuple[str, ...] = ()

    @property
    def angle_deg(self) -> float:
        """The repose angle, deg: the triangle's, as `heap.Readings.repose` of grains."""
        return self.triangle.angle_deg


def measure(file: Path, horizon_deg: float | None = None) -> Photograph:
    """The repose angle in a photograph.

    Parameters
    ----------
    file : any picture that Pillow reads
    horizon_deg : tilt of the level in the picture, positive where it rises to the right; default: the plate's edge

    Raises
    ------
    InputError : no picture, or no heap in it that can be measured; says which
    """
    pixels = read(file)
    try:
        return find(pixels, horizon_deg)
    except heap.NoHeap as error:
        raise InputError(f"{file}: {error}") from None


def find(pixels: np.ndarray, horizon_deg: float | None = None) -> Photograph:
    """The heap in a picture, its outline, its flanks.

    Raises
    ------
    heap.NoHeap : none, cut off, two of them, or too little contrast
    InputError : scikit-image is not installed
    """
    lab = smooth_lab(pixels)
    problems: list[heap.NoHeap] = []
    wide = None
    for edge in [*plate_edges(lab), None]:
        try:
            seen = apart(lab, edge)
            wide = np.flatnonzero(seen.mask.any(axis=0))[[0, -1]]
            return _measured(pixels, lab, seen, edge, horizon_deg)
        except heap.NoHeap as error:
            problems.append(error)
    for edge in plate_edges(lab, *wide) if wide is not None else ():  # of a plate that ends inside the picture
        try:
            return _measured(pixels, lab, apart(lab, edge), edge, horizon_deg)
        except heap.NoHeap:
            pass
    raise problems[0]


def _measured(
    pixels: np.ndarray, lab: np.ndarray, seen: Apart, edge: LevelLine | None, horizon_deg: float | None
) -> Photograph:
    """The heap in a mask: one, whole, of the shape of a heap; its outline and flanks."""
    body, tone = one_heap(seen.mask, edge), seen.tone
    columns = body.shape[1]
    at = np.flatnonzero(body.any(axis=0))
    top = body[:, at].argmax(axis=0)
    before = np.maximum(top - 1, 0)
    step = tone[top, at] - tone[before, at]
    inner = np.clip(np.where(step > 0, tone[top, at] / np.where(step > 0, step, 1), 0), 0, 1)
    outline = np.column_stack([at, top - inner])
    base, base_is = _base(body, edge, horizon_deg)
    x, height = _profile(outline, base, columns)
    _one_top(height)
    flanks = heap.fit_flanks(x, height)
    if (
        min(flanks.left.angle_deg, flanks.right.angle_deg) < 3
        or max(flanks.left.angle_deg, flanks.right.angle_deg) > 80
    ):
        raise heap.NoHeap(
            f"what stands out is no heap: its sides lie at {flanks.left.angle_deg:.0f} and {flanks.right.angle_deg:.0f} deg"
        )
    triangle = heap.fit_triangle(x, height)
    of_flanks = _error_deg(x, height, flanks)
    of_sides = _error_deg(x, height, sides(triangle, heap.LOW, heap.HIGH))
    uneven = triangle.angle_deg - flanks.angle_deg  # both sides alike, a line each: what the choice is worth
    left, right = flanks.left.angle_deg, flanks.right.angle_deg
    apart_deg = abs(left - right) / 2  # standard error of the mean of two
    flank_error, triangle_error = np.hypot(of_flanks, apart_deg), np.hypot(np.hypot(of_sides, uneven), apart_deg)
    doubts = [*of_view(lab, body, edge, triangle.angle_deg), *of_light(seen.difference, body, seen.contrast)]
    if of_flanks > UNSURE_DEG:
        doubts.append(f"the sides are no straight lines (+- {of_flanks:.1f} deg)")
    elif apart_deg > max(UNLIKE_DEG / 2, UNLIKE * of_flanks):
        doubts.append(f"the sides differ (left {left:.1f}, right {right:.1f} deg) by more than they are uneven")
    elif base_is == FOOT and triangle_error > UNSURE_DEG:
        doubts.append(
            f"no plate's edge is seen, and the foot is as uneven as the sides (+- {triangle_error:.1f} deg): no level"
        )
    return Photograph(
        pixels, outline, base, base_is, flanks, triangle, float(flank_error), float(triangle_error), tuple(doubts)
    )


def _error_deg(x: np.ndarray, height: np.ndarray, flanks: heap.Flanks) -> float:
    """Standard error of the mean angle of two lines."""
    left, right = (slope_error_deg(x, height, flank) for flank in flanks)
    return float(np.hypot(left, right) / 2)


def _base(body: np.ndarray, edge: LevelLine | None, horizon_deg: float | None) -> tuple[LevelLine, str]:
    """The level line the heap stands on, and what it was taken from."""
    from scipy.stats import theilslopes

    rows, columns = body.shape
    at = np.flatnonzero(body.any(axis=0))
    foot = rows - 1 - body[::-1, at].argmax(axis=0)
    if horizon_deg is not None:
        slope = -np.tan(np.radians(horizon_deg))
        y_at_0 = edge.at(columns / 2) - slope * columns / 2 if edge else float(np.median(foot - slope * at))
        return LevelLine(float(y_at_0), float(slope)), "--horizon"
    if edge is not None:
        return edge, "plate's edge"
    slope = theilslopes(foot, at)[0]
    return LevelLine(float(np.median(foot - slope * at)), float(slope)), FOOT


def _profile(outline: np.ndarray, base: LevelLine, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Height above the base line against the place along it, a point a pixel, 0 on both sides of the heap."""
    turn = np.arctan(base.slope)
    along = outline[:, 0] * np.cos(turn) + (outline[:, 1] - base.y_at_0) * np.sin(turn)
    height = outline[:, 0] * np.sin(turn) - (outline[:, 1] - base.y_at_0) * np.cos(turn)
    room = 0.05 * np.ptp(along)
    x = np.arange(np.floor(along.min() - room), np.ceil(along.max() + room) + 1)
    order = np.argsort(along, kind="stable")
    return x, np.maximum(np.interp(x, along[order], height[order], left=0, right=0), 0)


def _one_top(height: np.ndarray) -> None:
    """Raise heap.NoHeap where a profile has two tops."""
    from scipy.ndimage import median_filter
    from scipy.signal import find_peaks

    smooth = median_filter(height, max(3, round(heap.SMOOTHED * len(height))))
    if len(find_peaks(smooth, prominence=SECOND_TOP * smooth.max())[0]) > 1:
        raise heap.NoHeap("two heaps that touch stand out; expected one in a picture")


def sides(triangle: heap.Triangle, low: float = 0.0, high: float = 1.0) -> heap.Flanks:
    """Both sides of a triangle as lines between two shares of its height."""
    middle, top, slope = triangle
    inner, outer = (1 - high) * top / slope, (1 - low) * top / slope
    return heap.Flanks(
        heap.Flank(triangle.angle_deg, slope, top - slope * middle, middle - outer, middle - inner),
        heap.Flank(triangle.angle_deg, -slope, top + slope * middle, middle + inner, middle + outer),
    )


def slope_error_deg(x: np.ndarray, height: np.ndarray, flank: heap.Flank) -> float:
    """Standard error of a flank's angle from the scatter about the least-squares line there, neighbours being alike.

    sd sqrt(tau / sum (x - mean)^2), tau the integrated autocorrelation of the residuals up to its first negative value;
    1.25 for a median instead of a mean; and a quarter of a pixel over the flank's length.
    """
    on = (x >= flank.start) & (x <= flank.end)
    left = height[on] - np.polyval(np.polyfit(x[on], height[on], 1), x[on])
    power = np.correlate(left, left, "full")[len(left) - 1 :]
    alike = power / power[0] if power[0] > 0 else np.zeros(len(left))
    positive = np.flatnonzero(alike < 0)
    tau = 1 + 2 * alike[1 : positive[0] if len(positive) else len(alike)].sum()
    error = 1.25 * left.std(ddof=2) * np.sqrt(tau / ((x[on] - x[on].mean()) ** 2).sum())
    error = np.hypot(error, PLACED / (flank.end - flank.start))
    return float(np.degrees(error / (1 + flank.slope**2)))
