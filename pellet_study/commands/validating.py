"""The validation of `bbd`: margins declared before the runs, and the runs tested against the goal of each response."""

import argparse
import shlex
from pathlib import Path

from pellet_study.commands.design_tables import writing
from pellet_study.commands.numbers import whole
from pellet_study.commands.responses import one_number
from pellet_study.commands.wanted import GOALS, goal_of
from pellet_study.errors import InputError
from pellet_study.tables.numbers import number as number_in
from pellet_study.tables.numbers import number_given


def add_validation_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    group = parser.add_argument_group("validation")
    group.add_argument(
        "--declare-margin", metavar="[NAME=]M", action="append", help="write the equivalence margin of a target down"
    )
    group.add_argument("--margin-file", metavar="FILE", type=Path, help="where (default: margin.json beside the table)")
    group.add_argument("--verify", metavar="[NAME=]Y1,Y2,...", action="append", help="readings of the validation runs")
    group.add_argument("--at", metavar="A=X,B=Y", help="where they were made (default: the recommended setting)")
    group.add_argument(
        "--target-n", metavar="N", type=whole, help="readings behind the target (default: taken as known)"
    )


def check_validation(told: dict[str, argparse.Namespace]) -> None:
    """Refuse runs to validate with that have nothing to be held against, and a margin declared with them.

    Raises
    ------
    InputError : says which response, and what to give
    """
    for name, own in told.items():
        if own.verify and all(getattr(own, goal) is None for goal in GOALS):
            raise InputError(
                f"--verify needs what {name} is to meet: give --target, or --maximise, --minimise or --limits"
            )
    verified = any(own.verify for own in told.values())
    if verified and any(own.declare_margin for own in told.values()):
        raise InputError("--declare-margin and --verify came together: a margin is declared before the runs are made")
    if next(iter(told.values())).at and not verified:
        raise InputError("--at says where the runs of --verify were made: give their readings with --verify")


def margin_file(arguments: argparse.Namespace) -> Path:
    """Where the margins of equivalence are declared."""
    return arguments.margin_file or arguments.table.parent / "margin.json"


def only_response(arguments: argparse.Namespace) -> bool:
    """Whether a margin without a name can only be that of the response analysed: the table has no other."""
    return len(arguments.response) < 2 and not (arguments.response and arguments.ignore)


def validate(told: dict, each: dict, joint, parts: list[str], warnings: list[str]) -> None:
    """Declare the margins, or test the validation runs of each response that has some; into its answer and the words."""
    from pellet_study.doe.validation_text import together_text

    shown: dict[str, bool] = {}
    untested = []
    for name, own in told.items():
        if own.declare_margin:
            _declare(own, each[name], parts)
    where = None
    for name, own in told.items():
        if not own.verify:
            untested += [name] if any(getattr(own, goal) is not None for goal in GOALS) else []
            continue
        if where is None:
            where = _setting_of_runs(own, each[name], joint)
            parts.append("the runs to validate with count for " + ", ".join(f"{n} {v:.5g}" for n, v in where.items()))
        met = _verify(own, each[name], where, len(told) > 1, parts, warnings)
        if met is not None:
            shown[name] = met
    if shown and len(shown) + len(untested) > 1:
        parts.append(together_text(shown, untested, next(iter(told.values())).alpha))


def _declare(own, one, parts: list[str]) -> None:
    from pellet_study.doe import margins

    path, response, margin = margin_file(own), one.response.name, one_number("declare-margin", own.declare_margin)
    with writing(path):
        margins.declare_margin(path, margin, own.unit, response, only_response(own))
    parts.append(f"margin {margin:g} of {response} declared in {path}; make the runs, then --verify them")
    one.answer["margin"] = margin


