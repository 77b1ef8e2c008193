"""`pellet-study bbd`: analyse a Box-Behnken or central composite table, or make one."""

import argparse

from pellet_study.commands.arguments import write_figures
from pellet_study.commands.design_tables import (
    add_making_arguments,
    add_table_arguments,
    check_arguments,
    kept,
    warn,
    write_design,
)
from pellet_study.commands.following import next_commands
from pellet_study.commands.numbers import number
from pellet_study.commands.other_command import for_the_other
from pellet_study.commands.responses import (
    add_response_argument,
    each_able,
    each_response,
    figure_prefixes,
    heading,
    not_analysed,
    one_number,
    read_tables,
    response_columns,
    warnings_of,
)
from pellet_study.commands.surface import analysed
from pellet_study.commands.validating import add_validation_arguments, check_validation, validate
from pellet_study.commands.wanted import GOALS, HELP, add_goal_arguments, goal_of, wants_joint
from pellet_study.errors import InputError
from pellet_study.output.terminal import done, say

NOTES = """\
TABLE.csv: factor columns in coded or physical units, the response in the last column; an empty response is a
run that failed. A factor whose -1 is its higher level is given as --factor B=0.90,0.82.
A column of -1, 0, 1, with axial levels such as -1.414 and 1.414 or without, is coded already; of any other the least
and the greatest value are -1 and 1, in a composite design those of the cube; --factor says otherwise.
CSV of any spreadsheet or statistics program (decimal commas, UTF-16, GBK too), or xlsx; columns such as StdOrder,
RunOrder and PtType are left out, a block (day, batch) is given as --block NAME, anything else as --ignore NAME.
"""

