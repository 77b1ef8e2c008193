"""Force that draws a sphere off a plate or off another sphere, against JKR's 3/2 pi Gamma R*."""

if __name__ == "__main__":  # by hand: yade -x -n pull_off.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from math import pi

from yade_scripts import contacts, laws
from yade_scripts.case import quantity
from yade_scripts.checks import sphere_scene
from yade_scripts.checks.sphere_scene import POWDER

RIG = {
    "name": "pull_off",
    "contact_laws": sphere_scene.CONTACT_LAWS,
    "parameters": sphere_scene.RESTITUTION
    | {"surface_energy_j_m2": quantity(0.05, 0.0, 1.0, "J/m2", "JKR surface energy asked of the pair")}
    | sphere_scene.DAMPING,
    "conditions": {
        "radius_mm": quantity(0.26, 0.05, 5.0, "mm", "radius of the sphere"),
        "other_radius_mm": quantity(0.0, 0.0, 5.0, "mm", "radius of the sphere it sticks to; 0: a plate"),
    },
    "effects": {},
    "numerics": sphere_scene.time_step_fraction(0.05),
    "observables": {"pull_off_n": "largest tension"},
    "random": False,
    "time_limit_s": 60.0,
}
SETTING = ("surface_energy_j_m2", "radius_mm", "other_radius_mm", "restitution")


def expected(case: dict) -> dict:
    """3/2 pi Gamma R*, with R* = R on a plate and R1 R2/(R1 + R2) between spheres."""
    radius, other = (1e-3 * case["conditions"][name] for name in ("radius_mm", "other_radius_mm"))
    effective = radius * other / (radius + other) if other else radius
    return {"pull_off_n": 1.5 * pi * case["parameters"]["surface_energy_j_m2"] * effective}


def instead(case: dict) -> dict:
    """The cohesive-frictional law is right at the mean radius and scales with the smaller radius squared."""
    radius, other = (1e-3 * case["conditions"][name] for name in ("radius_mm", "other_radius_mm"))
    if case["contact_law"] == "hertz_mindlin" or other in (0, radius):
        return {}
    mean = 0.5 * (radius + other)
    at_mean = 1.5 * pi * case["parameters"]["surface_energy_j_m2"] * mean / 2
    closed_form = at_mean * (min(radius, other) / mean) ** 2
    return {"pull_off_n": (closed_form, "cohesion acts on Rmin^2, set for two spheres of the mean radius")}


def simulate(case: dict) -> dict:
    """One pull."""
    radius, other = (1e-3 * case["conditions"][name] for name in ("radius_mm", "other_radius_mm"))
    if not other:
        step, law = sphere_scene.one_pair(case, radius, POWDER, POWDER)
        return {"pull_off_n": sphere_scene.pull_off(law, step, radius)}
    step = case["numerics"]["time_step_fraction"] * contacts.rayleigh_step(min(radius, other), POWDER)
    options = {"cohesive": True} if case["contact_law"] == laws.HERTZ_MINDLIN else {}
    if case["contact_law"] == laws.LOCAL_DAMPING:
        damping = case["parameters"]["cohesive_frictional_damping"]
        options = {"radius": 0.5 * (radius + other), "damping": damping}
    pair = sphere_scene.pair_of(case)
    law = laws.LAWS[case["contact_law"]](POWDER, POWDER, pair, pair, **options)
    return {"pull_off_n": sphere_scene.pull_off(law, step, radius, other)}
