"""pellet-study angle PHOTO...: the repose angle of a heap from photographs, or from the grains of a simulated one."""

import argparse
import math
from pathlib import Path
from typing import Any

from pellet_study.commands.numbers import number
from pellet_study.errors import InputError
from pellet_study.output.terminal import done, say, warn, working

EXAMPLE = """\
Photograph the heap from the side, the camera at its height, lit from the front, with background of another tone on both
sides and above, and the plate's edge in the picture from side to side: it gives the camera's tilt. Needs scikit-image:
pip install 'pellet-study[angle]'. A CSV with columns x_m, y_m, z_m, radius_m (grains on a plate at z = 0) is read as every
simulated heap is, over 12 directions. Every heap is read by straight lines through both flanks (20 to 80 % of the height)
and by the least-squares triangle, which is the repose angle; grains by their moments as well.

example:
  pellet-study angle heap_1.jpg heap_2.jpg heap_3.jpg --figures overlays --json angle.json
  pellet-study angle results/full/heap_grains.csv
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.epilog = EXAMPLE
    parser.add_argument(
        "photos", metavar="PHOTO", type=Path, nargs="+", help="pictures of one heap each, or CSVs of grains"
    )
    parser.add_argument(
        "--horizon", metavar="DEG", type=number, help="the level in the pictures, positive where it rises to the right "
        "(default: the plate's edge, else the heap's foot)",
    )  # fmt: skip
    parser.add_argument(
        "--base-diameter", metavar="MM", type=number, help="of the disc about the axis on which the grains of CSVs lie "
        "(default: an endless plate)",
    )  # fmt: skip
    parser.add_argument(
        "--figures", metavar="DIR", type=Path, default=Path("angle"), help="where the overlays go (./angle)"
    )


def run(arguments: argparse.Namespace) -> dict:
    """Measure every picture, draw what was fitted, print the angles and the row for measurements.csv."""
    if arguments.horizon is not None and not abs(arguments.horizon) <= 45:
        raise InputError(f"--horizon {arguments.horizon:g}: expected a tilt from -45 to 45 deg")
    if arguments.base_diameter is not None and not 0 < arguments.base_diameter < math.inf:
        raise InputError(f"--base-diameter {arguments.base_diameter:g}: expected a length above 0, in mm")
    tables = [file for file in arguments.photos if file.suffix.lower() == ".csv"]
    if tables:
        if len(tables) < len(arguments.photos):
            raise InputError("pictures and CSVs of grains together: expected one kind, as they are read differently")
        return _of_grains(tables, arguments.base_diameter)
    if arguments.base_diameter is not None:
        raise InputError("--base-diameter is of grains; a photograph shows where its heap ends")
    from pellet_study.heap import photograph, report

    found, problems = [], []
    with working("reading the photographs"):
        for file in arguments.photos:
            try:
                found.append(photograph.measure(file, arguments.horizon))
            except InputError as error:
                problems.append(str(error))
    if problems:
        raise InputError("; ".join(problems))
    overlays = report.draw(arguments.photos, found, arguments.figures)
    answer = report.answer(arguments.photos, found, overlays)
    say(report.page(answer))
    warn(
        f"{p['photo']}: {doubt}; look at {p['overlay']}, and photograph the heap from the side, at its height, evenly lit"
        for p in answer["photos"]
        for doubt in p["doubts"]
    )
    done(f"overlays in {arguments.figures}", "init FOLDER")
    return answer


def _of_grains(files: list[Path], base_diameter_mm: float | None) -> dict:
    """Read heaps of grains, print their angles."""
    from pellet_study.heap import render
    from yade_scripts import heap

    base_radius = None if base_diameter_mm is None else 0.5e-3 * base_diameter_mm
    heaps = []
    for file in files:
        try:
            found = heap.readings(*render.read_grains(file), base_radius)
        except heap.NoHeap as error:
            raise InputError(f"{file}: {error}") from None
        one: dict[str, Any] = {"grains": str(file)}
        one |= {"angle_deg": found.repose.angle_deg, "standard_error_deg": found.repose.standard_error_deg}
        said = []
        for name, (angle, apart) in zip(found._fields, found[:3], strict=False):
            known = not math.isnan(angle)
            one |= {f"{name}_deg": angle if known else None, f"{name}_error_deg": apart if known else None}
            said.append(f"{name} {angle:.2f} +- {apart:.2f} deg" if known else f"no {name} ({found.no_flank})")
        heaps.append(one)
        say(f"{file}: {', '.join(said)}; over {heap.DIRECTIONS} directions")
    return {"angle_deg": sum(one["angle_deg"] for one in heaps) / len(heaps), "heaps": heaps}
