"""A sphere moving along a level plate, in the seed's scene: rolling without slip, or sliding without spin at first."""

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
        "speed_m_s": quantity(0.5, 0.01, 3.0, "m/s", "at the start"),
        "rolls": quantity(1.0, 0.0, 1.0, "1", "1 starts rolling, 0 without spin"),
        "time_s": quantity(0.1, 0.001, 1.0, "s", "how long"),
    },
    "observables": {"speed_after_m_s": "at the end", "time_run_s": "as stepped"},
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
    with mock.patch.multiple(particles, alfalfa_seed=sphere, seed_mass_properties=properties):
        scene = seed_scene.SeedScene(case, np.eye(3), effects=Effects(inclined_roll.EFFECTS, case))
    scene.place((0, 0, scene.rest_height))
    scene.plate((0, 0, -0.005), (10, 10, 0.005))
    scene.start((0, 0, -seed_scene.GRAVITY))
    for _ in range(3000):  # comes to rest on its overlap
        scene.step()
    state, speed = scene.state, conditions["speed_m_s"]
    state.vel = (speed, 0, 0)
    if conditions["rolls"]:
        state.angVel = (0, speed / scene.rest_height, 0)
        state.angMom = (0, scene.inertia[0] * speed / scene.rest_height, 0)
    start = O.time
    while O.time - start < conditions["time_s"]:
        scene.step()
    return {"speed_after_m_s": state.vel[0], "time_run_s": O.time - start}
