"""pellet-study check STUDY: what was understood of a study, without a simulation; changes nothing."""

import argparse

from pellet_study.api import studies
from pellet_study.commands.arguments import add_study, named, study_of
from pellet_study.errors import InputError
from pellet_study.output.terminal import say, warn
from pellet_study.study import Study

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
    study = study_of(arguments)
    answer = studies.check_study(study)
    say(answer.page)
    warn(answer.warnings, noted=answer.warnings)
    then = "calibrate" if _one_heap(study) else "compare"
    say(f"\nnothing was simulated or written; next: pellet-study {then} {named(arguments)}")
    return answer.json


def _one_heap(study: Study) -> bool:
    """Whether all that is asked is the powder of one repose angle: `calibrate` takes the study, and all its rows."""
    from pellet_study.powder import plan_of
    from pellet_study.powder.plan import READINGS, RIG

    if any((r.rig, r.split) != (RIG, "fit") or r.observable not in READINGS for r in study.rows):
        return False
    try:
        plan_of(study)
    except InputError:
        return False
    return True
