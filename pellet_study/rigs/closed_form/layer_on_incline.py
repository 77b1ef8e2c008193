"""Layer on an incline: at which angle does a layer of grains start to slide?

    tan a = mu + c / (rho g h cos a)

The balance rho g h sin a = tau(sigma), sigma = rho g h cos a, is solved for the angle by bisection.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

RIG = {
    "name": "layer_on_incline",
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
        "layer_height_mm": {
            "default": 20.0,
            "min": 2.0,
            "max": 100.0,
            "positive": True,
            "unit": "mm",
            "meaning": "height across the layer, h",
        },
        "particle_diameter_mm": {
            "default": 1.0,
            "min": 0.1,
            "max": 5.0,
            "positive": True,
            "of_material": True,
            "unit": "mm",
            "meaning": "grain diameter, d",
        },
        "bulk_density_kg_m3": {
            "default": 1400.0,
            "min": 200.0,
            "max": 5000.0,
            "positive": True,
            "of_material": True,
            "unit": "kg/m3",
            "meaning": "bulk density, rho",
        },
        "channel_width_mm": {
            "default": 100.0,
            "min": 10.0,
            "max": 1000.0,
            "limits": (1.0, 1e12),  # as wide as one likes: no side walls
            "positive": True,
            "unit": "mm",
            "meaning": "width between side walls, W",
        },
    },
    "observables": {"slip_angle_deg": {"unit": "deg", "meaning": "angle at which the layer starts to slide, a"}},
    "readable": {"slip_angle_deg": (0.0, 80.0)},
}

GRAVITY = 9.81  # m/s2
BISECTIONS = 22
NEWTON_STEPS = 3


def predict(parameters: Mapping, conditions: Mapping, effects: Mapping) -> dict[str, Any]:
    """Slip angle, deg; 90 where the layer never slides."""
    weight = conditions["bulk_density_kg_m3"] * GRAVITY * 1e-3 * conditions["layer_height_mm"]  # rho g h, Pa
    friction = parameters["internal_friction"]

    def excess(sine: Any, cosine: Any) -> Any:
        """Driving less carried stress over rho g h; grows with the angle."""
        normal = weight * cosine
        carried = friction * normal
        for act, values in effects.values():
            carried = act(carried, normal, conditions, values)
        return sine - carried / weight

    if not effects:
        return {"slip_angle_deg": np.degrees(np.arctan(friction + 0 * weight))}
    shape = np.broadcast_shapes(
        np.shape(friction),
        np.shape(weight),
        *(np.shape(v) for _, values in effects.values() for v in values.values()),
    )
    half, step = np.full(shape, 0.5), 0.25  # of the angle's tangent over 1 + it: nothing to compute but a root
    for _ in range(BISECTIONS):
        length = np.sqrt(half * half + (1 - half) ** 2)
        half = np.where(excess(half / length, (1 - half) / length) > 0, half - step, half + step)
        step *= 0.5
    angle = np.arctan2(half, 1 - half)
    for _ in range(NEWTON_STEPS):  # secant slope over a small step: full accuracy for finite differences
        here = excess(np.sin(angle), np.cos(angle))
        slope = (excess(np.sin(angle + 1e-6), np.cos(angle + 1e-6)) - here) / 1e-6
        angle = np.clip(angle - here / np.where(slope > 1e-3, slope, np.inf), 0.0, np.pi / 2 - 1e-9)
    return {"slip_angle_deg": np.degrees(angle)}


def normal_stress(conditions: Mapping, values: Any) -> Any:
    """Normal stress rho g h cos a of each row at its measured angle, Pa."""
    weight = conditions["bulk_density_kg_m3"] * GRAVITY * 1e-3 * conditions["layer_height_mm"]
    return weight * np.cos(np.radians(values))
