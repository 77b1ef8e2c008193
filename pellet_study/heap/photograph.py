"""The repose angle of a heap in a photograph: heap told from background, profile, both flanks fitted.

The plate's edge is looked for at both sides of the picture, where no heap is: it gives the camera's tilt and the line the
heap stands on. Above it are only background and heap: the background is a smooth surface through the picture's margin
(uneven light), and Otsu's threshold (1979, doi:10.1109/TSMC.1979.4310076) parts what differs from it. The profile and
its lines are those of yade_scripts/heap.py. The camera should look along the plate, at the height of the heap.
"""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pellet_study.errors import InputError
from yade_scripts import heap

LONGEST = 1000  # pixels of the longer side that are looked at
SHORTEST = 64
LEAST_COLUMNS = 8
MARGIN = 0.07  # share of the width on each side in which no heap is expected
STEEPEST_TILT_DEG = 15.0
EDGE_COLUMNS = 0.6  # share of the columns in each margin that must show the plate's edge
LEAST_CONTRAST = 5.0  # of heap to background, in CIELAB units; 2.3 is the least one can see
LEAST_CLEARNESS = 4.0  # contrast over the background's own unevenness
SECOND_HEAP = 0.05  # share of the largest heap's area from which on another one counts
SECOND_TOP = 0.2  # share of its height by which a second top must stand out
PLACED = 0.25  # pixels to which an end of a fitted line is known at best


class Line(NamedTuple):
    """A straight line in the picture, y = y_at_0 + slope x, pixels, y downwards."""

    y_at_0: float
    slope: float

    def at(self, x):
        """y at x."""
        return self.y_at_0 + self.slope * x

    @property
    def tilt_deg(self) -> float:
        """Angle of the line, positive where it rises to the right."""
        return float(-np.degrees(np.arctan(self.slope)))


class Photograph(NamedTuple):
    """What was found: `outline` (n, 2) in pixels of `pixels` (rows, columns, 3; 0 to 1), `flanks` along `base`."""

    pixels: np.ndarray
    outline: np.ndarray
    base: Line
    base_is: str
    flanks: heap.Flanks
    uncertainty_deg: float

    @property
    def angle_deg(self) -> float:
        """Mean angle of both flanks, deg."""
        return self.flanks.angle_deg


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


def read(file: Path) -> np.ndarray:
    """A picture as (rows, columns, 3) array, 0 to 1, upright, its longer side at most `LONGEST` pixels.

    Raises
    ------
    InputError : no picture, or one too small or too large
    """
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with Image.open(file) as opened:
            picture: Any = opened
            if min(picture.size) < SHORTEST:
                raise InputError(
                    f"{file}: {picture.width} x {picture.height} pixels; expected {SHORTEST} or more each way"
                )
            picture.draft("RGB", (2 * LONGEST, 2 * LONGEST))
            picture = ImageOps.exif_transpose(picture)
            if picture.mode[0] in "IF":  # 16 and 32 bits a pixel
                values = np.asarray(picture, dtype=float)
                span = float(np.ptp(values)) or 1.0
                picture = Image.fromarray(np.uint8(255 * (values - values.min()) / span))
            if picture.mode in ("RGBA", "LA", "PA") or "transparency" in picture.info:
                picture = picture.convert("RGBA")
                picture = Image.alpha_composite(Image.new("RGBA", picture.size, "white"), picture)
            picture = picture.convert("RGB")
            picture.thumbnail((LONGEST, LONGEST))
            return np.asarray(picture, dtype=float) / 255
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except Image.DecompressionBombError:
        raise InputError(f"{file}: the picture is too large; make it smaller") from None
    except UnidentifiedImageError:
        raise InputError(f"{file}: is no picture that can be read; expected JPEG, PNG, TIFF or the like") from None
    except (OSError, SyntaxError, ValueError) as error:
        raise InputError(f"{file}: cannot be read as a picture: {error}") from None