EXAMPLES = """
examples:
  pellet-study bbd surface.csv --factor B=0.90,0.82 --target 41.69 --uncertainty 0.79 --figures figures
  pellet-study bbd surface.csv --reduce 0.1 --predict B=0.887,C=0.319,G=0.162
  pellet-study bbd surface.csv --declare-margin 0.8
  pellet-study bbd surface.csv --target 41.69 --uncertainty 0.79 --target-n 5 --verify 41.1,41.5,40.9
  pellet-study bbd tread.csv --response wear hardness --limits wear=120, --limits hardness=60,75 --verify wear=128,131,125 --verify hardness=66,69,67
  pellet-study bbd tread.csv --response wear hardness --maximise wear=120,170 --target hardness=67.5 --limits hardness=60,75
  pellet-study bbd cycles.csv --transform --select
  pellet-study bbd --design B=0.90,0.82 C=0.25,0.33 G=0.10,0.18 --output design.csv
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.epilog = NOTES + HELP + EXAMPLES
    add_table_arguments(parser)
    add_response_argument(parser)
    models = parser.add_argument_group("models: reduced ones beside the full one, another scale of the response")
    models.add_argument(
        "--reduce",
        metavar="P",
        type=number,
        nargs="?",
        const=0.1,
        help="leave out terms with p above P, hierarchy kept (0.1)",
    )
    models.add_argument("--drop", metavar="BC,B2", help="leave these terms out")
    models.add_argument("--select", action="store_true", help="leave terms out backward by AICc, hierarchy kept")
    models.add_argument(
        "--transform", metavar="[NAME=]HOW", action="append", nargs="?", const="",
        help="analyse log, sqrt, inverse or a power of the response (without HOW: what Box-Cox advises, if it does)",
    )  # fmt: skip
    models.add_argument("--predict", metavar="A=X,B=Y", help="prediction at a setting in physical units")
    add_goal_arguments(parser)
    add_validation_arguments(parser)
    making = add_making_arguments(parser, centre=5)
    making.add_argument(
        "--axial", metavar="rotatable|face|orthogonal|VALUE",
        help="a central composite with axial points there instead of a Box-Behnken design (it has corners)",
    )  # fmt: skip
    making.add_argument("--face-centred", action="store_true", help="the same as --axial face")
    making.add_argument(
        "--fraction", action="store_true", help="corners of the composite: the fraction of resolution V"
    )


def run(arguments: argparse.Namespace) -> dict:
    """Analyse or design; prints the readable answer and returns the JSON one."""
    check_arguments(arguments)
    if arguments.reduce is not None and not 0 < arguments.reduce < 1:
        raise InputError(f"--reduce {arguments.reduce:g}: expected a p value between 0 and 1, such as 0.1")
    if arguments.select and (arguments.reduce is not None or arguments.drop is not None):
        raise InputError("--select came with --reduce or --drop: expected one way to leave terms out")
    if arguments.design:
        return _design(arguments)
    from pellet_study.doe.factors import parse_factors
    from pellet_study.doe.labels import degraded
    from pellet_study.doe.response_answers import joint_answer

    try:
        tables, failed = read_tables(arguments, parse_factors(arguments.factor), 5)
        told = each_response(arguments, [*tables, *failed])
        _check_goals(told)
        joint = wants_joint(told)
        each, more_failed = each_able(tables, lambda name: analysed(told[name], tables[name], joint))
    except InputError as error:
        raise for_the_other(arguments, "pb", error) from None
    failed |= more_failed
    _refuse_goals_of(failed, told)
    told = {name: told[name] for name in each}
    warnings = not_analysed(failed) + warnings_of({name: one.warnings for name, one in each.items()})
    parts = []  # printed when all that was asked for could be answered
    for name, one in each.items():
        parts += heading(name, each) + one.parts
    found = _joint(told, each, warnings, parts) if joint else None
    validate(told, each, found, parts, warnings)
    answer = dict(next(iter(each.values())).answer)
    if len(each) > 1:
        answer["responses"] = {name: {**one.answer, "warnings": one.warnings} for name, one in each.items()}
    if failed:
        answer["not_analysed"] = failed
    if found is not None:
        answer["joint"] = joint_answer(found)
    say("\n\n".join(parts))
    answer["warnings"] = warnings
    warn(warnings)
    if arguments.figures:
        surfaces = [one.response.surface for one in each.values()]
        warn(degraded(surfaces[0].table.names, *(str(surface.table.response.name) for surface in surfaces)))
        prefixes = figure_prefixes(each)
        answer["figures"] = [path for name, one in each.items() for path in _figures(told[name], one, prefixes[name])]
        if found is not None and len(found.factors) > 1:
            answer["figures"] += _regions(arguments, found, {name: own.unit for name, own in told.items()})
    following, then = next_commands(arguments, told, each, found)
    done(kept(arguments), following)
    if then:
        say(f"then, with the runs made there: pellet-study {then}")
    return answer


def _refuse_goals_of(failed: dict[str, str], told: dict[str, argparse.Namespace]) -> None:
    """A goal of a response that is not analysed cannot be met: an error, not a warning."""
    for name, reason in failed.items():
        own = told[name]
        if any(getattr(own, goal) is not None for goal in GOALS):
            raise InputError(f"{name} has a goal and cannot be analysed: {reason}")


def _check_goals(told: dict[str, argparse.Namespace]) -> None:
    """Refuse what one response can be asked for and several cannot, and readings of a target without their scatter."""
    own = next(iter(told.values()))
    if wants_joint(told) and own.rule != "centre":
        raise InputError(f"--rule {own.rule} picks a point that meets the target of one response on its own scale: leave it "
                         "out, the desirability picks the point here")  # fmt: skip
    if own.target_n is not None and len(told) > 1:
        raise InputError(
            f"--target-n {own.target_n} counts the readings of the target that --verify tests one response against: name it "
            "alone with --response, and the others with --ignore"
        )
    for name, one in told.items():
        if one.uncertainty is not None and one.target is None:
            raise InputError(
                f"--uncertainty {name}={one.uncertainty} is that of a target: give --target {name}=VALUE too, or say what is "
                f"acceptable of {name} with --limits, --maximise or --minimise"
            )
    if own.target_n is not None and not one_number("uncertainty", own.uncertainty):
        raise InputError(
            f"--target-n {own.target_n} needs the standard deviation of a reading of the target: give it with "
            "--uncertainty, or leave --target-n out to take the target as known"
        )
    check_validation(told)


def _joint(told: dict, each: dict, warnings: list[str], parts: list[str]):
    """The settings that meet the goals of all responses that have one."""
    from pellet_study.doe import coded_box, surface_text
    from pellet_study.doe.cautions import box_scale_cautions, scale_cautions
    from pellet_study.doe.joint_set import joint_set
    from pellet_study.doe.response_text import joint_text

    goals = {name: goal for name, own in told.items() if (goal := goal_of(own, each[name].response)) is not None}
    found = joint_set([each[name].response for name in goals], list(goals.values()))
    parts.append(joint_text(found))
    if found.extrapolation:
        warnings.append(surface_text.EXTRAPOLATION)
    points = coded_box.sample(len(found.factors))
    for part in found.parts:
        warnings += box_scale_cautions(part.response, points) or scale_cautions(part.response, found.coded)
    return found


def _design(arguments) -> dict:
    from pellet_study.doe import blocking, box_behnken
    from pellet_study.doe.cautions import axial_cautions
    from pellet_study.doe.composite import composite_matrix
    from pellet_study.doe.factors import parse_factors
    from pellet_study.doe.run_sheet import run_sheet
    from pellet_study.doe.terms import columns_of, quadratic_terms

    factors = parse_factors(arguments.design)
    words = [factor.name for factor in factors if factor.levels]
    if words:
        raise InputError(
            f"{words[0]!r} is categorical, and a quadratic surface has a middle and a square of every factor: make a design "
            "for each of its levels, or screen it with pb"
        )
    axial = "face" if arguments.face_centred else arguments.axial
    if arguments.fraction and axial is None:
        raise InputError(
            "--fraction is for the corners of a central composite: give --axial rotatable or --axial face too"
        )
    if axial is not None:
        coded, blocks = composite_matrix(len(factors), axial, arguments.centre, arguments.fraction, arguments.blocks)
        warn(axial_cautions(factors, float(abs(coded).max())))
    else:
        coded, blocks = box_behnken.coded_matrix(len(factors), arguments.centre), None
    matrix = columns_of(coded, quadratic_terms([factor.name for factor in factors]))
    if blocks is None:
        blocks = blocking.surface_blocks(coded, matrix, arguments.blocks)
    sheet = run_sheet(coded, factors, blocks, arguments.seed, response_columns(arguments), matrix)
    return write_design(sheet, arguments.output, "bbd")


def _figures(own, one, prefix: str) -> list[str]:
    from pellet_study.doe import figures

    surface, found = one.response.surface, one.target_set
    unit = own.unit if one.response.transformation is None else ""  # a transformed response has another
    table = surface.table

    def draw() -> dict:
        drawn = {"predicted_observed": figures.predicted_observed(surface, unit)}
        if len(table.names) > 1:
            drawn |= {
                "response_surface": figures.surface_contours(surface, found, unit),
                "surface_3d": figures.surface_3d(surface, found, unit),
                "interactions": figures.interactions(surface, found, unit),
            }
        drawn["perturbation"] = figures.perturbation(surface, found, unit)
        if surface.model.mean_square_error:
            drawn["residuals"] = figures.residual_plots(table, surface.model, surface.runs, unit, own.alpha)
        if surface.saturated:
            drawn["half_normal"] = figures.half_normal(surface.scaled_effects, surface.lenth, names=table.names)
        return {prefix + name: figure for name, figure in drawn.items()}

    return [str(path) for path in write_figures(own, draw)]


def _regions(arguments, found, units: dict[str, str]) -> list[str]:
    from pellet_study.doe import figures

    return [str(path) for path in write_figures(arguments, lambda: {"overlay": figures.overlaid_regions(found, units)})]
