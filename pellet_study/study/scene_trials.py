"""Is an effect of the user's own continuous in the scene of a bench rig on YADE? Its functions are asked, nothing is simulated."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pellet_study.rigs.declared import Effect, Rig
from pellet_study.study.continuity import refuse_jumps

# What each place of yade_scripts/acting.py that deals in numbers asks with: typical of seeds of some mg
ASKED: Mapping[str, Sequence[tuple]] = {
    "slope_deg": [(30.0,)],
    "aspect": [(1.0,)],
    "restitution": [(0.5, 0.3), (0.5, 2.0)],
    "friction": [(0.6, 2e-5), (0.6, 2e-4)],
    "rolling": [(0.0, 0.05), (0.0, 0.5)],
    "tangential_stiffness": [(1.0,)],
    "force": [((1e-5, 0.0, -1e-4), (0.3, 0.0, -1.0), 5e-9)],
    "reading": [(10.0,)],
}


def refuse_jumps_in_scenes(effect: Effect, rigs: Sequence[Rig]) -> None:
    """Refuse an effect that jumps or moves in steps in what it answers the scene of a bench rig on YADE.

    Raises
    ------
    InputError : names the parameter, the place, where it jumps, and by how much
    """
    for place, act in effect.scenes.get("SEED_SCENE", {}).items():
        for given in ASKED.get(place, ()):
            stand_in = Rig(
                ", ".join(rig.name for rig in rigs), None, {}, {}, {place: place}, _predict(place, act, given)
            )
            tried = replace(effect, closed_form={stand_in.name: act})
            try:
                _number(act(*given, {**effect.neutral(), effect.amount: _half(effect)}))
            except Exception:  # not made for such values, as far as can be told without its scene
                continue
            refuse_jumps(stand_in, tried, {}, {})


def _half(effect: Effect) -> float:
    quantity = effect.parameters[effect.amount]
    return 0.5 * sum(quantity.get("physical", (quantity["min"], quantity["max"])))


def _number(answer: Any) -> float:
    """A place's answer as one number: a force is summed."""
    return float(np.sum(answer))


def _predict(place: str, act: Any, given: tuple) -> Any:
    """A stand-in for a rig's `predict`: what one place answers."""

    def predict(parameters: Mapping, conditions: Mapping, effects: Mapping) -> dict[str, np.ndarray]:
        if not effects:
            return {place: np.array([[_number(given[0])]])}
        [(_, values)] = effects.values()
        columns = {name: np.ravel(column) for name, column in values.items()}
        count = len(next(iter(columns.values())))
        found = []
        for k in range(count):
            try:
                found.append(_number(act(*given, {name: float(column[k]) for name, column in columns.items()})))
            except Exception:
                found.append(np.nan)  # told by YADE, in its scene
        return {place: np.array(found)[:, None]}

    return predict
