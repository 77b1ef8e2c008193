"""`pellet-study calibrate`: the source paper's powder calibration on the repose rig, stage by stage."""

import argparse
import os
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from pellet_study.commands.arguments import add_look, add_study, look_of, say_assumed, study_of
from pellet_study.commands.numbers import whole
from pellet_study.errors import InputError
from pellet_study.files import writing
from pellet_study.output.terminal import say

if TYPE_CHECKING:
    from pellet_study.powder import Heaps, Plan
    from pellet_study.study import Study

EPILOG = """\
The measurements need the measured repose angle with its sd. Rows of other readings of the same pouring (another angle,
discharge_time_s, fill_bulk_density_kg_m3) count as well: the setting is then the one that agrees with all of them, and the
summary says which parameters they tell, and which reading would tell more. Parameters A to G (powder_restitution, powder_static_friction,
powder_rolling_friction, powder_steel_restitution, powder_steel_static_friction, powder_steel_rolling_friction,
powder_surface_energy) are screened over their min and max in study.toml, or over the paper's Table 6. C, F and G belong to
effects: with their min and max study.toml also lists these, with nothing of them beyond C, F and G, as results/full does:
  [effects]
  rolling_resistance = { rolling_friction = 0.0 }
  cohesion = { surface_energy_j_m2 = 0.0 }
Those of A to G that study.toml gives as a number, and other parameters of the rig, keep it, as does what measurements.csv gives as
known for the measured angle; effects that are present, and other parameters with min and max, are refused.

Stages: screening (Plackett-Burman), climb, surface (Box-Behnken), optimum, validation. Each leaves design, runs, analysis
and decision in STUDY/STAGE; runs.csv has a row a heap. Finished heaps are kept in STUDY/.store: called again, nothing is
simulated twice. --surface takes another powder's surface, so that only the validation is simulated. --until stops after a stage; --only does one stage again with the decisions that stand in the files. A
decision is used only for what it was made for: after a change of study.toml or of the measured angle do the whole chain
again. --repeats is kept in the folder of the results and holds there until another is given. The two contact laws need a
--results folder each.

example:
  pellet-study calibrate results/full --until screening && pellet-study calibrate results/full --json answer.json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    from pellet_study.powder.decisions import STAGES

    parser.epilog = EPILOG
    add_study(parser)
    add_look(parser)
    parser.add_argument("--until", choices=STAGES, metavar="STAGE", help=f"last stage to do: {', '.join(STAGES)}")
    parser.add_argument("--only", choices=STAGES, metavar="STAGE", help="the one stage to do, again if it was done")
    parser.add_argument(
        "--contact-law",
        choices=("cohesive_frictional", "hertz_mindlin", "cohesive_frictional_local_damping"),
        help="instead of the study's",
    )
    parser.add_argument(
        "--results", metavar="FOLDER", type=Path, help="where the results go (the study itself); made where missing"
    )
    parser.add_argument(
        "--repeats",
        type=whole,
        metavar="N",
        help="heaps at each point of the designs and of the climb (as before in the folder "
        "of the results, else 3; --quick 1)",
    )
    parser.add_argument(
        "--few",
        action="store_true",
        help="few heaps, 60 at most: a screening of 8, then heaps where its path meets the measured angle, until their interval lies within "
        "its sd; only the angle that steers counts",
    )
    parser.add_argument(
        "--quick",
        metavar="FOLDER",
        type=Path,
        help="screening and a small validation; the other stages read from FOLDER",
    )
    parser.add_argument(
        "--surface",
        metavar="FOLDER",
        type=Path,
        help="screening, climb and surface read from FOLDER, the results of a chain of another powder measured under the same "
        "conditions, with the same ranges and law; optimum and validation are done",
    )


def run(arguments: argparse.Namespace) -> dict:
    """Do the stages, write the results, print the summary."""
    with look_of(arguments):
        return _run(arguments)


def _run(arguments: argparse.Namespace) -> dict:
    from pellet_study.powder import Chain, Results, few_heaps, plan_of, report

    folder = arguments.results or arguments.study
    _check(arguments, folder)
    study = study_of(arguments)
    plan = plan_of(study, arguments.contact_law)
    _make(folder)
    assumed = _say_ranges(arguments, study, plan)
    heaps = _heaps(arguments, plan, folder)
    results = Results(plan, folder, arguments.surface or arguments.quick, any_target=arguments.surface is not None)
    if arguments.few:
        setting = few_heaps.calibrate(heaps, results)
        say(report.write_path(results, setting))
        return {**report.path_answer(setting), **assumed}
    chain = Chain(heaps, results, after=report.write_summary)
    chain.run(_stages(arguments))
    say(report.write(chain))
    return {**report.answer(results), **assumed}


def _say_ranges(arguments: argparse.Namespace, study: "Study", plan: "Plan") -> dict:
    """Print which factors have the paper's range, and what else is assumed; returns the JSON key of the latter."""
    from pellet_study.powder.plan import SYMBOLS

    printed = [f for f in plan.factors if f.name not in plan.own]
    if printed and "screening" in _stages(arguments):
        ranges = ", ".join(f"{SYMBOLS[f.name]} ({f.name}) {f.low:g} to {f.high:g}" for f in printed)
        say(f"screened over the source paper's Table 6, as study.toml gives no range: {ranges}")
    return say_assumed(study, [SYMBOLS[f.name] for f in plan.factors])


