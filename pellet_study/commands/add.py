"""pellet-study add STUDY EFFECT: write an effect into study.toml and recalibrate."""

import argparse
import sys
from pathlib import Path

from pellet_study import answers, pages
from pellet_study.catalogue import nearest
from pellet_study.compare import calibrate, compare
from pellet_study.errors import InputError
from pellet_study.model import Model
from pellet_study.study import Setting, check, load, settings, write_effect


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study and the effect."""
    parser.add_argument("study", type=Path, help="folder with study.toml and measurements.csv")
    parser.add_argument("effect", help="name of the effect")


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
    before = compare(study, level_out=True)
    larger = study.with_effect(arguments.effect)
    check(larger)
    state = calibrate(larger, Model(larger))
    after = compare(larger, state, level_out=True)
    prefix = f"{arguments.effect}."
    fitted = {
        name: after.parameters[prefix + name]
        for name in settings(study.catalogue.effects[arguments.effect], {})
    }
    free = settings(study.catalogue.effects[arguments.effect], fitted)
    write_effect(
        arguments.study / "study.toml",
        arguments.effect,
        {k: Setting(fitted[k], s.low, s.high) for k, s in free.items()},
    )
    steps = [answers.step(before), answers.step(after)]
    answers.record(arguments.study, steps)
    print("\n".join([pages.comparison_page(larger, after), "", *pages.ladder(steps)]))
    for warning in after.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    return {**answers.comparison(after), "before": answers.step(before)}
