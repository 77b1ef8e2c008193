"""What was understood of a study, before anything is simulated: its rows, conditions, parameters, and what they could show.

For rigs that are formulas the amount from which on a candidate would be noticed is computed, as `diagnose` does it; for rigs
on YADE that takes simulations, and what the candidate shows in is said instead.
"""

from collections.abc import Sequence
from typing import Any

from pellet_study.criticism.calibration import fit_study
from pellet_study.criticism.diagnose import diagnose
from pellet_study.criticism.reading_order import in_order_words
from pellet_study.criticism.time_drift import along
from pellet_study.criticism.used_sd import reading_sd
from pellet_study.errors import InputError
from pellet_study.model.model import key
from pellet_study.output.terminal import fold
from pellet_study.output.words import flush, number, width
from pellet_study.study.ranges import limits, usual
from pellet_study.study.study import Study, means_something

MOST_LEVELS = 12  # of a condition that are spelt out


def understood(study: Study) -> dict[str, Any]:
    """What a study's files say, as data.

    Returns
    -------
    `rigs` with their rows and conditions, `parameters`, `effects` present, `candidates` with the amount from which on each
    would be noticed, `assumed`, `advice`, and the `warnings` that any answer would have
    """
    noticed, trouble = _noticed(study)
    rigs = [_rig(study, name) for name in study.rigs]
    return {
        "title": study.title,
        "rigs": rigs,
        "parameters": _parameters(study),
        "effects": list(study.effects),
        "candidates": [_candidate(study, name, noticed) for name in study.absent()],
        "no_candidate": study.why_none_absent(),
        "assumed": study.assumed,
        "advice": [*trouble, *_advice(study)],
        "warnings": list(study.remarks),
    }


def _rig(study: Study, name: str) -> dict[str, Any]:
    """A rig: its rows by what becomes of them, its observables, its conditions."""
    rig, rows = study.catalogue.rigs[name], [row for row in study.rows if row.rig == name]
    left_out = sum(row.rig == name for row in study.left_out)
    observables = {}
    for observable in dict.fromkeys(row.observable for row in rows):
        values = [row.value for row in rows if row.observable == observable]
        observables[observable] = [min(values), max(values)]
    assumed = study.assumed_conditions.get(name, {})
    return {
        "rig": name,
        "engine": "YADE" if rig.on_yade else "a formula",
        "contact_law": (study.contact_law or rig.contact_laws[0]) if rig.on_yade else None,
        "rows": {s: sum(row.split == s for row in rows) for s in ("fit", "holdout")} | {"leave_out": left_out},
        "readings": sum(row.n for row in rows),
        "observables": observables,
        "conditions": [
            {
                "condition": condition,
                "unit": quantity.get("unit"),
                "meaning": quantity.get("meaning"),
                "levels": sorted({row.conditions[condition] for row in rows}),
                "assumed": condition in assumed,
                "default": quantity["default"],
                "required": bool(quantity.get("required")),
                "usual": list(quantity["options"] if "options" in quantity else usual(quantity)),
                "can_simulate": list(quantity["options"] if "options" in quantity else limits(quantity)),
            }
            for condition, quantity in rig.conditions.items()
            if any(condition not in row.assumed or means_something(quantity, row.conditions) for row in rows)
        ],
    }


def _parameters(study: Study) -> list[dict[str, Any]]:
    """Every parameter of the rigs used: free, fixed, known for some rows, or at its default."""
    assumed, found = study.assumed_parameters, {}
    for rig in study.rigs:
        for name, quantity in study.catalogue.rigs[rig].parameters.items():
            if name not in study.parameters and name not in assumed:
                continue
            setting = study.parameters.get(name)
            known = sum(name in row.parameters for row in study.rows)
            found[name] = {
                "parameter": name,
                "unit": quantity.get("unit"),
                "meaning": quantity.get("meaning"),
                "value": assumed.get(name) if setting is None else setting.value,
                "range": [setting.low, setting.high] if setting is not None and setting.free else None,
                "state": "assumed" if setting is None else "free" if setting.free else "fixed",
                "known_rows": known,
                "possible": list(usual(quantity)),
            }
    return list(found.values())


def _noticed(study: Study) -> tuple[dict[str, Any], list[str]]:
    """The ranking of the candidates where no simulation is needed for it, by name, and what stands against any."""
    if any(study.catalogue.rigs[rig].on_yade for rig in study.rigs):
        return {}, []
    try:
        state = fit_study(study)
        ranked = {suspect.effect: suspect for suspect in diagnose(study, state, propose=False, rank=False).ranking}
        return {**ranked, "known scatter": state.cells.scale_known}, []
    except InputError as error:
        return {}, [str(error)]


def _candidate(study: Study, name: str, noticed: dict[str, Any]) -> dict[str, Any]:
    """An absent effect: where it would show, and from which amount on."""
    effect, suspect = study.catalogue.effects[name], noticed.get(name)
    quantity = effect.parameters[effect.amount]
    acts_in = [rig for rig in study.rigs if name in study.catalogue.acting(rig)]
    return {
        "effect": name,
        "means": effect.means,
        "amount": effect.amount,
        "unit": quantity["unit"],
        "physical": list(quantity.get("physical", (quantity["min"], quantity["max"]))),
        "shows": {rig: effect.rigs.get(rig, "") for rig in acts_in},
        "noticed_from": None if suspect is None else suspect.smallest_visible,
        "visible_percent": None if suspect is None else 100 * suspect.visible_share,
        "needs": _needs(study, suspect, noticed, acts_in),
    }


