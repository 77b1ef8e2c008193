"""What `angle` found, as table, row for measurements.csv, JSON and overlay pictures."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pellet_study.heap.photograph import Photograph, sides
from pellet_study.heap.plate import LevelLine
from pellet_study.output import style
from pellet_study.output.style import MEASURED, MODEL, styled
from yade_scripts.heap import Flank

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def answer(files: Sequence[Path], found: Sequence[Photograph], overlays: Sequence[Path]) -> dict[str, Any]:
    """Mean and standard deviation over the photographs (None for one) of each reading, and each photograph."""

    def over_all(angles: list[float]) -> tuple[float, float | None]:
        return float(np.mean(angles)), float(np.std(angles, ddof=1)) if len(angles) > 1 else None

    angle, sd = over_all([photo.angle_deg for photo in found])
    flank, flank_sd = over_all([photo.flanks.angle_deg for photo in found])
    triangle, triangle_sd = over_all([photo.triangle.angle_deg for photo in found])
    return {
        "angle_deg": angle,
        "sd": sd,
        "flank_deg": flank,
        "flank_sd": flank_sd,
        "triangle_deg": triangle,
        "triangle_sd": triangle_sd,
        "photos": [
            {
                "photo": str(file),
                "angle_deg": photo.angle_deg,
                "uncertainty_deg": photo.triangle_error_deg,
                "flank_deg": photo.flanks.angle_deg,
                "flank_uncertainty_deg": photo.flank_error_deg,
                "triangle_deg": photo.triangle.angle_deg,
                "left_deg": photo.flanks.left.angle_deg,
                "right_deg": photo.flanks.right.angle_deg,
                "tilt_deg": photo.base.tilt_deg,
                "tilt_from": photo.base_is,
                "doubts": list(photo.doubts),
                "overlay": str(overlay),
            }
            for file, photo, overlay in zip(files, found, overlays, strict=True)
        ],
    }


def page(answer: dict[str, Any]) -> str:
    """The angles as a table, and the rows for measurements.csv."""
    lines = [f"{'photo':24s}{'left':>8s}{'right':>8s}{'flank':>8s}{'triangle':>9s}{'tilt':>7s}  tilt from"]
    for p in answer["photos"]:
        name = Path(p["photo"]).name
        lines.append(
            f"{name if len(name) < 24 else '...' + name[-20:]:24s}{p['left_deg']:8.2f}{p['right_deg']:8.2f}"
            f"{p['flank_deg']:8.2f}{p['triangle_deg']:9.2f}{p['tilt_deg']:7.2f}  {p['tilt_from']}"
        )
    number = len(answer["photos"])
    lines.append("")
    for reading in ("flank", "triangle"):
        value, sd = answer[f"{reading}_deg"], answer[f"{reading}_sd"]
        error = answer["photos"][0]["uncertainty_deg" if reading == "triangle" else "flank_uncertainty_deg"]
        alone = f"+- {error:.2f} deg, one photograph, scatter of heaps not known"
        scatter = alone if sd is None else f"deg, sd {sd:.2f} deg over {number} photographs"
        lines.append(f"{reading:8s} {value:6.2f} {scatter}")
    doubtful = sum(bool(p["doubts"]) for p in answer["photos"])
    if doubtful:
        which = "the photograph is" if number == 1 else f"{doubtful} of {number} photographs are"
        return "\n".join([*lines, "", f"no row for measurements.csv: {which} in doubt"])
    lines += ["", "for measurements.csv of a study:", "rig,observable,value,sd,n"]
    lines.append(_row("repose_angle_deg", answer["angle_deg"], answer["sd"], number))
    lines += ["the angle is the triangle's; of the lines through the flanks:"]
    lines.append(_row("repose_flank_deg", answer["flank_deg"], answer["flank_sd"], number))
    return "\n".join(lines)


def _row(observable: str, value: float, sd: float | None, number: int) -> str:
    return f"repose,{observable},{value:.4g},{'' if sd is None else f'{sd:.3g}'},{number}"


def draw(files: Sequence[Path], found: Sequence[Photograph], folder: Path) -> list[Path]:
    """An overlay for each photograph, named after it; a name that repeats, or is a photograph's own, gets a number."""
    taken = {file.resolve() for file in files}
    paths: list[Path] = []
    for file, photo in zip(files, found, strict=True):
        path = folder / f"{file.stem}.png"
        again = 2
        while path.resolve() in taken:
            path = folder / f"{file.stem}_{again}.png"
            again += 1
        taken.add(path.resolve())
        paths.append(style.save(overlay(photo), path))
    return paths


@styled
def overlay(photo: Photograph) -> "Figure":
    """The photograph with the profile, the fitted lines and the level it was measured from."""
    rows, columns = photo.pixels.shape[:2]
    figure, axes = style.new_axes(7.0, 7.0 * rows / columns + 0.5)
    axes.imshow(photo.pixels)
    axes.set_axis_off()
    axes.plot(*photo.outline.T, color="black", linewidth=2.4)
    axes.plot(*photo.outline.T, color="white", linewidth=1.2, label="profile")
    axes.plot(
        [0, columns - 1],
        photo.base.at(np.array([0, columns - 1])),
        ":",
        color="#F0E442",
        label=f"level: {photo.base_is}",
    )
    for flank, name, colour, dash in zip(photo.flanks, ("left", "right"), (MEASURED, MODEL), ("-", "--"), strict=True):
        x, y = _in_picture(photo.base, flank)
        axes.plot(x, y, color="white", linewidth=4.5)
        axes.plot(x, y, dash, color=colour, linewidth=2.5, label=f"{name} flank {flank.angle_deg:.2f} deg")
    axes.set(xlim=(-0.5, columns - 0.5), ylim=(rows - 0.5, -0.5))
    for x, y, name in (
        (*_in_picture(photo.base, side), "triangle" if k == 0 else None) for k, side in enumerate(sides(photo.triangle))
    ):
        axes.plot(x, y, ":", color="white", linewidth=3.5)
        axes.plot(x, y, ":", color="black", linewidth=1.8, label=name)
    axes.set_title(
        f"flanks {photo.flanks.angle_deg:.2f} ± {photo.flank_error_deg:.2f} deg, "
        f"triangle {photo.triangle.angle_deg:.2f} ± {photo.triangle_error_deg:.2f} deg"
    )
    figure.legend(loc="outside lower center", ncols=2, facecolor="0.75", frameon=True, edgecolor="none")
    return figure


def _in_picture(base: LevelLine, line: Flank) -> tuple[np.ndarray, np.ndarray]:
    """x and y (pixels) of both ends of a line that is given along the base and above it."""
    turn = np.arctan(base.slope)
    along = np.array([line.start, line.end])
    height = line.height_at_0 + line.slope * along
    return (
        along * np.cos(turn) + height * np.sin(turn),
        base.y_at_0 + along * np.sin(turn) - height * np.cos(turn),
    )
