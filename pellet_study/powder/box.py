"""The box of the response surface: where it is put, and how it moves."""

from collections.abc import Mapping

import numpy as np

from pellet_study.doe.factors import Factor
from pellet_study.powder.plan import SYMBOLS

CLIMB_POINTS = 6
HALF_BOX = 2.0  # half-width of the surface's box, in steps of the climb
MOVES = 3  # of climb or box, before it is given up


def crossing(place: np.ndarray, angle: np.ndarray, target: float) -> float:
    """Place along the path where a straight line through the angles meets the target; an end where it falls."""
    slope, level = np.polyfit(place, angle, 1)
    if slope <= 0:
        return float("inf") if target > angle.mean() else float("-inf")
    return float((target - level) / slope)


def allowed(coded: np.ndarray, factors: list[Factor], known: Mapping[str, Mapping[str, float]]) -> bool:
    """Whether every level lies within what the rig takes."""
    levels = [(float(f.physical(x)), known[SYMBOLS[f.name]]) for f, x in zip(factors, coded, strict=True)]
    return all(quantity["min"] <= level <= quantity["max"] for level, quantity in levels)


def box_around(
    centre: np.ndarray, half: float, factors: list[Factor], known: Mapping[str, Mapping[str, float]]
) -> dict[str, list[float]]:
    """{factor: [low, high]} of a box of half-width `half` coded units around a centre, inside what the rig takes."""
    box = {}
    for f, x in zip(factors, centre, strict=True):
        quantity = known[SYMBOLS[f.name]]
        low, high = float(f.physical(x - half)), float(f.physical(x + half))
        shift = max(quantity["min"] - low, 0.0) + min(quantity["max"] - high, 0.0)
        box[f.name] = [round(low + shift, 4), round(high + shift, 4)]
    return box


def moved(factor: Factor, shift: float, quantity: Mapping[str, float]) -> Factor:
    """The factor's range moved by `shift` coded units, inside what the rig takes."""
    low, high = factor.low + shift * factor.half_range, factor.high + shift * factor.half_range
    back = max(quantity["min"] - low, 0.0) + min(quantity["max"] - high, 0.0)
    return Factor(factor.name, round(low + back, 4), round(high + back, 4), factor.unit)
