"""Two spinning grains meet aslant: is energy gained at any time?"""

if __name__ == "__main__":  # by hand: yade -x -n grain_energy.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from math import radians

from yade_scripts.case import quantity
from yade_scripts.checks import grain_scene, sphere_scene
from yade_scripts.checks.grain_scene import Grains

RIG = {
    "name": "grain_energy",
    "contact_laws": grain_scene.CONTACT_LAWS,
    "parameters": grain_scene.PARAMETERS | sphere_scene.STATIC_FRICTION | sphere_scene.ROLLING_FRICTION,
    "conditions": grain_scene.RADIUS
    | {
        "speed_m_s": quantity(0.5, 0.01, 10.0, "m/s", "of the impact"),
        "aslant_deg": quantity(35.0, 0.0, 80.0, "deg", "between the velocity and the line of centres"),
        "spin_rad_s": quantity(200.0, 0.0, 5000.0, "rad/s", "of both grains"),
    },
    "effects": {},
    "numerics": grain_scene.NUMERICS,
    "observables": {"energy_gained": "largest kinetic energy over that before, less 1; 0 where none is gained"},
    "random": False,
    "time_limit_s": 120.0,
}
SETTING = ("restitution", "aslant_deg", "spin_rad_s", "surface_energy_j_m2", "speed_m_s")


def expected(case: dict) -> dict:
    """None."""
    return {"energy_gained": 0.0}


def instead(case: dict) -> dict:
    """Nothing: the law can."""
    return {}


def simulate(case: dict) -> dict:
    """One impact."""
    given, conditions = case["parameters"], case["conditions"]
    grains = Grains(case, given["static_friction"], given["rolling_friction"])
    aslant = radians(conditions["aslant_deg"])
    return {
        "energy_gained": grain_scene.energy_gained(grains, conditions["speed_m_s"], aslant, conditions["spin_rad_s"])
    }
