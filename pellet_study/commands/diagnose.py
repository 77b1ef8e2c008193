"""pellet-study diagnose STUDY: rank the effects the model lacks; changes nothing."""

import argparse
from pathlib import Path

from pellet_study.criticism import answers, text
from pellet_study.criticism.by_level import by_level
from pellet_study.criticism.calibration import calibrate
from pellet_study.criticism.diagnose import diagnose
from pellet_study.output.terminal import done, say, warn, working
from pellet_study.study import history
from pellet_study.study.load import load

EXAMPLE = """\
Writes diagnose.txt and diagnose.json into STUDY, which `report` shows; study.toml stays as it is.

example:
  pellet-study diagnose results/wet_beads --figures
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.epilog = EXAMPLE
    parser.add_argument("study", metavar="STUDY", type=Path, help="folder with study.toml and measurements.csv")
    parser.add_argument("--figures", action="store_true", help="also draw the figures")


def run(arguments: argparse.Namespace) -> dict:
    """Diagnose, print the page, leave it and the answer in the study."""
    study = load(arguments.study)
    with working("ranking the candidate effects"):
        state = calibrate(study)
        found = diagnose(study, state)
    page = text.diagnosis_page(study, found)
    answer = {**answers.diagnosis(found), "by_level": by_level(state, found)}
    say(page)
    warn(found.warnings, noted=found.warnings)
    history.leave(arguments.study, "diagnose", page, answer)
    if arguments.figures:
        from pellet_study.criticism import figures
        from pellet_study.output import style

        folder = arguments.study / "figures"
        if answer["ranking"]:
            style.save(figures.ranking(answer), folder / "ranking.png")
        if answer["by_level"]:
            style.save(figures.constants(answer["by_level"]), folder / "constants.png")
    after = f"add {arguments.study} {found.missing[0]}" if found.missing else f"report {arguments.study}"
    done(arguments.study / "diagnose.txt", after)
    return answer
