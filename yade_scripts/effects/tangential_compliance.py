"""Tangential compliance: the contact gives way sideways more than Mindlin's smooth elastic one."""

EFFECT = {
    "name": "tangential_compliance",
    "means": "the seed's coat gives way sideways: the contact stores less of a tangential impact",
    "formula": "kt = kt0 / (1 + c), kt0 Mindlin's stiffness 8 G* sqrt(R* x)",
    "parameters": {
        "added_compliance": {
            "absent": 0.0, "min": 0.0, "max": 30.0, "physical": (0.0, 10.0), "unit": "1",
            "meaning": "c, tangential compliance beyond Mindlin's, as a share of it",
        },
    },
    "sides": 1,
    "rigs": {
        "rebound": "on a tilted plate the speed along the plate after the impact changes",
        "inclined_roll": "bouncing seeds take up spin differently",
    },
    "signature": "speed along a tilted plate changes where the contact sticks (steep impact, high friction), not where it slides",
    "source": "Maw, Barber & Fawcett 1976, Wear 38, 101, doi:10.1016/0043-1648(76)90201-5",
}  # fmt: skip


def tangential_stiffness(share: float, values) -> float:
    """Share of Mindlin's tangential stiffness: 1/(1 + c)."""
    return share / (1 + values["added_compliance"])


TURN = 12
SEED_SCENE = {"tangential_stiffness": tangential_stiffness}
