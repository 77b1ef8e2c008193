"""Repose angle of a heap: four readings of its grains, of which two read a profile from a photograph as well.

- `flank`: straight lines through both flanks of each silhouette, from 20 to 80 % of the height. The straight line through
  the outline of a heap is the source paper's way (its Figure 10), so that its 41.69 deg is compared with this one.
- `triangle`: the least-squares isosceles triangle through each silhouette, as well from 20 to 80 % of the height.
- `moment`: the slope of the cone that has the moments of the grains' heights z and distances r from the axis,
  atan(2 <z>/<r>).
- `height`: atan(height / radius of the base), the reading of the tester of ISO 4324. There is none on an endless plate.

A rig calls

    try:
        found = heap.readings(centres, radii, base_radius)  # None: endless plate; grains of a rough base are not passed in
    except heap.NoHeap as reason:
        raise Failed(f"no heap: {reason}") from None
    found.repose.angle_deg, found.repose.standard_error_deg  # repose_angle_deg, direction_error_deg
    found.flank.angle_deg, found.triangle.angle_deg, found.moment.angle_deg  # flank: nan where found.no_flank says why

The heap is the connected body of most grains: strays on the plate or in the air count in no reading. A flat heap has an
angle; a layer one grain thick has 0 deg. Lengths are in any one unit.
"""

from typing import NamedTuple

import numpy as np

LOW, HIGH = 0.2, 0.8  # share of the heap's height between which a flank is fitted: no toe, no rounded or flat top
LEAST_POINTS = 8  # on a flank
LEAST_GRAINS = 12  # of a heap
PLACE = 0.25  # distance of the places of a profile made from grains, in their mean radius
DIRECTIONS = 12
SMOOTHED = 0.04  # of the profile's length, in which a median is taken to find the heap (not to fit it)
TOUCHING = 0.2  # gap between two grains of one body, at most, in the mean radius
SECOND_LAYER = 1.5  # height above which a centre lies on other grains, in the mean radius
BULK_BASE = 0.25  # height above the plate from which grains fill space as further up, in the mean radius
STRAY_SHARE = 0.01  # of the grains of a layer, which may lie on it
LEAST_FLANK = 3.0  # height that a flank must span, in the mean radius: a grain and a half
ROUNDS, STILL = 60, 1e-10  # of the search for the least-squares triangle; the last relative gain
FAR = 5.0  # median deviations from the running median from which on a point of a profile is an outlier


class NoHeap(ValueError):
    """Grains that are no heap, or a profile that cannot be read; the message says why."""


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


class Triangle(NamedTuple):
    """An isosceles triangle, height = max(0, top - slope |x - middle|)."""

    middle: float
    top: float
    slope: float

    @property
    def angle_deg(self) -> float:
        """Angle of its sides, deg."""
        return float(np.degrees(np.arctan(self.slope)))


class Reading(NamedTuple):
    """An angle and its standard error over the directions from which one heap is seen, deg."""

    angle_deg: float
    standard_error_deg: float


NO_READING = Reading(np.nan, np.nan)


class Readings(NamedTuple):
    """Three readings of one heap; `no_flank` says why the flank is nan, and is empty where it is not."""

    flank: Reading
    triangle: Reading
    moment: Reading
    no_flank: str = ""

    @property
    def repose(self) -> Reading:
        """The reading that stands for the repose angle: the triangle, chosen in results/checks/heap_reader.csv."""
        return self.triangle


