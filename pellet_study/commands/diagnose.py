"""pellet-study diagnose STUDY: rank the effects the model lacks; changes nothing."""

import argparse

from pellet_study.api import criticism
from pellet_study.api.figures import draw_all
from pellet_study.commands.arguments import add_figures, add_study, check_look, named, study_of, write_figures
from pellet_study.criticism import verdict_facts
from pellet_study.output.terminal import done, say, warn, working

EXAMPLE = """\
Writes diagnose.txt and diagnose.json into STUDY, which `report` shows; study.toml stays as it is.

example:
  pellet-study diagnose results/wet_beads --figures
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.epilog = EXAMPLE
    add_study(parser)
    add_figures(parser)


def run(arguments: argparse.Namespace) -> dict:
    """Diagnose, print the page, leave it and the answer in the study."""
    check_look(arguments)
    with working("ranking the candidate effects"):
        answer = criticism.diagnose(study_of(arguments), write=True)
    say(answer.page)
    warn(answer.warnings, noted=answer.warnings)
    write_figures(arguments, lambda: draw_all(answer, arguments.width))
    after = f"report {named(arguments)}"
    if answer.missing:  # a pair is added by `refine`, as `add` takes one effect
        after = (
            f"add {named(arguments)} {answer.missing[0]}" if len(answer.missing) == 1 else f"refine {named(arguments)}"
        )
    first = verdict_facts.fit_too(answer.json)
    done(arguments.study / "diagnose.txt", f"diagnose {named(arguments)}" if first else after, first)
    return answer.json
