"""Rolling friction of a sphere on a level plate, resting on it or bouncing along: a = g mu_r / (1 + I/(m R^2)).

The speed it loses is mu_r J / (1 + I/(m R^2)) for a normal impulse J per mass, bouncing or not: the moment is mu_r R
times the normal force at every instant. A rolling spring so soft that a bounce is over before it yields falls short
of it; a moment that acts without a normal force would exceed it.
"""

if __name__ == "__main__":  # by hand: yade -x -n rolling.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from yade_scripts import laws
from yade_scripts.case import quantity
from yade_scripts.checks import sphere_scene
from yade_scripts.checks.sphere_scene import POWDER, SEED

RIG = {
    "name": "rolling",
    "contact_laws": sphere_scene.CONTACT_LAWS,
    "parameters": sphere_scene.RESTITUTION
    | sphere_scene.STATIC_FRICTION
    | sphere_scene.ROLLING_FRICTION
    | sphere_scene.DAMPING,
    "conditions": sphere_scene.RADIUS
    | {
        "speed_m_s": quantity(0.1, 0.01, 2.0, "m/s", "along the plate at the start, rolling"),
        "impact_m_s": quantity(0.0, 0.0, 1.0, "m/s", "downward at the start; 0 starts at rest on the plate"),
    },
    "effects": {},
    "numerics": sphere_scene.time_step_fraction(0.05) | sphere_scene.ROLLING_SPRING,
    "observables": {"measured_rolling_friction": "(1 + I/(m R^2)) speed lost / normal impulse per mass"},
    "random": False,
    "time_limit_s": 60.0,
}
SETTING = (
    "rolling_friction",
    "impact_m_s",
    "restitution",
    "rolling_spring",
    "cohesive_frictional_damping",
)


def expected(case: dict) -> dict:
    """The rolling friction asked for."""
    return {"measured_rolling_friction": case["parameters"]["rolling_friction"]}


def instead(case: dict) -> dict:
    """Local damping brakes; a soft spring does not yield within a bounce."""
    if case["contact_law"] == laws.LOCAL_DAMPING and case["parameters"]["cohesive_frictional_damping"] > 0:
        return {"measured_rolling_friction": (None, "local damping d brakes all that moves: (1 + d) mu_r and more")}
    if case["conditions"]["impact_m_s"] > 0:
        return {"measured_rolling_friction": (None, "a bounce is over before the soft rolling spring yields")}
    return {}


def simulate(case: dict) -> dict:
    """One run along the plate."""
    conditions = case["conditions"]
    radius = 1e-3 * conditions["radius_mm"]
    step, law = sphere_scene.one_pair(case, radius)
    overlap = sphere_scene.weight_overlap(case, radius, SEED, POWDER)
    speed, impact = conditions["speed_m_s"], conditions["impact_m_s"]
    return {"measured_rolling_friction": sphere_scene.rolling_friction(law, step, radius, overlap, speed, impact)}
