"""How right the readings of a repose angle are: heaps of known shape, cut out of random packings of grains, and read.

    .venv/bin/python benchmarks/heap_reader.py

makes results/checks/heap_reader.csv, a row per shape, base, angle and number of grains: bias and standard deviation of each
reading over `HEAPS` heaps (a quarter as many photographs). A grain belongs to a heap where its centre lies below the surface.
`right_deg` is the angle of the flanks where there is one; the mean of both, over all directions, of a skewed heap; the
least-squares line through the surface from 20 to 80 % of the height of a rounded one and of one with two slopes; 0 of a layer one
grain thick. `cone_moment` is atan(2 <z>/<r>) with z from the base, on either base: a reading not taken. Base "disc, cut": a cone so
wide that the edge of the disc cuts it; "photograph": 1,500 grains on a plate, rendered from one side each and read as a photograph
is. A last row for each angle on a disc has grains as large as the rig's on its base of 50 mm.

Of flank and triangle, which photographs have as well, that one stands for the repose angle whose root-mean-square error over
the cones of the table (shape "cone", every base, angle and number; a missing reading counts as one of 0 deg) is smallest.
The same error over the table's other shapes is told beside it.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from pellet_study.heap import photograph, render
from yade_scripts import heap

OUT = Path(__file__).resolve().parent.parent / "results" / "checks" / "heap_reader.csv"
HEAPS = 20
ANGLES = (5.0, 10.0, 15.0, 20.0, 30.0, 41.69, 50.0)
NUMBERS = (300, 500, 1500, 4000)
SOLID = 0.6  # share of the packings
RIG_BASE = 25.0 / 1.294  # radius of the rig's base of 50 mm, in grain radii
READINGS = ("flank", "triangle", "moment", "cone_moment")


class Packing(NamedTuple):
    """Grains of mean radius 1 on a floor at z = 0, repeated every `wide` along x and y."""

    centres: np.ndarray
    radii: np.ndarray
    wide: float


class Made(NamedTuple):
    """A heap cut out of a packing, the radius of its disc (None: a plate), and the angle that it has."""

    centres: np.ndarray
    radii: np.ndarray
    base_radius: float | None
    right_deg: float


def packing(seed: int, wide: float = 64.0, tall: float = 36.0, spread: float = 0.05) -> Packing:
    """Random loose packing: random places whose overlaps are pushed apart, between a floor and a lid."""
    from scipy.spatial import cKDTree

    draw = np.random.default_rng(seed)
    number = round(SOLID * wide * wide * tall / (4 / 3 * np.pi))
    radii = draw.uniform(1 - spread, 1 + spread, number)
    centres = draw.uniform(0, 1, (number, 3)) * [wide, wide, tall]
    overlap = np.ones(1)
    pushes = 0
    while overlap.max() > 0.08:
        if pushes % 8 == 0:
            centres[:, :2] %= wide
            pairs = cKDTree(centres, boxsize=[wide, wide, 4 * tall]).query_pairs(2.4, output_type="ndarray")
        apart = centres[pairs[:, 0]] - centres[pairs[:, 1]]
        apart[:, :2] -= wide * np.round(apart[:, :2] / wide)
        distance = np.linalg.norm(apart, axis=1)
        overlap = np.maximum(radii[pairs].sum(axis=1) - distance, 0)
        push = (0.3 * overlap / np.maximum(distance, 1e-9))[:, None] * apart
        for axis in range(3):
            for side, sign in ((0, 1), (1, -1)):
                centres[:, axis] += sign * np.bincount(pairs[:, side], push[:, axis], number)
        centres[:, 2] = np.clip(centres[:, 2], radii, tall - radii)
        pushes += 1
    return Packing(centres, radii, wide)


LEAN, ROUND, KNEE, STEEPER, TOE = 0.3, 0.2, 0.5, 1.25, 1.3


def below_knee(r: np.ndarray) -> np.ndarray:
    """Height of a heap that is steeper inside the knee than outside of it; 1 on the axis."""
    return np.where(r < KNEE, 1 - STEEPER * r, (2 - STEEPER) * (1 - r))


SHAPES = {  # depth below the surface at x, y (in base radii), u (in the height of the whole cone)
    "cone": lambda x, y, u: 1 - u - np.hypot(x, y),
    "truncated": lambda x, y, u: np.minimum(1 - u - np.hypot(x, y), 0.6 - u),
    "rounded": lambda x, y, u: np.sqrt(1 + ROUND**2) - np.sqrt(x * x + y * y + ROUND**2) - u,
    "two slopes": lambda x, y, u: below_knee(np.hypot(x, y)) - u,
    "skewed": lambda x, y, u: 1 - u - np.hypot(x - LEAN * u, y),
}
OTHERS = tuple(shape for shape in SHAPES if shape != "cone")
CUT = {"plate": 1.0, "disc": 1.0, "disc, cut": 0.8}  # radius of the base over that of the whole cone


def right_deg(shape: str, angle_deg: float) -> float:
    """The angle of a shape whose height over its base radius is tan(angle)."""
    steep = np.tan(np.radians(angle_deg))
    if shape == "skewed":
        lean = LEAN * np.cos(np.linspace(0, np.pi, 180, endpoint=False))
        return float(np.degrees(np.arctan(steep / (1 + lean)) + np.arctan(steep / (1 - lean))).mean() / 2)
    r = np.linspace(0, 1, 4001)
    surface = SHAPES[shape](r, 0 * r, 0 * r)
    on = (surface > 0.2 * surface.max()) & (surface < 0.8 * surface.max())
    return float(np.degrees(np.arctan(-steep * np.polyfit(r[on], surface[on], 1)[0])))


def volume(shape: str, cut: float) -> float:
    """Of a heap of base radius and height 1, cut at a radius, by counting points."""
    x, y, u = np.meshgrid(np.linspace(-1.5, 1.5, 151), np.linspace(-1.5, 1.5, 151), (np.arange(50) + 0.5) / 50)
    inside = (SHAPES[shape](x, y, u) > 0) & (np.hypot(x, y) < cut)
    return float(inside.sum()) * (3 / 150) ** 2 / 50


def made(
    grains: Packing, shape: str, base: str, angle_deg: float, number: float, draw: np.random.Generator, toe: float = 1.0
) -> Made:
    """A heap of a shape, its axis at a random place of the packing; `toe` base radii wide with a sparse layer around it."""
    steep, cut = np.tan(np.radians(angle_deg)), CUT[base]
    foot = (number * 4 / 3 * np.pi / SOLID / steep / volume(shape, cut)) ** (1 / 3)
    centres, radii = spread_out(grains, 1.5 * foot, draw)
    x, y, z = centres.T / foot
    inside = SHAPES[shape](x, y, z / steep) > 0
    inside |= (centres[:, 2] < 1.5) & (np.hypot(x, y) < toe) & (draw.random(len(x)) < 0.5) & (toe > 1)
    if base != "plate":
        inside &= np.hypot(x, y) < cut
    return Made(centres[inside], radii[inside], None if base == "plate" else cut * foot, right_deg(shape, angle_deg))


def layer(grains: Packing, number: float, draw: np.random.Generator) -> Made:
    """The lowest grains of a packing: a layer one grain thick, of so many grains, round."""
    lowest = grains.centres[:, 2] < 1.5
    thin = Packing(grains.centres[lowest], grains.radii[lowest], grains.wide)
    foot = grains.wide * np.sqrt(number / lowest.sum() / np.pi)
    centres, radii = spread_out(thin, foot, draw)
    inside = np.hypot(*centres[:, :2].T) < foot
    return Made(centres[inside], radii[inside], None, 0.0)


def spread_out(grains: Packing, half: float, draw: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A packing over a square of at least twice `half`, moved and mirrored at random."""
    centres = grains.centres.copy()
    centres[:, :2] = (centres[:, :2] + draw.uniform(0, grains.wide, 2)) % grains.wide
    if draw.random() < 0.5:
        centres[:, 0] = grains.wide - centres[:, 0]
    times = int(np.ceil(2 * half / grains.wide))
    shifts = grains.wide * (np.stack([*np.ndindex(times, times)]) - times / 2)
    shifted = centres[None] + np.column_stack([shifts, np.zeros(len(shifts))])[:, None]
    return shifted.reshape(-1, 3), np.tile(grains.radii, len(shifts))


