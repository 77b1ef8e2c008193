"""pellet-study compare STUDY: calibrate the present model, residual of every row, where it fails."""

import argparse

from pellet_study.api import criticism
from pellet_study.api.figures import draw_all
from pellet_study.commands.arguments import add_figures, add_study, check_look, named, study_of, write_figures
from pellet_study.criticism import fit_facts
from pellet_study.output.terminal import done, say, warn, working

EXAMPLE = """\
Writes compare.txt and compare.json into STUDY, which `report` shows.

example:
  pellet-study compare results/wet_beads --figures
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.epilog = EXAMPLE
    add_study(parser)
    add_figures(parser)


def run(arguments: argparse.Namespace) -> dict:
    """Compare, print the page, leave it and the answer in the study."""
    check_look(arguments)
    with working("comparing the model with the measurements"):
        answer = criticism.compare(study_of(arguments), write=True)
    say(answer.page)
    warn([*answer.warnings, *answer.unsaid], noted=answer.warnings)
    write_figures(arguments, lambda: draw_all(answer, arguments.width))
    after = "diagnose" if fit_facts.doubted(answer.json) and answer.study.absent() else "report"
    done(arguments.study / "compare.txt", f"{after} {named(arguments)}")
    return answer.json
