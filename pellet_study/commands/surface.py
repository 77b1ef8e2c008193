"""One response of `bbd`: fitted on the scale asked for, reduced, predicted at a setting, its own target met."""

import argparse
from dataclasses import dataclass
from typing import Any

from pellet_study.commands.responses import one_number
from pellet_study.errors import InputError


@dataclass
class Analysed:
    """One response as analysed: the fit that predictions and goals use, the JSON answer, the words, the warnings."""

    response: Any
    answer: dict
    parts: list[str]
    warnings: list[str]
    target_set: Any = None


def analysed(own: argparse.Namespace, table, joint: bool) -> Analysed:
    """Everything that is asked for of one response; its target is left to the joint set where there is one.

    Raises
    ------
    InputError
        As the fit, the reduction, the prediction and the target set do.
    """
    from pellet_study.doe import answers, surface_text
    from pellet_study.doe.fitted_response import FittedResponse

    response, parts, more = _fitted(own, table)
    surface = response.surface
    parts.append(surface_text.surface_text(surface))
    found = Analysed(
        response, {**answers.surface_answer(surface), **more}, parts, surface_text.surface_warnings(surface)
    )
    reduced = _reduced(own, surface, found)
    if reduced is not surface:
        found.response = FittedResponse(response.name, reduced, response.transformation)
    _predict(own, found)
    if own.target is not None and not joint:
        _target(own, found)
    return found


def _fitted(own, table):
    """The response on the scale asked for, what is to be said of that scale, and what goes into the answer."""
    from pellet_study.doe import box_behnken
    from pellet_study.doe.fitted_response import FittedResponse

    name = str(table.response.name)
    if own.transform is None:
        return FittedResponse(name, box_behnken.analyse(table, own.alpha)), [], {}
    from pellet_study.doe.response_answers import transformation_answer
    from pellet_study.doe.response_text import scale_text
    from pellet_study.doe.transformation import advised, parse_transformation

    named = parse_transformation(own.transform) if own.transform else None
    plain = box_behnken.analyse(table, own.alpha)
    word = advised(plain.box_cox)
    power = named or (parse_transformation(word) if word else None)
    surface = box_behnken.analyse(power.applied(table), own.alpha) if power else plain
    response = FittedResponse(name, surface, power)
    told = transformation_answer(name, power, plain.box_cox, word)
    return response, [scale_text(name, power, plain.box_cox, word)], {"transformation": told}


def _reduced(own, surface, found: Analysed):
    """The reduced model where one was asked for, else the full one."""
    if own.drop is None and own.reduce is None and not own.select:
        return surface
    from pellet_study.doe import reduction, surface_text
    from pellet_study.doe.cautions import reduction_cautions, suspect_cautions, suspects_first
    from pellet_study.doe.response_answers import reduced_answer
    from pellet_study.doe.response_text import selection_text
    from pellet_study.doe.selection import select_by_aicc
    from pellet_study.doe.terms import resolve_terms

    selection = None
    dropped = resolve_terms(own.drop, surface.model.terms) if own.drop else []
    reduced = reduction.without(surface, dropped) if dropped else surface
    if own.reduce is not None:
        reduced, more = reduction.reduce_backward(reduced, own.reduce)
        dropped += more
    if own.select:
        selection = select_by_aicc(surface)
        reduced, dropped = selection.surface, selection.dropped
        found.parts.append(selection_text(selection))
    if dropped or not own.select:
        found.parts.append(
            f"Reduced model, without {', '.join(dropped) or 'nothing'}{surface_text.SELECTED if dropped else ''}\n\n"
            + surface_text.surface_text(reduced)
        )
        option = "--select" if own.select else "--drop" if own.reduce is None else "--reduce"
        found.warnings += suspects_first(surface, reduction_cautions(surface, reduced, option)) if dropped else []
        repeated = suspect_cautions(reduced) or suspect_cautions(
            surface
        )  # a smaller model may hide what the full one shows
        found.warnings += [f"before the reduced model is used, {caution}" for caution in repeated]
    found.answer["reduced"] = reduced_answer(reduced, dropped, selection)
    return reduced


def _predict(own, found: Analysed) -> None:
    if not own.predict:
        return
    from pellet_study.doe import answers, surface_text, text
    from pellet_study.doe.cautions import scale_cautions
    from pellet_study.doe.factors import parse_levels
    from pellet_study.doe.response_text import back_transformed_text
    from pellet_study.tables.headers import found_in

    table = found.response.surface.table
    levels = {found_in(name, table.names) or name: level for name, level in parse_levels(own.predict).items()}
    missing = set(table.names) ^ set(levels)
    if missing:
        raise InputError(
            f"--predict and the table disagree on {sorted(missing)[0]!r}: expected one level of every factor "
            f"({', '.join(table.names)})"
        )
    coded = [[float(f.coded(levels[f.name])) for f in table.factors]]
    predicted = found.response.interval(coded)
    if found.response.transformation:
        found.parts.append(back_transformed_text(found.response, levels, predicted))
    else:
        found.parts.append(text.prediction_text(levels, predicted))
    found.parts[-1] = "\n".join([found.parts[-1], *text.selection_cautions([found.response])])
    if predicted.extrapolation:
        found.warnings.append(surface_text.EXTRAPOLATION)
    found.warnings += scale_cautions(found.response, coded)
    found.answer["prediction"] = answers.interval_answer(predicted)


def _target(own, found: Analysed) -> None:
    from pellet_study.doe import answers, optimum, surface_text, text

    target, uncertainty = one_number("target", own.target), one_number("uncertainty", own.uncertainty) or 0.0
    found.target_set = optimum.target_set(found.response.surface, target, uncertainty, own.rule)
    lines = [surface_text.target_text(found.target_set), *text.selection_cautions([found.response])]
    found.parts.append("\n".join(lines))
    if found.target_set.prediction.extrapolation:
        found.warnings.append(surface_text.EXTRAPOLATION)
    found.answer["optimum"] = answers.target_answer(found.target_set)
