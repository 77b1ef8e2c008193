"""Sliding friction of a sphere that cannot roll on a tilted plate: from its acceleration, and the tilt where it slips.

a = g (sin(tilt) - mu cos(tilt)) once it slides; it slips at tan(tilt) = mu.
"""

if __name__ == "__main__":  # by hand: yade -x -n sliding.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from math import atan, degrees, radians, tan

from yade_scripts.case import quantity
from yade_scripts.checks import sphere_scene
from yade_scripts.checks.sphere_scene import POWDER, SEED

RIG = {
    "name": "sliding",
    "contact_laws": sphere_scene.CONTACT_LAWS,
    "parameters": sphere_scene.RESTITUTION | sphere_scene.STATIC_FRICTION | sphere_scene.DAMPING,
    "conditions": sphere_scene.RADIUS
    | {"steeper_deg": quantity(5.0, 0.5, 30.0, "deg", "slope of the slide above the angle of friction")},
    "effects": {},
    "numerics": sphere_scene.time_step_fraction(0.05),
    "observables": {
        "effective_friction": "tan(tilt) - a/(g cos(tilt)) while it slides",
        "slip_angle_deg": "tilt at which it starts to slide",
    },
    "random": False,
    "time_limit_s": 60.0,
}
SETTING = ("static_friction", "steeper_deg", "restitution", "cohesive_frictional_damping")


def _slope(case: dict) -> float:
    """Slope of the slide, rad."""
    return atan(case["parameters"]["static_friction"]) + radians(case["conditions"]["steeper_deg"])


def expected(case: dict) -> dict:
    """mu and atan(mu)."""
    friction = case["parameters"]["static_friction"]
    return {"effective_friction": friction, "slip_angle_deg": degrees(atan(friction))}


def instead(case: dict) -> dict:
    """Local damping takes the share d off the force that moves the sphere."""
    damping = case["parameters"]["cohesive_frictional_damping"]
    if case["contact_law"] == "hertz_mindlin" or damping == 0:
        return {}
    friction = case["parameters"]["static_friction"]
    closed_form = friction + damping * (tan(_slope(case)) - friction)
    return {"effective_friction": (closed_form, "local damping d slows the slide: mu + d (tan(tilt) - mu)")}


def simulate(case: dict) -> dict:
    """One slide, one search for the angle."""
    radius = 1e-3 * case["conditions"]["radius_mm"]
    step, law = sphere_scene.one_pair(case, radius)
    overlap = sphere_scene.weight_overlap(case, radius, SEED, POWDER)
    return {
        "effective_friction": sphere_scene.slope_friction(law, step, radius, overlap, _slope(case)),
        "slip_angle_deg": degrees(sphere_scene.slip_angle(law, step, radius, overlap)),
    }
