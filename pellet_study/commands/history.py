"""pellet-study history STUDY: the error falling step by step, as table and figure."""

import argparse
from pathlib import Path

from pellet_study.commands.arguments import add_look, add_study, named, study_of, write_figures
from pellet_study.criticism import text
from pellet_study.errors import InputError
from pellet_study.output.terminal import done, say, warn
from pellet_study.study import history

EXAMPLE = """\
The steps that add, drop and refine left in STUDY; draws figures/ladder.png.

example:
  pellet-study history results/wet_beads
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.epilog = EXAMPLE
    add_study(parser)
    parser.add_argument(
        "--figures", metavar="DIR", type=Path, default=Path(), help="where the ladder goes (STUDY/figures)"
    )
    add_look(parser)


def run(arguments: argparse.Namespace) -> dict:
    """Print the ladder and draw it."""
    study = study_of(arguments)
    steps = history.read_history(arguments.study)
    if not steps:
        raise InputError(f"{arguments.study}: nothing was done yet; run add, drop or refine first")
    say(text.fold([study.title, "", *text.ladder(steps)]))
    if steps[-1].get("basis", study.basis) != study.basis:
        warn(
            [
                f"these steps are of other rows, or of another rig, than {arguments.study} has now; refine, add or drop begin anew"
            ]
        )
    from pellet_study.criticism import figures

    file = write_figures(arguments, lambda: {"ladder": figures.ladder(steps, effects=study.acting())})[0]
    done(file, f"report {named(arguments)}")
    return {"steps": steps}
