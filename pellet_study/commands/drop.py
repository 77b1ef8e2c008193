"""pellet-study drop STUDY EFFECT: take an effect out of study.toml and recalibrate."""

import argparse
import sys
from pathlib import Path

from pellet_study import answers, pages
from pellet_study.catalogue import nearest
from pellet_study.compare import compare
from pellet_study.errors import InputError
from pellet_study.study import erase_effect, load


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study and the effect."""
    parser.add_argument("study", type=Path, help="folder with study.toml and measurements.csv")
    parser.add_argument("effect", help="name of an effect in [effects]")


def run(arguments: argparse.Namespace) -> dict:
    """Drop, recalibrate, print the error before and after."""
    study = load(arguments.study)
    if arguments.effect not in study.effects:
        raise InputError(f"{arguments.effect} is not in [effects]{nearest(arguments.effect, study.effects)}")
    before = compare(study, level_out=True)
    erase_effect(arguments.study / "study.toml", arguments.effect)
    smaller = load(arguments.study)
    after = compare(smaller, level_out=True)
    steps = [answers.step(before), answers.step(after)]
    answers.record(arguments.study, steps)
    print("\n".join([pages.comparison_page(smaller, after), "", *pages.ladder(steps)]))
    for warning in after.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    return {**answers.comparison(after), "before": answers.step(before)}
