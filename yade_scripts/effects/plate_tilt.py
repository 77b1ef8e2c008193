"""Plate tilt: the plate, or the slope, does not stand at the angle it is said to stand at."""

EFFECT = {
    "name": "plate_tilt",
    "means": "the plate or slope is steeper than its scale says",
    "formula": "angle = angle by the scale + tilt",
    "parameters": {
        "tilt_deg": {
            "absent": 0.0, "min": -10.0, "max": 10.0, "physical": (-2.0, 2.0), "unit": "deg",
            "meaning": "added to plate_tilt_deg (rebound), to the tilt (slope_slip), to slope_deg (inclined_roll)",
        },
    },
    "sides": 2,
    "rigs": {
        "rebound": "part of the rebound goes sideways; on a level plate alike for either sign",
        "slope_slip": "every slip angle reads lower by the tilt",
        "inclined_roll": "all runs are longer, those on the gentlest slope by the largest share",
    },
    "signature": "the slip angle is shifted by the tilt; the roll-out changes most on gentle slopes",
    "source": "geometry of the rigs; BIPM, JCGM 100:2008 (systematic effect)",
}  # fmt: skip


def slope_deg(angle_deg: float, values) -> float:
    """The true angle, deg."""
    return angle_deg + values["tilt_deg"]


TURN = 15
SEED_SCENE = {"slope_deg": slope_deg}
