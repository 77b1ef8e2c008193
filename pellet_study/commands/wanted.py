"""What is wanted of each response, from the words of the command line to a `Goal`."""

import argparse
from typing import Any

from pellet_study.commands.responses import number_or_none, one_number
from pellet_study.errors import InputError

INFINITE = float("inf")

GOALS = ("target", "maximise", "minimise", "limits")
"""Options that say what is wanted of a response."""

SHAPED = ("maximise", "minimise", "limits", "weight", "importance")
"""Options that ask for a desirability."""

HELP = """\
Several responses: --response NAME NAME (after the table); the other columns are factors. What is said of one of
several responses is said as NAME=...: --target angle=41.7 --uncertainty angle=0.8 --unit angle=deg. With several
responses, or any of --maximise, --minimise, --limits, --weight and --importance, the settings of the box that meet
all goals are found, and the most desirable of them (Derringer and Suich 1980): the desirability of a response rises
from 0 at the limit to 1 at the target or the best end; a weight bends it, an importance is its exponent in the mean.
--select leaves terms out while AICc falls (hierarchy kept) and says what the choice costs. --transform analyses the
response on the scale that Box and Cox's likelihood advises, where it advises one, or on the one named (log, sqrt,
inverse or a power), and takes predictions and goals back to the response's own unit: they are medians then.
"""


def add_goal_arguments(parser: argparse.ArgumentParser) -> None:
    """What is wanted of the responses."""
    goal = parser.add_argument_group("what is wanted, of each response (NAME= may be left out where there is one)")
    goal.add_argument("--target", metavar="[NAME=]V", action="append", help="response wanted")
    goal.add_argument(
        "--uncertainty", metavar="[NAME=]U", action="append",
        help="its uncertainty: within +-U will do (sd of a reading with --target-n)",
    )  # fmt: skip
    goal.add_argument(
        "--maximise", metavar="NAME[=LOW,HIGH]", action="append", nargs="?", const="",
        help="as high as can be: unacceptable below LOW, no better beyond HIGH (default: the ends predicted in the box)",
    )  # fmt: skip
    goal.add_argument(
        "--minimise", metavar="NAME[=LOW,HIGH]", action="append", nargs="?", const="",
        help="as low as can be: no better beyond LOW, unacceptable above HIGH (default: the ends predicted in the box)",
    )  # fmt: skip
    goal.add_argument(
        "--limits", metavar="[NAME=]LOW,HIGH", action="append",
        help="acceptable values, around a target or alone; one may be left empty (120, or ,75)",
    )  # fmt: skip
    goal.add_argument("--weight", metavar="[NAME=]R[,S]", action="append", help="exponents of the desirability (1)")
    goal.add_argument("--importance", metavar="[NAME=]W", action="append", help="among the responses (1)")
    goal.add_argument(
        "--rule",
        choices=("centre", "insensitive"),
        default="centre",
        help="which point that meets the target of one response to recommend (centre)",
    )


def wants_joint(told: dict[str, argparse.Namespace]) -> bool:
    """Whether the goals are more than one target of one response on its own scale."""
    asked = [own for own in told.values() if any(getattr(own, option) is not None for option in ("target", *SHAPED))]
    if len(told) > 1:
        return bool(asked)
    return any(getattr(own, option) is not None for own in asked for option in (*SHAPED, "transform"))


def two_numbers(option: str, text: str) -> tuple[float | None, float | None]:
    """(LOW, HIGH) of `LOW,HIGH`, `LOW,` or `,HIGH`; None where left empty.

    Raises
    ------
    InputError
        If a part is no number, or there are more than two.
    """
    parts = [part.strip() for part in text.split(",")]
    values = [number_or_none(part) if part else None for part in parts]
    if len(parts) > 2 or any(value is None and part for value, part in zip(values, parts, strict=True)):
        raise InputError(
            f"--{option} {text}: expected LOW,HIGH, of which one may be left empty, such as 120,170 or 120,"
        )
    return (values[0], values[1] if len(values) > 1 else None)


