"""Load-dependent friction: the friction coefficient falls as the seed presses harder."""

REFERENCE_LOAD = 2e-5  # N, about the weight of a seed of 2.2 mm
LEAST = 1e-3  # of the reference load: below it the coefficient rises no more

EFFECT = {
    "name": "load_dependent_friction",
    "means": "contact area grows less than the load, so static friction falls with the load",
    "formula": "mu = mu0 (N/N0)^-n, N the seed's whole normal load, N0 = 20 uN",
    "parameters": {
        "load_exponent": {
            "absent": 0.0, "min": 0.0, "max": 0.5, "physical": (0.0, 1 / 3), "unit": "1",
            "meaning": "n; 1/3 is a smooth elastic (Hertz) contact",
        },
    },
    "sides": 1,
    "rigs": {
        "slope_slip": "loaded and large seeds slip earlier, by a power of the load",
        "inclined_roll": "heavy seeds slip more easily instead of rolling",
    },
    "signature": "the tangent of the slip angle falls as a small power of the load",
    "source": "Archard 1957, Proceedings of the Royal Society A 243, 190, doi:10.1098/rspa.1957.0214",
}  # fmt: skip


def friction(mu: float, load: float, values) -> float:
    """mu (N/N0)^-n, N in N."""
    return mu * max(load / REFERENCE_LOAD, LEAST) ** -values["load_exponent"]


TURN = 11
SEED_SCENE = {"friction": friction}
