"""pellet-study compare STUDY: calibrate the present model, residual of every row, where it fails."""

import argparse
import sys
from pathlib import Path

from pellet_study import answers, pages
from pellet_study.compare import compare
from pellet_study.study import load


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.add_argument("study", type=Path, help="folder with study.toml and measurements.csv")
    parser.add_argument("--figures", action="store_true", help="also draw the figures")


def run(arguments: argparse.Namespace) -> dict:
    """Compare, print the page, leave compare.txt in the study."""
    study = load(arguments.study)
    found = compare(study, level_out=True)
    page = pages.comparison_page(study, found)
    print(page)
    for warning in found.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    (arguments.study / "compare.txt").write_text(page + "\n", encoding="utf-8")
    if arguments.figures:
        from pellet_study import figures

        figures.residuals(found, arguments.study / "residuals.png")
    return answers.comparison(found)
