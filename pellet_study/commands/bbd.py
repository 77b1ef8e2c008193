"""`pellet-study bbd`: analyse a Box-Behnken or central composite table, or make one."""

import argparse
from pathlib import Path

from pellet_study.commands.arguments import write_figures
from pellet_study.commands.design_tables import (
    add_making_arguments,
    add_table_arguments,
    again,
    check_arguments,
    kept,
    warn,
    write_design,
    writing,
)
from pellet_study.errors import InputError
from pellet_study.output.terminal import done, say

EXAMPLES = """\
TABLE.csv: factor columns in coded or physical units, the response in the last column; an empty response is a
run that failed. A factor whose -1 is its higher level is given as --factor B=0.90,0.82.
A column of -1, 0, 1, with axial levels such as -1.414 and 1.414 or without, is coded already; of any other the least
and the greatest value are -1 and 1, in a composite design those of the cube; --factor says otherwise.
CSV of any spreadsheet or statistics program (decimal commas, UTF-16, GBK too), or xlsx; columns such as StdOrder,
RunOrder and PtType are left out, a block (day, batch) is given as --block NAME, anything else as --ignore NAME.

examples:
  pellet-study bbd surface.csv --factor B=0.90,0.82 --target 41.69 --uncertainty 0.79 --figures figures
  pellet-study bbd surface.csv --reduce 0.1 --predict B=0.887,C=0.319,G=0.162
  pellet-study bbd surface.csv --declare-margin 0.8
  pellet-study bbd surface.csv --target 41.69 --uncertainty 0.79 --target-n 5 --verify 41.1,41.5,40.9
  pellet-study bbd --design B=0.90,0.82 C=0.25,0.33 G=0.10,0.18 --output design.csv
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.epilog = EXAMPLES
    add_table_arguments(parser)
    models = parser.add_argument_group("reduced models, beside the full one")
    models.add_argument(
        "--reduce",
        metavar="P",
        type=float,
        nargs="?",
        const=0.1,
        help="leave out terms with p above P, hierarchy kept (0.1)",
    )
    models.add_argument("--drop", metavar="BC,B2", help="leave these terms out")
    models.add_argument("--predict", metavar="A=X,B=Y", help="prediction at a setting in physical units")
    target = parser.add_argument_group("target")
    target.add_argument("--target", type=float, help="response wanted")
    target.add_argument(
        "--uncertainty", type=float, default=0.0, help="its uncertainty (sd of a reading with --target-n)"
    )
    target.add_argument(
        "--rule",
        choices=("centre", "insensitive"),
        default="centre",
        help="which point of the set to recommend (centre)",
    )
    validation = parser.add_argument_group("validation")
    validation.add_argument("--declare-margin", metavar="M", type=float, help="write the equivalence margin down")
    validation.add_argument(
        "--margin-file", metavar="FILE", type=Path, help="where (default: margin.json beside the table)"
    )
    validation.add_argument("--verify", metavar="Y1,Y2,...", help="responses of the validation runs")
    validation.add_argument(
        "--target-n", metavar="N", type=int, help="readings behind the target (default: taken as known)"
    )
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
    if arguments.target_n is not None and not arguments.uncertainty:
        raise InputError(
            f"--target-n {arguments.target_n} needs the standard deviation of a reading of the target: give it with "
            "--uncertainty, or leave --target-n out to take the target as known"
        )
    if arguments.verify and arguments.target is None:
        raise InputError("--verify needs the response to be met: give --target")
    if arguments.design:
        return _design(arguments)
    from pellet_study.doe import answers, box_behnken, text
    from pellet_study.doe.design_table import read_design
    from pellet_study.doe.factors import parse_factors

    table = read_design(arguments.table, parse_factors(arguments.factor), 5, arguments.ignore, arguments.block)
    surface = box_behnken.analyse(table, arguments.alpha)
    warnings = text.surface_warnings(surface)
    parts = [text.surface_text(surface)]  # printed when all that was asked for could be answered
    answer = answers.surface_answer(surface)
    used = _reduced(arguments, surface, answer, parts)
    _predict(arguments, used, answer, warnings, parts)
    found = _target(arguments, used, answer, warnings, parts)
    _validate(arguments, answer, parts)
    say("\n\n".join(parts))
    answer["warnings"] = warnings
    warn(warnings)
    if arguments.figures:
        answer["figures"] = _figures(arguments, used, found)
    after = "--target VALUE" if arguments.target is None else "--target ... --verify RUNS"
    done(kept(arguments), None if arguments.verify else f"bbd {again(arguments)} {after}")
    return answer


def _design(arguments) -> dict:
    from pellet_study.doe import blocking, box_behnken
    from pellet_study.doe.composite import composite_matrix
    from pellet_study.doe.factors import parse_factors
    from pellet_study.doe.linear_model import columns_of, quadratic_terms
    from pellet_study.doe.run_sheet import run_sheet

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
    else:
        coded, blocks = box_behnken.coded_matrix(len(factors), arguments.centre), None
    matrix = columns_of(coded, quadratic_terms([factor.name for factor in factors]))
    if blocks is None:
        blocks = blocking.surface_blocks(coded, matrix, arguments.blocks)
    sheet = run_sheet(coded, factors, blocks, arguments.seed, model_matrix=matrix)
    return write_design(sheet, arguments.output, arguments.force, "bbd")


def _reduced(arguments, surface, answer: dict, parts: list[str]):
    """The reduced model where one was asked for, else the full one: what predictions and the target use."""
    if arguments.drop is None and arguments.reduce is None:
        return surface
    from pellet_study.doe import answers, box_behnken, text
    from pellet_study.doe.linear_model import resolve_terms

    dropped = resolve_terms(arguments.drop, surface.model.terms) if arguments.drop else []
    reduced = box_behnken.without(surface, dropped) if dropped else surface
    if arguments.reduce is not None:
        reduced, more = box_behnken.reduce_backward(reduced, arguments.reduce)
        dropped += more
    parts.append(
        f"Reduced model, without {', '.join(dropped) or 'nothing'}{text.SELECTED if dropped else ''}\n\n"
        + text.surface_text(reduced)
    )
    answer["reduced"] = {"dropped": dropped, **answers.surface_answer(reduced), "p_follow_selection": bool(dropped)}
    return reduced


def _predict(arguments, surface, answer: dict, warnings: list[str], parts: list[str]) -> None:
    if not arguments.predict:
        return
    from pellet_study.doe import answers, text
    from pellet_study.doe.factors import parse_levels
    from pellet_study.doe.linear_model import interval
    from pellet_study.tables.headers import found_in

    levels = parse_levels(arguments.predict)
    levels = {found_in(name, surface.table.names) or name: level for name, level in levels.items()}
    missing = set(surface.table.names) ^ set(levels)
    if missing:
        raise InputError(
            f"--predict and the table disagree on {sorted(missing)[0]!r}: expected one level of every factor "
            f"({', '.join(surface.table.names)})"
        )
    found = interval(surface.model, [[float(f.coded(levels[f.name])) for f in surface.table.factors]], surface.alpha)
    parts.append(text.prediction_text(levels, found))
    if found.extrapolation:
        warnings.append(text.EXTRAPOLATION)
    answer["prediction"] = answers.interval_answer(found)


def _target(arguments, surface, answer: dict, warnings: list[str], parts: list[str]):
    if arguments.target is None:
        return None
    from pellet_study.doe import answers, optimum, text

    found = optimum.target_set(surface, arguments.target, arguments.uncertainty, arguments.rule)
    parts.append(text.target_text(found))
    if found.prediction.extrapolation:
        warnings.append(text.EXTRAPOLATION)
    answer["optimum"] = answers.target_answer(found)
    return found


def _validate(arguments, answer: dict, parts: list[str]) -> None:
    """Declare the margin, or test the validation runs against the one declared."""
    path = arguments.margin_file or arguments.table.parent / "margin.json"
    from pellet_study.doe import answers, text, validation

    if arguments.declare_margin is not None:
        if arguments.verify:
            raise InputError(
                "--declare-margin and --verify came together: a margin is declared before the runs are made"
            )
        with writing(path):
            validation.declare_margin(path, arguments.declare_margin, arguments.unit)
        parts.append(f"margin {arguments.declare_margin:g} declared in {path}; make the runs, then --verify them")
        answer["margin"] = arguments.declare_margin
    if not arguments.verify:
        return
    runs = validation.sample_of(_readings(arguments.verify))
    target = validation.Sample(arguments.target)
    if arguments.target_n is not None:
        target = validation.Sample(arguments.target, arguments.uncertainty, arguments.target_n)
    found = validation.equivalence(runs, target, validation.read_margin(path), arguments.alpha)
    parts.append(text.equivalence_text(found))
    answer["validation"] = answers.equivalence_answer(found)


def _readings(text: str) -> list[float]:
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        raise InputError(f"--verify {text}: expected numbers separated by commas, such as 41.1,41.5,40.9") from None


def _figures(arguments, surface, found) -> list[str]:
    from pellet_study.doe import figures
    from pellet_study.doe.labels import degraded

    table, unit = surface.table, arguments.unit
    warn(degraded(table.names, str(table.response.name)))

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
            drawn["residuals"] = figures.residual_plots(table, surface.model, surface.runs, unit, arguments.alpha)
        if surface.saturated:
            drawn["half_normal"] = figures.half_normal(surface.scaled_effects, surface.lenth, names=table.names)
        return drawn

    return [str(path) for path in write_figures(arguments, draw)]