def find(pixels: np.ndarray, horizon_deg: float | None = None) -> Photograph:
    """The heap in a picture, its outline, its flanks.

    Raises
    ------
    heap.NoHeap : none, cut off, two of them, or too little contrast
    InputError : scikit-image is not installed
    """
    color, filters = _skimage()
    smooth = filters.gaussian(pixels, sigma=max(1.0, 0.0025 * max(pixels.shape)), channel_axis=2)
    lab = color.rgb2lab(smooth)
    problem, wide = None, None
    for edge in [*plate_edges(lab), None]:
        try:
            mask, tone = apart(lab, edge)
            wide = np.flatnonzero(mask.any(axis=0))[[0, -1]]
            return _measured(pixels, mask, tone, edge, horizon_deg)
        except heap.NoHeap as error:
            problem = problem or error
    for edge in plate_edges(lab, *wide) if wide is not None else ():  # of a plate that ends inside the picture
        try:
            return _measured(pixels, *apart(lab, edge), edge, horizon_deg)
        except heap.NoHeap:
            pass
    raise problem


def _skimage():
    try:
        from skimage import color, filters
    except ImportError:
        raise InputError("angle needs scikit-image: pip install 'pellet-study[angle]'") from None
    return color, filters


def plate_edges(lab: np.ndarray, first: int = 0, last: int | None = None) -> list[Line]:
    """Straight edges that run through both margins of the picture (or of its columns first to last), uppermost first.

    In every column of the margins the three sharpest changes along y are candidates; a line counts that meets a
    candidate in most columns of both margins.
    """
    rows, columns, _ = lab.shape
    last = columns - 1 if last is None else last
    if last - first < 4 * LEAST_COLUMNS:
        return []
    width = max(LEAST_COLUMNS, round(MARGIN * (last - first + 1)))
    side = np.linspace(0, width - 1, min(width, 20)).round().astype(int)
    places = np.r_[first + side, last - side[::-1]]
    change = np.linalg.norm(np.gradient(lab[:, places], axis=0), axis=2)
    change[[0, -1]] = 0
    peak = (change[1:-1] >= change[:-2]) & (change[1:-1] > change[2:])
    height = np.where(peak, change[1:-1], 0)
    y = np.argsort(-height, axis=0)[:3] + 1  # (3, columns of both margins)
    sharp = np.take_along_axis(change, y, axis=0)
    y = y + _vertex(change, y)
    left, right = slice(0, len(side)), slice(len(side), None)
    found: list[tuple[float, Line]] = []
    free = np.ones_like(y, dtype=bool)
    reach = max(1.5, 0.004 * rows)
    for _ in range(3):
        start = np.column_stack([np.tile(places[left], 3), y[:, left].ravel()])[free[:, left].ravel()]
        end = np.column_stack([np.tile(places[right], 3), y[:, right].ravel()])[free[:, right].ravel()]
        slope = (end[None, :, 1] - start[:, None, 1]) / (end[None, :, 0] - start[:, None, 0])
        at_0 = start[:, None, 1] - slope * start[:, None, 0]
        level = np.abs(slope) < np.tan(np.radians(STEEPEST_TILT_DEG))
        slope, at_0 = slope[level], at_0[level]
        if not len(slope):
            break
        gap = np.abs(y[None] - (at_0[:, None, None] + slope[:, None, None] * places))
        met = ((gap < reach) & free).any(axis=1)
        share = np.minimum(met[:, left].mean(axis=1), met[:, right].mean(axis=1))
        near = np.where((gap < reach) & free, sharp, 0).max(axis=1).sum(axis=1)
        best = int(np.argmax(np.where(share >= EDGE_COLUMNS, near, -1)))
        if share[best] < EDGE_COLUMNS:
            break
        on = (gap[best] < reach) & free
        x_on, y_on = np.broadcast_to(places, y.shape)[on], y[on]
        fitted_slope, fitted_at_0 = np.polyfit(x_on, y_on, 1)
        found.append((near[best], Line(float(fitted_at_0), float(fitted_slope))))
        free &= gap[best] > 3 * reach
    strongest = max((sharpness for sharpness, _ in found), default=0)
    middle = (first + last) / 2
    lines = [line for sharpness, line in found if sharpness > 0.2 * strongest]
    return sorted((line for line in lines if line.at(middle) > 0.15 * rows), key=lambda line: line.at(middle))


