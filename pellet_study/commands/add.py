"""pellet-study add STUDY EFFECT: write an effect into study.toml and recalibrate."""

import argparse

from pellet_study.api import criticism
from pellet_study.commands.arguments import add_study, named, study_of
from pellet_study.criticism import fit_facts
from pellet_study.output.terminal import done, say, warn, working

EXAMPLE = """\
Writes the effect into [effects] of study.toml, compare.txt and compare.json, and a step of the history.

example:
  pellet-study add results/wet_beads cohesion
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study and the effect."""
    parser.epilog = EXAMPLE
    add_study(parser)
    parser.add_argument("effect", metavar="EFFECT", help="name of the effect")


def run(arguments: argparse.Namespace) -> dict:
    """Add, recalibrate, print the error before and after."""
    with working("calibrating without and with the effect"):
        answer = criticism.add(study_of(arguments), arguments.effect, write=True)
    say(answer.page)
    warn([*answer.warnings, *answer.unsaid], noted=answer.warnings)
    after = "diagnose" if fit_facts.doubted(answer.json) else "report"
    done(arguments.study / "compare.txt", f"{after} {named(arguments)}")
    return answer.json
