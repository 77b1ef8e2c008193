"""The climb: heaps along the gradient of the screening, through the middle of its box, to where they meet the target."""

import numpy as np
import pandas as pd

from pellet_study.doe.factors import Factor
from pellet_study.powder.box import CLIMB_POINTS, HALF_BOX, MOVES, allowed, box_around, crossing
from pellet_study.powder.decisions import Climb, Screening
from pellet_study.powder.heaps import Heaps, lost_of, point_at
from pellet_study.powder.plan import OBSERVABLE, RIG
from pellet_study.powder.results import Results
from pellet_study.rigs import on_yade

STEP = 2 / (CLIMB_POINTS - 1)  # of the path, the box of the screening being -1 to 1


def climb(heaps: Heaps, results: Results) -> Climb:
    """Simulate the path, longer where it does not meet the target yet, and put the box of the surface."""
    screened: Screening = results.decision("screening")
    factors = [f for f in heaps.plan.factors if f.name in screened.factors]
    slopes = np.array([screened.coefficients[f.name] for f in factors])
    uphill = slopes / np.abs(slopes).max()
    coded = [(k * STEP - 1) * uphill for k in range(CLIMB_POINTS)]
    for move in range(MOVES):
        runs, along, place = walk(heaps, results, factors, coded, uphill)
        reached = bool(along.min() <= place <= along.max())
        beyond = further(along, place, uphill, factors)
        if reached or not beyond or move == MOVES - 1:
            break
        heaps.say(f"  climb: {heaps.plan.target:g} deg is not met along the path; it goes on beyond the box")
        coded = coded + beyond  # at the end of the list, so that earlier points keep their seeds
    centre = float(np.clip(place, along.min(), along.max())) * uphill
    decision = Climb(
        factors=screened.factors,
        reached=reached,
        centre=point_at(factors, centre),
        box=box_around(centre, HALF_BOX * STEP, factors, on_yade.rig(RIG).parameters),
        heaps=len(runs),
        lost=lost_of(runs),
        moves=move,
        repeats=heaps.sizes.repeats,
    )
    results.write_decision("climb", decision)
    return decision


def walk(
    heaps: Heaps, results: Results, factors: list[Factor], coded: list[np.ndarray], uphill: np.ndarray
) -> tuple[pd.DataFrame, np.ndarray, float]:
    """The heaps at the points of a path, how far along it the points lie, and where the heaps meet the target."""
    repeats = heaps.sizes.repeats
    points = [point_at(factors, row) for row in coded]
    results.write_table("climb", "design", pd.DataFrame(points).round(10))
    runs = heaps.at("climb", [point for point in points for _ in range(repeats)])
    results.write_table("climb", "runs", runs)
    good = heaps.good(runs, "climb", 2 * repeats + 1)  # two places at least
    along = np.array([float(row @ uphill) for row in coded]) / (uphill @ uphill)  # -1 to 1 inside the first box
    place = crossing(np.repeat(along, repeats)[good.index], good[OBSERVABLE].to_numpy(), heaps.plan.target)
    return runs, along, place


def further(along: np.ndarray, place: float, uphill: np.ndarray, factors: list[Factor]) -> list[np.ndarray]:
    """The next two points of the path beyond that end where the target lies, as far as the rig takes their levels."""
    known = on_yade.rig(RIG).parameters
    steps = STEP * np.array([1, 2])
    places = along.max() + steps if place > 0 else along.min() - steps
    return [x * uphill for x in places if allowed(x * uphill, factors, known)]
