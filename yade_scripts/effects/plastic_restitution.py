"""Plastic restitution: above a yield speed the contact is crushed for good."""

from math import sqrt

EFFECT = {
    "name": "plastic_restitution",
    "means": "the seed yields at the contact: impacts faster than a yield speed leave a dent",
    "formula": "e = e0 T(vy/v) above vy; T(y) = sqrt(6 sqrt(3)/5 (1 - y^2/6)) (y/(y + 2 sqrt((6 - y^2)/5)))^(1/4)",
    "parameters": {
        "inverse_yield_speed": {
            "absent": 0.0, "min": 0.0, "max": 40.0, "physical": (0.0, 10.0), "unit": "s/m",
            "meaning": "1/vy, one over the speed at which yielding begins",
        },
    },
    "sides": 1,
    "rigs": {"rebound": "rebound height over drop height is level for low drops and falls for high ones"},
    "signature": "restitution level at low speed, falling towards v^(-1/4) above the yield speed, alike for all sizes",
    "source": "Thornton 1997, Journal of Applied Mechanics 64, 383, doi:10.1115/1.2787319",
}  # fmt: skip


def restitution(e: float, speed: float, values) -> float:
    """Thornton's elastic, perfectly plastic sphere: e above the yield speed falls towards 1.185 e (vy/v)^(1/4)."""
    if speed * values["inverse_yield_speed"] <= 1:
        return e
    y = 1 / (speed * values["inverse_yield_speed"])
    return e * sqrt(1.2 * sqrt(3) * (1 - y**2 / 6)) * (y / (y + 2 * sqrt(1.2 - 0.2 * y**2))) ** 0.25


TURN = 7
SEED_SCENE = {"restitution": restitution}