def readings(centres, radii, base_radius: float | None = None) -> Readings:
    """Flank, triangle and moment of one heap, each a mean over directions.

    The standard errors are those over the directions of this one heap, the standard deviation over the root of their
    number (of the moment: by leaving out a sector at a time); heaps of other seeds scatter more, as neighbouring views
    share grains.

    Parameters
    ----------
    centres : (n, 3) array, z above the base, any one unit of length; grains of a rough base are left out
    radii : (n,) array, the same unit
    base_radius : of the disc about the axis x = y = 0 whose level is z = 0; None for an endless plate at z = 0

    Raises
    ------
    NoHeap : less than `LEAST_GRAINS` grains, in all or in the heap, or a disc narrower than a few grains
    ValueError : arrays that are no grains
    """
    radii = np.asarray(radii, dtype=float)
    centres = np.asarray(centres, dtype=float) if len(radii) else np.empty((0, 3))
    if centres.shape != (len(radii), 3) or not (np.isfinite(centres).all() and np.isfinite(radii).all()):
        raise ValueError(f"expected centres (n, 3) and radii (n,), finite; got {centres.shape} and {radii.shape}")
    if not (radii > 0).all() or not (base_radius is None or base_radius > 0):
        raise ValueError("expected radii and a base radius above 0")
    if len(radii):
        centres, radii = body(centres, radii)
    if len(radii) < LEAST_GRAINS:
        raise NoHeap(f"{len(radii)} grains that touch are no heap: expected {LEAST_GRAINS} or more")
    grain = float(radii.mean())
    profiles = [silhouette(centres, radii, np.pi * k / DIRECTIONS, base_radius) for k in range(DIRECTIONS)]
    flank, no_flank = _flanks(profiles, grain, base_radius is not None)
    if (centres[:, 2] > SECOND_LAYER * grain).mean() <= STRAY_SHARE:
        triangle = of_moments = Reading(0.0, 0.0)  # both would tell only how wide the layer is
    else:
        triangle = _mean([fit_triangle(*seen).angle_deg for seen in profiles])
        of_moments = moment(centres, radii, base_radius)
    return Readings(flank, triangle, of_moments, no_flank)


def _flanks(profiles, grain: float, cut: bool) -> tuple[Reading, str]:
    """Mean over the profiles of which most have two flanks, else why they have not."""
    if (HIGH - LOW) * np.median([height.max() for _, height in profiles]) < LEAST_FLANK * grain:
        return (
            NO_READING,
            f"a flank from {LOW:.0%} to {HIGH:.0%} of the height would be less than {LEAST_FLANK:g} radii high",
        )
    angles, reason = [], ""
    for x, height in profiles:
        try:
            angles.append(fit_flanks(x, height, cut=cut).angle_deg)
        except NoHeap as error:
            reason = str(error)
    if 2 * len(angles) <= len(profiles):
        return NO_READING, reason
    return _mean(angles), ""


def _mean(angles: list[float]) -> Reading:
    return Reading(float(np.mean(angles)), float(np.std(angles, ddof=1) / np.sqrt(len(angles))))


def moment(centres, radii, base_radius: float | None = None) -> Reading:
    """Slope of a cone from the moments of its grains' places, weighted by their volumes.

    With z the height above the base and r the distance from the vertical axis through the middle of the volume, a cone
    on a plate has

        tan(angle) = 2 <z> / <r>,

    z from `BULK_BASE` mean radii above the plate, where a packing of grains begins (so measured on cones of grains). On
    a disc, whose edge may cut the heap, the grains' mean height at a place is still half the surface's, and therefore

        tan(angle) = -2 cov(z, r) / var(r).

    Parameters
    ----------
    centres, radii : of the grains of one heap, as in `readings`, without strays
    base_radius : None on a plate

    Returns
    -------
    Angle, and its standard error from leaving out one of `DIRECTIONS` sectors at a time (jackknife)
    """
    centres, radii = np.asarray(centres, dtype=float), np.asarray(radii, dtype=float)
    volume = radii**3
    grain = volume @ radii / volume.sum()
    across = centres[:, :2] - volume @ centres[:, :2] / volume.sum()
    r, z = np.hypot(*across.T) / grain, centres[:, 2] / grain - BULK_BASE
    turn = np.arctan2(across[:, 1], across[:, 0]) / (2 * np.pi) + 0.5
    sector = np.minimum((DIRECTIONS * turn).astype(int), DIRECTIONS - 1)
    powers = volume / volume.sum() * np.stack([np.ones(len(r)), r, z, r * r, r * z])
    sums = np.stack([np.bincount(sector, power, DIRECTIONS) for power in powers])
    whole = sums.sum(axis=1, keepdims=True)
    slope = _slope_of_cone if base_radius is None else _slope_of_cut_cone
    without = np.degrees(np.arctan(slope(*(whole - sums))))
    error = np.sqrt((DIRECTIONS - 1) * np.mean((without - without.mean()) ** 2))
    return Reading(float(np.degrees(np.arctan(slope(*whole)))[0]), float(error))


