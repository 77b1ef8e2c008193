"""pellet-study diagnose STUDY: rank the effects the model lacks; changes nothing."""

import argparse
import sys
from pathlib import Path

from pellet_study import answers, pages
from pellet_study.compare import calibrate
from pellet_study.diagnose import diagnose
from pellet_study.study import load


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.add_argument("study", type=Path, help="folder with study.toml and measurements.csv")
    parser.add_argument("--figures", action="store_true", help="also draw the figures")


def run(arguments: argparse.Namespace) -> dict:
    """Diagnose, print the page, leave diagnose.txt in the study."""
    study = load(arguments.study)
    found = diagnose(study)
    page = pages.diagnosis_page(study, found)
    print(page)
    for warning in dict.fromkeys(found.warnings):
        print(f"warning: {warning}", file=sys.stderr)
    (arguments.study / "diagnose.txt").write_text(page + "\n", encoding="utf-8")
    if arguments.figures:
        from pellet_study import figures

        figures.ranking(found, arguments.study / "ranking.png")
        figures.constants(calibrate(study), found, arguments.study / "constants.png")
    return answers.diagnosis(found)
