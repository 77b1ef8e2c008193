"""pellet-study drop STUDY EFFECT: take an effect out of study.toml and recalibrate."""

import argparse
from pathlib import Path

from pellet_study.criticism import answers, text
from pellet_study.criticism.compare import compare
from pellet_study.errors import InputError
from pellet_study.output.terminal import done, say, warn, working
from pellet_study.output.words import nearest
from pellet_study.study import history
from pellet_study.study.edit import erase_effect
from pellet_study.study.load import load

EXAMPLE = """\
Takes the effect out of [effects] of study.toml; writes compare.txt and compare.json, and a step of the history.

example:
  pellet-study drop results/wet_beads cohesion
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study and the effect."""
    parser.epilog = EXAMPLE
    parser.add_argument("study", metavar="STUDY", type=Path, help="folder with study.toml and measurements.csv")
    parser.add_argument("effect", metavar="EFFECT", help="name of an effect in [effects]")


def run(arguments: argparse.Namespace) -> dict:
    """Drop, recalibrate, print the error before and after."""
    study = load(arguments.study)
    if arguments.effect not in study.effects:
        raise InputError(f"{arguments.effect} is not in [effects]{nearest(arguments.effect, study.effects)}")
    with working("calibrating with and without the effect"):
        before = compare(study, level_out=True)
        erase_effect(arguments.study / "study.toml", arguments.effect)
        smaller = load(arguments.study)
        after = compare(smaller, level_out=True)
    steps = [answers.comparison(before), answers.comparison(after)]
    history.record(arguments.study, steps)
    page = text.folded([text.comparison_page(smaller, after), "", *text.ladder(steps)])
    say(page)
    warn(after.warnings, noted=after.warnings)
    history.leave(arguments.study, "compare", page, steps[1])
    done(arguments.study / "compare.txt", f"{'report' if after.fits else 'diagnose'} {arguments.study}")
    return {**steps[1], "before": steps[0]}
