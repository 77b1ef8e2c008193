"""pellet-study compare STUDY: calibrate the present model, residual of every row, where it fails."""

import argparse
from pathlib import Path

from pellet_study.criticism import answers, text
from pellet_study.criticism.calibration import calibrate
from pellet_study.criticism.compare import compare
from pellet_study.output.terminal import done, say, warn, working
from pellet_study.study import history
from pellet_study.study.load import load

EXAMPLE = """\
Writes compare.txt and compare.json into STUDY, which `report` shows.

example:
  pellet-study compare results/wet_beads --figures
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.epilog = EXAMPLE
    parser.add_argument("study", metavar="STUDY", type=Path, help="folder with study.toml and measurements.csv")
    parser.add_argument("--figures", action="store_true", help="also draw the figures")


def run(arguments: argparse.Namespace) -> dict:
    """Compare, print the page, leave it and the answer in the study."""
    study = load(arguments.study)
    with working("comparing the model with the measurements"):
        state = calibrate(study)
        found = compare(study, state, level_out=True)
        answer = answers.comparison(found)
        interpolation = answers.check_surface(answer, state)
    page = text.comparison_page(study, found)
    say(page)
    warn([*found.warnings, *interpolation], noted=found.warnings)
    history.leave(arguments.study, "compare", page, answer)
    if arguments.figures:
        from pellet_study.criticism import figures
        from pellet_study.output import style

        style.save(figures.predictions(answer["rows"]), arguments.study / "figures" / "predictions.png")
        style.save(figures.residuals([answer]), arguments.study / "figures" / "residuals.png")
    done(arguments.study / "compare.txt", f"{'report' if found.fits else 'diagnose'} {arguments.study}")
    return answer
