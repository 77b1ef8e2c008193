"""Bulk density of powder that has settled in a funnel or a cylinder, read in the middle of the fill."""

from math import pi

import numpy as np

CORE = 0.8  # of the outlet's radius: the part of the fill that is read stands over it, clear of the walls
CLEAR = 1.0  # of a grain's diameter, which it keeps from the lowest and the highest grain over it
LEAST = 3.0  # grain diameters that it must be high


def bulk_density(centres, radii, density: float, outlet: float) -> float | None:
    """Mass over volume of the fill in a cylinder about its axis, kg/m3; None where the fill is too low for one.

    The cylinder has `CORE` times the outlet's radius. A grain is in it with its whole mass where its centre is, which is
    right in the mean: the faces of the cylinder cut as many grains whose centre lies inside as outside.

    Parameters
    ----------
    centres : (n, 3) array, m, the axis being x = y = 0
    radii : (n,) array, m
    density : of the grains, kg/m3
    outlet : radius of the outlet, m
    """
    centres, radii = np.asarray(centres, dtype=float), np.asarray(radii, dtype=float)
    diameter, reach = 2 * float(radii.mean()), CORE * outlet
    over = np.hypot(centres[:, 0], centres[:, 1]) < reach
    if not over.any():
        return None
    height = centres[over, 2]
    low, high = height.min() + CLEAR * diameter, height.max() - CLEAR * diameter
    if high - low < LEAST * diameter:
        return None
    inside = over & (centres[:, 2] > low) & (centres[:, 2] < high)
    volume = pi * reach**2 * (high - low)
    return float(4 / 3 * pi * density * (radii[inside] ** 3).sum() / volume)
