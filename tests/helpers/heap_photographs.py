"""Photographs of heaps whose angle is known because they were drawn that way."""

import numpy as np
from scipy.ndimage import gaussian_filter

ROWS, COLUMNS = 320, 480
TONES = {  # background, heap, plate
    "bright on dark": ((0.12, 0.13, 0.15), (0.85, 0.80, 0.70), (0.45, 0.46, 0.48)),
    "dark on bright": ((0.88, 0.88, 0.86), (0.25, 0.20, 0.15), (0.60, 0.60, 0.62)),
    "plate of the heap's tone": ((0.20, 0.25, 0.35), (0.72, 0.68, 0.58), (0.70, 0.67, 0.60)),
    "plate darker than the background": ((0.55, 0.57, 0.60), (0.90, 0.86, 0.76), (0.20, 0.20, 0.22)),
    "colour alone": ((0.20, 0.45, 0.65), (0.62, 0.42, 0.25), (0.35, 0.35, 0.35)),
    "no plate": ((0.15, 0.15, 0.16), (0.80, 0.76, 0.66), None),
}


def draw(
    left_deg=40.0, right_deg=40.0, *, tones="bright on dark", tilt_deg=0.0, noise=0.01, blur=1.0, uneven=0.0,
    texture=0.05, top=0.0, middle=0.5, width=0.6, seed=0, floor=0.78, heap=True,
):  # fmt: skip
    """A heap on a plate, (rows, columns, 3), 0 to 1.

    Parameters
    ----------
    left_deg, right_deg : angles of the flanks
    tilt_deg : of the camera, the picture's level rises to the right where positive
    uneven : change of the light over the picture, as a share
    texture : standard deviation of the grains' tone; background and plate have a third of it
    top : radius of the rounded top, pixels
    middle, width, floor : place of the apex, width of the foot and height of the plate, as shares of the picture
    """
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:ROWS, :COLUMNS] + 0.5
    turn = np.radians(tilt_deg)
    centre = np.array([COLUMNS * middle, ROWS * floor])
    u = (x - centre[0]) * np.cos(turn) - (y - centre[1]) * np.sin(turn)
    v = -(x - centre[0]) * np.sin(turn) - (y - centre[1]) * np.cos(turn)
    left, right = np.tan(np.radians([left_deg, right_deg]))
    height = width * COLUMNS / (1 / left + 1 / right)
    sides = np.stack([left * u, -right * u])
    if top > 0:  # a smooth minimum of both flanks rounds the top
        sharp = max(top * (left + right) / 4, 1e-3)
        surface = height - sharp * np.logaddexp(-sides[0] / sharp, -sides[1] / sharp)
    else:
        surface = height + sides.min(axis=0)
    background, grain, plate = TONES[tones]
    image = np.broadcast_to(np.array(background), (ROWS, COLUMNS, 3)).copy()
    grains = gaussian_filter(rng.standard_normal((ROWS, COLUMNS)), 1.0)
    grains /= grains.std()
    image *= 1 + texture / 3 * grains[::-1, ::-1, None]
    if plate is not None:
        image[v < 0] = np.array(plate) * (1 + texture / 3 * grains[v < 0][:, None])
    if heap:
        inside = (v >= 0) & (v < surface)
        image[inside] = np.array(grain) * (1 + texture * grains[inside][:, None])
    direction = rng.uniform(0, 2 * np.pi)
    slope = (np.cos(direction) * (x / COLUMNS - 0.5) + np.sin(direction) * (y / ROWS - 0.5)) / 0.7
    bowl = ((x / COLUMNS - 0.5) ** 2 + (y / ROWS - 0.5) ** 2) / 0.5
    image *= (1 + uneven * (0.7 * slope - 0.5 * bowl))[..., None]
    image = gaussian_filter(image, (blur, blur, 0))
    return np.clip(image + noise * rng.standard_normal(image.shape), 0, 1)


def random_heap(seed: int) -> tuple[np.ndarray, float]:
    """A picture with everything at once, and the mean of its two angles (deg)."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(22, 52)
    lean = rng.uniform(-4, 4)
    picture = draw(
        angle + lean,
        angle - lean,
        tones=list(TONES)[seed % len(TONES)],
        tilt_deg=rng.uniform(-5, 5),
        noise=rng.uniform(0, 0.05),
        blur=rng.uniform(0.5, 2.5),
        uneven=rng.uniform(0, 0.5),
        texture=rng.uniform(0, 0.15),
        top=rng.uniform(0, 25),
        middle=rng.uniform(0.45, 0.55),
        width=rng.uniform(0.5, 0.68),
        seed=seed,
    )
    return picture, angle
