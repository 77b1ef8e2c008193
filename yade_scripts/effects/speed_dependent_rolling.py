"""Speed-dependent rolling: rolling resistance grows with the rolling speed."""

EFFECT = {
    "name": "speed_dependent_rolling",
    "means": "rolling resistance grows with the rolling speed (viscous loss in the contact)",
    "formula": "M = (mu_r + k v) R N, v = R |rolling angular velocity|, at each member sphere that touches",
    "parameters": {
        "slope": {
            "absent": 0.0, "min": 0.0, "max": 1.0, "physical": (0.0, 0.3), "unit": "s/m",
            "meaning": "k, growth of the rolling friction coefficient with the rolling speed",
        },
    },
    "sides": 1,
    "rigs": {"inclined_roll": "long and steep runs end earlier than the short ones promise"},
    "signature": "the effective rolling friction rises with release distance and slope, alike for all sizes",
    "source": "Brilliantov & Poeschel 1998, Europhysics Letters 42, 511, doi:10.1209/epl/i1998-00281-7; "
    "Zhou et al. 1999, Physica A 269, 536, doi:10.1016/S0378-4371(99)00183-1",
}  # fmt: skip


def rolling(coefficient: float, speed: float, values) -> float:
    """Rolling friction coefficient beyond the constant one, with k v added (v in m/s)."""
    return coefficient + values["slope"] * speed


TURN = 10
SEED_SCENE = {"rolling": rolling}
