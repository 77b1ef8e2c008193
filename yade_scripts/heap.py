"""Repose angle of a heap: silhouettes of its grains, the profile of each, straight lines through both flanks.

The profile (height above the plate against the horizontal place) may as well come from a photograph: `fit_flanks` takes
any. The straight line through the outline of a heap is the source paper's way (its Figure 10).
"""

from typing import NamedTuple

import numpy as np

LOW, HIGH = 0.2, 0.8  # share of the heap's height between which a flank is fitted: no toe, no rounded or flat top
LEAST_POINTS = 8  # on a flank
PLACES = 400  # of a profile made from grains
DIRECTIONS = 24
SMOOTHED = 0.04  # of the profile's length, in which a median is taken to find the heap (not to fit it)


class NoHeap(ValueError):
    """A profile in which no two flanks can be fitted; the message says why."""


class Flank(NamedTuple):
    """A straight line height = height_at_0 + slope x through one flank, fitted between two places."""

    angle_deg: float
    slope: float
    height_at_0: float
    start: float
    end: float


class Flanks(NamedTuple):
    """Both flanks of a profile; left is the side of smaller x."""

    left: Flank
    right: Flank

    @property
    def angle_deg(self) -> float:
        """Mean of both angles, deg."""
        return 0.5 * (self.left.angle_deg + self.right.angle_deg)


class Angle(NamedTuple):
    """Repose angle over directions: mean, standard error, and the angle seen from each direction (deg)."""

    mean_deg: float
    standard_error_deg: float
    directions_deg: np.ndarray


def silhouette(centres, radii, azimuth: float, places: int = PLACES) -> tuple[np.ndarray, np.ndarray]:
    """Outline of grains on a level plate at z = 0, seen along a horizontal direction.

    height(x) = max over the grains of z + sqrt(r^2 - (x - u)^2), u = X cos(azimuth) + Y sin(azimuth); 0 where none is.

    Parameters
    ----------
    centres : (n, 3) array, m (or any one unit)
    radii : (n,) array
    azimuth : rad, of the horizontal axis x of the picture; 0 to pi covers all views, the rest are their mirror images
    places : number of x

    Returns
    -------
    x, height : (places,) arrays
    """
    centres, radii = np.asarray(centres, dtype=float), np.asarray(radii, dtype=float)
    u = centres[:, 0] * np.cos(azimuth) + centres[:, 1] * np.sin(azimuth)
    x = np.linspace((u - radii).min(), (u + radii).max(), places)
    height = np.zeros(places)
    for part in np.array_split(np.arange(len(u)), max(1, len(u) // 1000)):  # a thousand grains at a time
        square = radii[part, None] ** 2 - (x - u[part, None]) ** 2
        top = np.where(square > 0, centres[part, 2, None] + np.sqrt(np.maximum(square, 0)), 0.0)
        height = np.maximum(height, top.max(axis=0))
    return x, height


def fit_flanks(x, height, low: float = LOW, high: float = HIGH) -> Flanks:
    """Straight lines through both flanks of a profile, whatever its unit of length.

    The heap's height is that of the profile's running median, so that a grain on the top or in the air does not count.
    From the middle of its top each flank runs outwards from where the running median falls below `high` times the
    height to where it falls below `low` times it. The slope is the median of the slopes between all pairs of points
    (Theil 1950; Sen 1968, doi:10.1080/01621459.1968.10480934): up to 29 % of the points may lie anywhere.

    Parameters
    ----------
    x : (n,) array, horizontal place, in ascending order, the same unit both ways (square pixels)
    height : (n,) array, above the plate, 0 where there is no heap
    low, high : shares of the height, 0 <= low < high <= 1

    Raises
    ------
    NoHeap : no heap in the profile, one that is cut off by the edge, or too few points on a flank
    ValueError : arrays that are no profile
    """
    x, height = np.asarray(x, dtype=float), np.asarray(height, dtype=float)
    if x.shape != height.shape or x.ndim != 1 or not np.isfinite([x, height]).all() or np.any(np.diff(x) <= 0):
        raise ValueError("expected x and height as two arrays of equal length, finite, x ascending")
    if not 0 <= low < high <= 1:
        raise ValueError(f"low {low:g} and high {high:g}: expected 0 <= low < high <= 1")
    if len(x) < 4 * LEAST_POINTS:
        raise NoHeap(f"a profile of {len(x)} points is too coarse: expected {4 * LEAST_POINTS} or more")
    smooth = _running_median(height, max(3, round(SMOOTHED * len(x))))
    tallest = smooth.max()
    if tallest <= 0:
        raise NoHeap("the profile has no height above the plate")
    top = np.flatnonzero(smooth >= 0.9 * tallest)
    apex = int(round(np.median(top)))
    return Flanks(
        *(_flank(x, height, smooth / tallest, apex, step, low, high) for step in (-1, 1)),
    )


def _running_median(values: np.ndarray, width: int) -> np.ndarray:
    half = width // 2
    padded = np.pad(values, half, mode="edge")
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1), axis=1)


def _flank(x, height, share, apex: int, step: int, low: float, high: float) -> Flank:
    """The flank left (step -1) or right (1) of the apex."""
    outwards = np.arange(apex, -1, -1) if step < 0 else np.arange(apex, len(x))
    below_high, below_low = share[outwards] < high, share[outwards] < low
    if not below_low.any():
        raise NoHeap(f"the heap does not come down to {low:.0%} of its height on the {'left' if step < 0 else 'right'}")
    points = outwards[int(below_high.argmax()) : int(below_low.argmax())]
    if len(points) < LEAST_POINTS:
        raise NoHeap(
            f"only {len(points)} points on the {'left' if step < 0 else 'right'} flank: expected {LEAST_POINTS}"
        )
    slope = _median_slope(x[points], height[points])
    level = float(np.median(height[points] - slope * x[points]))
    ends = sorted((float(x[points[0]]), float(x[points[-1]])))
    return Flank(float(np.degrees(np.arctan(-step * slope))), slope, level, *ends)


def _median_slope(x: np.ndarray, y: np.ndarray) -> float:
    first, second = np.triu_indices(len(x), 1)
    return float(np.median((y[second] - y[first]) / (x[second] - x[first])))


def repose_angle(centres, radii, directions: int = DIRECTIONS) -> Angle:
    """Repose angle of grains on a level plate at z = 0: mean of both flanks over evenly spread directions.

    The standard error is that over the directions of this one heap, their standard deviation over the root of their
    number; heaps of other seeds scatter more, as neighbouring views share grains.

    Parameters
    ----------
    centres : (n, 3) array, any one unit of length
    radii : (n,) array
    directions : number of views between 0 and 180 deg, 2 or more

    Raises
    ------
    NoHeap : a silhouette has no two flanks
    """
    angles = np.array(
        [fit_flanks(*silhouette(centres, radii, np.pi * k / directions)).angle_deg for k in range(directions)]
    )
    return Angle(float(angles.mean()), float(angles.std(ddof=1) / np.sqrt(directions)), angles)
