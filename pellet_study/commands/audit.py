"""`pellet-study audit`: the source paper's printed numbers recomputed, with verdicts."""

import argparse
from pathlib import Path

from pellet_study.commands.design_tables import writing
from pellet_study.output.terminal import done, say

EXAMPLES = """\
verdicts: reproduced (equal at the printed digits), reproduced to rounding, consistent, inconsistent, data
missing, not recomputable.

examples:
  pellet-study audit
  pellet-study audit --verdict inconsistent
  pellet-study audit --results results/paper --json audit.json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    from pellet_study.paper.verdicts import VERDICTS

    parser.epilog = EXAMPLES
    parser.add_argument("--verdict", choices=VERDICTS, help="print only the items with this verdict")
    parser.add_argument(
        "--results",
        metavar="DIR",
        type=Path,
        help="also write audit.csv, the recomputed tables and their figures there",
    )


def run(arguments: argparse.Namespace) -> dict:
    """Print the audit and return its rows."""
    from pellet_study.doe.answers import plain
    from pellet_study.paper.audit import audit, counts

    items = audit()
    _print([item for item in items if arguments.verdict in (None, item.verdict)])
    say("\n" + ", ".join(f"{number} {verdict}" for verdict, number in counts(items).items()) + f"; {len(items)} items")
    answer = {"rows": plain([item.as_dict() for item in items]), "counts": counts(items)}
    if arguments.results:
        from pellet_study.paper.results import write

        with writing(arguments.results):
            paths = write(arguments.results, items)
        answer["files"] = [str(path) for path in paths]
        done(f"{len(paths)} files in {arguments.results}")
    return answer


def _print(items) -> None:
    """One line an item, its reason below."""
    section = None
    for item in items:
        if item.section != section:
            section = item.section
            say(f"\n{section}")
        value = item.recomputed
        shown = "-" if value is None else value if isinstance(value, str) else f"{value:.7g}"
        say(f"  {item.item}: printed {item.published or '-'}, recomputed {shown}: {item.verdict}")
        if item.reason:
            say(f"      {item.reason}")
