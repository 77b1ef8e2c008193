"""pellet-study refine STUDY: compare, diagnose, add, again, until adequate, tied or unexplained."""

import argparse

from pellet_study.api import criticism
from pellet_study.api.figures import draw_all
from pellet_study.commands.arguments import add_figures, add_study, check_look, named, study_of, write_figures
from pellet_study.criticism import facts
from pellet_study.output.terminal import done, say, warn, working

EXAMPLE = """\
Writes what it adds into study.toml; refine.txt, refine.json, compare.json and the history into STUDY.

example:
  pellet-study refine results/wet_beads --figures
  pellet-study refine results/wet_beads --figures paper --format pdf --width single
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.epilog = EXAMPLE
    add_study(parser)
    add_figures(parser)


def run(arguments: argparse.Namespace) -> dict:
    """Refine, write what was added into study.toml, print the page, leave refine.txt and the history in the study."""
    check_look(arguments)
    with working("comparing, diagnosing, adding"):
        answer = criticism.refine(study_of(arguments), write=True)
    say(answer.page)
    warn([*answer.warnings, *answer.unsaid], noted=answer.warnings)
    write_figures(arguments, lambda: draw_all(answer, arguments.width))
    first = facts.fit_too(answer.json)
    done(arguments.study / "refine.txt", f"{'refine' if first else 'report'} {named(arguments)}", first)
    return answer.json
