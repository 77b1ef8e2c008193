"""Restitution of a single sphere that hits a plate head on, against the one asked for."""

if __name__ == "__main__":  # by hand: yade -x -n restitution.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from yade_scripts import laws
from yade_scripts.checks import sphere_scene
from yade_scripts.checks.sphere_scene import local_damping_restitution

RIG = {
    "name": "restitution",
    "contact_laws": sphere_scene.CONTACT_LAWS,
    "parameters": sphere_scene.RESTITUTION | sphere_scene.SURFACE_ENERGY | sphere_scene.DAMPING,
    "conditions": sphere_scene.SPEED | sphere_scene.RADIUS,
    "effects": {},
    "numerics": sphere_scene.time_step_fraction(0.005),
    "observables": {"measured_restitution": "speed after over before"},
    "random": False,
    "time_limit_s": 60.0,
}
SETTING = (
    "restitution",
    "speed_m_s",
    "surface_energy_j_m2",
    "cohesive_frictional_damping",
    "time_step_fraction",
)


def expected(case: dict) -> dict:
    """The restitution asked for."""
    return {"measured_restitution": case["parameters"]["restitution"]}


def instead(case: dict) -> dict:
    """Local damping alone in the cohesive-frictional law; adhesion and a coarse time step in the other."""
    parameters = case["parameters"]
    if case["contact_law"] == laws.LOCAL_DAMPING:
        closed_form = local_damping_restitution(parameters["cohesive_frictional_damping"])
        return {"measured_restitution": (closed_form, "no damper in the law: local damping d gives sqrt((1-d)/(1+d))")}
    if parameters["surface_energy_j_m2"] > 0:
        return {"measured_restitution": (None, "with adhesion the damper may pull, as far as the pull-off force")}
    if case["numerics"]["time_step_fraction"] > 0.01:
        return {
            "measured_restitution": (None, "time step too long for a strong damper; the error falls in step with dt")
        }
    return {}


def simulate(case: dict) -> dict:
    """One impact."""
    radius = 1e-3 * case["conditions"]["radius_mm"]
    step, law = sphere_scene.one_pair(case, radius)
    bounce = sphere_scene.bounce(law, step, radius, case["conditions"]["speed_m_s"])
    return {"measured_restitution": bounce["restitution"]}
