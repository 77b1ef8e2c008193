"""pellet-study report STUDY: one self-contained HTML page about a study."""

import argparse

from pellet_study.commands.arguments import add_study
from pellet_study.output.terminal import done, working

EXAMPLE = """\
Made of the files in STUDY alone (what compare, diagnose, refine and bench left there); nothing is simulated. The page
STUDY/report.html opens from disk, loads nothing from elsewhere and prints. What is missing is named with its command.

example:
  pellet-study report results/wet_beads
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.epilog = EXAMPLE
    add_study(parser)


def run(arguments: argparse.Namespace) -> dict:
    """Write the page, say where it is."""
    from pellet_study.report import page

    with working("drawing the report"):
        path = page.write(arguments.study, arguments.library)
    done(f"{path} (open it in a browser)")
    return {"path": str(path)}
