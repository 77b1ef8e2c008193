"""A sphere on a level plate, in the seed's scene: rolling, sliding without spin at first, or thrown at it aslant."""

from unittest import mock

import numpy as np

from yade_scripts import inclined_roll, particles, seed_scene
from yade_scripts.acting import Effects
from yade_scripts.case import quantity

RIG = {
    **inclined_roll.RIG,
    "name": "sphere_on_plate",
    "conditions": {
        "seed_length_mm": seed_scene.SEED_LENGTH,
        "speed_m_s": quantity(0.5, 0.01, 3.0, "m/s", "along the plate at the start"),
        "rolls": quantity(1.0, 0.0, 1.0, "1", "1 starts rolling, 0 without spin"),
        "impact_m_s": quantity(0.0, 0.0, 3.0, "m/s", "toward the plate at the start; 0 starts at rest on it"),
        "time_s": quantity(0.1, 0.0001, 1.0, "s", "how long"),
    },
    "observables": {
        "speed_after_m_s": "along the plate at the end",
        "time_run_s": "as stepped",
        "kno": "Hertz's constant of the contact, N/m^1.5",
        "kso": "Mindlin's constant of the contact before the effect, N/m^1.5",
    },
    "random": False,
}


def sphere(length_mm: float, aspect: float = 1.0):
    """One sphere as a clump."""
    return np.zeros((1, 3)), np.array([5e-4 * length_mm])


def properties(length_mm: float, density: float, aspect: float = 1.0):
    """Its mass (kg) and moments of inertia (kg m2)."""
    radius = 5e-4 * length_mm
    mass = density * 4 / 3 * np.pi * radius**3
    return mass, (0.4 * mass * radius**2,) * 3


def simulate(case: dict) -> dict:
    """One run along the plate."""
    from yade import O

    conditions = case["conditions"]
    effects = Effects(inclined_roll.EFFECTS, case)
    with mock.patch.multiple(particles, alfalfa_seed=sphere, seed_mass_properties=properties):
        scene = seed_scene.SeedScene(case, np.eye(3), effects=effects)
    scene.place((0, 0, scene.rest_height))
    scene.plate((0, 0, -0.005), (10, 10, 0.005))
    scene.start((0, 0, -seed_scene.GRAVITY))
    impact, speed, state = conditions["impact_m_s"], conditions["speed_m_s"], scene.state
    for _ in range(0 if impact else 3000):  # comes to rest on its overlap
        scene.step()
    state.vel = (speed, 0, -impact)
    if conditions["rolls"]:
        state.angVel = (0, speed / scene.rest_height, 0)
        state.angMom = (0, scene.inertia[0] * speed / scene.rest_height, 0)
    start, stiffness = O.time, (None, None)
    while O.time - start < conditions["time_s"]:
        scene.step()
        for contact in O.interactions:
            stiffness = contact.phys.kno, contact.phys.kso / effects.at("tangential_stiffness", 1.0)
    return dict(zip(RIG["observables"], (state.vel[0], O.time - start, *stiffness), strict=True))
