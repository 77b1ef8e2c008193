"""`pellet-study bench`: the three seed bench tests calibrated stage by stage, beside the paper's numbers."""

import argparse
from pathlib import Path

from pellet_study.errors import InputError

EPILOG = """\
The measurements need a row of at least one of the rigs rebound, slope_slip and inclined_roll.
Results go to STUDY: sweep_*.csv, calibration.csv, summary.txt, figures/. Finished simulations are kept in
STUDY/.store: called again, nothing is computed twice.

example:
  pellet-study init seeds && pellet-study bench seeds --json answer.json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.epilog = EPILOG
    parser.add_argument("study", metavar="STUDY", type=Path, help="a study folder")
    parser.add_argument(
        "--effort",
        type=float,
        default=1.0,
        metavar="SHARE",
        help="share of the seeds to simulate, for a quick look (1)",
    )


def run(arguments: argparse.Namespace) -> dict:
    """Calibrate, write the results into the study, print the summary."""
    from pellet_study import bench, bench_report, study

    if not 0 < arguments.effort <= 4:
        raise InputError(f"--effort {arguments.effort:g}: expected a share of the seeds above 0 and up to 4")
    loaded = study.load(arguments.study)
    readings = bench.readings(loaded.rows)
    swept = {stage.parameter for stage in bench.STAGES}
    parameters = {name: setting.value for name, setting in loaded.parameters.items() if name not in swept}
    rig = bench.Bench(
        loaded.contact_law or "hertz_mindlin",
        parameters,
        arguments.study / ".store",
        effort=arguments.effort,
    )
    results = rig.run(readings)
    print(bench_report.write(results, arguments.study, rig))
    return bench_report.answer(results)
