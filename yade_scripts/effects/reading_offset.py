"""Reading offset: the instrument's zero is off."""

EFFECT = {
    "name": "reading_offset",
    "means": "the zero of the instrument is off: its readings are all shifted by the same amount",
    "formula": "reading = value + offset",
    "parameters": {
        "offset": {
            "absent": 0.0, "min": -20.0, "max": 20.0, "physical": (-3.0, 3.0), "unit": "mm or deg",
            "meaning": "added to the reading (height, angle, distance), in its unit",
        },
    },
    "reads": ("rebound_height_mm", "slip_angle_deg", "roll_distance_mm"),  # a ratio of speeds has no zero of its own
    "sides": 2,
    "rigs": {
        "rebound": "low rebounds are off by the larger share",
        "slope_slip": "the same shift at every load",
        "inclined_roll": "short distances are off by the larger share",
    },
    "signature": "the same shift under all conditions",
    "source": "BIPM, Guide to the Expression of Uncertainty in Measurement, JCGM 100:2008 (systematic effect)",
}  # fmt: skip


def reading(value: float, values) -> float:
    """The reading, in the observable's unit."""
    return value + values["offset"]


TURN = 14
SEED_SCENE = {"reading": reading}
