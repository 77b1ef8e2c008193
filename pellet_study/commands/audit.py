"""`pellet-study audit`: a paper's printed numbers recomputed, with verdicts; the source paper's, or those a folder describes."""

import argparse
from pathlib import Path

from pellet_study.commands.arguments import add_look, look_of
from pellet_study.commands.design_tables import writing
from pellet_study.output.terminal import done, say

EXAMPLES = """\
FOLDER describes another paper: its tables as CSV, its printed numbers in paper.toml (docs/audit_a_paper.md).

verdicts: reproduced (equal at the printed digits), reproduced to rounding, consistent, inconsistent, data
missing, not recomputable.

examples:
  pellet-study audit
  pellet-study audit --verdict inconsistent
  pellet-study audit --results results/paper --json audit.json
  pellet-study audit results/genre/viscosity
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    from pellet_study.paper.verdicts import VERDICTS

    parser.epilog = EXAMPLES
    parser.add_argument(
        "folder", metavar="FOLDER", type=Path, nargs="?", help="describes a paper; default: the source paper"
    )
    parser.add_argument("--verdict", choices=VERDICTS, help="print only the items with this verdict")
    parser.add_argument(
        "--results",
        metavar="DIR",
        type=Path,
        help="also write audit.csv, the recomputed tables and (of the source paper) their figures there",
    )
    add_look(parser)


def run(arguments: argparse.Namespace) -> dict:
    """Print the audit and return its rows."""
    from pellet_study.doe.answers import plain
    from pellet_study.paper.verdicts import counts

    items, answer, write = _source_paper() if arguments.folder is None else _described(arguments.folder)
    _print([item for item in items if arguments.verdict in (None, item.verdict)])
    say("\n" + ", ".join(f"{number} {verdict}" for verdict, number in counts(items).items()) + f"; {len(items)} items")
    answer = {**answer, "rows": plain([item.as_dict() for item in items]), "counts": counts(items)}
    if arguments.results:
        with writing(arguments.results), look_of(arguments):
            paths = write(arguments.results)
        answer["files"] = [str(path) for path in paths]
        done(f"{len(paths)} files in {arguments.results}")
    return answer


def _source_paper():
    """Items, further keys of the answer, and what writes the results of the source paper."""
    from pellet_study.paper.audit import audit

    items = audit()

    def write(folder: Path) -> list[Path]:
        from pellet_study.paper.results import write

        return write(folder, items)

    return items, {}, write


def _described(folder: Path):
    """The same of the paper that a folder describes."""
    from pellet_study.doe.answers import plain, target_answer
    from pellet_study.paper.described.audit import audit_folder

    found = audit_folder(folder)
    paper = found.paper
    say(f"{paper.title}\n{paper.source}" + (f"\n{paper.note}" if paper.note else ""))
    answer = {"title": paper.title, "source": paper.source}
    if found.target is not None:
        answer["optimum"] = plain(target_answer(found.target))

    def write(results: Path) -> list[Path]:
        from pellet_study.paper.described.results import write

        return write(results, found)

    return found.items, answer, write


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
