"""Adhesion: seed and plate attract each other where they touch."""

EFFECT = {
    "name": "adhesion",
    "means": "the seed sticks to the powder plate where they touch",
    "formula": "F = 3/2 pi Gamma R at each member sphere that touches; sliding at mu (N + F), rolling at mu_r R (N + F)",
    "parameters": {
        "surface_energy": {
            "absent": 0.0, "min": 0.0, "max": 2e-3, "physical": (0.0, 1e-3), "unit": "J/m2",
            "meaning": "Gamma, effective for the rough contact of a member sphere; a flat seed touches with six",
        },
    },
    "sides": 1,
    "rigs": {
        "rebound": "slow and small rebounds are lower; hardly seen in seeds of 2 mm",
        "slope_slip": "light seeds hold to steeper angles, tan a = mu (1 + F/N)",
        "inclined_roll": "all runs are shorter, small seeds' most: mu_r (1 + F/N)",
    },
    "signature": "the slip angle rises as the load falls, like 1/load, and for small seeds like 1/length^2",
    "source": "Johnson, Kendall & Roberts 1971, doi:10.1098/rspa.1971.0141 (pull-off); "
    "Derjaguin, Muller & Toporov 1975, doi:10.1016/0021-9797(75)90018-1 (the law in the run)",
}  # fmt: skip


def contact(pair, values):
    """The contact pair with its surface energy raised, J/m2."""
    return pair._replace(surface_energy=pair.surface_energy + values["surface_energy"])


TURN = 8
SEED_SCENE = {"contact": contact}
