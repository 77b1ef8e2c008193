"""Seed shape: the seed is more slender or stouter than the one taken."""

EFFECT = {
    "name": "seed_shape",
    "means": "the seeds are more slender or stouter than the measured mean",
    "formula": "length/width = 1.69 f at the same length; the cross-section keeps its proportions",
    "parameters": {
        "aspect_factor": {
            "absent": 1.0, "min": 0.75, "max": 1.6, "physical": (0.75, 1.25), "unit": "1",
            "meaning": "f, length over width as a share of the measured 1.69",
        },
    },
    "sides": 2,
    "rigs": {
        "rebound": "the share of the fall that turns into spin, about the same at every height",
        "slope_slip": "stout seeds tip over before they slide",
        "inclined_roll": "stout seeds roll more readily and farther",
    },
    "signature": "rebounds from all drop heights change by about the same factor; the slip angle has a ceiling that friction does not lift",
    "source": "Journal of Biology, Agriculture and Healthcare, article 43338 (measured proportions); "
    "Montaine et al. 2011, Physical Review E 84, 041306, doi:10.1103/PhysRevE.84.041306 (scatter by shape)",
}  # fmt: skip


def aspect(factor: float, values) -> float:
    """Length over width as a share of the measured one."""
    return factor * values["aspect_factor"]


TURN = 13
SEED_SCENE = {"aspect": aspect}
