"""Friction that peaks at one load. Only measurements are made with it."""

from math import exp, log

EFFECT = {
    "name": "friction_hump",
    "means": "friction peaks at one load",
    "formula": "mu = mu0 (1 + a exp(-(ln(N/40 uN)/0.5)^2 / 2))",
    "parameters": {
        "amplitude": {"absent": 0.0, "min": 0.0, "max": 1.0, "physical": (0.0, 0.5), "unit": "1", "meaning": "a"},
    },
    "sides": 1,
    "rigs": {"slope_slip": "seeds of a middle load hold to steeper angles"},
    "signature": "no trend with the load, but a peak",
    "source": "made up: an effect that no candidate describes",
}


def friction(mu: float, load: float, values) -> float:
    """mu under a normal load, N."""
    return mu * (1 + values["amplitude"] * exp(-0.5 * (log(max(load, 1e-9) / 4e-5) / 0.5) ** 2))


SEED_SCENE = {"friction": friction}