def goal_of(own: argparse.Namespace, response):
    """The goal of one fitted response, None where nothing is wanted of it.

    Raises
    ------
    InputError
        If it has two goals, or a target without what is still acceptable around it.
    """
    kinds = [kind for kind in ("target", "maximise", "minimise") if getattr(own, kind) is not None]
    if len(kinds) > 1 or (kinds and kinds != ["target"] and own.limits is not None):
        other = kinds[1] if len(kinds) > 1 else "limits"
        raise InputError(
            f"{response.name} has --{kinds[0]} and --{other}: expected one goal a response; limits of a response to be "
            "maximised or minimised are --maximise NAME=LOW,HIGH"
        )
    below, above = two_numbers("weight", own.weight or "1")
    weights = (below if below is not None else above or 1.0, above if above is not None else below or 1.0)
    shape: dict[str, Any] = {"weights": weights, "importance": one_number("importance", own.importance or "1")}
    if kinds == ["target"]:
        return _target(own, response, shape)
    if kinds:
        return _one_sided(own, kinds[0], response, shape)
    if own.limits is not None:
        low, high = two_numbers("limits", own.limits)
        ends = (-INFINITE if low is None else low, INFINITE if high is None else high)
        return _goal(own, response, "limits", *ends, **shape)
    if own.weight or own.importance:
        raise InputError(
            f"{response.name} has a weight or importance but no goal: give --target, --maximise, --minimise "
            "or --limits too"
        )
    return None


def _goal(own, response, *what, **shape):
    """A goal; what is wrong with it is said of the options that gave it."""
    from pellet_study.doe.goals import Goal

    try:
        return Goal(*what, **shape)
    except InputError as error:
        options = [
            option for option in (*GOALS, "uncertainty", "weight", "importance") if getattr(own, option) is not None
        ]
        said = " ".join(
            f"--{option} {response.name}" + (f"={value}" if (value := getattr(own, option)) else "")
            for option in options
        )
        raise InputError(f"{said}: {error}") from None


def _target(own, response, shape: dict):
    target, uncertainty = one_number("target", own.target), one_number("uncertainty", own.uncertainty)
    low, high = two_numbers("limits", own.limits) if own.limits else (None, None)
    if uncertainty:
        low, high = (target - uncertainty if low is None else low), (target + uncertainty if high is None else high)
    if low is None or high is None:
        raise InputError(
            f"--target {response.name}={target:g} does not say how far off will still do: give --uncertainty "
            f"{response.name}=U, or both ends with --limits {response.name}=LOW,HIGH"
        )
    return _goal(own, response, "target", low, high, target, **shape)


def _one_sided(own, kind: str, response, shape: dict):
    """A goal of maximising or minimising; ends that were not given are those predicted in the box."""
    ends = two_numbers(kind, getattr(own, kind))
    low, high = ends
    if low is None or high is None:
        least, most = response.predicted_range()
        _refuse_endless(kind, response, least, most)
        if low is None:
            low = least if high is None or least < high else high - (most - least)
        if high is None:
            high = most if most > low else low + (most - least)
    limited = ends[0 if kind == "maximise" else 1] is not None
    return _goal(own, response, kind, low, high, limited=limited, **shape)


def _refuse_endless(kind: str, response, least: float, most: float) -> None:
    """Ends that the predictions cannot give: there are none where all are one, or where the scale runs out."""
    if most == INFINITE:
        raise InputError(
            f"--{kind} {response.name}: in a part of the box {response.surface.table.response.name} is predicted where no "
            f"{response.name} has it, so there is no highest prediction to go by: give both ends, --{kind} "
            f"{response.name}=LOW,HIGH, or use --transform {response.name}=log, whose predictions have an end"
        )
    if most - least <= 1e-9 * max(abs(least), abs(most)):
        raise InputError(
            f"--{kind} {response.name}: its model predicts {most:.5g} at every setting, so none is higher or lower than "
            f"another; predict with the full model (without --select, --reduce and --drop), or leave the goal of "
            f"{response.name} out"
        )
