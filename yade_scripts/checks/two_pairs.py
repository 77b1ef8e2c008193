"""Powder among powder and on steel in one interaction loop: each pair must keep its own contact parameters.

Every reading is taken in a scene whose loop holds both pairs' functors. In the cohesive-frictional law the
powder-powder contacts are cohesive-frictional and the powder-steel contacts Hertz-Mindlin; in the other both are
Hertz-Mindlin.
"""

if __name__ == "__main__":  # by hand: yade -x -n two_pairs.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from math import pi, sqrt

from yade_scripts import contacts, laws
from yade_scripts.case import quantity
from yade_scripts.checks import sphere_scene
from yade_scripts.checks.sphere_scene import POWDER, STEEL, local_damping_restitution

PAIRS = ("powder_powder", "powder_steel")


def _pair(name: str, restitution: float, sliding: float, rolling: float, energy: float) -> dict:
    """Declaration of one pair's parameters."""
    return {
        f"{name}_restitution": quantity(restitution, 0.05, 0.95, "1", "asked of the pair"),
        f"{name}_static_friction": quantity(sliding, 0.0, 1.5, "1", "asked of the pair"),
        f"{name}_rolling_friction": quantity(rolling, 0.0, 1.0, "1", "asked of the pair"),
        f"{name}_surface_energy_j_m2": quantity(energy, 0.0, 1.0, "J/m2", "JKR, asked of the pair"),
    }


RIG = {
    "name": "two_pairs",
    "contact_laws": sphere_scene.CONTACT_LAWS,
    "parameters": _pair("powder_powder", 0.3, 0.6, 0.1, 0.0)
    | _pair("powder_steel", 0.6, 0.3, 0.05, 0.0)
    | sphere_scene.DAMPING,
    "conditions": sphere_scene.SPEED | {"radius_mm": quantity(0.26, 0.05, 5.0, "mm", "radius of the spheres")},
    "effects": {},
    "numerics": sphere_scene.time_step_fraction(0.01) | sphere_scene.ROLLING_SPRING,
    "observables": {
        f"measured_{pair}_{what}": meaning
        for pair in PAIRS
        for what, meaning in (
            ("restitution", "speed after over before"),
            ("static_friction", "tangential over normal force plus pull-off force while it slides"),
            ("rolling_friction", "moment over radius times normal force while it rolls"),
            ("pull_off_n", "largest tension"),
        )
    }
    | {"measured_powder_steel_hertz_share": "elastic force at an overlap of R/1000 over Hertz's"},
    "random": False,
    "time_limit_s": 60.0,
}
SETTING = (
    "powder_powder_restitution",
    "powder_steel_restitution",
    "powder_powder_surface_energy_j_m2",
    "powder_steel_surface_energy_j_m2",
    "cohesive_frictional_damping",
)


def expected(case: dict) -> dict:
    """What each pair is asked for."""
    parameters, radius = case["parameters"], 1e-3 * case["conditions"]["radius_mm"]
    values = {"measured_powder_steel_hertz_share": 1.0}
    for pair, effective in (("powder_powder", radius / 2), ("powder_steel", radius)):
        for what in ("restitution", "static_friction", "rolling_friction"):
            values[f"measured_{pair}_{what}"] = parameters[f"{pair}_{what}"]
        values[f"measured_{pair}_pull_off_n"] = 1.5 * pi * parameters[f"{pair}_surface_energy_j_m2"] * effective
    return values


def instead(case: dict) -> dict:
    """Restitution under local damping and adhesion, and the softer plate."""
    parameters = case["parameters"]
    softer = "YADE's R* on a box is R/2; the moduli are kept for the powder's own contacts"
    cannot = {"measured_powder_steel_hertz_share": (sqrt(0.5), softer)}
    adhesive = "with adhesion the damper may pull, as far as the pull-off force"
    for pair in PAIRS:
        if parameters[f"{pair}_surface_energy_j_m2"] > 0:
            cannot[f"measured_{pair}_restitution"] = (None, adhesive)
    if case["contact_law"] == laws.LOCAL_DAMPING:
        damping = parameters["cohesive_frictional_damping"]
        own = local_damping_restitution(damping)
        ratio = "the cohesive material's `poisson` is ks/kn, which the Mindlin functor takes for Poisson's ratio"
        cannot["measured_powder_steel_hertz_share"] = (None, ratio)
        cannot["measured_powder_powder_restitution"] = (
            own,
            "no damper in the law: local damping d gives sqrt((1-d)/(1+d))",
        )
        if damping > 0:
            cannot["measured_powder_steel_restitution"] = (None, "local damping acts on this pair as well")
    return cannot


def simulate(case: dict) -> dict:
    """Eight readings."""
    radius, speed = 1e-3 * case["conditions"]["radius_mm"], case["conditions"]["speed_m_s"]
    step = case["numerics"]["time_step_fraction"] * contacts.rayleigh_step(radius, POWDER)
    spring = case["numerics"]["rolling_spring"] * sphere_scene.sphere_inertia(radius, POWDER) / step**2
    options = {"rolling_stiffness": spring}
    if case["contact_law"] == laws.LOCAL_DAMPING:
        options |= {"radius": radius, "damping": case["parameters"]["cohesive_frictional_damping"]}
    if case["contact_law"] == laws.HERTZ_MINDLIN:
        options |= {"cohesive": True}
    powder, steel = (sphere_scene.pair_of(case, f"{pair}_") for pair in PAIRS)
    law = laws.LAWS[case["contact_law"]](POWDER, STEEL, steel, powder, **options)
    read = {}
    for pair, plate in (("powder_powder", False), ("powder_steel", True)):
        read[f"measured_{pair}_restitution"] = sphere_scene.bounce(law, step, radius, speed, plate)["restitution"]
        read[f"measured_{pair}_pull_off_n"] = sphere_scene.pull_off(law, step, radius, None if plate else radius)
        linear = case["contact_law"] == laws.LOCAL_DAMPING and not plate
        pressed = sphere_scene.pressed(  # so far that force and adhesion are alike
            law, step, radius, (1e-5 if linear else 1e-3) * radius, plate, read[f"measured_{pair}_pull_off_n"]
        )
        read |= {f"measured_{pair}_{what}": value for what, value in pressed.items()}
    overlap = 1e-3 * radius
    hertz = sphere_scene.hertz_force(overlap, radius, sphere_scene.effective_modulus(POWDER, STEEL))
    elastic = sphere_scene.normal_force(law, step, radius, overlap) + read["measured_powder_steel_pull_off_n"]
    read["measured_powder_steel_hertz_share"] = elastic / hertz
    return read
