"""`pellet-study pb`: analyse a Plackett-Burman table, climb from it, or make a design."""

import argparse
import shlex
from pathlib import Path

from pellet_study.commands.arguments import write_figures
from pellet_study.commands.design_tables import (
    add_making_arguments,
    add_table_arguments,
    check_arguments,
    kept,
    warn,
    write_design,
)
from pellet_study.errors import InputError
from pellet_study.output.terminal import done, say

EXAMPLES = """\
TABLE.csv: factor columns in coded or physical units, the response in the last column; an empty response is a
run that failed. Rows in any order, centre points and replicates welcome.
CSV of any spreadsheet or statistics program (decimal commas, UTF-16, GBK too), or xlsx; columns such as StdOrder,
RunOrder and PtType are left out, a block (day, batch) is given as --block NAME, anything else as --ignore NAME.
R2 and its kin leave out the curvature (the centre points), C.V. is in percent of the mean of all runs.

examples:
  pellet-study pb screening.csv --figures figures --json answer.json
  pellet-study pb screening.csv --factor B=0.7,0.9 --climb gradient --climb-factors B,C,G
  pellet-study pb screening.csv --climb equal --climb-start worst --climb-runs climb.csv --target 41.69
  pellet-study pb --design A=0.05,0.25 B=0.7,0.9 C=0.25,0.45 --centre 3 --output design.csv
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.epilog = EXAMPLES
    add_table_arguments(parser)
    climb = parser.add_argument_group("steepest climb")
    climb.add_argument(
        "--climb", choices=("gradient", "equal"), help="path along the gradient, or by equal coded steps"
    )
    climb.add_argument("--climb-factors", metavar="A,B", help="factors to move (default: the significant ones)")
    climb.add_argument("--climb-points", metavar="N", type=int, default=6, help="points of the path (6)")
    climb.add_argument("--climb-start", choices=("centre", "worst"), default="centre", help="start (centre)")
    climb.add_argument("--climb-step", metavar="A=STEP", help="physical step of one factor (default: up to the limit)")
    climb.add_argument(
        "--climb-limits",
        metavar="A=LOW,HIGH",
        action="append",
        default=[],
        help="limits beyond the design's range",
    )
    climb.add_argument("--descend", action="store_true", help="go down instead of up")
    climb.add_argument("--climb-runs", metavar="CSV", type=Path, help="runs made on the path, response last: read back")
    climb.add_argument("--lowest", action="store_true", help="the best run has the lowest response, as for errors")
    climb.add_argument("--target", type=float, help="response wanted on the path (default: the highest)")
    making = add_making_arguments(parser, centre=0)
    making.add_argument("--runs", metavar="N", type=int, help="8, 12, 16, 20 or 24 (default: 12, 20 or 24)")


def run(arguments: argparse.Namespace) -> dict:
    """Analyse, climb or design; prints the readable answer and returns the JSON one."""
    check_arguments(arguments)
    if arguments.climb is None and (arguments.climb_step or arguments.climb_factors):
        raise InputError("--climb-step and --climb-factors shape a path: give --climb gradient or --climb equal too")
    if arguments.design:
        return _design(arguments)
    from pellet_study.doe import answers, plackett_burman, text
    from pellet_study.doe.cautions import climb_cautions
    from pellet_study.doe.design_table import read_design
    from pellet_study.doe.factors import parse_factors
    from pellet_study.doe.path_table import ignored_in

    factors = parse_factors(arguments.factor)
    if any(len(factor.levels) > 2 for factor in factors):
        return _levels(arguments, factors)
    tables = [arguments.table, *([arguments.climb_runs] if arguments.climb_runs else [])]
    ignore, *ignore_runs = ignored_in(tables, arguments.ignore) if arguments.ignore else [[]] * len(tables)
    table = read_design(arguments.table, factors, 3, ignore, arguments.block)
    screening = plackett_burman.analyse(table, arguments.alpha)
    warnings = text.screening_warnings(screening)
    answer = {**answers.screening_answer(screening), "warnings": warnings}
    climb = _climb(arguments, screening)
    if climb:
        warnings += climb_cautions(climb, screening)
    runs, turning = _turning(arguments, table, warnings, ignore_runs)
    say(text.screening_text(screening))
    if climb:
        say("\n" + text.climb_text(climb))
        answer["climb"] = answers.climb_answer(climb)
    if turning:
        say("\n" + text.turning_text(turning))
        answer["turning"] = answers.turning_answer(turning)
    warn(warnings)
    if arguments.figures:
        answer["figures"] = _figures(arguments, screening, climb, runs, turning)
    done(kept(arguments), _next(screening))
    return answer


def _levels(arguments, factors) -> dict:
    """The analysis of a table with factors at three or more named levels."""
    from pellet_study.doe import categorical, design_text
    from pellet_study.doe.answers import plain

    if arguments.climb or arguments.climb_runs or arguments.figures:
        raise InputError(
            "a factor has three or more named levels: expected no --climb, --climb-runs or --figures then; leave them out, "
            "or analyse the table at two of the levels"
        )
    found = categorical.read_levels(arguments.table, factors, arguments.ignore, arguments.block, arguments.alpha)
    say(design_text.levels_text(found))
    warn(found.notes)
    done(kept(arguments))
    return {**plain(found), "p": {row["source"]: row["p"] for row in found.anova}, "warnings": found.notes}


def _next(screening) -> str | None:
    """The design of a surface in the factors that are clear; None where there are not two of them."""
    from pellet_study.doe.steepest_climb import significant

    clear = sorted(significant(screening))
    if len(clear) < 2:
        return None
    words = " ".join(shlex.quote(f"{name}=LOW,HIGH") for name in clear)
    return f"bbd --design {words}" + (" --face-centred" if len(clear) == 2 else "")


def _design(arguments) -> dict:
    import numpy as np

    from pellet_study.doe import blocking, plackett_burman
    from pellet_study.doe.factors import parse_factors
    from pellet_study.doe.run_sheet import run_sheet

    factors = parse_factors(arguments.design)
    plain = plackett_burman.coded_matrix(len(factors), arguments.runs, arguments.centre)
    coded = plackett_burman.with_words(plain, factors, arguments.blocks)
    blocks = blocking.screening_blocks(plain, arguments.blocks)
    matrix = np.column_stack([np.ones(len(coded)), coded])
    sheet = run_sheet(coded, factors, blocks, arguments.seed, model_matrix=matrix)
    return write_design(sheet, arguments.output, arguments.force, "pb")


def _climb(arguments, screening):
    """The path asked for, if any."""
    if arguments.climb is None:
        return None
    from pellet_study.doe import steepest_climb
    from pellet_study.doe.factors import parse_levels, parse_range

    names = arguments.climb_factors.split(",") if arguments.climb_factors else None
    model, factors = steepest_climb.first_order_model(screening, names)
    step = next(iter(parse_levels(arguments.climb_step).items())) if arguments.climb_step else None
    return steepest_climb.path(
        model,
        factors,
        points=arguments.climb_points,
        equal_steps=arguments.climb == "equal",
        start=arguments.climb_start,
        step=step,
        limits=dict(parse_range(word) for word in arguments.climb_limits),
        ascend=not arguments.descend,
        alpha=arguments.alpha,
    )


def _turning(arguments, table, warnings: list[str], ignore: list[list[str]]):
    """The runs made on the path and where they turned, if any were given."""
    if arguments.climb_runs is None:
        return None, None
    from pellet_study.doe import steepest_climb
    from pellet_study.doe.path_table import read_path

    runs, notes = read_path(arguments.climb_runs, table, ignore[0], arguments.lowest)
    warnings += notes
    units = {factor.name: factor.unit for factor in table.factors}
    ascend = not (arguments.descend or arguments.lowest)
    return runs, steepest_climb.turning(runs, arguments.target, ascend, units)


def _figures(arguments, screening, climb, runs, turning) -> list[str]:
    from pellet_study.doe import figures
    from pellet_study.doe.box_behnken import diagnostics
    from pellet_study.doe.labels import degraded

    table, unit = screening.table, arguments.unit
    warn(degraded(table.names, str(table.response.name)))

    def draw() -> dict:
        drawn = {
            "pareto": figures.pareto(screening, unit),
            "half_normal": figures.half_normal(
                screening.effects, screening.lenth, unit, screening.noise_contrasts, table.names
            ),
        }
        if len(table.names) > 1:
            drawn["interactions"] = figures.observed_interactions(screening, unit)
        if screening.model.mean_square_error:
            model = screening.model
            drawn["residuals"] = figures.residual_plots(table, model, diagnostics(model), unit, arguments.alpha)
        if climb is not None:
            on_it = runs if runs is not None and {f.name for f in climb.factors} <= set(runs.columns) else None
            drawn["climb"] = figures.climb_path(climb, unit, arguments.target, table.names, on_it, turning)
        if turning is not None:
            drawn["path"] = figures.path_runs(runs, turning, table.factors, unit, arguments.target, table.names)
        return drawn

    return [str(path) for path in write_figures(arguments, draw)]