def _slope_of_cone(volume, r, z, rr, rz) -> np.ndarray:
    """From the volume and the sums of r, z, r r and r z over it."""
    return 2 * z / r


def _slope_of_cut_cone(volume, r, z, rr, rz) -> np.ndarray:
    """From the same sums."""
    return -2 * (volume * rz - r * z) / (volume * rr - r * r)


def height_deg(centres, radii, base_radius: float | None) -> float | None:
    """atan(h/r) of a heap on a disc of radius r, h being the top of its highest grain above the disc, deg; None on a plate.

    The reading of the tester of ISO 4324. The highest grain stands out of the cone by up to its diameter.

    Parameters
    ----------
    centres, radii : of the grains of one heap, as in `readings`
    """
    if base_radius is None:
        return None
    centres, radii = body(centres, radii)
    return float(np.degrees(np.arctan((centres[:, 2] + radii).max() / base_radius)))


def body(centres, radii) -> tuple[np.ndarray, np.ndarray]:
    """The grains of the heap: the largest connected body, without strays on the plate and in the air.

    Two grains are connected where the gap between them is at most `TOUCHING` mean radii; twice, four times ... as much
    where no body has half of the grains, as in a layer of grains that do not touch.

    Parameters
    ----------
    centres : (n, 3) array
    radii : (n,) array

    Returns
    -------
    centres, radii : of m <= n grains
    """
    centres, radii = np.asarray(centres, dtype=float), np.asarray(radii, dtype=float)
    gap = TOUCHING * float(radii.mean())
    while True:
        label = _bodies(centres, radii, gap)
        grains = np.bincount(label)
        if 2 * grains.max() >= len(radii):
            inside = label == grains.argmax()
            return centres[inside], radii[inside]
        gap *= 2


def _bodies(centres: np.ndarray, radii: np.ndarray, gap: float) -> np.ndarray:
    """For every grain the smallest number of a grain of its body."""
    first, second = _neighbours(centres, radii, gap)
    label = np.arange(len(radii))
    while True:
        least = label.copy()
        np.minimum.at(least, first, label[second])
        np.minimum.at(least, second, label[first])
        least = least[least]
        if (least == label).all():
            return label
        label = least


