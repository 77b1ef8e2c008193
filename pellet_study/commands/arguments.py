"""Arguments that several commands share."""

import argparse
from pathlib import Path


def add_study(parser: argparse.ArgumentParser) -> None:
    """STUDY, a folder."""
    parser.add_argument("study", metavar="STUDY", type=Path, help="folder with study.toml and measurements.csv")
