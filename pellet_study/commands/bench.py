"""`pellet-study bench`: the three seed bench tests calibrated stage by stage, beside the paper's numbers."""

import argparse

from pellet_study.commands.arguments import add_look, add_study, look_of, named, say_assumed, study_of
from pellet_study.commands.numbers import number
from pellet_study.errors import InputError
from pellet_study.output.terminal import done, say, warn
from pellet_study.study.study import RESTITUTION_AT

EPILOG = """\
The measurements need a row of at least one of the rigs rebound, slope_slip and inclined_roll.
Results go to STUDY: sweep_*.csv, calibration.csv, summary.txt, figures/, and runs.csv with every simulation. Finished simulations are kept in
STUDY/.store: called again, nothing is computed twice.

example:
  pellet-study init seeds && pellet-study bench seeds --json answer.json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.epilog = EPILOG
    add_study(parser)
    add_look(parser)
    parser.add_argument(
        "--effort",
        type=number,
        default=1.0,
        metavar="TIMES",
        help="times the usual number of seeds: below 1 for a quick look, up to 4 (1)",
    )


def run(arguments: argparse.Namespace) -> dict:
    """Calibrate, write the results into the study, print the summary."""
    from pellet_study.bench import Seeds, calibrate, report
    from pellet_study.bench.readings import readings

    if not 0 < arguments.effort <= 4:
        raise InputError(
            f"--effort {arguments.effort:g}: expected how many times the usual number of seeds, above 0 and up to 4"
        )
    with look_of(arguments):  # refused before anything is simulated
        loaded = study_of(arguments)
    measured = readings(loaded.rows)
    seeds = Seeds(
        loaded.contact_law or "hertz_mindlin",
        {name: setting.value for name, setting in loaded.parameters.items()},
        arguments.study / ".store",
        effort=arguments.effort,
        damping_at_contact=RESTITUTION_AT[loaded.restitution_at],
    )
    results = calibrate(seeds, measured)
    assumed = say_assumed(loaded)
    with look_of(arguments):
        say(report.write(results, arguments.study, seeds.contact_law, loaded.restitution_at == "contact"))
    report.write_runs(seeds.runs, arguments.study / "runs.csv")
    last = results[-1]
    if last.value is None:
        warn(
            [
                f"{last.stage.rig} does not reach {last.reading.value:g} between {last.curve.low:g} and "
                f"{last.curve.high:g}; the stages after it were not run"
            ]
        )
    done(f"{arguments.study / 'summary.txt'}, figures", f"report {named(arguments)}")
    return {**report.answer(results), **assumed}
