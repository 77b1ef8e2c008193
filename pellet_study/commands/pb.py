"""`pellet-study pb`: analyse a Plackett-Burman table, climb from it, or make a design."""

import argparse
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pellet_study.commands.arguments import write_figures
from pellet_study.commands.design_tables import (
    add_making_arguments,
    add_table_arguments,
    again,
    check_arguments,
    kept,
    warn,
    write_design,
)
from pellet_study.commands.numbers import number, whole
from pellet_study.commands.other_command import for_the_other
from pellet_study.commands.responses import (
    add_response_argument,
    each_able,
    each_response,
    figure_prefixes,
    heading,
    not_analysed,
    others_of,
    read_tables,
    response_columns,
    warnings_of,
)
from pellet_study.errors import InputError
from pellet_study.output.terminal import done, say

EXAMPLES = """\
TABLE.csv: factor columns in coded or physical units, the response in the last column; an empty response is a
run that failed. Rows in any order, centre points and replicates welcome.
CSV of any spreadsheet or statistics program (decimal commas, UTF-16, GBK too), or xlsx; columns such as StdOrder,
RunOrder and PtType are left out, a block (day, batch) is given as --block NAME, anything else as --ignore NAME.
Several responses: --response NAME NAME (after the table), each analysed; the other columns are factors.
Interactions of two factors are fitted where the runs tell them from the main effects and from one another, as in a full
factorial; --main-effects fits none.
R2 and its kin leave out the curvature (the centre points), C.V. is in percent of the mean of all runs.

examples:
  pellet-study pb screening.csv --figures figures --json answer.json
  pellet-study pb screening.csv --factor B=0.7,0.9 --climb gradient --climb-factors B,C,G
  pellet-study pb screening.csv --response yield cost --unit yield=%
  pellet-study pb screening.csv --climb equal --climb-start worst --climb-runs climb.csv --target 41.69
  pellet-study pb --design A=0.05,0.25 B=0.7,0.9 C=0.25,0.45 --centre 3 --output design.csv
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.epilog = EXAMPLES
    add_table_arguments(parser)
    add_response_argument(parser)
    parser.add_argument(
        "--main-effects", action="store_true", help="fit no interactions (default: those that the runs tell apart)"
    )
    parser.add_argument(
        "--transform", metavar="[NAME=]HOW", action="append", nargs="?", const="",
        help="analyse log, sqrt, inverse or a power of the response (without HOW: what Box-Cox advises, if it does)",
    )  # fmt: skip
    climb = parser.add_argument_group("steepest climb")
    climb.add_argument(
        "--climb", choices=("gradient", "equal"), help="path along the gradient, or by equal coded steps"
    )
    climb.add_argument("--climb-factors", metavar="A,B", help="factors to move (default: the significant ones)")
    climb.add_argument("--climb-points", metavar="N", type=whole, default=6, help="points of the path (6)")
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
    climb.add_argument("--target", type=number, help="response wanted on the path (default: the highest)")
    making = add_making_arguments(parser, centre=0)
    making.add_argument("--runs", metavar="N", type=whole, help="8, 12, 16, 20 or 24 (default: 12, 20 or 24)")


def run(arguments: argparse.Namespace) -> dict:
    """Analyse, climb or design; prints the readable answer and returns the JSON one."""
    check_arguments(arguments)
    _check_path(arguments)
    if arguments.design:
        return _design(arguments)
    if len(arguments.response) > 1 and (arguments.climb or arguments.climb_runs):
        raise InputError("a climb follows one response: name it alone with --response, and the others with --ignore")
    from pellet_study.doe import screening_text
    from pellet_study.doe.factors import parse_factors
    from pellet_study.doe.labels import degraded
    from pellet_study.doe.path_table import named_in

    factors = parse_factors(arguments.factor)
    if any(len(factor.levels) > 2 for factor in factors):
        return _levels(arguments, factors)
    files = [arguments.table, *([arguments.climb_runs] if arguments.climb_runs else [])]
    ignore, *of_path = named_in(files, arguments.ignore, "ignore")
    blocks, *blocks_of_path = named_in(files, arguments.block, "use as block")
    try:
        tables, failed = read_tables(arguments, factors, 3, ignore, blocks)
        told = each_response(arguments, [*tables, *failed])
        each, more_failed = each_able(
            tables, lambda name: _screened(told[name], tables[name], of_path + blocks_of_path)
        )
    except InputError as error:
        raise for_the_other(arguments, "bbd", error) from None
    failed |= more_failed
    for k, (name, one) in enumerate(each.items()):
        say("\n".join(([""] if k else []) + heading(name, each) + [one.words]))
    if len(each) > 1:
        from pellet_study.doe.response_text import screenings_text

        say("\n" + screenings_text([one.screening for one in each.values()]))
    warnings = not_analysed(failed) + warnings_of({name: one.answer["warnings"] for name, one in each.items()})
    warn(warnings)
    first = next(iter(each.values()))
    answer = {**first.answer, "warnings": warnings}
    if len(each) > 1:
        answer["responses"] = {name: one.answer for name, one in each.items()}
    if failed:
        answer["not_analysed"] = failed
    if arguments.figures:
        warn(degraded(first.screening.table.names, *(str(one.screening.table.response.name) for one in each.values())))
        prefixes = figure_prefixes(each)
        answer["figures"] = [path for name, one in each.items() for path in _figures(told[name], one, prefixes[name])]
    screenings = [one.screening for one in each.values()]
    following = _after_the_path(first) or _axial(arguments, screenings) or _along_the_path(arguments, first)
    if following is None and (following := _next(screenings)):
        say("".join(f"\n{line}" for line in screening_text.borderline_lines(screenings)))
    done(kept(arguments), following)
    return answer


def _check_path(arguments: argparse.Namespace) -> None:
    """Refuse what says how a path goes, or what is wanted on it, where there is none."""
    if arguments.climb is None and (arguments.climb_step or arguments.climb_factors or arguments.climb_limits):
        raise InputError(
            "--climb-step, --climb-factors and --climb-limits shape a path: give --climb gradient or --climb equal too"
        )
    if arguments.transform and (arguments.climb or arguments.climb_runs):
        raise InputError(
            "--transform came with a climb: expected one of the two, as the runs of a path are read on the response's own scale; "
            "leave --transform out to climb, its direction is nearly the same"
        )
    if arguments.climb is None and arguments.climb_runs is None:
        wanted = [
            option for option in ("target", "descend", "lowest") if getattr(arguments, option) not in (None, False)
        ]
        if wanted:
            raise InputError(
                f"--{wanted[0]} says what is wanted on a path: give --climb gradient, or the runs made on it with --climb-runs; "
                "the target of a surface is met by bbd"
            )


@dataclass
class Screened:
    """One response: its screening, its climb, its answer and the words of it, the runs made on the path and where they turned."""

    screening: Any
    climb: Any
    answer: dict
    words: str
    runs: Any = None
    turning: Any = None


def _screened(own, table, of_path: list[list[str]]) -> Screened:
    """The analysis of one response, with its climb and the runs made on it."""
    from pellet_study.doe import answers, path_text, plackett_burman, screening_text
    from pellet_study.doe.cautions import climb_cautions

    table, scale_words, told = _on_scale(own, table)
    screening = plackett_burman.analyse(table, own.alpha, interactions=not own.main_effects)
    warnings = screening_text.screening_warnings(screening)
    answer = {**answers.screening_answer(screening), **told, "warnings": warnings}
    climb = _climb(own, screening)
    if climb:
        warnings += climb_cautions(climb, screening)
    runs, turning = _turning(own, screening, warnings, of_path)
    words = [*scale_words, screening_text.screening_text(screening)]
    if climb:
        moved = {factor.name for factor in climb.factors}
        words.append(path_text.climb_text(climb, [factor for factor in table.factors if factor.name not in moved]))
        answer["climb"] = answers.climb_answer(climb)
    if turning:
        words.append(path_text.turning_text(turning))
        answer["turning"] = answers.turning_answer(turning)
    return Screened(screening, climb, answer, "\n\n".join(words), runs, turning)


def _on_scale(own, table):
    """The table with its response on the scale asked for, what is to be said of that, and what goes into the answer."""
    if own.transform is None:
        return table, [], {}
    from pellet_study.doe import plackett_burman
    from pellet_study.doe.box_cox import box_cox
    from pellet_study.doe.response_answers import transformation_answer
    from pellet_study.doe.response_text import scale_text
    from pellet_study.doe.transformation import advised, parse_transformation

    name = str(table.response.name)
    named = parse_transformation(own.transform) if own.transform else None
    model = plackett_burman.analyse(table, own.alpha, interactions=not own.main_effects).model
    found = box_cox(model, own.alpha) if model.mean_square_error else None
    word = advised(found)
    power = named or (parse_transformation(word) if word else None)
    words = [scale_text(name, power, found, word, predicted=False)]
    told = {"transformation": transformation_answer(name, power, found, word)}
    return (power.applied(table) if power else table), words, told


def _levels(arguments, factors) -> dict:
    """The analysis of a table with factors at three or more named levels."""
    from pellet_study.doe import categorical, design_text
    from pellet_study.doe.answers import plain

    if arguments.climb or arguments.climb_runs or arguments.figures or arguments.transform:
        raise InputError(
            "a factor has three or more named levels: expected no --climb, --climb-runs, --transform or --figures; leave them out, "
            "or analyse the table at two of the levels"
        )
    each: dict[str, dict] = {}
    notes: dict[str, list[str]] = {}
    for name, others in others_of(arguments):
        found = categorical.read_levels(
            arguments.table, factors, [*arguments.ignore, *others], arguments.block, arguments.alpha, name
        )
        say(
            "\n".join(
                ([""] if each else []) + heading(found.response, arguments.response) + [design_text.levels_text(found)]
            )
        )
        p = {row["source"]: row["p"] for row in found.anova}
        each[found.response] = {**plain(found), "p": p, "warnings": found.notes}
        notes[found.response] = found.notes
    warnings = warnings_of(notes)
    warn(warnings)
    done(kept(arguments))
    first = next(iter(each.values()))
    return {**first, "warnings": warnings, "responses": each} if len(each) > 1 else first


def _after_the_path(one: Screened) -> str | None:
    """The design of a surface around the point where the path turned; None where it has not, or moved one factor only."""
    if one.turning is None or not one.turning.turned or len(one.turning.next_factors) < 2:
        return None
    words = " ".join(
        shlex.quote(f"{f.name}={min(f.low, f.high):.10g},{max(f.low, f.high):.10g}") for f in one.turning.next_factors
    )
    return f"bbd --design {words}" + (" --face-centred" if len(one.turning.next_factors) == 2 else "")


def _along_the_path(arguments, one: Screened) -> str | None:
    """The same command with the runs made on the path, to be written to climb.csv; None where there is no path or they are there."""
    if one.climb is None or one.runs is not None:
        return None
    words = ["--climb", arguments.climb, "--climb-runs", "climb.csv"]
    for name, usual in (("factors", None), ("points", 6), ("start", "centre"), ("step", None)):
        value = getattr(arguments, f"climb_{name}")
        words += [] if value == usual else [f"--climb-{name}", str(value)]
    words += [word for limits in arguments.climb_limits for word in ("--climb-limits", limits)]
    words += [f"--{name}" for name in ("descend", "lowest") if getattr(arguments, name)]
    words += [] if arguments.target is None else [f"--target={arguments.target:g}"]
    return f"pb {again(arguments)} {shlex.join(words)}"


def _axial(arguments, screenings) -> str | None:
    """The runs that make a surface of a screening whose centre runs show curvature; None where none does."""
    from pellet_study.doe.cautions import rules_out_a_climb

    names = _clear(screenings)
    if not any(map(rules_out_a_climb, screenings)) or len(names) < 2:
        return None
    return f"design axial {again(arguments)} {shlex.join(['--factors', ','.join(names), '--output', 'surface.csv'])}"


def _clear(screenings) -> list[str]:
    """The factors that act on any response, but for those at named levels, which have no middle."""
    from pellet_study.doe.steepest_climb import acting

    words_only = {factor.name for factor in screenings[0].table.factors if factor.levels}
    return sorted({name for screening in screenings for name in acting(screening)} - words_only)


def _next(screenings) -> str | None:
    """The design of a surface in the factors that are clear of any response; None where there are not two of them."""
    clear = _clear(screenings)
    if len(clear) < 2:
        return None
    words = " ".join(shlex.quote(f"{name}=LOW,HIGH") for name in clear)
    names = [str(screening.table.response.name) for screening in screenings]
    responses = f" --response {shlex.join(names)}" if len(names) > 1 else ""
    return f"bbd --design {words}" + (" --face-centred" if len(clear) == 2 else "") + responses


def _design(arguments) -> dict:
    import numpy as np

    from pellet_study.doe import blocking, screening_designs
    from pellet_study.doe.cautions import aliasing_cautions
    from pellet_study.doe.factors import parse_factors
    from pellet_study.doe.run_sheet import run_sheet

    factors = parse_factors(arguments.design)
    plain = screening_designs.coded_matrix(len(factors), arguments.runs, arguments.centre)
    coded = screening_designs.with_words(plain, factors, arguments.blocks)
    blocks = blocking.screening_blocks(plain, arguments.blocks)
    matrix = np.column_stack([np.ones(len(coded)), coded])
    warn(aliasing_cautions([factor.name for factor in factors], plain))
    sheet = run_sheet(coded, factors, blocks, arguments.seed, response_columns(arguments), matrix)
    return write_design(sheet, arguments.output, "pb")


def _climb(arguments, screening):
    """The path asked for, if any."""
    if arguments.climb is None:
        return None
    from pellet_study.doe import steepest_climb
    from pellet_study.doe.factors import factor_meant, factors_meant, parse_levels, parse_range

    known = screening.table.names
    names = arguments.climb_factors and factors_meant(arguments.climb_factors, known)
    model, factors = steepest_climb.first_order_model(screening, names)
    step = next(iter(parse_levels(arguments.climb_step).items())) if arguments.climb_step else None
    limits = dict(parse_range(word) for word in arguments.climb_limits)
    return steepest_climb.path(
        model,
        factors,
        points=arguments.climb_points,
        equal_steps=arguments.climb == "equal",
        start=arguments.climb_start,
        step=step and (factor_meant(step[0], known), step[1]),
        limits={factor_meant(name, known): ends for name, ends in limits.items()},
        ascend=not arguments.descend,
        alpha=arguments.alpha,
    )


def _turning(arguments, screening, warnings: list[str], of_path: list[list[str]]):
    """The runs made on the path and where they turned, if any were given; `of_path`: its columns to ignore, its blocks."""
    if arguments.climb_runs is None:
        return None, None
    from pellet_study.doe import path_turning
    from pellet_study.doe.path_table import read_path

    ignore, blocks = of_path
    runs, notes = read_path(arguments.climb_runs, screening.table, ignore, arguments.lowest, blocks)
    warnings += notes
    units = {factor.name: factor.unit for factor in screening.table.factors}
    ascend = not (arguments.descend or arguments.lowest)
    # a column of errors scatters otherwise than the response of the screening
    scatter = None if arguments.lowest else path_turning.scatter_of(screening)
    return runs, path_turning.turning(runs, arguments.target, ascend, units, scatter)


def _figures(own, one: Screened, prefix: str) -> list[str]:
    from pellet_study.doe import figures
    from pellet_study.doe.run_diagnostics import diagnostics

    screening, climb, runs, turning = one.screening, one.climb, one.runs, one.turning
    table, unit = screening.table, own.unit

    def draw() -> dict:
        drawn = {
            "pareto": figures.pareto(screening, unit),
            "half_normal": figures.half_normal(
                screening.effects, screening.lenth, unit, screening.noise_contrasts, table.names
            ),
        }
        if len(table.names) > 1:
            drawn["screening_interactions"] = figures.observed_interactions(screening, unit)
        if screening.model.mean_square_error:
            model = screening.model
            drawn["screening_residuals"] = figures.residual_plots(table, model, diagnostics(model), unit, own.alpha)
        if climb is not None:
            on_it = runs if runs is not None and {f.name for f in climb.factors} <= set(runs.columns) else None
            drawn["climb"] = figures.climb_path(
                climb, unit, own.target, table.names, on_it, turning, response=str(table.response.name)
            )
        if turning is not None:
            drawn["path"] = figures.path_runs(runs, turning, table.factors, unit, own.target, table.names)
        return {prefix + name: figure for name, figure in drawn.items()}

    return [str(path) for path in write_figures(own, draw)]
