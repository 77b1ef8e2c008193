"""Restitution of the alfalfa seed landing without spin on one, two or all six of its members.

On one member it must be the one asked for: the damper reads the mass of the member, which the scene sets to that of
the clump. n members that touch at once have n springs and n dampers: one contact of damping ratio n^(1/2) beta.
"""

if __name__ == "__main__":  # by hand: yade -x -n clump_restitution.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from math import pi, sqrt

import numpy as np

from yade_scripts import contacts, laws, particles, seed_scene
from yade_scripts.case import Failed, quantity
from yade_scripts.checks import sphere_scene
from yade_scripts.seed_scene import SeedScene

RIG = {
    "name": "clump_restitution",
    "contact_laws": seed_scene.CONTACT_LAWS,
    "parameters": seed_scene.PARAMETERS,
    "conditions": {
        "members_touching": quantity(1.0, 1.0, 6.0, "1", "1 on its end, 2 on its edge, 6 flat"),
        "seed_length_mm": seed_scene.SEED_LENGTH,
    }
    | sphere_scene.SPEED,
    "effects": {},
    "numerics": seed_scene.numerics(time_step_fraction=0.005, stiffness_scale=1.0),
    "observables": {"measured_restitution": "speed after over before", "contacts": "members that touched the plate"},
    "random": False,
    "time_limit_s": 60.0,
}
SETTING = (
    "seed_powder_restitution",
    "members_touching",
    "speed_m_s",
    "cohesive_frictional_damping",
    "time_step_fraction",
)


def expected(case: dict) -> dict:
    """The restitution asked for, on the members asked for."""
    return {
        "measured_restitution": case["parameters"]["seed_powder_restitution"],
        "contacts": case["conditions"]["members_touching"],
    }


def instead(case: dict) -> dict:
    """Several dampers at once; local damping in the cohesive-frictional law; a coarse time step."""
    members = case["conditions"]["members_touching"]
    if case["contact_law"] == laws.LOCAL_DAMPING:
        own = sphere_scene.local_damping_restitution(case["parameters"]["cohesive_frictional_damping"])
        return {"measured_restitution": (own, "no damper in the law: local damping d gives sqrt((1-d)/(1+d))")}
    if case["numerics"]["time_step_fraction"] > 0.01:
        return {
            "measured_restitution": (None, "time step too long for n strong dampers; the error falls in step with dt"),
            "contacts": (None, "time step too long for n strong dampers"),
        }
    if members > 1:
        ratio = contacts.damping_ratio(case["parameters"]["seed_powder_restitution"])
        own = sphere_scene.damped_restitution(sqrt(members) * ratio)
        return {"measured_restitution": (own, "n members at once damp like one with n^(1/2) times the ratio")}
    return {}


def simulate(case: dict) -> dict:
    """One landing, without gravity."""
    from yade import O

    postures = {1: particles.about(1, pi / 2), 2: particles.about(0, pi / 2), 6: np.eye(3)}
    members, speed = case["conditions"]["members_touching"], case["conditions"]["speed_m_s"]
    if members not in postures:
        raise Failed(f"members_touching: expected 1, 2 or 6, got {members:g}")
    scene = SeedScene(case, postures[members])
    touch = -seed_scene.lowest(scene.points, scene.radii, (0, 0, 1))
    scene.place((0, 0, touch))
    scene.plate((0, 0, -0.005), (10, 10, 0.005))
    scene.start((0, 0, 0))
    state = scene.state
    state.blockedDOFs = "XYZ"
    state.vel = (0, 0, -speed)
    touched = steps = 0
    while state.pos[2] <= touch or state.vel[2] <= 0:
        O.step()
        steps += 1
        touched = max(touched, sum(contact.isReal for contact in O.interactions))
        if steps > 200_000:
            raise Failed("the contact does not end")
    return {"measured_restitution": state.vel[2] / speed, "contacts": touched}
