"""pellet-study diagnose STUDY: rank the effects the model lacks; changes nothing."""

import argparse

from pellet_study.api import criticism
from pellet_study.commands.arguments import add_study, named, study_of
from pellet_study.criticism import facts
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
    parser.add_argument("--figures", action="store_true", help="also draw the figures")


def run(arguments: argparse.Namespace) -> dict:
    """Diagnose, print the page, leave it and the answer in the study."""
    with working("ranking the candidate effects"):
        answer = criticism.diagnose(study_of(arguments), write=True)
    say(answer.page)
    warn(answer.warnings, noted=answer.warnings)
    if arguments.figures:
        from pellet_study.criticism import figures
        from pellet_study.output import style

        folder = arguments.study / "figures"
        if answer.ranking:
            style.save(figures.ranking(answer.json), folder / "ranking.png")
        if answer.by_level:
            style.save(figures.constants(answer.by_level), folder / "constants.png")
    after = f"add {named(arguments)} {answer.missing[0]}" if answer.missing else f"report {named(arguments)}"
    first = facts.fit_too(answer.json)
    done(arguments.study / "diagnose.txt", f"diagnose {named(arguments)}" if first else after, first)
    return answer.json