def _verify(own, one, where: dict[str, float], named: bool, parts: list[str], warnings: list[str]) -> bool | None:
    """Test the readings of one response; returns whether its goal is shown to be met, None of one without a limit."""
    from pellet_study.doe import answers, margins, validation, validation_text

    readings = _readings(own.verify, one.response.surface.table.decimal)
    response, answer = one.response.name, one.answer
    name = response if named else ""
    answer["validated_at"] = where
    if own.target is None:
        tested = validation.within_limits(readings, goal_of(own, one.response).accepted, own.alpha)
        parts.append(validation_text.within_limits_text(tested, name))
        answer["validation"] = answers.plain({**vars(tested), "shown": tested.shown})
        shown = tested.shown if tested.p else None
    else:
        found = _equivalence(own, readings, margins.read_margin(margin_file(own), response, only_response(own)))
        parts.append(validation_text.equivalence_text(found, name))
        answer["validation"] = answers.equivalence_answer(found)
        shown = found.equivalent
    coded = [[float(f.coded(where[f.name])) for f in one.response.factors]]
    predicted = one.response.interval(coded)
    if predicted.prediction is None:
        return shown
    of_mean = one.response.interval(coded, len(readings)).prediction if predicted.block_scatter else None
    mean = one.response.mean_of(readings)
    beside = validation.beside_prediction(readings, predicted.prediction, predicted.level, mean, of_mean)
    parts[-1] += "\n" + validation_text.beside_prediction_text(beside)
    told = {"inside": beside.inside, "prediction": beside.prediction, "contradicts_prediction": beside.contradicted}
    told |= {"prediction_of_mean": of_mean} if of_mean else {}
    answer["validation"] |= answers.plain(told)
    if beside.contradicted:
        warnings.append((f"{name}: " if named else "") + validation_text.contradicted_text(beside))
    return shown


def _equivalence(own, readings: list[float], margin: float):
    """The test of the readings against the target, which may be a mean of readings itself."""
    from pellet_study.doe import validation

    runs = validation.sample_of(readings)
    target = validation.Sample(one_number("target", own.target))
    if own.target_n is not None:
        sd = one_number("uncertainty", own.uncertainty)
        target = validation.Sample(target.mean, sd, own.target_n)
    return validation.equivalence(runs, target, margin, own.alpha)


def _setting_of_runs(own, one, joint) -> dict[str, float]:
    """{factor: level} of the validation runs: as --at says, else the setting that was recommended."""
    if not own.at:
        return (joint if joint is not None else one.target_set).physical
    from pellet_study.doe.factors import parse_levels
    from pellet_study.tables.headers import found_in

    names = one.response.surface.table.names
    levels = {found_in(name, names) or name: level for name, level in parse_levels(own.at).items()}
    if set(levels) != set(names):
        raise InputError(f"--at {own.at}: expected one level of every factor ({', '.join(names)})")
    return levels


def _readings(text: str, decimal: str) -> list[float]:
    """The readings of `--verify`: commas between decimal points, or semicolons, between which commas are decimal.

    Raises
    ------
    InputError
        If one is no number, or commas may be either: `decimal` is the sign of the table.
    """
    try:
        if ";" in text:
            sign = "," if "," in text and "." not in text else "."
            return [number_in(word, sign) for word in text.split(";") if word.strip()]
        values = [number_given(word) for word in text.split(",")]
    except ValueError:
        raise InputError(
            f"--verify {text}: expected numbers separated by commas, such as 41.1,41.5,40.9, or by semicolons, such as "
            "'41,1;41,5;40,9'"
        ) from None
    first, second = values[::2], values[1::2]
    if "." in text or len(first) != len(second):
        return values
    if decimal == "," or max(map(abs, second)) < min(map(abs, first)) / 2:
        words = text.split(",")
        pairs = [f"{a.strip()},{b.strip()}" for a, b in zip(words[::2], words[1::2], strict=True)]
        raise InputError(
            f"--verify {text}: is that {len(first)} readings with decimal commas, or {len(values)}? Put semicolons between them: "
            f"{shlex.quote(';'.join(pairs))}, or {shlex.quote(';'.join(map(str.strip, words)))}"
        )
    return values
