"""The plate's edge in a picture: straight edges that run through both margins, where no heap is."""

from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

LEAST_COLUMNS = 8
MARGIN = 0.07  # share of the width on each side in which no heap is expected
STEEPEST_TILT_DEG = 15.0
EDGE_COLUMNS = 0.6  # share of the columns in each margin that must show the plate's edge
MOST_EDGES = 3
LEAST_SHARPNESS = 0.2  # of the sharpest edge
HIGHEST = 0.15  # share of the picture's height above which no plate is looked for

Number = TypeVar("Number", float, np.ndarray)


class LevelLine(NamedTuple):
    """A nearly level line in a picture, y = y_at_0 + slope x, pixels, y downwards: an edge of the plate, a heap's foot."""

    y_at_0: float
    slope: float

    def at(self, x: Number) -> Number:
        """y at x."""
        return self.y_at_0 + self.slope * x

    @property
    def tilt_deg(self) -> float:
        """Angle of the line, positive where it rises to the right."""
        return float(-np.degrees(np.arctan(self.slope)))


@dataclass(frozen=True)
class Candidates:
    """The sharpest changes along y in the columns of both margins: places (k,), their y (3, k), the change (3, k, CIELAB)."""

    places: np.ndarray
    y: np.ndarray
    change: np.ndarray
    left: slice  # of the columns
    right: slice

    @property
    def sharpness(self) -> np.ndarray:
        """How large each change is, (3, k)."""
        return np.linalg.norm(self.change, axis=2)


def plate_edges(lab: np.ndarray, first: int = 0, last: int | None = None) -> list[LevelLine]:
    """Straight edges that run through both margins of the picture (or of its columns first to last), uppermost first.

    In every column of the margins the three sharpest changes along y are candidates; a line counts that meets a
    candidate in most columns of both margins.
    """
    rows, columns, _ = lab.shape
    last = columns - 1 if last is None else last
    if last - first < 4 * LEAST_COLUMNS:
        return []
    changes = candidates(lab, first, last)
    reach = max(1.5, 0.004 * rows)
    free = np.ones_like(changes.y, dtype=bool)
    found: list[tuple[float, LevelLine]] = []
    for _ in range(MOST_EDGES):
        edge = sharpest_line(changes, free, reach)
        if edge is None:
            break
        sharpness, line, gap = edge
        found.append((sharpness, line))
        free &= gap > 3 * reach
    strongest = max((sharpness for sharpness, _ in found), default=0)
    middle = (first + last) / 2
    lines = [line for sharpness, line in found if sharpness > LEAST_SHARPNESS * strongest]
    return sorted((line for line in lines if line.at(middle) > HIGHEST * rows), key=lambda line: line.at(middle))


def candidates(lab: np.ndarray, first: int, last: int) -> Candidates:
    """The three sharpest changes along y in some columns of each margin."""
    width = max(LEAST_COLUMNS, round(MARGIN * (last - first + 1)))
    side = np.linspace(0, width - 1, min(width, 20)).round().astype(int)
    places = np.r_[first + side, last - side[::-1]]
    steps = np.gradient(lab[:, places], axis=0)
    change = np.linalg.norm(steps, axis=2)
    change[[0, -1]] = 0
    peak = (change[1:-1] >= change[:-2]) & (change[1:-1] > change[2:])
    height = np.where(peak, change[1:-1], 0)
    y = np.argsort(-height, axis=0)[:3] + 1  # (3, columns of both margins)
    at = np.take_along_axis(np.where(change[..., None] > 0, steps, 0), y[..., None], axis=0)
    return Candidates(places, y + _vertex(change, y), at, slice(0, len(side)), slice(len(side), None))


def sharpest_line(changes: Candidates, free: np.ndarray, reach: float) -> tuple[float, LevelLine, np.ndarray] | None:
    """The line through a free candidate of each margin that meets the sharpest ones within `reach` pixels.

    Both candidates change the same way: a line from the upper edge of a thin plate to its lower one is none.

    Returns
    -------
    Its sharpness, the line fitted to what it meets, and the distance (3, k) of the candidates; None where no line meets
    enough columns of both margins.
    """
    places, y, left, right, sharpness = changes.places, changes.y, changes.left, changes.right, changes.sharpness
    start, from_start = _ends(changes, free, left)
    end, from_end = _ends(changes, free, right)
    slope = (end[None, :, 1] - start[:, None, 1]) / (end[None, :, 0] - start[:, None, 0])
    at_0 = start[:, None, 1] - slope * start[:, None, 0]
    level = (np.abs(slope) < np.tan(np.radians(STEEPEST_TILT_DEG))) & (from_start @ from_end.T > 0)
    slope, at_0 = slope[level], at_0[level]
    if not len(slope):
        return None
    gap = np.abs(y[None] - (at_0[:, None, None] + slope[:, None, None] * places))
    met = ((gap < reach) & free).any(axis=1)
    share = np.minimum(met[:, left].mean(axis=1), met[:, right].mean(axis=1))
    near = np.where((gap < reach) & free, sharpness, 0).max(axis=1).sum(axis=1)
    best = int(np.argmax(np.where(share >= EDGE_COLUMNS, near, -1)))
    if share[best] < EDGE_COLUMNS:
        return None
    on = (gap[best] < reach) & free
    x_on, y_on = np.broadcast_to(places, y.shape)[on], y[on]
    fitted_slope, fitted_at_0 = np.polyfit(x_on, y_on, 1)
    return near[best], LevelLine(float(fitted_at_0), float(fitted_slope)), gap[best]


def _ends(changes: Candidates, free: np.ndarray, margin: slice) -> tuple[np.ndarray, np.ndarray]:
    """Places (k, 2) and changes (k, CIELAB) of the free candidates of a margin."""
    at = free[:, margin].ravel()
    place = np.column_stack([np.tile(changes.places[margin], 3), changes.y[:, margin].ravel()])
    return place[at], changes.change[:, margin].reshape(-1, changes.change.shape[2])[at]


def _vertex(values: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Place of the maximum between the rows, from the parabola through three of them."""
    here, before, after = (np.take_along_axis(values, y + d, axis=0) for d in (0, -1, 1))
    bend = before - 2 * here + after
    return np.where(bend < 0, 0.5 * (before - after) / np.where(bend < 0, bend, 1), 0)
