"""What `angle` found, as table, row for measurements.csv, JSON and overlay pictures."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pellet_study.heap.photograph import Photograph
from pellet_study.output import style
from pellet_study.output.style import MEASURED, MODEL, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNSURE_DEG = 3.0  # uncertainty of a photograph from which on its lines miss the flanks; level views of heaps stay below


def answer(files: Sequence[Path], found: Sequence[Photograph], overlays: Sequence[Path]) -> dict[str, Any]:
    """Mean and standard deviation over the photographs (None for one), and each photograph."""
    angles = [photo.angle_deg for photo in found]
    return {
        "angle_deg": float(np.mean(angles)),
        "sd": float(np.std(angles, ddof=1)) if len(angles) > 1 else None,
        "photos": [
            {
                "photo": str(file),
                "angle_deg": photo.angle_deg,
                "uncertainty_deg": photo.uncertainty_deg,
                "left_deg": photo.flanks.left.angle_deg,
                "right_deg": photo.flanks.right.angle_deg,
                "tilt_deg": photo.base.tilt_deg,
                "tilt_from": photo.base_is,
                "overlay": str(overlay),
            }
            for file, photo, overlay in zip(files, found, overlays, strict=True)
        ],
    }


def page(answer: dict[str, Any]) -> str:
    """The angles as a table, and the row for measurements.csv."""
    lines = [f"{'photo':24s}{'left':>8s}{'right':>8s}{'angle':>8s}{'+-':>6s}{'tilt':>7s}  deg; tilt from"]
    for p in answer["photos"]:
        name = Path(p["photo"]).name
        lines.append(
            f"{name if len(name) < 24 else '...' + name[-20:]:24s}{p['left_deg']:8.2f}{p['right_deg']:8.2f}"
            f"{p['angle_deg']:8.2f}{p['uncertainty_deg']:6.2f}{p['tilt_deg']:7.2f}  {p['tilt_from']}"
        )
    number = len(answer["photos"])
    if answer["sd"] is None:
        lines += [
            "",
            f"angle {answer['angle_deg']:.2f} deg from one photograph; the scatter from heap to heap is not known",
        ]
    else:
        lines += ["", f"mean {answer['angle_deg']:.2f} deg, sd {answer['sd']:.2f} deg over {number} photographs"]
    if any(p["uncertainty_deg"] > UNSURE_DEG for p in answer["photos"]):
        return "\n".join([*lines, "", "no row for measurements.csv: the lines miss the flanks"])
    sd = "" if answer["sd"] is None else f"{answer['sd']:.3g}"
    lines += ["", "for measurements.csv of a study:", "rig,observable,value,sd,n"]
    lines.append(f"repose,repose_angle_deg,{answer['angle_deg']:.4g},{sd},{number}")
    return "\n".join(lines)


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
    turn = np.arctan(photo.base.slope)
    for flank, name, colour, dash in zip(photo.flanks, ("left", "right"), (MEASURED, MODEL), ("-", "--"), strict=True):
        along = np.array([flank.start, flank.end])
        height = flank.height_at_0 + flank.slope * along
        x = along * np.cos(turn) + height * np.sin(turn)
        y = photo.base.y_at_0 + along * np.sin(turn) - height * np.cos(turn)
        axes.plot(x, y, color="white", linewidth=4.5)
        axes.plot(x, y, dash, color=colour, linewidth=2.5, label=f"{name} flank {flank.angle_deg:.2f} deg")
    axes.set(xlim=(-0.5, columns - 0.5), ylim=(rows - 0.5, -0.5))
    axes.set_title(f"{photo.angle_deg:.2f} ± {photo.uncertainty_deg:.2f} deg")
    figure.legend(loc="outside lower center", ncols=2, facecolor="0.75", frameon=True, edgecolor="none")
    return figure
