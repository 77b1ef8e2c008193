"""Amplification: grains drawn larger than they are do not keep the powder's cohesion as the scaling rule says."""

EFFECT = {
    "name": "amplification_size",
    "means": "the angle depends on the amplification itself: the rule that scales the surface energy is not the right one",
    "formula": "Gamma_k = Gamma (k/6)^(m - q), m the study's rule (2 keeps the Bond number), q its error",
    "parameters": {
        "exponent_error": {
            "absent": 0.0, "min": -2.0, "max": 2.0, "physical": (-1.0, 2.0), "unit": "1",
            "meaning": "q; 1 where pull-off should grow with the area of a grain, 2 where the energy should stay as it is",
        },
    },
    "sides": 2,
    "rigs": {"repose": "heaps of other amplifications than 6 come out steeper or flatter; none without cohesion"},
    "signature": "the angle drifts with the amplification, and with nothing else",
    "source": "Thakur, Ooi & Ahmadian, Scaling of discrete element model parameters for cohesionless and cohesive solid, "
    "Powder Technology (2015)",
}  # fmt: skip


def other_rule(exponent: float, values) -> float:
    """Exponent of the amplification in the surface energy."""
    return exponent - values["exponent_error"]


TURN = 16
POWDER_SCENE = {"exponent": other_rule}