def _needs(study: Study, suspect: Any, noticed: dict[str, Any], acts_in: Sequence[str]) -> str:
    """What it would take to see a candidate, in words."""
    if suspect is None:
        on_yade = [rig for rig in acts_in if study.catalogue.rigs[rig].on_yade]
        return f"how much of it would be noticed takes simulations ({', '.join(on_yade)})" if on_yade else ""
    if suspect.smallest_visible is not None:
        known = "" if noticed["known scatter"] else ", by the scatter about the present model"
        amount = study.catalogue.effects[suspect.effect].amount
        smallest = number(suspect.smallest_visible, 3)
        return f"from {amount} = {smallest} on it would be noticed in 80 of 100 such data sets{known}"
    if suspect.note:
        return f"not to be seen in these rows, {suspect.note}: measure under more, or other, conditions"
    return "not to be seen within its physical range: more readings, smaller sd, or a wider range of conditions"


def _advice(study: Study) -> list[str]:
    """What would make the answers worth more."""
    advice = []
    if not any(setting.free for setting in study.parameters.values()):
        advice.append("no parameter is free: nothing is calibrated; give one { min = ..., max = ... } in [parameters]")
    if any(sd is None for sd in reading_sd(study.rows)):
        advice.append(
            "some rows have neither sd nor replicates: whether the model fits cannot be judged there; give `sd`, or repeat "
            "readings"
        )
    ordered = [row for row in study.rows if row.order is not None]
    if (
        not ordered and len({(row.rig, *key(row)[2:]) for row in study.rows}) > 1
    ):  # readings of one pouring have no order
        advice.append(
            "there is no column `order`: randomise the order in which readings are taken and note it there (1, 2, ...), as a "
            "drift with time looks like an effect of whatever was changed meanwhile"
        )
    elif ordered and len(ordered) < len(study.rows):
        lines = ", ".join(str(row.line) for row in study.rows if row.order is None)
        advice.append(f"column `order` is blank in line {lines}")
    for rig in study.rigs:
        rows = [row for row in ordered if row.rig == rig]
        ran = along(rows) if rows else ()
        advice += [in_order_words(rig, ran)] if ran else []
    return advice


def understood_page(answer: dict[str, Any]) -> str:
    """One page of what was understood."""
    lines = [f"{answer['title']}: model base{''.join(f' + {name}' for name in answer['effects'])}"]
    for rig in answer["rigs"]:
        lines += ["", *_rig_lines(rig)]
    room = width([parameter["parameter"] for parameter in answer["parameters"]], 40)
    lines += ["", f"{'parameter':{room}s}{'value':>10s}   what is known of it"]
    lines += [_parameter_line(parameter, room) for parameter in answer["parameters"]]
    lines += ["", "candidates, absent from the model, that these rows could be asked for:"]
    for candidate in answer["candidates"]:
        lines += _candidate_lines(candidate)
    lines += [] if answer["candidates"] else [f"  none: {answer['no_candidate']}"]
    notes = [*answer["warnings"], *answer["advice"]]
    return fold([*lines, *([""] if notes else []), *(f"NOTE   {note}" for note in notes)])


def _rig_lines(rig: dict[str, Any]) -> list[str]:
    rows = rig["rows"]
    law = f", contact law {rig['contact_law']}" if rig["contact_law"] else ""
    left_out = f", {rows['leave_out']} left out" if rows["leave_out"] else ""
    spans = "; ".join(f"{name} {_span(ends)}" for name, ends in rig["observables"].items())
    lines = [
        f"{rig['rig']} ({rig['engine']}{law}): {rows['fit']} rows fitted, {rows['holdout']} held out{left_out}; "
        f"{rig['readings']} readings of {spans}"
    ]
    for condition in rig["conditions"]:
        unit = "" if condition["unit"] in (None, "", "1") else f" {condition['unit']}"
        levels = condition["levels"]
        given = (
            ", ".join(map(number, levels)) if len(levels) <= MOST_LEVELS else f"{len(levels)} levels, {_span(levels)}"
        )
        said = f"{number(levels[0])}{unit}, ASSUMED: no row gives it" if condition["assumed"] else f"{given}{unit}"
        default = "required" if condition["required"] else f"default {number(condition['default'])}"
        possible = f"usual {_span(condition['usual'])}, can be {_span(condition['can_simulate'])}"
        if isinstance(condition["usual"][0], str):
            possible = f"can be {', '.join(condition['usual'])}"
        lines.append(f"  {condition['condition']}: {said} ({possible}, {default})")
    return lines


def _parameter_line(parameter: dict[str, Any], room: int) -> str:
    states = {
        "free": "free" if parameter["range"] is None else f"free, {_span(parameter['range'])}",
        "fixed": "fixed in study.toml",
        "assumed": "ASSUMED: the default",
    }
    known = f"; known for {parameter['known_rows']} rows" if parameter["known_rows"] else ""
    return (
        f"{parameter['parameter']:{room}s}{flush(number(parameter['value']), 10)}   {states[parameter['state']]}{known}"
    )


def _candidate_lines(candidate: dict[str, Any]) -> list[str]:
    unit = "" if candidate["unit"] in ("", "1") else f" {candidate['unit']}"
    lines = [
        f"  {candidate['effect']}: {candidate['means']} ({candidate['amount']}, physical {_span(candidate['physical'])}{unit})",
        *(f"    shows in {rig}: {where}" for rig, where in candidate["shows"].items()),
    ]
    if candidate["needs"]:
        lines.append(f"    {candidate['needs']}")
    return lines


def _span(ends: Sequence) -> str:
    low, high = number(ends[0]), number(ends[-1])
    return low if low == high else f"{low} to {high}"
