"""pellet-study refine STUDY: compare, diagnose, add, again, until adequate, tied or unexplained."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from pellet_study.api import criticism
from pellet_study.api.figures import draw_all
from pellet_study.commands.arguments import add_figures, add_study, check_look, named, study_of, write_figures
from pellet_study.criticism import verdict_facts
from pellet_study.output.terminal import done, say, warn, working
from pellet_study.study import Measurement
from pellet_study.tables.numbers import number_given

EXAMPLE = """\
Writes what it adds into study.toml; refine.txt, refine.json, compare.json and the history into STUDY.

example:
  pellet-study refine results/wet_beads --figures
  pellet-study refine results/wet_beads --measure proposed.csv
  pellet-study refine results/wet_beads --figures paper --format pdf --width single
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.epilog = EXAMPLE
    add_study(parser)
    parser.add_argument(
        "--measure",
        metavar="FILE",
        type=Path,
        help="readings taken since, such as the proposed one, written as measurements.csv is: they are added to it first",
    )
    parser.add_argument(
        "--budget",
        metavar="MINUTES",
        type=_minutes,
        default=criticism.BUDGET,
        help="of a processor, for more simulations where the verdict hangs on their scatter (%(default)g)",
    )
    add_figures(parser)


def _minutes(text: str) -> float:
    """Minutes, none or more."""
    try:
        value = number_given(text)
    except ValueError:
        value = -1.0
    if not 0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r}: expected minutes, 0 or more, such as 10")
    return value


def run(arguments: argparse.Namespace) -> dict:
    """Refine, write what was added into study.toml, print the page, leave refine.txt and the history in the study."""
    check_look(arguments)
    added: Sequence[Measurement] = ()
    if arguments.measure is not None:
        study_of(arguments)  # one that cannot be used gets no rows
        added = criticism.measure(arguments.study, arguments.measure, arguments.library)
    study = study_of(arguments)
    with working("comparing, diagnosing, adding"):
        answer = criticism.refine(study, write=True, budget=arguments.budget, measured=added)
    say(answer.page)
    warn([*answer.warnings, *answer.unsaid], noted=answer.warnings)
    write_figures(arguments, lambda: draw_all(answer, arguments.width))
    first = verdict_facts.fit_too(answer.json)
    after = f"{'refine' if first else 'report'} {named(arguments)}"
    if not first and answer.tied and answer.next_measurement:
        first, after = "take the reading proposed (NEXT)", f"refine {named(arguments)} --measure FILE"
    done(arguments.study / "refine.txt", after, first)
    return answer.json
