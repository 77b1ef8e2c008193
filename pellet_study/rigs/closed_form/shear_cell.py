"""Shear cell: at which shear stress does a bed yield under a normal stress?  tau = mu sigma."""

from collections.abc import Mapping
from typing import Any

RIG = {
    "name": "shear_cell",
    "parameters": {
        "internal_friction": {
            "default": 0.5,
            "min": 0.0,
            "max": 3.0,
            "unit": "1",
            "meaning": "tangent of the angle of internal friction, mu",
        },
    },
    "conditions": {
        "normal_stress_pa": {
            "default": 1000.0,
            "min": 100.0,
            "max": 10000.0,
            "positive": True,
            "unit": "Pa",
            "meaning": "normal stress, sigma",
        },
    },
    "observables": {"shear_stress_pa": {"unit": "Pa", "meaning": "shear stress at yield, tau"}},
}


def predict(parameters: Mapping, conditions: Mapping, effects: Mapping) -> dict[str, Any]:
    """tau = mu sigma, Pa, and what the effects present make of it."""
    normal = conditions["normal_stress_pa"]
    stress = parameters["internal_friction"] * normal
    for act, values in effects.values():
        stress = act(stress, normal, conditions, values)
    return {"shear_stress_pa": stress}


def normal_stress(conditions: Mapping, values: Any) -> Any:
    """Normal stress of each row, Pa."""
    return conditions["normal_stress_pa"]
