"""Pictures of heaps of known angle, most of them taken badly: which are read wrong without a doubt?

    .venv/bin/python benchmarks/photographs.py [--number 400] [--keep FOLDER]

Writes results/checks/photographs.csv, a line a picture. Cones of grains and, every fifth, a coarse heap that YADE made on a plate (results/checks/heap_on_a_plate.csv, by release 0.1) are rendered
by the package (`pellet_study.heap.render`) and put before a wall, on a plate that ends inside or outside the picture; every
third is level and evenly lit, the others have elevations of 0 to 30 deg, shadows on wall and plate, light from one side. All
have texture, noise and blur. The true angle is the triangle's of the outline of the same grains seen level.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd
from PIL import Image
from scipy.ndimage import affine_transform, gaussian_filter, shift

from pellet_study.errors import InputError
from pellet_study.heap import photograph, render
from yade_scripts import heap

ROOT = Path(__file__).resolve().parents[1]
FILE = ROOT / "results" / "checks" / "photographs.csv"
WIDTH = 300  # pixels, of the heap
WRONG_DEG = 1.0
TONES = (  # wall, heap, plate
    ((0.12, 0.13, 0.15), (0.85, 0.80, 0.70), (0.45, 0.46, 0.48)),
    ((0.85, 0.85, 0.84), (0.35, 0.26, 0.18), (0.60, 0.60, 0.62)),
    ((0.55, 0.57, 0.60), (0.95, 0.90, 0.78), (0.22, 0.22, 0.24)),
    ((0.25, 0.45, 0.65), (0.72, 0.50, 0.28), (0.40, 0.40, 0.42)),
)
SHADOWS = ("none", "on the wall", "on the plate")


def cone(angle_deg: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Grains on the surface of a cone of base radius 1."""
    radius, slope = 0.025, np.tan(np.radians(angle_deg))
    number = int(np.pi / np.cos(np.radians(angle_deg)) / radius**2)  # so many that none is seen through
    r, turn = np.sqrt(rng.uniform(0, 1, number)), rng.uniform(0, 2 * np.pi, number)
    z = np.maximum(radius, slope * (1 - r) + rng.uniform(-radius, 0, number))
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), z]), np.full(number, radius)


class Scene:
    """One picture, all of it drawn from its number."""

    def __init__(self, number: int):
        rng = self.rng = np.random.default_rng(number)
        self.level = number % 3 == 0
        self.kind = "heap of YADE" if number % 5 == 4 else "cone"
        if self.kind == "cone":
            self.centres, self.radii = cone(rng.uniform(24, 50), rng)
        else:
            grains = render.read_grains(ROOT / "results" / "checks" / "heap_on_a_plate.csv")
            self.centres, self.radii = heap.body(*grains)
        self.azimuth_deg = float(rng.uniform(0, 360))
        self.elevation_deg = 0.0 if self.level else float(rng.uniform(0, 30))
        self.shadow = "none" if self.level else SHADOWS[number % 7 % 3]
        self.one_sided = not self.level and number % 4 == 1
        self.plate = float(rng.choice([1.15, 1.5, 2.5, 20.0]))  # half its depth, in the heap's radius
        self.tones = TONES[number % len(TONES)]
        x, height = heap.silhouette(self.centres, self.radii, np.radians(self.azimuth_deg) + np.pi / 2)
        self.angle_deg = heap.fit_triangle(x, height).angle_deg

    def draw(self) -> np.ndarray:
        """The picture, (rows, columns, 3), 0 to 1."""
        rng = self.rng
        share, shade, foot, radius = self._heap()
        rows, columns = share.shape
        sine = np.sin(np.radians(self.elevation_deg))
        y = np.arange(rows)[:, None] + np.zeros((1, columns))
        far, near = foot - self.plate * radius * sine, foot + self.plate * radius * sine
        wall, grain, plate = (np.array(tone) for tone in self.tones)
        image = np.where((y < far)[..., None], wall, plate)
        image = np.where((y >= near)[..., None], 0.8 * plate if sine > 0 else plate, image)
        grains = gaussian_filter(rng.standard_normal((rows, columns)), 1.0)
        image *= 1 + rng.uniform(0, 0.05) * (grains / grains.std())[..., None]
        image *= self._shadows(share, y < far, foot)[..., None]
        image = image * (1 - share[..., None]) + grain * shade[..., None]
        x = np.linspace(-1, 1, columns)
        image *= (1 + rng.uniform(-0.12, 0.12) * x)[:, None]  # no light is quite even
        blur = rng.uniform(0.4, 1.5)
        image = gaussian_filter(image, (blur, blur, 0))
        return np.clip(image + rng.uniform(0, 0.03) * rng.standard_normal(image.shape), 0, 1)

    def _heap(self) -> tuple[np.ndarray, np.ndarray, float, float]:
        """Share of each pixel that is heap, its light, the row of the middle of the foot, the foot's radius in pixels."""
        seen = render.picture(
            self.centres, self.radii, width=WIDTH, azimuth_deg=self.azimuth_deg, elevation_deg=self.elevation_deg,
            colour=(1.0, 0.0, 0.0), plate=None, margin=0.0,
        )  # fmt: skip
        share, shade = 1 - seen[..., 2], seen[..., 0] - seen[..., 2]
        right, up, _ = render._camera(np.radians(self.azimuth_deg), np.radians(self.elevation_deg))
        u, v = self.centres @ right, self.centres @ up
        scale = WIDTH / np.ptp(np.r_[u - self.radii, u + self.radii])
        foot = len(share) + scale * (v - self.radii).min() - scale * (self._middle() @ up)
        if self.one_sided:
            across = np.linspace(-1, 1, WIDTH)
            shade = shade * np.clip(1 + self.rng.choice([-1, 1]) * 0.8 * across, 0.25, 1.3)
        side, top, under = (round(part * WIDTH) for part in self.rng.uniform((0.2, 0.2, 0.25), (0.35, 0.4, 0.4)))
        room = ((top, under), (side, side))
        radius = scale * np.percentile(np.hypot(*(self.centres - self._middle())[:, :2].T), 99)
        return np.pad(share, room), np.pad(shade, room), top + foot, radius

    def _middle(self) -> np.ndarray:
        return np.array([*self.centres[:, :2].mean(axis=0), 0.0])

    def _shadows(self, share: np.ndarray, wall: np.ndarray, foot: float) -> np.ndarray:
        """Light that reaches each pixel of wall and plate."""
        rng = self.rng
        if self.shadow == "none":
            return np.ones_like(share)
        if self.shadow == "on the wall":
            place = (rng.uniform(0, 20), rng.choice([-1, 1]) * rng.uniform(10, 60))
            thrown = gaussian_filter(shift(share, place, order=1), rng.uniform(1, 4)) * wall
        else:  # laid down: what is h above the foot falls a h to the side and b h upwards
            a, b = rng.choice([-1, 1]) * rng.uniform(0.5, 2), rng.uniform(0.1, 0.5)
            matrix = np.array([[1 / b, 0], [a / b, 1]])
            thrown = affine_transform(share, matrix, np.array([foot - foot / b, -a * foot / b]), order=1) * ~wall
            thrown = gaussian_filter(thrown, rng.uniform(1, 4))
        return 1 - rng.uniform(0.2, 0.6) * np.clip(thrown, 0, 1)