def _check(arguments: argparse.Namespace, folder: Path) -> None:
    """Options that fit together, before the study is read.

    Raises
    ------
    InputError : they do not
    """
    if arguments.few and (arguments.until or arguments.only or arguments.quick or arguments.repeats):
        raise InputError("--few has no stages: leave --until, --only, --quick and --repeats away")
    if arguments.surface and (arguments.few or arguments.quick or arguments.repeats):
        raise InputError("--surface has the heaps of another chain: leave --few, --quick and --repeats away")
    if arguments.surface and arguments.surface.resolve() == folder.resolve():
        raise InputError(f"--surface {arguments.surface}: is where the results go; name the folder of another chain")
    if arguments.surface and not (arguments.surface / "surface" / "decision.json").exists():
        raise InputError(f"--surface {arguments.surface}: expected the results of a chain that was run to the surface")
    if arguments.surface and (arguments.only or arguments.until) in ("screening", "climb", "surface"):
        raise InputError("--surface reads screening, climb and surface: only optimum and validation are done with it")
    if arguments.until and arguments.only:
        raise InputError("--until and --only exclude each other: give one")
    if arguments.quick and arguments.until:
        raise InputError("--quick has its own stages, screening and validation: leave --until away")
    if arguments.quick and arguments.quick.resolve() == folder.resolve():
        raise InputError(f"--quick {arguments.quick}: would write over the results it reads; name another --results")
    if arguments.repeats is not None and arguments.repeats < 1:
        raise InputError(f"--repeats {arguments.repeats}: expected at least one heap a point")
    if arguments.quick and not (arguments.quick / "optimum" / "decision.json").exists():
        raise InputError(f"--quick {arguments.quick}: expected the results of a chain that was run to the optimum")


def _stages(arguments: argparse.Namespace) -> tuple[str, ...]:
    """The stages that the options name."""
    from pellet_study.powder.decisions import STAGES

    if arguments.only:
        return (arguments.only,)
    if arguments.quick:
        return ("screening", "validation")
    if arguments.surface:
        return ("optimum",) if arguments.until == "optimum" else ("optimum", "validation")
    return STAGES[: STAGES.index(arguments.until) + 1] if arguments.until else STAGES


def _heaps(arguments: argparse.Namespace, plan: "Plan", folder: Path) -> "Heaps":
    """Heaps of the sizes asked for, else of those that the folder of the results was begun with."""
    from pellet_study.powder.decisions import repeats_before
    from pellet_study.powder.heaps import FULL, QUICK, Heaps

    say = partial(print, flush=True)  # a line a stage, also where the output goes to a file
    sizes = QUICK if arguments.quick else FULL
    before = repeats_before(folder)
    if repeats := arguments.repeats or before:
        if repeats == before != sizes.repeats and not arguments.few:
            say(f"heaps at each point: {before}, as before in {folder}; --repeats {sizes.repeats} for {sizes.repeats}")
        sizes = replace(sizes, repeats=repeats)
    return Heaps(plan, folder / ".store", sizes, say=say)


def _make(folder: Path) -> None:
    """The folder of the results, made where it is missing.

    Raises
    ------
    InputError : it cannot be, or cannot be written to
    """
    try:
        writing.folder(folder)
    except OSError as error:
        raise InputError(f"--results {folder}: cannot be made ({error.strerror}); name a folder of your own") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"--results {folder}: cannot be written to; name a folder of your own")
