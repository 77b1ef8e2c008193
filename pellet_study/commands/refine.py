"""pellet-study refine STUDY: compare, diagnose, add, again, until adequate, tied or unexplained."""

import argparse
import sys
from pathlib import Path

from pellet_study import answers, pages
from pellet_study.refine import refine
from pellet_study.study import load, write_effect


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.add_argument("study", type=Path, help="folder with study.toml and measurements.csv")


def run(arguments: argparse.Namespace) -> dict:
    """Refine, write what was added into study.toml, print the page, leave refine.txt and the history in the study."""
    study = load(arguments.study)
    found = refine(study)
    file = arguments.study / "study.toml"
    for name in found.added:
        write_effect(file, name, found.study.effects[name])
    answer = answers.refinement(found)
    answers.record(arguments.study, answer["steps"])
    page = pages.refinement_page(study, found, answer["steps"])
    print(page)
    for warning in answer["warnings"]:
        print(f"warning: {warning}", file=sys.stderr)
    (arguments.study / "refine.txt").write_text(page + "\n", encoding="utf-8")
    return answer