def _vertex(values: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Place of the maximum between the rows, from the parabola through three of them."""
    here, before, after = (np.take_along_axis(values, y + d, axis=0) for d in (0, -1, 1))
    bend = before - 2 * here + after
    return np.where(bend < 0, 0.5 * (before - after) / np.where(bend < 0, bend, 1), 0)


def apart(lab: np.ndarray, edge: Line | None) -> tuple[np.ndarray, np.ndarray]:
    """What stands out from the background above the plate's edge: a mask, and the tone it was cut from at 0.

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
    behind, mask = margin, None
    for _ in range(3):
        difference = lab - _surface(lab, behind)
        if mask is None:
            tone = np.linalg.norm(difference, axis=2)
        else:
            direction = difference[mask].mean(axis=0) - difference[above & ~mask].mean(axis=0)
            tone = difference @ (direction / np.linalg.norm(direction))
        cut = filters.threshold_otsu(tone[above])
        mask = above & (tone > cut)
        if not mask.any() or not (above & ~mask).any():
            raise heap.NoHeap("no heap: the picture is of one tone")
        behind = above & ~_grown(mask, 3)
        if behind.sum() < 0.05 * behind.size:
            behind = margin
    rest = above & ~_grown(mask, 3)
    contrast = float(np.median(tone[mask]) - np.median(tone[rest])) if rest.any() else 0.0
    uneven = float(1.4826 * np.median(np.abs(tone[rest] - np.median(tone[rest])))) if rest.any() else 1.0
    if contrast < LEAST_CONTRAST or contrast < LEAST_CLEARNESS * uneven:
        raise heap.NoHeap(
            f"no heap stands out: the contrast is {contrast:.1f} CIELAB units where the background itself varies by "
            f"{uneven:.1f}; expected {LEAST_CONTRAST:g} and {LEAST_CLEARNESS:g} times that. Light the heap from the front "
            "before a background of another tone"
        )
    return mask, tone - cut


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


def _measured(pixels, mask, tone, edge: Line | None, horizon_deg: float | None) -> Photograph:
    """The heap in a mask: one, whole, of the shape of a heap; its outline and flanks."""
    body = _body(mask, edge)
    rows, columns = mask.shape
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
    spread = [slope_error_deg(x, height, flank) for flank in flanks]
    return Photograph(pixels, outline, base, base_is, flanks, float(np.hypot(spread[0], spread[1]) / 2))


def _body(mask: np.ndarray, edge: Line | None) -> np.ndarray:
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


def _base(body: np.ndarray, edge: Line | None, horizon_deg: float | None) -> tuple[Line, str]:
    """The level line the heap stands on, and what it was taken from."""
    from scipy.stats import theilslopes

    rows, columns = body.shape
    at = np.flatnonzero(body.any(axis=0))
    foot = rows - 1 - body[::-1, at].argmax(axis=0)
    if horizon_deg is not None:
        slope = -np.tan(np.radians(horizon_deg))
        y_at_0 = edge.at(columns / 2) - slope * columns / 2 if edge else float(np.median(foot - slope * at))
        return Line(float(y_at_0), float(slope)), "--horizon"
    if edge is not None:
        return edge, "plate's edge"
    slope = theilslopes(foot, at)[0]
    return Line(float(np.median(foot - slope * at)), float(slope)), "heap's foot"


def _profile(outline: np.ndarray, base: Line, columns: int) -> tuple[np.ndarray, np.ndarray]:
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


def slope_error_deg(x: np.ndarray, height: np.ndarray, flank: heap.Flank) -> float:
    """Standard error of a flank's angle from the scatter about its line, neighbours being alike.

    sd sqrt(tau / sum (x - mean)^2), tau the integrated autocorrelation of the residuals up to its first negative value;
    1.25 for a median instead of a mean; and a quarter of a pixel over the flank's length.
    """
    on = (x >= flank.start) & (x <= flank.end)
    left = height[on] - flank.height_at_0 - flank.slope * x[on]
    left = left - left.mean()
    power = np.correlate(left, left, "full")[len(left) - 1 :]
    alike = power / power[0] if power[0] > 0 else np.zeros(len(left))
    positive = np.flatnonzero(alike < 0)
    tau = 1 + 2 * alike[1 : positive[0] if len(positive) else len(alike)].sum()
    error = 1.25 * left.std(ddof=2) * np.sqrt(tau / ((x[on] - x[on].mean()) ** 2).sum())
    error = np.hypot(error, PLACED / (flank.end - flank.start))
    return float(np.degrees(error / (1 + flank.slope**2)))
