"""Pictures of grains as shaded balls: an orthographic view with depth buffer, ambient occlusion and a plate's shadow.

Nothing but numpy; `picture` gives an array to show or save. Grains come from a CSV with columns x_m, y_m, z_m, radius_m or
from (centres, radii), as particles.py and the rigs give them.
"""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from pellet_study.errors import InputError
from pellet_study.files import opening
from pellet_study.output import style
from pellet_study.output.style import styled
from yade_scripts import heap

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = ("x_m", "y_m", "z_m", "radius_m")
GRAIN = (0.86, 0.78, 0.62)  # soybean meal and diatomaceous earth
SEED = (0.66, 0.52, 0.28)
PLATE = (0.93, 0.935, 0.94)
Camera = tuple[np.ndarray, np.ndarray, np.ndarray]  # unit vectors: right, up, towards the camera
LIGHT_FROM = np.array([-0.45, 0.62, 0.64])  # to the right, up and towards the camera


def read_grains(file: Path) -> tuple[np.ndarray, np.ndarray]:
    """Centres (n, 3) and radii (n,) of the grains in a CSV with columns x_m, y_m, z_m, radius_m.

    Raises
    ------
    InputError : the file is no such table
    """
    try:
        table = pd.read_csv(opening.stream(file), comment="#")
        grains = table[list(COLUMNS)].to_numpy(float)
    except (OSError, ValueError, KeyError) as error:
        raise InputError(f"{file}: expected a CSV with columns {', '.join(COLUMNS)} ({error})") from None
    if not len(grains) or not np.isfinite(grains).all() or (grains[:, 3] <= 0).any():
        raise InputError(f"{file}: expected at least one grain, finite places and radii above 0")
    return grains[:, :3], grains[:, 3]


