"""pellet-study refine STUDY: compare, diagnose, add, again, until adequate, tied or unexplained."""

import argparse
from pathlib import Path

from pellet_study.criticism import answers, text
from pellet_study.criticism.by_level import by_level
from pellet_study.criticism.refine import refine
from pellet_study.output.terminal import done, say, warn, working
from pellet_study.study import history
from pellet_study.study.edit import write_effect
from pellet_study.study.load import load

EXAMPLE = """\
Writes what it adds into study.toml; refine.txt, refine.json, compare.json and the history into STUDY.

example:
  pellet-study refine results/wet_beads
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.epilog = EXAMPLE
    parser.add_argument("study", metavar="STUDY", type=Path, help="folder with study.toml and measurements.csv")


def run(arguments: argparse.Namespace) -> dict:
    """Refine, write what was added into study.toml, print the page, leave refine.txt and the history in the study."""
    study = load(arguments.study)
    with working("comparing, diagnosing, adding"):
        found = refine(study)
        answer = answers.refinement(found)
        interpolation = answers.check_surface(answer, found.state)
    file = arguments.study / "study.toml"
    for name in found.added:
        write_effect(file, name, found.study.effects[name])
    answer["diagnoses"][0]["by_level"] = by_level(found.first, found.diagnoses[0])
    history.record(arguments.study, answer["steps"])
    page = text.refinement_page(study, found, answer["steps"])
    say(page)
    warn([*answer["warnings"], *interpolation], noted=answer["warnings"])
    history.leave(arguments.study, "refine", page, answer)
    history.leave(arguments.study, "compare", text.comparison_page(found.study, found.steps[-1]), answer["steps"][-1])
    done(arguments.study / "refine.txt", f"report {arguments.study}")
    return answer
