"""What a contact law of another engine is told of powder and steel."""

from math import log, pi, sqrt
from typing import NamedTuple

from yade_scripts.contacts import Material, Pair


class Powder(NamedTuple):
    """Grains and the steel of the walls, as soft as they are simulated."""

    grain: Material
    steel: Material
    pair: Pair
    wall_pair: Pair
    radius: float  # mean, m
    time_step: float  # s
    wall_rolling: float  # stiffness of the rolling moment at walls below its limit, N m/rad


def effective_young(first: Material, second: Material) -> float:
    """E* of two solids, Pa."""
    return 1 / sum((1 - each.poisson_ratio**2) / each.young for each in (first, second))


def effective_shear(first: Material, second: Material) -> float:
    """G* of two solids, Pa."""
    return 1 / sum((2 - each.poisson_ratio) / each.shear_modulus for each in (first, second))


def pulling_ratio(restitution: float) -> float:
    """Damping ratio of a contact whose damper may pull: -ln e/sqrt(pi^2 + ln^2 e).

    Of a linear contact, and of Hertz's with a damper that goes with the fourth root of the overlap (Antypov & Elliott 2011,
    doi:10.1209/0295-5075/94/50004), where the ratio is the damper over sqrt(5 m k) x^(1/4).
    """
    return -log(restitution) / sqrt(pi**2 + log(restitution) ** 2)
