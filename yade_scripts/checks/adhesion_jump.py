"""Does anything jump where the surface energy becomes positive? Restitution and rolling friction on both sides."""

if __name__ == "__main__":  # by hand: yade -x -n adhesion_jump.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from yade_scripts.case import quantity
from yade_scripts.checks import sphere_scene
from yade_scripts.checks.sphere_scene import POWDER, SEED

RIG = {
    "name": "adhesion_jump",
    "contact_laws": sphere_scene.CONTACT_LAWS,
    "parameters": sphere_scene.RESTITUTION
    | sphere_scene.STATIC_FRICTION
    | sphere_scene.ROLLING_FRICTION
    | {"surface_energy_j_m2": quantity(1e-7, 1e-9, 1e-3, "J/m2", "next to none")}
    | sphere_scene.DAMPING,
    "conditions": sphere_scene.SPEED | sphere_scene.RADIUS,
    "effects": {},
    "numerics": sphere_scene.time_step_fraction(0.01) | sphere_scene.ROLLING_SPRING,
    "observables": {
        "restitution_jump": "restitution with the surface energy less that without",
        "rolling_friction_jump": "rolling friction of a bouncing sphere with the surface energy less that without",
    },
    "random": False,
    "time_limit_s": 60.0,
}
SETTING = ("restitution", "rolling_friction", "speed_m_s", "surface_energy_j_m2")


def expected(case: dict) -> dict:
    """No jump."""
    return {"restitution_jump": 0.0, "rolling_friction_jump": 0.0}


def instead(case: dict) -> dict:
    """Nothing: the laws can."""
    return {}


def simulate(case: dict) -> dict:
    """Two impacts, two runs along the plate."""
    radius, speed = 1e-3 * case["conditions"]["radius_mm"], case["conditions"]["speed_m_s"]
    without = {**case, "parameters": case["parameters"] | {"surface_energy_j_m2": 0.0}}
    overlap = sphere_scene.weight_overlap(case, radius, SEED, POWDER)

    def read(one: dict) -> tuple[float, float]:
        step, law = sphere_scene.one_pair(one, radius)
        bounce = sphere_scene.bounce(law, step, radius, speed)
        return bounce["restitution"], sphere_scene.rolling_friction(law, step, radius, overlap, 0.1, 0.05)

    (restitution, rolling), (restitution_0, rolling_0) = read(case), read(without)
    return {"restitution_jump": restitution - restitution_0, "rolling_friction_jump": rolling - rolling_0}
