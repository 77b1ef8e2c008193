"""The inclined roll with a sphere for the seed: no tumbling, so that a small cause has a small effect."""

from unittest import mock

import numpy as np

from yade_scripts import inclined_roll, particles

EFFECTS = inclined_roll.EFFECTS
RIG = {
    **inclined_roll.RIG,
    "name": "sphere_roll",
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
    """One release."""
    with mock.patch.multiple(particles, alfalfa_seed=sphere, seed_mass_properties=properties):
        return inclined_roll.simulate(case)
