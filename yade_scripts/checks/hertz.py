"""Stiffness of the contact of a sphere and a plate: force at an overlap, and duration of an impact.

Hertz: F = 4/3 E* R^(1/2) overlap^(3/2) and T = 2.868 (m^2/(R E*^2 v))^(1/5) for an elastic impact (Johnson 1985,
Contact Mechanics, eqs. 4.22 and 11.24; the constant is 2.943 (15/16)^(2/5)). The impact is asked to be nearly elastic.
The cohesive-frictional law is linear: F = k overlap and T = pi (m/k)^(1/2), without damping.
"""

if __name__ == "__main__":  # by hand: yade -x -n hertz.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from math import pi, sqrt

from yade_scripts import laws
from yade_scripts.case import quantity
from yade_scripts.checks import sphere_scene
from yade_scripts.checks.sphere_scene import POWDER, SEED

RIG = {
    "name": "hertz",
    "contact_laws": sphere_scene.CONTACT_LAWS,
    "parameters": {
        "restitution": quantity(0.95, 0.05, 0.95, "1", "asked of the pair"),
        "cohesive_frictional_damping": quantity(0.0, 0.0, 0.0, "1", "none, for the closed form"),
    },
    "conditions": sphere_scene.SPEED
    | sphere_scene.RADIUS
    | {"overlap_share": quantity(0.01, 1e-5, 0.1, "1", "overlap over radius, for the force")},
    "effects": {},
    "numerics": sphere_scene.time_step_fraction(0.01),
    "observables": {"force_n": "force at the overlap", "contact_time_s": "duration of the impact"},
    "random": False,
    "time_limit_s": 60.0,
}
SETTING = ("speed_m_s", "radius_mm", "overlap_share")


def expected(case: dict) -> dict:
    """Force and contact time of the closed form."""
    conditions = case["conditions"]
    radius = 1e-3 * conditions["radius_mm"]
    overlap, mass = conditions["overlap_share"] * radius, sphere_scene.sphere_mass(radius, SEED)
    if case["contact_law"] == laws.LOCAL_DAMPING:
        stiffness = sphere_scene.linear_stiffness(radius, SEED, POWDER)
        return {"force_n": stiffness * overlap, "contact_time_s": pi * sqrt(mass / stiffness)}
    modulus = sphere_scene.effective_modulus(SEED, POWDER)
    return {
        "force_n": sphere_scene.hertz_force(overlap, radius, modulus),
        "contact_time_s": 2.868 * (mass**2 / (radius * modulus**2 * conditions["speed_m_s"])) ** 0.2,
    }


def instead(case: dict) -> dict:
    """Nothing: the laws can."""
    return {}


def simulate(case: dict) -> dict:
    """One overlap held, one impact."""
    conditions = case["conditions"]
    radius = 1e-3 * conditions["radius_mm"]
    step, law = sphere_scene.one_pair(case, radius)
    return {
        "force_n": sphere_scene.normal_force(law, step, radius, conditions["overlap_share"] * radius),
        "contact_time_s": sphere_scene.bounce(law, step, radius, conditions["speed_m_s"])["contact_time_s"],
    }
