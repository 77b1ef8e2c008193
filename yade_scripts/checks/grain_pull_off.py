"""Two cohesive grains are drawn apart, slowly and fast: the damper must not add to the pull-off force."""

if __name__ == "__main__":  # by hand: yade -x -n grain_pull_off.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from yade_scripts.case import quantity
from yade_scripts.checks import grain_scene
from yade_scripts.checks.grain_scene import Grains

RIG = {
    "name": "grain_pull_off",
    "contact_laws": grain_scene.CONTACT_LAWS,
    "parameters": grain_scene.PARAMETERS
    | {"surface_energy_j_m2": quantity(0.2, 1e-4, 1.0, "J/m2", "JKR surface energy")},
    "conditions": grain_scene.RADIUS
    | {"apart_mm_s": quantity(1.0, 0.01, 500.0, "mm/s", "speed at which they are drawn apart")},
    "effects": {},
    "numerics": grain_scene.NUMERICS
    | {"time_step_fraction": quantity(0.01, 0.0005, 0.25, "1", "of the Rayleigh step")},
    "observables": {"pull_off_n": "largest tension"},
    "random": False,
    "time_limit_s": 120.0,
}
SETTING = ("apart_mm_s", "restitution", "surface_energy_j_m2", "adhesion_load", "stiffness_scale")
TOLERANCE = {"pull_off_n": (0.05, 0.0)}


def expected(case: dict) -> dict:
    """3/2 pi Gamma R/2."""
    return {"pull_off_n": Grains(case).pull}


def instead(case: dict) -> dict:
    """Nothing: the law can."""
    return {}


def simulate(case: dict) -> dict:
    """One pull."""
    return {"pull_off_n": grain_scene.pull_off(Grains(case), 1e-3 * case["conditions"]["apart_mm_s"])}
