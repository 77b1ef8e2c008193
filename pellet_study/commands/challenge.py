"""pellet-study challenge FOLDER: hidden-effect trials, sealed, then opened and counted.

On closed-form twins of the rigs (`--on twins`, fast), on stored YADE predictions of the bench demonstration
(`--on predictions`: the first call simulates for about 12 cpu-minutes), or on YADE from the readings on: sealed
trials on seeds (`--on yade`, about a minute each and core) or heaps (`--on heaps`, half a minute each and core after ten
minutes for what all share). Every call goes on where the last one stopped.

example: pellet-study challenge results/hidden_effect --on yade --minutes 30
"""

import argparse
import math
import sys
from pathlib import Path

from pellet_study.challenge import acceptance, counting, resume
from pellet_study.challenge.demonstration import Demonstration
from pellet_study.challenge.resume import Show
from pellet_study.commands.numbers import number, whole
from pellet_study.files import writing
from pellet_study.output.terminal import done, fold, say


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where to, on what, and how many."""
    parser.description = __doc__.split(": ", 1)[1]
    parser.add_argument("study", type=Path, metavar="FOLDER", help="folder for the trials and the tables")
    parser.add_argument(
        "--on", choices=("twins", "predictions", "yade", "heaps"), default="twins", help="default: twins"
    )
    parser.add_argument(
        "--scale", type=number, default=0.02, help="share of the full campaign (default 0.02; 1 is full)"
    )
    parser.add_argument("--minutes", type=number, default=math.inf, help="stop after so long; the next call goes on")
    parser.add_argument("--first", type=whole, default=0, help="twins: number of the first trial (published: 0)")


def run(arguments: argparse.Namespace) -> dict:
    """Do what is missing, write the tables, print the figures beside their aims."""
    writing.folder(arguments.study)
    show: Show | None = None
    if sys.stderr.isatty():
        from tqdm import tqdm

        bar = tqdm(unit="trial", file=sys.stderr)

        def show(count: int, total: int) -> None:
            bar.total = total
            bar.update(count - bar.n)

    answer = {"twins": _twins, "predictions": _predictions, "yade": _yade, "heaps": _heaps}[arguments.on](
        arguments, show
    )
    for row in answer["figures"]:
        cells = list(row.values())
        say(fold([str(cells[0])]))
        say(f"    {cells[1]:26s}{cells[2]:>9s}  {cells[3]:18s}{cells[4]:6d}  {cells[5]}")
    done(arguments.study)
    return answer


def _command(arguments: argparse.Namespace) -> str:
    return f"pellet-study challenge {arguments.study} --on {arguments.on} --scale {arguments.scale:g}"


def _twins(arguments: argparse.Namespace, show: Show | None) -> dict:
    file = arguments.study / "twins.csv"
    acceptance.run(file, arguments.scale, 60 * arguments.minutes, arguments.first, show)
    rows = resume.read(file)
    acceptance.write_tables(rows, arguments.study, _command(arguments))
    return acceptance.as_json(rows)


def _predictions(arguments: argparse.Namespace, show: Show | None) -> dict:
    from pellet_study.challenge import predictions, tables

    stored = predictions.Stored(arguments.study / ".store")
    file = arguments.study / "predictions.csv"
    predictions.run(stored, file, arguments.scale, 60 * arguments.minutes, show)
    rows = resume.read(file)
    return _answer(rows, tables.write_predictions(rows, arguments.study, _command(arguments)))


def _yade(arguments: argparse.Namespace, show: Show | None) -> dict:
    from pellet_study.challenge import seeds, tables

    return _sealed(arguments, show, seeds.BENCH, tables.BENCH_TRIALS)


def _heaps(arguments: argparse.Namespace, show: Show | None) -> dict:
    from pellet_study.challenge import heaps, tables

    return _sealed(arguments, show, heaps.HEAPS, tables.HEAP_TRIALS)


def _sealed(arguments: argparse.Namespace, show: Show | None, of: Demonstration, text: str) -> dict:
    from pellet_study.challenge import sealed, tables

    folder, count = arguments.study, max(1, round(arguments.scale * len(of.kinds())))
    file = sealed.run(of, folder / "sealed", folder / ".store", count, 60 * arguments.minutes, show=show)
    rows = resume.read(file)
    return _answer(rows, tables.write_sealed(rows, folder, _command(arguments), text))


def _answer(rows: list[dict], figures: list[dict]) -> dict:
    one, nothing = ([r for r in rows if r["kind"] == kind] for kind in ("one", "nothing"))
    return {
        "trials": len(rows),
        "identified": sum(counting.right(r) for r in one),
        "in_answer": sum(counting.inside(r) for r in one),
        "hidden_trials": len(one),
        "false_alarms": sum(bool(counting.named(r)) for r in nothing),
        "null_trials": len(nothing),
        "figures": figures,
    }