def read(one: Made) -> dict[str, float]:
    """Every reading of a heap, deg."""
    found = heap.readings(one.centres, one.radii, one.base_radius)
    volume, centres = one.radii**3, one.centres
    r = np.hypot(*(centres[:, :2] - volume @ centres[:, :2] / volume.sum()).T)
    return {
        "flank": found.flank.angle_deg,
        "triangle": found.triangle.angle_deg,
        "moment": found.moment.angle_deg,
        "cone_moment": float(np.degrees(np.arctan(2 * (volume @ centres[:, 2]) / (volume @ r)))),
    }


def seen(one: Made, azimuth_deg: float) -> dict[str, float]:
    """Flank and triangle of a picture of a heap, level, from one side."""
    picture = render.picture(one.centres, one.radii, width=700, azimuth_deg=azimuth_deg, elevation_deg=0, margin=0.15)
    try:
        found = photograph.find(picture)
    except heap.NoHeap:
        return dict.fromkeys(READINGS, np.nan)
    return dict.fromkeys(READINGS, np.nan) | {"flank": found.flanks.angle_deg, "triangle": found.triangle.angle_deg}


def row(shape: str, base: str, angle_deg: float, heaps: list[Made]) -> dict[str, float | str]:
    """Bias, standard deviation and root-mean-square error of each reading over heaps of one kind."""
    if base == "photograph":
        found = pd.DataFrame([seen(one, 360 * k / len(heaps)) for k, one in enumerate(heaps)])
    else:
        found = pd.DataFrame([read(one) for one in heaps])
    right = heaps[0].right_deg
    told: dict[str, float | str] = {"shape": shape, "base": base, "angle_deg": angle_deg, "right_deg": round(right, 2)}
    told |= {"grains": round(np.mean([len(one.radii) for one in heaps])), "heaps": len(heaps)}
    for name in READINGS:
        error = found[name].astype(float) - right
        told[f"{name}_bias_deg"] = round(error.mean(), 2)
        told[f"{name}_sd_deg"] = round(error.std(ddof=1), 2)
        refused = error if base == "photograph" and "moment" in name else error.fillna(-right)
        told[f"{name}_rms_deg"] = round(float(np.sqrt((refused**2).mean())), 2)
    return told | {"flank_missing": int(found["flank"].isna().sum())}


