"""pellet-study challenge FOLDER: hidden-effect trials on the closed-form twins, sealed, then opened and counted."""

import argparse
import math
import sys
from pathlib import Path

from pellet_study.challenge import acceptance


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where to, and how many."""
    parser.add_argument("study", type=Path, metavar="FOLDER", help="folder for twins.csv and the tables")
    parser.add_argument(
        "--scale", type=float, default=0.02, help="share of the full campaign (default 0.02; 1 is full)"
    )
    parser.add_argument(
        "--minutes", type=float, default=math.inf, help="stop after so long; the next call goes on"
    )
    parser.add_argument(
        "--first", type=int, default=0, help="number of the first trial (published ones begin at 0)"
    )


def run(arguments: argparse.Namespace) -> dict:
    """Do what is missing, write the tables, print the figures beside their aims."""
    arguments.study.mkdir(parents=True, exist_ok=True)
    file = arguments.study / "twins.csv"
    show = None
    if sys.stderr.isatty():
        from tqdm import tqdm

        bar = tqdm(unit="trial", file=sys.stderr)

        def show(count: int, total: int) -> None:
            bar.total = total
            bar.update(count - bar.n)

    acceptance.run(file, arguments.scale, 60 * arguments.minutes, arguments.first, show)
    rows = acceptance.read(file)
    command = f"pellet-study challenge results/hidden_effect --scale {arguments.scale:g}"
    acceptance.write_tables(rows, arguments.study, command)
    answer = acceptance.as_json(rows)
    for row in answer["figures"]:
        print(
            f"{row['figure']:80s}{row['aim']:28s}{row['measured']:>9s}  {row['interval']:18s}{row['trials']:6d}  {row['met']}"
        )
    return answer
