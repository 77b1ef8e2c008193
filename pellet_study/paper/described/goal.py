"""Target, optimum and validation of a described paper."""

import numpy as np

from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.optimum import TargetSet, target_set
from pellet_study.doe.validation import Sample
from pellet_study.errors import InputError
from pellet_study.paper.described.analyses import Fit
from pellet_study.paper.described.description import FILE, Description
from pellet_study.paper.judging import settings, validation
from pellet_study.paper.verdicts import (
    CONSISTENT,
    NOT_RECOMPUTABLE,
    Item,
    equal_as_printed,
    half_last_digit,
    judged,
    printed_number,
)


def goal(paper: Description, fits: dict[str, Fit]) -> tuple[list[Item], TargetSet | None]:
    """Items of target, optimum and validation, and the settings that meet the target; none where the paper has no target.

    Raises
    ------
    InputError
        If the target is set for a fit that is no surface, or the optimum names other factors than its table.
    """
    wanted = paper.goal
    if wanted is None:
        return [], None
    surface = fits[wanted.analysis]
    if not isinstance(surface, Surface):
        raise InputError(
            f"{paper.folder / FILE}, [target], key 'analysis': expected one whose model predicts settings (quadratic, "
            f'interactions, or first order with centre_points = "residual"); found {wanted.analysis!r}'
        )
    found = _set(paper, surface)
    at = _at(paper, surface)
    items = _optimum(paper, surface, found, at)
    if wanted.value is not None:
        verified = printed_number(paper.validation.mean) if paper.validation else None
        items += (
            settings.reach("Optimum", found, wanted.unit) if paper.optimum and paper.optimum.unique else _reach(found)
        )
        items += settings.centre("Optimum", surface.table, found.target, verified)
    return items + _validation(paper, found, at), found


def _set(paper: Description, surface: Surface) -> TargetSet:
    """The settings that meet the target; for a maximum or minimum the extreme of the box."""
    wanted = paper.goal
    if wanted.value is not None:
        return target_set(surface, printed_number(wanted.value), _value(wanted.sd) or 0.0)
    spread = float(np.ptp(surface.model.response))
    found = target_set(surface, float(surface.model.response.mean()))
    end = found.highest if wanted.want == "maximum" else found.lowest
    beyond = end + (1e-6 if wanted.want == "maximum" else -1e-6) * spread
    return target_set(surface, beyond, 0.0)


def _value(text: str | None) -> float | None:
    return None if text is None else printed_number(text)


def _at(paper: Description, surface: Surface):
    """Coded setting, prediction and span at the printed optimum."""
    if paper.optimum is None:
        return None
    point = paper.optimum.point
    names = surface.table.names
    if set(point) != set(names):
        raise InputError(
            f"{paper.folder / FILE}, [optimum], key 'point': expected one level of every factor ({', '.join(names)}); "
            f"found {', '.join(point)}"
        )
    halves = {name: half_last_digit(text) for name, text in point.items()}
    return settings.at_point(surface, {name: printed_number(text) for name, text in point.items()}, halves)


def _optimum(paper: Description, surface: Surface, found: TargetSet, at) -> list[Item]:
    """The response at the printed setting, and whether that is an extreme of the box."""
    if at is None:
        return []
    coded, predicted, span = at
    section, printed = "Optimum", paper.optimum.predicted or (paper.goal.value if paper.goal.want == "target" else None)
    items = []
    if printed is not None:
        items.append(settings.prediction(section, "response at the printed optimum", printed, coded, predicted, span))
    if paper.goal.want != "target":
        items.append(_extreme(paper, surface, found, predicted))
    outside = [f.name for f, x in zip(surface.table.factors, coded, strict=True) if abs(x) > 1 + 1e-9]
    if outside:
        items.append(
            judged(section, "the setting lies in the box", "yes", ", ".join(outside), False, "beyond -1 or +1")
        )
    return items


def _extreme(paper: Description, surface: Surface, found: TargetSet, predicted) -> Item:
    """Whether the printed setting is the box's best, and how much of the box cannot be told from it.

    It is where its levels round to the best ones, or its prediction rounds to the printed response as the best one does.
    """
    want, point, printed = paper.goal.want, paper.optimum.point, paper.optimum.predicted
    best = found.highest if want == "maximum" else found.lowest
    where = ", ".join(f"{name} {level:.4g}" for name, level in found.physical.items())
    levels = all(equal_as_printed(point[name], level) for name, level in found.physical.items())
    fine = levels or (printed is not None and equal_as_printed(printed, best))
    reason = f"the {want} of the box is {best:.5g} at {where}"
    if predicted.confidence is not None:
        half = predicted.confidence[1] - predicted.predicted
        near = target_set(surface, best, half).fraction
        reason += (
            f"; {100 * near:.1f} % of the box is predicted within {half:.4g} of it, the half width of the 95 % confidence "
            "interval at the printed setting"
        )
    return judged("Optimum", f"the setting is the {want}", "yes", predicted.predicted, fine, reason)


def _reach(found: TargetSet) -> list[Item]:
    """The settings that meet the target where the paper does not call its own the only one."""
    first, unique = settings.reach("Optimum", found)
    return [
        first,
        Item("Optimum", "settings that meet the target", "", unique.recomputed, None, CONSISTENT, unique.reason),
    ]


def _validation(paper: Description, found: TargetSet, at) -> list[Item]:
    check, wanted, section = paper.validation, paper.goal, "Validation"
    if check is None:
        return []
    mean, target, sd = printed_number(check.mean), printed_number(wanted.value), _value(wanted.sd)
    items = []
    if check.relative_error_percent is not None:
        half = max(half_last_digit(check.mean), half_last_digit(wanted.value))
        items.append(validation.relative_error(section, mean, target, check.relative_error_percent, half))
    if check.less_than_percent is not None:
        limit = check.less_than_percent
        says = f"less than {limit} %"
        items.append(validation.less_than(section, says, limit, mean, target, check.relative_error_percent))
    runs, aim = Sample(mean, _value(check.sd), check.n or 1), Sample(target, sd if wanted.n else None, wanted.n or 1)
    if check.p is not None:
        items.append(_p(section, check.p, runs, aim, sd, wanted.unit))
    if sd is not None and at is not None and at[1].prediction:
        items.append(validation.interval_around(section, target, sd, [at[1].prediction], at[1].predicted, wanted.unit))
    items.append(validation.what_it_shows(section, aim, runs, wanted.unit))
    response = f"{wanted.value} {'+- ' + wanted.sd if wanted.sd else 'within 1 %'} {wanted.unit}".rstrip()
    share = found.fraction if wanted.sd else found.fraction_one_percent
    items.append(validation.what_it_cannot_show(section, found.unidentified, share, response))
    return items


def _p(section: str, printed: str, runs: Sample, aim: Sample, sd: float | None, unit: str) -> Item:
    """The printed P with what else is printed."""
    if runs.sd and runs.n > 1 and aim.sd and aim.n > 1:
        return validation.t_test_of_samples(section, runs, aim, printed)
    if sd and runs.mean != aim.mean:
        missing = (
            "n of the target is not given" if runs.sd and runs.n > 1 else "n and sd of the simulation are not given"
        )
        return validation.t_test(section, runs.mean - aim.mean, sd, printed, unit, missing)
    reason = "sd and n of both sides are needed"
    return Item(section, "P of the t test", printed, None, None, NOT_RECOMPUTABLE, reason)
