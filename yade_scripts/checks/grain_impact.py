"""Two grains head on: restitution with and without cohesion, and the speed below which they stick."""

if __name__ == "__main__":  # by hand: yade -x -n grain_impact.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from math import sqrt

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
        "sticking_speed_m_s": "below it they stick, mean over the phases; none without cohesion",
    },
    "random": False,
    "time_limit_s": 120.0,
}
SETTING = ("restitution", "speed_m_s", "surface_energy_j_m2", "adhesion_load", "time_step_fraction", "stiffness_scale")
TOLERANCE = {"measured_restitution": (0.0, 0.03), "sticking_speed_m_s": (0.15, 0.0)}  # relative, absolute


def expected(case: dict) -> dict:
    """sqrt(e^2 (v^2 + w) - w)/v, and sqrt(w (1 - e^2))/e, w = a F^2/(k m*)."""
    grains = Grains(case)
    asked = {"measured_restitution": grains.expected_restitution(case["conditions"]["speed_m_s"])}
    return asked | ({"sticking_speed_m_s": grains.sticking_speed} if grains.pull else {})


def instead(case: dict) -> dict:
    """A slow grain without much of a damper notices that the attraction begins a step after the touch."""
    if case["parameters"]["restitution"] > 0.5 and case["parameters"]["surface_energy_j_m2"] > 0:
        late = (
            "the attraction begins a step after the touch, and ends at it: energy is lost that counts where e is high"
        )
        return dict.fromkeys(("measured_restitution", "sticking_speed_m_s"), (None, late))
    return {}


def simulate(case: dict) -> dict:
    """An impact for each phase, and where there is cohesion a search for the speed."""
    grains, phases = Grains(case), [(k + 0.5) / grain_scene.PHASES for k in range(grain_scene.PHASES)]
    left = [grain_scene.impact(grains, case["conditions"]["speed_m_s"], phase) for phase in phases]
    sticks = [sticking_speed(grains, phase) for phase in phases] if grains.pull else None
    return {
        "measured_restitution": sum(left) / len(left),
        "sticking_speed_m_s": sum(sticks) / len(sticks) if sticks else None,
    }


def sticking_speed(grains: Grains, phase: float) -> float:
    """By halving, within 2 %, between a third and three times the closed form's, m/s."""
    low, high = grains.sticking_speed / 3, grains.sticking_speed * 3
    while high / low > 1.02:
        middle = sqrt(low * high)
        low, high = (low, middle) if grain_scene.impact(grains, middle, phase) else (middle, high)
    return sqrt(low * high)
