"""Viscoelastic restitution: the material's viscosity takes more of a faster impact."""

EFFECT = {
    "name": "viscoelastic_restitution",
    "means": "the seed is viscoelastic: faster impacts lose a larger share",
    "formula": "e = e0 (1 - A v^(1/5) + 3/5 A^2 v^(2/5)), v the normal approach speed of the contact",
    "parameters": {
        "loss": {
            "absent": 0.0, "min": 0.0, "max": 0.6, "physical": (0.0, 0.5), "unit": "(s/m)^0.2",
            "meaning": "A, share of the restitution lost at 1 m/s, to first order",
        },
    },
    "sides": 1,
    "rigs": {"rebound": "rebound height over drop height falls slowly with drop height"},
    "signature": "restitution falls slowly with impact speed, like 1 - A v^0.2, alike for all sizes",
    "source": "Ramirez et al. 1999, Physical Review E 60, 4465, doi:10.1103/PhysRevE.60.4465; "
    "Kuwabara & Kono 1987, Japanese Journal of Applied Physics 26, 1230, doi:10.1143/JJAP.26.1230",
}  # fmt: skip


def restitution(e: float, speed: float, values) -> float:
    """e (1 - A v^(1/5) + 3/5 A^2 v^(2/5)), v in m/s: the series to second order."""
    loss = values["loss"] * speed**0.2
    return e * (1 - loss + 0.6 * loss**2)


TURN = 6
SEED_SCENE = {"restitution": restitution}