def _neighbours(centres: np.ndarray, radii: np.ndarray, gap: float) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of grains with at most a gap between them, found in cubes that are as wide as the longest reach."""
    cube = np.floor((centres - centres.min(axis=0)) / (2 * radii.max() + gap)).astype(np.int64) + 1
    stride = np.array([1, cube[:, 0].max() + 2, (cube[:, 0].max() + 2) * (cube[:, 1].max() + 2)])
    key = cube @ stride
    order = np.argsort(key, kind="stable")
    ranked = key[order]
    pairs = []
    for shift in np.ndindex(3, 3, 3):
        wanted = key + (np.array(shift) - 1) @ stride
        start, end = np.searchsorted(ranked, wanted, "left"), np.searchsorted(ranked, wanted, "right")
        number = end - start
        first = np.repeat(np.arange(len(key)), number)
        second = order[np.arange(number.sum()) + np.repeat(start - np.cumsum(number) + number, number)]
        once = first < second
        first, second = first[once], second[once]
        near = np.linalg.norm(centres[first] - centres[second], axis=1) <= radii[first] + radii[second] + gap
        pairs.append((first[near], second[near]))
    return np.concatenate([p[0] for p in pairs]), np.concatenate([p[1] for p in pairs])


def silhouette(centres, radii, azimuth: float, base_radius: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Outline of grains above z = 0, seen along a horizontal direction, at places `PLACE` mean radii apart.

    height(x) = max over the grains of z + sqrt(r^2 - (x - u)^2), u = X cos(azimuth) + Y sin(azimuth); 0 where none is.

    Parameters
    ----------
    centres : (n, 3) array, m (or any one unit)
    radii : (n,) array
    azimuth : rad, of the horizontal axis x of the picture; 0 to pi covers all views, the rest are their mirror images
    base_radius : of a disc about the axis, on which the outline ends a mean radius before the edge; None for a plate

    Returns
    -------
    x, height : (places,) arrays
    """
    centres, radii = np.asarray(centres, dtype=float), np.asarray(radii, dtype=float)
    u = centres[:, 0] * np.cos(azimuth) + centres[:, 1] * np.sin(azimuth)
    place = PLACE * float(radii.mean())
    start = (u - radii).min() - place
    x = start + place * np.arange(int(np.ceil(((u + radii).max() - start) / place)) + 2)
    height = np.zeros(len(x))
    near = np.round((u - start) / place).astype(int)
    reach = int(np.ceil(radii.max() / place))
    for step in range(-reach, reach + 1):
        at = np.clip(near + step, 0, len(x) - 1)
        square = radii**2 - (x[at] - u) ** 2
        seen = square > 0
        np.maximum.at(height, at[seen], centres[seen, 2] + np.sqrt(square[seen]))
    if base_radius is not None:
        on = np.abs(x) <= base_radius - float(radii.mean())
        return x[on], height[on]
    return x, height


def fit_triangle(x, height, low: float = LOW, high: float = HIGH) -> Triangle:
    """The least-squares isosceles triangle through a profile without its toe and top, whatever its unit of length.

    Minimises, over the places where the running median is below `high` times the height (over all where that leaves no
    flanks), the sum of (h - max(0, top - slope |x - middle|))^2 with h = max(0, height - `low` times the height) (Levenberg-
    Marquardt, from two starts): what is above a level of a triangle is one of the same slope. Points further than `FAR`
    median deviations from the running median are put on it before. A profile that ends at the edges of a disc is fitted
    up to them. A profile without height has an angle of 0.

    Parameters
    ----------
    x : (n,) array, horizontal place, ascending, evenly spread, the same unit both ways (square pixels)
    height : (n,) array, above the plate, 0 where there is no heap
    low, high : shares of the height, 0 <= low < high; with 0 and above 1 it is the triangle through the whole profile

    Raises
    ------
    NoHeap : less than 4 `LEAST_POINTS` points
    ValueError : arrays that are no profile
    """
    x, height = _checked(x, height)
    smooth = _running_median(height, max(3, round(SMOOTHED * len(x))))
    away = np.abs(height - smooth)
    usual = np.median(away[smooth > 0]) if (smooth > 0).any() else 0.0
    tallest = smooth.max()
    if not tallest > 0:
        return Triangle(float(x.mean()), 0.0, 0.0)
    height = np.maximum(np.where(away > FAR * usual, smooth, height) - low * tallest, 0)
    total = height.sum()
    middle = float((x * height).sum() / total)
    half = 3 * float((np.abs(x - middle) * height).sum() / total)
    width = total * float(np.diff(x).mean())
    starts = [Triangle(middle, width / half, width / half**2)]  # of the profile's area and moments
    below = smooth < high * tallest
    flanks = below & (height > 0.1 * tallest)
    if flanks.sum() < LEAST_POINTS:
        below = flanks = np.ones(len(x), dtype=bool)
    falling, top = np.polyfit(np.abs(x[flanks] - middle), height[flanks], 1)
    starts.append(Triangle(middle, float(top), max(-float(falling), 1e-3 * starts[0].slope)))
    best = min((_descended(x[below], height[below], start) for start in starts), key=lambda found: found[0])[1]
    return best._replace(top=best.top + low * tallest)


