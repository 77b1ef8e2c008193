"""What in a picture's geometry speaks against its reading: a camera above the level, a shadow taken for heap.

The scatter of a profile about its lines does not tell: a heap seen from above has straight sides too, only flatter ones.
"""

import numpy as np

from pellet_study.heap.plate import LevelLine

FOOT = 0.9  # share of the foot's width, about its middle, in which its bend is looked for
LEAST_BIAS_DEG = 0.4  # by which a view from above may flatten a heap without being named
LEAST_STEP = 4.0  # pixels between a heap's foot and its level that count
STEP = 0.04  # and as share of the heap's height
STRIP = 0.12  # width of the strip along a flank, as share of the foot's
OTHER_TONE = 0.35  # of a strip, as share of the contrast between heap and background
LEAST_TONE = 6.0  # CIELAB units that count as another tone
LEAST_STRIP = (
    10.0  # CIELAB units by which a strip is darker that no shading of an evenly lit cone makes (95 % of rendered ones)
)


def elevation_deg(body: np.ndarray) -> float:
    """Elevation of the camera, deg, from the bend of the foot: a round foot is seen as half an ellipse of axes 1 : sin(elevation).

    Least squares of foot = a + b p + c sqrt(1 - p^2) over the places p, -1 to 1 across the foot; c over the half width is
    the sine.
    """
    at = np.flatnonzero(body.any(axis=0))
    foot = len(body) - 1 - body[::-1, at].argmax(axis=0)
    half = 0.5 * (at[-1] - at[0])
    place = (at - at[0]) / half - 1
    near = np.abs(place) < FOOT
    terms = np.column_stack([np.ones(near.sum()), place[near], np.sqrt(1 - place[near] ** 2)])
    bend = np.linalg.lstsq(terms, foot[near], rcond=None)[0][2]
    return float(np.degrees(np.arcsin(np.clip(bend / half, 0, 1))))


def bias_deg(seen_deg: float, elevation: float) -> float:
    """By how much a cone whose outline has an angle is steeper, seen from an elevation: tan^2 seen = tan^2 cos^2 - sin^2."""
    sine, cosine = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
    return float(np.degrees(np.arctan(np.hypot(np.tan(np.radians(seen_deg)), sine) / cosine)) - seen_deg)


def of_view(lab: np.ndarray, body: np.ndarray, edge: LevelLine | None, seen_deg: float) -> list[str]:
    """Why the camera does not look along the plate at the height of the heap; nothing where it does."""
    found = []
    elevation = elevation_deg(body)
    bias = bias_deg(seen_deg, elevation)
    if bias > LEAST_BIAS_DEG:
        found.append(
            f"the heap's foot is curved, as where it is seen from above (by {elevation:.0f} deg): it may be {bias:.1f} deg steeper"
        )
    if edge is None:
        return found
    above, below = _past_edge(lab, body, edge)
    if above:
        found.append(
            f"the heap ends {above:.0f} pixels above the plate's edge that its level was taken from, as seen from above"
        )
    if below:
        found.append("the heap goes on below the plate's edge that its level was taken from, as seen from above")
    return found


def _past_edge(lab: np.ndarray, body: np.ndarray, edge: LevelLine) -> tuple[float, bool]:
    """By how many pixels a heap ends above an edge (0: not at all), and whether it goes on below."""
    rows, columns = body.shape
    at = np.flatnonzero(body.any(axis=0))
    width = at[-1] - at[0]
    inner = np.arange(at[0] + width // 4, at[-1] - width // 4)
    line = edge.at(inner.astype(float))
    foot = rows - 1 - body[::-1, inner].argmax(axis=0)
    tall = float(line.mean()) - np.flatnonzero(body.any(axis=1))[0]
    gap = max(3.0, 0.012 * rows) + 1
    outer = np.array([at[0] // 2, (at[-1] + columns) // 2])  # half way to the border: further down a heap is wider
    step = float(np.median(line - foot)) - gap
    ends_above = step > max(LEAST_STEP, STEP * tall)
    if ends_above:
        return step, False
    depth = np.linspace(gap, gap + 0.1 * tall, 8)
    depth = depth[depth < rows - 2 - line.max()]
    if len(depth) < 3:
        return 0.0, False
    middle, beside = np.array([[_across(lab, edge, columns, d) for d in depth] for columns in (inner, outer)])
    itself = _across(lab, edge, inner, -2 * gap)
    to_plate, to_heap = np.linalg.norm(middle - beside, axis=1), np.linalg.norm(middle - itself, axis=1)
    return 0.0, bool(np.median(to_plate) > LEAST_TONE and np.median(to_heap) < np.median(to_plate))


def _across(lab: np.ndarray, edge: LevelLine, columns: np.ndarray, offset: float) -> np.ndarray:
    """Median tone of some columns so far below an edge."""
    row = np.clip((edge.at(columns.astype(float)) + offset).astype(int), 0, len(lab) - 1)
    return np.median(lab[row, columns], axis=0)


def of_light(difference: np.ndarray, body: np.ndarray, contrast: float) -> list[str]:
    """Which sides of a heap have another tone than its middle, or lie beside a background that has, as shadows make it.

    Parameters
    ----------
    difference : (rows, columns, 3) of the picture from its background, CIELAB
    body : the heap
    contrast : of the heap to the background, CIELAB
    """
    rows = np.flatnonzero(body.any(axis=1))
    tall = len(rows)
    band = rows[int(0.3 * tall) : int(0.8 * tall)]
    first, last = body[band].argmax(axis=1), body.shape[1] - 1 - body[band, ::-1].argmax(axis=1)
    wide = max(3, round(STRIP * (last - first).max()))
    middle = (first + last) // 2
    inside = _tone(difference, body, band, middle - wide, middle + wide)
    least = max(LEAST_STRIP, OTHER_TONE * contrast)
    found = []
    for side, start, end, out in (
        ("left", first + 2, first + 2 + wide, (first - 2 - wide, first - 2)),
        ("right", last - 2 - wide, last - 2, (last + 2, last + 2 + wide)),
    ):
        if np.linalg.norm(_tone(difference, body, band, start, end) - inside) > least:
            found.append(f"the heap's {side} side has another tone than its middle: a shadow, or light from one side")
        elif np.linalg.norm(_tone(difference, ~body, band, *out)) > least:
            found.append(f"the background beside the heap's {side} side has another tone than elsewhere: a shadow")
    return found


def _tone(
    difference: np.ndarray, where: np.ndarray, band: np.ndarray, start: np.ndarray, end: np.ndarray
) -> np.ndarray:
    """Median tone over the rows of a band of what lies between two columns of each and in a mask."""
    columns = np.arange(difference.shape[1])
    between = (columns >= start[:, None]) & (columns < end[:, None]) & where[band]
    return np.median(difference[band][between], axis=0) if between.any() else np.zeros(3)
