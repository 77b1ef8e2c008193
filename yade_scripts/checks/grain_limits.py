"""Two grains pressed on each other slide, and roll: what friction, rolling friction and cohesion hold."""

if __name__ == "__main__":  # by hand: yade -x -n grain_limits.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from yade_scripts.case import quantity
from yade_scripts.checks import grain_scene, sphere_scene
from yade_scripts.checks.grain_scene import Grains

RIG = {
    "name": "grain_limits",
    "contact_laws": grain_scene.CONTACT_LAWS,
    "parameters": grain_scene.PARAMETERS | sphere_scene.STATIC_FRICTION | sphere_scene.ROLLING_FRICTION,
    "conditions": grain_scene.RADIUS
    | {"load_n": quantity(1e-3, -1e-2, 1.0, "N", "normal force between them, tension negative")},
    "effects": {},
    "numerics": grain_scene.NUMERICS,
    "observables": {
        "sliding_force_n": "tangential force while they slide",
        "rolling_force_n": "moment over radius while they roll",
    },
    "random": False,
    "time_limit_s": 120.0,
}
SETTING = (
    "load_n",
    "surface_energy_j_m2",
    "static_friction",
    "rolling_friction",
    "adhesion_load",
    "stiffness_scale",
    "restitution",
)


def _grains(case: dict) -> Grains:
    return Grains(case, case["parameters"]["static_friction"], case["parameters"]["rolling_friction"])


def expected(case: dict) -> dict:
    """mu (N + a F) and mu_r (N + a F), a (N + F) in tension (Thornton & Yin 1991 for a = 2)."""
    grains, given, load = _grains(case), case["parameters"], case["conditions"]["load_n"]
    return {
        "sliding_force_n": grains.limit(given["static_friction"], load),
        "rolling_force_n": grains.limit(given["rolling_friction"], load),
    }


def instead(case: dict) -> dict:
    """Nothing: the law can."""
    return {}


def simulate(case: dict) -> dict:
    """One slide, one roll."""
    sliding, rolling = grain_scene.limits(_grains(case), case["conditions"]["load_n"])
    return {"sliding_force_n": sliding, "rolling_force_n": rolling}
