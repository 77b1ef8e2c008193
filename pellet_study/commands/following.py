"""The commands that follow an analysis of `bbd`: its goals, then the margins, then the runs that check the setting."""

import argparse
import shlex
from typing import TYPE_CHECKING

from pellet_study.commands.design_tables import again
from pellet_study.commands.responses import TOLD
from pellet_study.commands.validating import margin_file, only_response
from pellet_study.commands.wanted import GOALS
from pellet_study.errors import InputError

if TYPE_CHECKING:
    from pellet_study.doe.optimum import TargetSet

NOT_GOALS = ("transform", "unit", "declare_margin", "verify")
"""Options told of each response that say nothing of what is wanted of it."""


def next_commands(arguments: argparse.Namespace, told: dict, each: dict, joint) -> tuple[str | None, str | None]:
    """The next command; and, where that declares margins for several goals, the one after it, which checks the setting."""
    if any(own.verify for own in told.values()):
        return None, None
    model = ["bbd", again(arguments), *_model(arguments)]
    aimed = [name for name, own in told.items() if any(getattr(own, goal) is not None for goal in GOALS)]
    if not aimed:
        return " ".join([*model, *_goals_to_name(told)]), None
    if joint is not None and not joint.met:
        return None, None
    if joint is None and _out_of_reach(each[aimed[0]].target_set):
        return None, None
    words = [*model, *_goals_given(arguments)]
    setting = (joint if joint is not None else each[aimed[0]].target_set).physical
    check = " ".join([*words, *_check(aimed, setting, len(told) > 1)])
    lacking = [name for name in aimed if told[name].target is not None and not _has_margin(told[name], each[name])]
    if not lacking:
        return check, None
    margins = [_option("declare-margin", f"{name}=M" if len(told) > 1 else "M") for name in lacking]
    return " ".join([*words, *margins]), check if joint is not None else None


def _out_of_reach(target: "TargetSet") -> bool:
    """Whether no setting of the box meets a target, the uncertainties of both counted: there is nothing to validate."""
    return not target.reachable and not target.fraction_not_excluded


def _model(arguments: argparse.Namespace) -> list[str]:
    """How the responses were fitted."""
    words = [] if arguments.alpha == 0.05 else [f"--alpha {arguments.alpha:g}"]
    words += [] if arguments.reduce is None else [f"--reduce {arguments.reduce:g}"]
    words += [] if arguments.drop is None else [_option("drop", arguments.drop)]
    words += ["--select"] if arguments.select else []
    return words + [_option("transform", how) for how in arguments.transform or ()]


def _goals_to_name(told: dict[str, argparse.Namespace]) -> list[str]:
    """A target of each response, to be filled in."""
    if len(told) > 1:
        return [shlex.join(["--target", f"{name}=VALUE", "--uncertainty", f"{name}=U"]) for name in told]
    own = next(iter(told.values()))
    return ["--target VALUE", *(["--uncertainty U"] if own.transform is not None else [])]


def _goals_given(arguments: argparse.Namespace) -> list[str]:
    """The goals as they were given."""
    options = [name for name in TOLD if name not in NOT_GOALS]
    words = [_option(name, value) for name in options for value in getattr(arguments, name) or ()]
    words += [] if arguments.rule == "centre" else [f"--rule {arguments.rule}"]
    words += [] if arguments.target_n is None else [f"--target-n {arguments.target_n}"]
    return words + ([] if arguments.margin_file is None else [_option("margin-file", str(arguments.margin_file))])


def _option(name: str, value: str) -> str:
    """An option with its value, which may begin with a minus sign or be left out."""
    if value.startswith("-"):
        return shlex.quote(f"--{name}={value}")
    return shlex.join([f"--{name}", *filter(None, [value])])


def _check(names: list[str], setting: dict[str, float], several: bool) -> list[str]:
    """The runs made at a setting, their readings to be filled in."""
    place = _option("at", ",".join(f"{name}={value:.5g}" for name, value in setting.items()))
    return [place, *(_option("verify", f"{name}=Y1,Y2,..." if several else "Y1,Y2,...") for name in names)]


def _has_margin(own, one) -> bool:
    from pellet_study.doe.margins import read_margin

    try:
        read_margin(margin_file(own), one.response.name, only_response(own))
    except InputError:
        return False
    return True