def _descended(x: np.ndarray, height: np.ndarray, start: Triangle) -> tuple[float, Triangle]:
    """Sum of squares and triangle at the end of a descent."""

    def residual(found: np.ndarray) -> np.ndarray:
        return np.maximum(0, found[1] - found[2] * np.abs(x - found[0])) - height

    found, damping = np.array(start), 1e-3
    left = residual(found)
    for _ in range(ROUNDS):
        middle, top, slope = found
        inside = top - slope * np.abs(x - middle) > 0
        change = np.column_stack([slope * np.sign(x - middle), np.ones(len(x)), -np.abs(x - middle)]) * inside[:, None]
        square = change.T @ change
        scale = np.diag(square) + 1e-12 * np.trace(square) + 1e-300
        step = np.linalg.solve(square + damping * np.diag(scale), -change.T @ left)
        tried = found + step
        rest = residual(tried)
        gain = left @ left - rest @ rest
        if gain > 0:
            found, left, damping = tried, rest, damping / 3
            if gain < STILL * (left @ left):
                break
        else:
            damping *= 4
            if damping > 1e8:
                break
    return float(left @ left), Triangle(*map(float, found))


def fit_flanks(x, height, low: float = LOW, high: float = HIGH, cut: bool = False) -> Flanks:
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
    cut : the profile ends at the edges of a disc, and a flank there where it does not come down to `low` before

    Raises
    ------
    NoHeap : no heap in the profile, one that is cut off by the edge, or too few points on a flank
    ValueError : arrays that are no profile
    """
    if not 0 <= low < high <= 1:
        raise ValueError(f"low {low:g} and high {high:g}: expected 0 <= low < high <= 1")
    x, height = _checked(x, height)
    smooth = _running_median(height, max(3, round(SMOOTHED * len(x))))
    tallest = smooth.max()
    if tallest <= 0:
        raise NoHeap("the profile has no height above the plate")
    top = np.flatnonzero(smooth >= 0.9 * tallest)
    apex = int(round(np.median(top)))
    return Flanks(
        *(_flank(x, height, smooth / tallest, apex, step, low, high, cut) for step in (-1, 1)),
    )


def _running_median(values: np.ndarray, width: int) -> np.ndarray:
    half = width // 2
    padded = np.pad(values, half, mode="edge")
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1), axis=1)


def _flank(x, height, share, apex: int, step: int, low: float, high: float, cut: bool) -> Flank:
    """The flank left (step -1) or right (1) of the apex."""
    outwards = np.arange(apex, -1, -1) if step < 0 else np.arange(apex, len(x))
    below_high, below_low = share[outwards] < high, share[outwards] < low
    if not (cut or below_low.any()):
        raise NoHeap(f"the heap does not come down to {low:.0%} of its height on the {'left' if step < 0 else 'right'}")
    end = int(below_low.argmax()) if below_low.any() else len(outwards)
    points = outwards[int(below_high.argmax()) if below_high.any() else end : end]
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


def _checked(x, height) -> tuple[np.ndarray, np.ndarray]:
    x, height = np.asarray(x, dtype=float), np.asarray(height, dtype=float)
    if x.shape != height.shape or x.ndim != 1 or not np.isfinite([x, height]).all() or np.any(np.diff(x) <= 0):
        raise ValueError("expected x and height as two arrays of equal length, finite, x ascending")
    if len(x) < 4 * LEAST_POINTS:
        raise NoHeap(f"a profile of {len(x)} points is too coarse: expected {4 * LEAST_POINTS} or more")
    return x, height
