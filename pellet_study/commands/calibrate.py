"""`pellet-study calibrate`: the source paper's powder calibration on the repose rig, stage by stage."""

import argparse
from pathlib import Path

from pellet_study.errors import InputError

EPILOG = """\
The measurements need the measured repose angle with its sd. Parameters A to G (powder_restitution, powder_static_friction,
powder_rolling_friction, powder_steel_restitution, powder_steel_static_friction, powder_steel_rolling_friction,
powder_surface_energy) are screened over their min and max in study.toml, or over the paper's Table 6.

Stages: screening (Plackett-Burman), climb, surface (Box-Behnken), optimum, validation. Each leaves design, runs, analysis
and decision in STUDY/STAGE; runs.csv has a row a heap. Finished heaps are kept in STUDY/.store: called again, nothing is
simulated twice. --until stops after a stage; --only does one stage again with the decisions that stand in the files.

example:
  pellet-study calibrate results/full --until screening && pellet-study calibrate results/full --json answer.json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    from pellet_study.powder_chain import STAGES

    parser.epilog = EPILOG
    parser.add_argument("study", metavar="STUDY", type=Path, help="a study folder")
    parser.add_argument("--until", choices=STAGES, metavar="STAGE", help=f"last stage to do: {', '.join(STAGES)}")
    parser.add_argument("--only", choices=STAGES, metavar="STAGE", help="the one stage to do, again if it was done")
    parser.add_argument(
        "--contact-law", choices=("cohesive_frictional", "hertz_mindlin"), help="instead of the study's"
    )
    parser.add_argument(
        "--results", metavar="FOLDER", type=Path, help="where the results go (the study itself); made where missing"
    )
    parser.add_argument("--workers", type=int, metavar="N", help="YADE processes at once (one a core)")
    parser.add_argument("--powder-mass-g", type=float, metavar="G", help="powder of a heap, for a quick look")
    parser.add_argument("--centre-points", type=int, metavar="N", help="heaps at the centre of each design (5)")
    parser.add_argument("--validation-heaps", type=int, nargs=2, metavar=("LEAST", "MOST"), help="(10 30)")
    parser.add_argument(
        "--read-from", metavar="FOLDER", type=Path, help="results whose decisions stand for stages not done here"
    )


def run(arguments: argparse.Namespace) -> dict:
    """Do the stages, write the results, print the summary."""
    from pellet_study import powder_chain, powder_report, study

    if arguments.until and arguments.only:
        raise InputError("--until and --only exclude each other: give one")
    if arguments.centre_points is not None and arguments.centre_points < 2:
        raise InputError(f"--centre-points {arguments.centre_points}: expected 2 or more, for the scatter over seeds")
    fewest, most = arguments.validation_heaps or (powder_chain.FEWEST, powder_chain.MOST)
    if not 2 <= fewest <= most:
        raise InputError(f"--validation-heaps {fewest} {most}: expected LEAST of 2 or more, MOST not below it")
    stages = powder_chain.STAGES
    if arguments.only:
        stages = (arguments.only,)
    elif arguments.until:
        stages = stages[: stages.index(arguments.until) + 1]
    folder = arguments.results or arguments.study
    plan = powder_chain.plan_of(study.load(arguments.study), arguments.contact_law, arguments.powder_mass_g)
    folder.mkdir(parents=True, exist_ok=True)
    chain = powder_chain.Chain(
        plan,
        folder,
        folder / ".store",
        workers=arguments.workers,
        centre_points=arguments.centre_points or powder_chain.CENTRE_POINTS,
        fewest_heaps=fewest,
        most_heaps=most,
        decisions_from=arguments.read_from,
    )
    decisions = chain.run(stages)
    print(powder_report.write(chain, decisions))
    return powder_report.answer(decisions)
