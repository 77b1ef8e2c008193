"""pellet-study history STUDY: the error falling step by step, as table and figure."""

import argparse
from pathlib import Path

from pellet_study import answers, pages
from pellet_study.errors import InputError
from pellet_study.study import load


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.add_argument("study", type=Path, help="folder with study.toml and measurements.csv")


def run(arguments: argparse.Namespace) -> dict:
    """Print the ladder and draw history.png."""
    study = load(arguments.study)
    steps = answers.read_history(arguments.study)
    if not steps:
        raise InputError(f"{arguments.study}: nothing was done yet; run add, drop or refine first")
    print("\n".join([study.title, "", *pages.ladder(steps)]))
    from pellet_study import figures

    figures.ladder(steps, arguments.study / "history.png")
    return {"steps": steps}
