"""A plate that rings: restitution waves with the logarithm of the impact speed. Only measurements are made with it."""

from math import log2, sin, tau

EFFECT = {
    "name": "plate_resonance",
    "means": "the plate rings, so that restitution waves with the impact speed",
    "formula": "e = e0 (1 + a sin(2 pi log2(v/1 m/s)/0.6))",
    "parameters": {
        "amplitude": {"absent": 0.0, "min": 0.0, "max": 0.9, "physical": (0.0, 0.6), "unit": "1", "meaning": "a"},
    },
    "sides": 1,
    "rigs": {"rebound": "heights wave with the drop height"},
    "signature": "no trend with the drop height, but waves",
    "source": "made up: an effect that no candidate describes",
}


def restitution(e: float, speed: float, values) -> float:
    """e at a normal approach speed, m/s."""
    return min(0.95, e * (1 + values["amplitude"] * sin(tau * log2(max(speed, 1e-3)) / 0.6)))


SEED_SCENE = {"restitution": restitution}