def kinds() -> Iterator[tuple[str, str, float, float, float]]:
    """Shape, base, angle, number of grains, width of a sparse layer around the foot."""
    for base in CUT:
        yield from (("cone", base, angle, number, 1.0) for angle in ANGLES for number in NUMBERS)
        for angle in ANGLES:  # on the rig's disc, where the angle makes the number
            full = SOLID * np.tan(np.radians(angle)) * (RIG_BASE / CUT[base]) ** 3 * volume("cone", CUT[base])
            if base != "plate":
                yield "cone", base, angle, full * 3 / 4 / np.pi, 1.0
        for shape in OTHERS:
            yield from ((shape, base, angle, number, 1.0) for angle in (20.0, 30.0, 41.69) for number in (500, 1500))
    yield from (
        ("cone with toe", "plate", angle, number, TOE) for angle in (20.0, 30.0, 41.69) for number in (500, 1500)
    )


def main() -> None:
    """Make, read and tabulate the heaps; say which reading the rule chooses."""
    packings = [packing(seed) for seed in (1, 2, 3)]
    rows = []
    for shape, base, angle, number, toe in kinds():
        draws = [np.random.default_rng([k, 15]) for k in range(HEAPS)]
        surface = shape.removesuffix(" with toe")
        heaps = [made(packings[k % 3], surface, base, angle, number, draw, toe) for k, draw in enumerate(draws)]
        rows.append(row(shape, base, angle, heaps))
        print(*rows[-1].values(), flush=True)
    for shape, angle in [*(("cone", angle) for angle in ANGLES[1:]), *((shape, 30.0) for shape in OTHERS)]:
        draws = [np.random.default_rng([k, 16]) for k in range(HEAPS // 4)]
        heaps = [made(packings[k % 3], shape, "plate", angle, 1500, draw) for k, draw in enumerate(draws)]
        rows.append(row(shape, "photograph", angle, heaps))
        print(*rows[-1].values(), flush=True)
    for number in NUMBERS:
        heaps = [layer(packings[k % 3], number, np.random.default_rng([k, 15])) for k in range(HEAPS)]
        rows.append(row("layer", "plate", 0.0, heaps))
    table = pd.DataFrame(rows)
    OUT.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(OUT, index=False)
    print(f"{OUT}\n{chosen(table)}")


def chosen(table: pd.DataFrame) -> str:
    """What the rule says of flank and triangle."""
    said = {}
    for rows, which in ((table["shape"] == "cone", "cones"), (table["shape"] != "cone", "other shapes")):
        squares = table.loc[rows, ["flank_rms_deg", "triangle_rms_deg"]] ** 2
        said[which] = dict(zip(("flank", "triangle"), np.sqrt(squares.mean()).round(2).tolist(), strict=True))
    best = min(said["cones"], key=lambda name: said["cones"][name])
    lines = [f"root-mean-square errors, deg, over the {which}: {error}" for which, error in said.items()]
    return "\n".join([*lines, f"chosen: {best}"])


if __name__ == "__main__":
    main()
