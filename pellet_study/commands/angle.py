"""pellet-study angle PHOTO...: the repose angle of a heap from photographs, or from the grains of a simulated one."""

import argparse
from pathlib import Path

from pellet_study.commands.numbers import number
from pellet_study.errors import InputError
from pellet_study.output.terminal import done, say, warn, working

EXAMPLE = """\
Photograph the heap from the side, the camera at its height, lit from the front, with background of another tone on both
sides and above, and the plate's edge in the picture from side to side: it gives the camera's tilt. Needs scikit-image:
pip install 'pellet-study[angle]'. A CSV with columns x_m, y_m, z_m, radius_m (grains on a plate at z = 0) is read as every
simulated heap is, over 24 directions.

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
        "--figures", metavar="DIR", type=Path, default=Path("angle"), help="where the overlays go (./angle)"
    )


def run(arguments: argparse.Namespace) -> dict:
    """Measure every picture, draw what was fitted, print the angles and the row for measurements.csv."""
    if arguments.horizon is not None and not abs(arguments.horizon) <= 45:
        raise InputError(f"--horizon {arguments.horizon:g}: expected a tilt from -45 to 45 deg")
    tables = [file for file in arguments.photos if file.suffix.lower() == ".csv"]
    if tables:
        if len(tables) < len(arguments.photos):
            raise InputError("pictures and CSVs of grains together: expected one kind, as they are read differently")
        return _of_grains(tables)
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
        f"{p['photo']}: the sides are no straight lines (+- {p['uncertainty_deg']:.1f} deg), as where a heap is seen from "
        f"above; look at {p['overlay']}, and photograph it from the side"
        for p in answer["photos"]
        if p["uncertainty_deg"] > report.UNSURE_DEG
    )
    done(f"overlays in {arguments.figures}", "init FOLDER")
    return answer


def _of_grains(files: list[Path]) -> dict:
    """Read heaps of grains, print their angles."""
    from pellet_study.heap import render
    from yade_scripts import heap

    heaps = []
    for file in files:
        try:
            found = heap.repose_angle(*render.read_grains(file))
        except heap.NoHeap as error:
            raise InputError(f"{file}: {error}") from None
        heaps.append({"grains": str(file), "angle_deg": found.mean_deg, "standard_error_deg": found.standard_error_deg})
        seen = len(found.directions_deg)
        say(f"{file}: {found.mean_deg:.2f} +- {found.standard_error_deg:.2f} deg over {seen} directions")
    return {"angle_deg": sum(one["angle_deg"] for one in heaps) / len(heaps), "heaps": heaps}
