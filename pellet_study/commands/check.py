"""pellet-study check STUDY: what was understood of a study, without a simulation; changes nothing."""

import argparse

from pellet_study.api import studies
from pellet_study.commands.arguments import add_study, named, study_of
from pellet_study.output.terminal import say, warn

EXAMPLE = """\
Writes nothing into STUDY. Rigs, rows, conditions with ranges and defaults, parameters, candidates and what each would need
to be seen; nothing is simulated.

example:
  pellet-study check results/wet_beads
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study."""
    parser.epilog = EXAMPLE
    add_study(parser)


def run(arguments: argparse.Namespace) -> dict:
    """Print what was understood."""
    answer = studies.check_study(study_of(arguments))
    say(answer.page)
    warn(answer.warnings, noted=answer.warnings)
    say(f"\nnothing was simulated or written; next: pellet-study compare {named(arguments)}")
    return answer.json
