"""pellet-study history STUDY: the error falling step by step, as table and figure."""

import argparse

from pellet_study.commands.arguments import add_study, study_of
from pellet_study.criticism import text
from pellet_study.errors import InputError
from pellet_study.output.terminal import done, say
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


def run(arguments: argparse.Namespace) -> dict:
    """Print the ladder and draw it."""
    study = study_of(arguments)
    steps = history.read_history(arguments.study)
    if not steps:
        raise InputError(f"{arguments.study}: nothing was done yet; run add, drop or refine first")
    say(text.folded([study.title, "", *text.ladder(steps)]))
    from pellet_study.criticism import figures
    from pellet_study.output import style

    file = style.save(figures.ladder(steps), arguments.study / "figures" / "ladder.png")
    done(file, f"report {arguments.study}")
    return {"steps": steps}