def read(number: int, keep: Path | None = None) -> dict:
    """What is read in a picture, beside what is true."""
    scene = Scene(number)
    pixels = scene.draw()
    if keep is not None:
        Image.fromarray(np.uint8(255 * pixels)).save(keep / f"{number:03d}.png")
    line = {
        "number": number, "heap": scene.kind, "angle_deg": round(scene.angle_deg, 2), "elevation_deg": round(scene.elevation_deg, 1),
        "plate": scene.plate, "shadow": scene.shadow, "light": "one-sided" if scene.one_sided else "even",
        "level_and_even": scene.level,
    }  # fmt: skip
    try:
        found = photograph.find(pixels)
    except (heap.NoHeap, InputError) as error:
        return {**line, "read_deg": None, "error_deg": None, "row": False, "doubts": f"refused: {error}"}
    return {
        **line,
        "read_deg": round(found.angle_deg, 2),
        "error_deg": round(found.angle_deg - scene.angle_deg, 2),
        "uncertainty_deg": round(found.triangle_error_deg, 2),
        "row": not found.doubts,
        "doubts": "; ".join(found.doubts),
    }


def main() -> None:
    """Read them all, write the table, say how many are wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=400)
    parser.add_argument("--keep", type=Path, help="folder for the pictures")
    arguments = parser.parse_args()
    table = pd.DataFrame([read(number, arguments.keep) for number in range(arguments.number)])
    if arguments.number == parser.get_default("number"):
        table.to_csv(FILE, index=False)
    silent = table[table["row"] & (table["error_deg"].abs() > WRONG_DEG)]
    beyond = silent[silent["error_deg"].abs() > 2 * silent["uncertainty_deg"]]
    level, other = table[table["level_and_even"]], table[~table["level_and_even"]]
    print(
        f"wrong by more than {WRONG_DEG:g} deg without a doubt: {len(silent)} of {len(table)}, "
        f"{len(beyond)} of them by more than twice their uncertainty"
    )
    print(
        f"level and evenly lit ones that give a row: {level['row'].sum()} of {len(level)} ({level['row'].mean():.1%})"
    )
    print(
        f"others: {other['row'].sum()} rows, {other['doubts'].str.startswith('refused').sum()} refused, of {len(other)}"
    )
    if len(silent):
        print(silent.drop(columns=["doubts", "row"]).to_string(index=False))
    lost = level[~level["row"]]
    if len(lost):
        print(lost[["number", "heap", "angle_deg", "read_deg", "doubts"]].to_string(index=False))


if __name__ == "__main__":
    main()
