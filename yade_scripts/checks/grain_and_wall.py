"""A grain of the law on steel: its pair keeps its own constants."""

if __name__ == "__main__":  # by hand: yade -x -n grain_and_wall.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from yade_scripts.case import quantity
from yade_scripts.checks import grain_scene, sphere_scene
from yade_scripts.checks.grain_scene import Grains
from yade_scripts.contacts import Pair

RIG = {
    "name": "grain_and_wall",
    "contact_laws": grain_scene.CONTACT_LAWS,
    "parameters": grain_scene.PARAMETERS
    | {
        "steel_restitution": quantity(0.3, 0.05, 0.95, "1", "asked of the pair"),
        "steel_static_friction": quantity(0.3, 0.0, 1.5, "1", "asked of the pair"),
        "steel_rolling_friction": quantity(0.1, 0.0, 1.0, "1", "asked of the pair"),
    },
    "conditions": grain_scene.RADIUS | {"speed_m_s": quantity(0.3, 1e-4, 10.0, "m/s", "of the impact")},
    "effects": {},
    "numerics": grain_scene.NUMERICS
    | {"time_step_fraction": quantity(0.01, 0.0005, 0.25, "1", "of the Rayleigh step")},
    "observables": {
        "measured_restitution": "speed after over before",
        "static_friction": "tangential over normal force while it slides",
        "rolling_friction": "moment over radius times normal force while it rolls",
        "pull_off_n": "largest tension: walls are not sticky",
    },
    "random": False,
    "time_limit_s": 120.0,
}
SETTING = ("steel_restitution", "restitution", "surface_energy_j_m2", "speed_m_s")
TOLERANCE = {"measured_restitution": (0.0, 0.03)}  # relative, absolute


def _grains(case: dict) -> Grains:
    given = case["parameters"]
    walls = Pair(*(given[f"steel_{k}"] for k in ("restitution", "static_friction", "rolling_friction")))
    return Grains(case, 0.8, 0.35, walls)


def expected(case: dict) -> dict:
    """What the pair is asked for."""
    walls = {k: case["parameters"][f"steel_{k}"] for k in ("restitution", "static_friction", "rolling_friction")}
    return {
        "measured_restitution": walls["restitution"],
        "static_friction": walls["static_friction"],
        "rolling_friction": walls["rolling_friction"],
        "pull_off_n": 0.0,
    }


def instead(case: dict) -> dict:
    """Nothing: the law can."""
    return {}


def simulate(case: dict) -> dict:
    """An impact, a slide, a roll, a pull."""
    grains = _grains(case)
    law, step, radius = grains.law(), grains.time_step, grains.radius
    pressed = sphere_scene.pressed(law, step, radius, 1e-3 * radius)
    return {
        "measured_restitution": grain_scene.impact(grains, case["conditions"]["speed_m_s"], plate=True),
        **pressed,
        "pull_off_n": sphere_scene.pull_off(grains.law(), step, radius),
    }