def picture(
    centres: ArrayLike, radii: ArrayLike, *, width: int = 900, azimuth_deg: float = 30.0, elevation_deg: float = 12.0,
    colour: ArrayLike = GRAIN, plate: float | None = 0.0, vary: float = 0.07, margin: float = 0.06,
) -> np.ndarray:  # fmt: skip
    """Grains seen from a direction.

    Parameters
    ----------
    centres : (n, 3) array, any unit of length, z upwards
    radii : (n,) array, the same unit
    width : of the picture, pixels; the height follows from what is shown
    azimuth_deg, elevation_deg : of the camera, above the horizon
    colour : (3,) RGB of the grains, or (n, 3) of each, 0 to 1
    plate : z of a plate they lie on, None for none
    vary : how much the lightness of the grains differs
    margin : free share of the width on each side

    Returns
    -------
    (height, width, 3) array, 0 to 1
    """
    centres, radii = np.asarray(centres, float), np.asarray(radii, float)
    right, up, towards = _camera(np.radians(azimuth_deg), np.radians(elevation_deg))
    u, v, depth = centres @ right, centres @ up, centres @ towards
    low, high = np.array([(u - radii).min(), (v - radii).min()]), np.array([(u + radii).max(), (v + radii).max()])
    if plate is not None:  # room for the foot and its shadow
        foot = centres[:, :2].mean(axis=0)
        low[1] = min(
            low[1], np.array([*foot, plate]) @ up - 0.5 * (high[0] - low[0]) * np.sin(np.radians(elevation_deg))
        )
    room = margin * (high[0] - low[0])
    low, high = low - room, high + room
    fine = 2 * width  # drawn twice as fine, then averaged
    scale = fine / (high[0] - low[0])
    rows = 2 * max(1, round(0.5 * scale * (high[1] - low[1])))
    tone = 1 + vary * np.random.default_rng(0).uniform(-1, 1, len(radii))
    nearest, normal, owner = _buffer(
        (u - low[0]) * scale, (v - low[1]) * scale, depth * scale, radii * scale, fine, rows
    )
    hit = owner >= 0
    shade = 0.22 + 0.78 * (0.5 + 0.5 * normal @ LIGHT_FROM) ** 1.3
    shade *= 1 - 0.5 * _hidden(np.where(hit, nearest, np.nan), float(np.median(radii) * scale))
    image = np.ones((rows, fine, 3)) * (PLATE if plate is not None else (1.0, 1.0, 1.0))
    if plate is not None:
        image *= _shadow(centres, radii, plate, (right, up, towards), low, scale, (rows, fine))[..., None]
    own = np.broadcast_to(np.asarray(colour, dtype=float), (len(radii), 3))[owner[hit]]
    image[hit] = np.clip(own * (tone[owner[hit]] * shade[hit])[:, None], 0, 1)
    image = image.reshape(rows // 2, 2, fine // 2, 2, 3).mean(axis=(1, 3))
    return image[::-1]


def _camera(azimuth: float, elevation: float) -> Camera:
    """Unit vectors to the right and up in the picture, and from the grains towards the camera."""
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    towards = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    return right, np.cross(towards, right), towards


def _buffer(
    u: np.ndarray, v: np.ndarray, depth: np.ndarray, radii: np.ndarray, width: int, height: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Depth (towards the camera), surface normal (camera axes) and index of the foremost grain at each pixel."""
    nearest = np.full((height, width), -np.inf)
    normal = np.zeros((height, width, 3))
    owner = np.full((height, width), -1)
    for k in np.argsort(depth):
        r = radii[k]
        left, right = max(0, int(u[k] - r)), min(width, int(u[k] + r) + 2)
        bottom, top = max(0, int(v[k] - r)), min(height, int(v[k] + r) + 2)
        x = (np.arange(left, right) + 0.5 - u[k])[None, :]
        y = (np.arange(bottom, top) + 0.5 - v[k])[:, None]
        square = r * r - x * x - y * y
        out = np.sqrt(np.maximum(square, 0))
        here = (slice(bottom, top), slice(left, right))
        front = (square > 0) & (depth[k] + out > nearest[here])
        nearest[here][front] = (depth[k] + out)[front]
        owner[here][front] = k
        direction = np.stack(np.broadcast_arrays(x, y, out), axis=-1) / r
        normal[here][front] = direction[front]
    return nearest, normal, owner


def _hidden(nearest: np.ndarray, radius: float) -> np.ndarray:
    """How deep a pixel lies below the mean depth around it, 0 to 1: crevices between grains are dark."""
    from scipy.ndimage import gaussian_filter

    known = np.isfinite(nearest)
    filled = np.where(known, nearest, 0.0)
    spread = min(1.2 * radius, 40.0)
    share = np.maximum(gaussian_filter(known.astype(float), spread), 1e-6)
    below = gaussian_filter(filled, spread) / share - filled
    return np.where(known, np.clip(below / spread, 0, 1), 0.0)


def _shadow(
    centres: np.ndarray, radii: np.ndarray, plate: float, camera: Camera, low: np.ndarray, scale: float,
    shape: tuple[int, int],
) -> np.ndarray:  # fmt: skip
    """Light that reaches each pixel of the plate, 0.55 to 1: the grains' soft shadow, thrown along the light."""
    from scipy.ndimage import gaussian_filter

    right, up, towards = camera
    light = LIGHT_FROM @ np.stack(camera)
    thrown = centres - ((centres[:, 2] - plate) / max(light[2], 0.3))[:, None] * light
    u, v = (thrown @ right - low[0]) * scale, (thrown @ up - low[1]) * scale
    squeeze = max(abs(towards[2]), 0.1)  # a disc on the plate is seen as an ellipse
    dark = np.zeros(shape)
    for x, y, r in zip(u, v, radii * scale, strict=True):
        left, to = max(0, int(x - r)), min(shape[1], int(x + r) + 2)
        bottom, top = max(0, int(y - squeeze * r)), min(shape[0], int(y + squeeze * r) + 2)
        if left < to and bottom < top:
            across = ((np.arange(left, to) + 0.5 - x) / r)[None, :]
            along = ((np.arange(bottom, top) + 0.5 - y) / (squeeze * r))[:, None]
            dark[bottom:top, left:to][across**2 + along**2 < 1] = 1
    return 1 - 0.45 * gaussian_filter(dark, 0.8 * float(np.median(radii)) * scale)


@styled
def profile(centres: np.ndarray, radii: np.ndarray, base_radius: float | None = None) -> "Figure":
    """A heap's outline from one side, lines through both flanks as in the source paper's Figures 9 and 10, the triangle.

    The title gives the heap's angles, means over all directions; `base_radius` (m) is that of a disc the heap lies on.
    """
    whole = heap.readings(centres, radii, base_radius)
    x, height = heap.silhouette(*heap.body(centres, radii), 0.0, base_radius)
    ends = 1e3 * x[[0, -1]]
    figure, axes = style.new_axes(6.0, 2.1 + 5.2 * 1.1e3 * height.max() / np.ptp(ends))
    axes.fill_between(1e3 * x, 1e3 * height, color=style.BAND)
    axes.plot(1e3 * x, 1e3 * height, color="black", linewidth=1, label="outline of the grains")
    triangle = heap.fit_triangle(x, height)
    sides = np.maximum(0, triangle.top - triangle.slope * np.abs(x - triangle.middle))
    axes.plot(1e3 * x, 1e3 * sides, ":", color="black", linewidth=1.5, label=f"triangle {triangle.angle_deg:.2f} deg")
    for flank, side, colour, dash in zip(
        _flanks(x, height, base_radius is not None), ("left", "right"), (style.MEASURED, style.MODEL), ("-", "--"),
        strict=False,
    ):  # fmt: skip
        along = np.array([flank.start, flank.end])
        label = f"{side} flank {flank.angle_deg:.2f} deg"
        axes.plot(
            1e3 * along, 1e3 * (flank.height_at_0 + flank.slope * along), dash, color=colour, linewidth=2.5, label=label
        )
    axes.set_xlim(*ends)
    axes.set_aspect("equal")
    axes.set_title(
        f"seen from one of {heap.DIRECTIONS} directions; the heap:\n"
        + ", ".join(
            f"{name} {reading.angle_deg:.2f} ± {reading.standard_error_deg:.2f} deg"
            for name, reading in zip(heap.Readings._fields, whole[:3], strict=False)
            if np.isfinite(reading.angle_deg)
        )
    )
    axes.set_xlabel("place (mm)")
    axes.set_ylabel("height above the base (mm)")
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def _flanks(x: np.ndarray, height: np.ndarray, cut: bool) -> tuple[heap.Flank, ...]:
    """Both flanks of an outline, or none where it is too flat."""
    try:
        return heap.fit_flanks(x, height, cut=cut)
    except heap.NoHeap:
        return ()
