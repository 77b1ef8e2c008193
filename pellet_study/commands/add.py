"""pellet-study add STUDY EFFECT: write an effect into study.toml and recalibrate."""

import argparse
from pathlib import Path

from pellet_study.criticism import answers, text
from pellet_study.criticism.calibration import calibrate
from pellet_study.criticism.compare import compare
from pellet_study.errors import InputError
from pellet_study.model.model import Model
from pellet_study.output.terminal import done, say, warn, working
from pellet_study.output.words import nearest
from pellet_study.study import history
from pellet_study.study.edit import write_effect
from pellet_study.study.load import load
from pellet_study.study.study import Setting, check, settings

EXAMPLE = """\
Writes the effect into [effects] of study.toml, compare.txt and compare.json, and a step of the history.

example:
  pellet-study add results/wet_beads cohesion
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study and the effect."""
    parser.epilog = EXAMPLE
    parser.add_argument("study", metavar="STUDY", type=Path, help="folder with study.toml and measurements.csv")
    parser.add_argument("effect", metavar="EFFECT", help="name of the effect")


def run(arguments: argparse.Namespace) -> dict:
    """Add, recalibrate, print the error before and after."""
    study = load(arguments.study)
    if arguments.effect in study.effects:
        raise InputError(f"{arguments.effect} is in [effects] already")
    if arguments.effect not in study.acting():
        study.catalogue.effect(arguments.effect)
        raise InputError(
            f"{arguments.effect} acts in none of the rigs used ({', '.join(study.rigs)})"
            f"{nearest(arguments.effect, study.acting())}"
        )
    larger = study.with_effect(arguments.effect)
    check(larger)
    with working("calibrating without and with the effect"):
        before = compare(study, level_out=True)
        state = calibrate(larger, Model(larger))
        after = compare(larger, state, level_out=True)
    prefix = f"{arguments.effect}."
    fitted = {name: after.parameters[prefix + name] for name in settings(study.catalogue.effects[arguments.effect], {})}
    free = settings(study.catalogue.effects[arguments.effect], fitted)
    write_effect(
        arguments.study / "study.toml",
        arguments.effect,
        {k: Setting(fitted[k], s.low, s.high) for k, s in free.items()},
    )
    steps = [answers.comparison(before), answers.comparison(after)]
    history.record(arguments.study, steps)
    page = text.folded([text.comparison_page(larger, after), "", *text.ladder(steps)])
    say(page)
    warn(after.warnings, noted=after.warnings)
    history.leave(arguments.study, "compare", page, steps[1])
    done(arguments.study / "compare.txt", f"{'report' if after.fits else 'diagnose'} {arguments.study}")
    return {**steps[1], "before": steps[0]}
