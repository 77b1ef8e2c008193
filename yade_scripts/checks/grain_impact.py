"""Two grains head on: restitution with and without cohesion."""

if __name__ == "__main__":  # by hand: yade -x -n grain_impact.py cases.json observables.csv
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
    "name": "grain_impact",
    "contact_laws": grain_scene.CONTACT_LAWS,
    "parameters": grain_scene.PARAMETERS,
    "conditions": grain_scene.RADIUS | {"speed_m_s": quantity(1.0, 1e-4, 10.0, "m/s", "of the impact")},
    "effects": {},
    "numerics": grain_scene.NUMERICS,
    "observables": {
        "measured_restitution": "speed after over before, mean over the phases of the first step",
    },
    "random": False,
    "time_limit_s": 120.0,
}
SETTING = ("restitution", "speed_m_s", "surface_energy_j_m2", "adhesion_load", "time_step_fraction", "stiffness_scale")
TOLERANCE = {"measured_restitution": (0.0, 0.03)}  # relative, absolute


def expected(case: dict) -> dict:
    """sqrt(e^2 (v^2 + w) - w)/v, w = a F^2/(k m*)."""
    return {"measured_restitution": Grains(case).expected_restitution(case["conditions"]["speed_m_s"])}


def instead(case: dict) -> dict:
    """About the sticking speed the phase of the first step decides whether they part."""
    grains, speed = Grains(case), case["conditions"]["speed_m_s"]
    if 0.8 < speed / (grains.sticking_speed or 1e-9) < 1.2:
        return {
            "measured_restitution": (
                None,
                "at the sticking speed the phase of the first step decides whether they part",
            )
        }
    return {}


def simulate(case: dict) -> dict:
    """An impact for each phase."""
    grains, speed = Grains(case), case["conditions"]["speed_m_s"]
    left = [grain_scene.impact(grains, speed, phase) for phase in grain_scene.PHASES]
    return {"measured_restitution": sum(left) / len(left)}
