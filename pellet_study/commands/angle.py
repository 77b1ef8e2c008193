"""pellet-study angle PHOTO...: the repose angle of a heap from photographs."""

import argparse
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.terminal import done, say, working

EXAMPLE = """\
Photograph the heap from the side, the camera at its height, lit from the front, with background of another tone on both
sides and above, and the plate's edge in the picture from side to side: it gives the camera's tilt. Needs scikit-image:
pip install 'pellet-study[angle]'.

example:
  pellet-study angle heap_1.jpg heap_2.jpg heap_3.jpg --figures overlays --json angle.json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.epilog = EXAMPLE
    parser.add_argument("photos", metavar="PHOTO", type=Path, nargs="+", help="pictures of one heap each")
    parser.add_argument(
        "--horizon", metavar="DEG", type=float, help="the level in the pictures, positive where it rises to the right "
        "(default: the plate's edge, else the heap's foot)",
    )  # fmt: skip
    parser.add_argument(
        "--figures", metavar="DIR", type=Path, default=Path("angle"), help="where the overlays go (./angle)"
    )


def run(arguments: argparse.Namespace) -> dict:
    """Measure every picture, draw what was fitted, print the angles and the row for measurements.csv."""
    if arguments.horizon is not None and not abs(arguments.horizon) <= 45:
        raise InputError(f"--horizon {arguments.horizon:g}: expected a tilt from -45 to 45 deg")
    from pellet_study import angle_report, photograph

    found, problems = [], []
    with working("reading the photographs"):
        for file in arguments.photos:
            try:
                found.append(photograph.measure(file, arguments.horizon))
            except InputError as error:
                problems.append(str(error))
    if problems:
        raise InputError("; ".join(problems))
    overlays = angle_report.draw(arguments.photos, found, arguments.figures)
    answer = angle_report.answer(arguments.photos, found, overlays)
    say(angle_report.page(answer))
    done(f"overlays in {arguments.figures}", "init FOLDER")
    return answer
