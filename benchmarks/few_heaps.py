"""How many heaps `calibrate --few` takes, and how often it calls a setting equivalent that is not: results/checks/few_heaps.csv.

    .venv/bin/python benchmarks/few_heaps.py [--draws 10000]

Nothing is simulated. The response is that of our screening (results/full/screening/effects.csv): a level, seven effects, heaps that
scatter normally about it; the plan is the one that the command follows (`few_heaps.search`), computed for all draws at once. Ten targets lie evenly over the
middle of what the box gives. A run that does not show equivalence counts as the most heaps there may be. A row a scatter: 1.2 and
1.4 deg (the height of the heap, `repose_height_deg`), 1.7 and 2.0, where the rule errs most, 3.1 (a line through the flanks).

False equivalence: the share of draws in which a setting is called equivalent whose true angle lies at the margin, .79 deg, or
beyond. It is counted at the ten targets; at targets a margin beyond the end of the path, where the setting stays at the edge
whatever is poured; and where the response bends.

The chain beside it is counted, not run: its screening, climb, one box, and a validation of the standard error that it wants. Cpu
seconds are those of a heap in the middle of Table 6 times the time steps of the heaps over that one's.

THE LEAST NUMBER. n heaps at one setting with the scatter s have a mean known to t s/sqrt(n), t the quantile of the test's level
with n - 1 degrees of freedom. A test within the margin m can pass only where that is below m. At s = 1.4 and m = .79, each
one-sided test at 2 %, that is n = 16 on the path, 24 with the screening.

Heaps that take no part in the choice of the setting are not to be had for 25: at a setting that is exact, tests at 5 % need 11 of them to
pass at all, 19 to pass every second time, 29 four times in five (`doe.validation.tost_power`): 27 with the screening, even if
that placed the setting without error. It does not: n heaps that place it leave an error s/sqrt(n) at least, so that the least
number that passes every second time is 39 (`least_apart`). So --few tests the heaps that placed the setting, at a level that allows for it.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from pellet_study.doe import screening_designs
from pellet_study.doe.validation import tost_power
from pellet_study.powder import few_heaps
from pellet_study.powder.from_study import plan_of
from pellet_study.powder.heaps import FULL
from pellet_study.powder.plan import RIG, SYMBOLS, Plan
from pellet_study.powder.uphill import FARTHEST
from pellet_study.rigs import on_yade
from pellet_study.study import load
from yade_scripts.layered import step_share
from yade_scripts.powder_scene import damper_share

ROOT = Path(__file__).resolve().parent.parent
SCATTERS = (1.2, 1.4, 1.7, 2.0, 3.1)
TARGETS = 10
LEVEL_DEG = 46.8  # of the heaps at the middle of Table 6
BEND = -0.5  # deg per squared half range of the path


def effects(study: Path = ROOT / "results" / "full") -> np.ndarray:
    """Half the effects of the screening, deg per coded unit of A to G."""
    return pd.read_csv(study / "screening" / "effects.csv")["effect_deg"].to_numpy() / 2


@dataclass(frozen=True)
class Response:
    """True angle (deg) of coded levels (..., 7): a level, slopes (deg per coded unit), a bend along their gradient."""

    level: float
    slopes: np.ndarray
    bend: float = 0.0

    def at(self, coded: np.ndarray) -> np.ndarray:
        along = coded @ self.slopes
        return self.level + along + self.bend * along**2 / (self.slopes @ self.slopes)


@dataclass(frozen=True)
class Drawn:
    """Calibrations on a synthetic response, an entry each.

    `heaps` of each, the most there may be where it does not call its setting equivalent (`called`); how far that is `off`, deg;
    where on its path it stands (`place`). `cost` is in heaps of the middle of Table 6, as low restitutions take smaller time steps;
    `there` is that of a heap at the setting.
    """

    heaps: np.ndarray
    called: np.ndarray
    off: np.ndarray
    place: np.ndarray
    cost: np.ndarray
    there: np.ndarray

    def false_equivalence(self, margin: float) -> float:
        """Share that calls a setting equivalent whose angle is off by the margin or more."""
        return float(np.mean(self.called & (np.abs(self.off) >= margin - 1e-9)))


def computed(
    plan: Plan, response: Response, scatter: float, target: np.ndarray, noise: np.ndarray, beyond: float | None = None
) -> Drawn:
    """What `few_heaps.search` does after a screening, for many calibrations at once (tests/powder/test_few_heaps.py holds them together).

    Parameters
    ----------
    target : (n,) deg; the measured angle is a known number
    noise : (n, 60) standard normal, of the screening's heaps first
    beyond : puts the target so far (deg) beyond that end of the path which is higher
    """
    coded = screening_designs.coded_matrix(len(plan.factors), few_heaps.SCREENED)
    direction, low, high, level, slope, slope_variance = paths(
        plan, response.at(coded) + scatter * noise[:, : len(coded)], coded
    )
    if beyond is not None:
        ends = [response.at(end[:, None] * direction) for end in (low, high)]
        target = np.maximum(*ends) + beyond
    number, most = len(noise), few_heaps.MOST - few_heaps.SCREENED
    place = np.clip((target - level) / slope, low, high)
    sums, weight = np.zeros((5, number)), 1 / slope_variance
    heaps, called = np.full(number, few_heaps.MOST), np.zeros(number, bool)
    cost = np.full(number, cost_of(plan, coded).sum())
    on = np.ones(number, bool)
    for n in range(few_heaps.BATCH, most + 1, few_heaps.BATCH):
        points = place[:, None] * direction
        cost += on * few_heaps.BATCH * cost_of(plan, points)
        for k in range(few_heaps.BATCH):
            y = response.at(points) + scatter * noise[:, few_heaps.SCREENED + n - few_heaps.BATCH + k]
            sums += on * np.array([place, y, place**2, place * y, y**2])
        middle, mean = sums[0] / n, sums[1] / n
        precision = sums[2] - n * middle**2 + weight
        b = (sums[3] - n * middle * mean + weight * slope) / precision
        squares = sums[4] - n * mean**2 + weight * slope**2 - precision * b**2
        variance = squares / (n - 1)
        place = np.where(on, np.clip(middle + (target - mean) / b, low, high), place)
        error = np.sqrt(variance * (1 / n + (place - middle) ** 2 / precision))
        half = stdtrit(n - 1, 1 - few_heaps.LEVEL) * error
        miss = np.abs(mean + b * (place - middle) - target)
        hopeless = np.sqrt(variance / most) * stdtrit(most - 1, 1 - few_heaps.LEVEL) >= plan.margin
        if n >= few_heaps.FEWEST:
            stop = on & ((half < plan.margin) | (miss - half > plan.margin) | hopeless)
            passes = stop & (miss + half < plan.margin)
            called |= passes
            heaps = np.where(passes, few_heaps.SCREENED + n, heaps)
            cost = np.where(stop & ~passes, cost * few_heaps.MOST / (few_heaps.SCREENED + n), cost)
            on &= ~stop
    points = place[:, None] * direction
    return Drawn(heaps, called, response.at(points) - target, place, cost, cost_of(plan, points))


def paths(plan: Plan, angle: np.ndarray, coded: np.ndarray) -> tuple[np.ndarray, ...]:
    """`uphill` of many complete screenings (n, 8) at once: direction (n, 7), ends, level, slope, variance of the slope."""
    slopes = angle @ coded / len(coded)
    sizes = np.abs(slopes)
    few = np.where(sizes < 3.75 * np.median(sizes, axis=1, keepdims=True), sizes, np.nan)
    error = 1.5 * np.nanmedian(few, axis=1, keepdims=True)
    direction = slopes * np.maximum(1 - error**2 / slopes**2, 0)
    nothing = ~direction.any(axis=1)
    direction[nothing] = np.where(sizes == sizes.max(axis=1, keepdims=True), np.sign(slopes), 0)[nothing]
    direction /= np.abs(direction).max(axis=1, keepdims=True)
    known = [on_yade.rig(RIG).parameters[SYMBOLS[f.name]] for f in plan.factors]
    limits = [[f.coded(one[side]) for f, one in zip(plan.factors, known, strict=True)] for side in ("min", "max")]
    with np.errstate(divide="ignore"):
        ends = np.sort(np.array(limits)[:, None] / direction, axis=0)
    still = direction == 0
    low = np.maximum(-FARTHEST, np.where(still, -np.inf, ends[0]).max(axis=1))
    high = np.minimum(FARTHEST, np.where(still, np.inf, ends[1]).min(axis=1))
    slope = (direction * slopes).sum(axis=1)
    return direction, low, high, angle.mean(axis=1), slope, (direction**2).sum(axis=1) / len(coded)


def cost_of(plan: Plan, coded: np.ndarray) -> np.ndarray:
    """Time steps of heaps (n, 7) over those of one in the middle of Table 6: both restitutions shorten the step of the default law."""
    names = [f.name for f in plan.factors]
    grid = np.linspace(0.05, 0.6, 111).round(3)  # the laws begin at 0.05
    walls = [min(1.0, 2 * damper_share(e)) for e in grid]
    grains = [step_share(e) for e in grid]
    share = np.minimum(*(_at(plan, coded, names.index(n), grid, one) for n, one in (("D", walls), ("A", grains))))
    return min(np.interp(0.15, grid, walls), np.interp(0.15, grid, grains)) / share


def _at(plan: Plan, coded: np.ndarray, place: int, grid: np.ndarray, share: list[float]) -> np.ndarray:
    """The share of the step at the levels of a restitution, between those of a grid."""
    return np.interp(plan.factors[place].physical(coded[:, place]), grid, share)


def least(margin: float, scatter: float, level: float = 0.05, power: float = 0.0) -> int:
    """Least heaps at an exact setting with which the two one-sided t tests pass, at all or with a probability."""
    for n in range(2, 10_000):
        error = scatter / n**0.5
        if stdtrit(n - 1, 1 - level) * error < margin and tost_power(margin, error, n - 1, level) >= power:
            return n
    raise ValueError(f"a scatter of {scatter:g} deg and a margin of {margin:g}: expected less than 10,000 heaps")


def least_apart(margin: float, scatter: float, power: float = 0.5) -> tuple[int, int]:
    """Least heaps to place a setting, and for one test of their own, that pass with a probability.

    Those that place it leave an error s/sqrt(n), as if all of them stood there, the screening's too.
    """
    nodes, weights = np.polynomial.hermite_e.hermegauss(21)
    weights = weights / weights.sum()

    def passes(before: int, apart: int) -> float:
        off = nodes * scatter / before**0.5
        return float(weights @ [tost_power(margin, scatter / apart**0.5, apart - 1, 0.05, x) for x in off])

    def best(total: int) -> tuple[float, int]:
        shares = range(start, total - few_heaps.SCREENED + 1, 1 + (total - start) // 40)
        return max((passes(total - apart, apart), apart) for apart in shares)

    start = least(margin, scatter, power=power)
    low, high = few_heaps.SCREENED + start, 10 * start
    while low < high:  # the probability grows with the number
        middle = (low + high) // 2
        low, high = (low, middle) if best(middle)[0] >= power else (middle + 1, high)
    return low - best(low)[1], best(low)[1]


def row_of(plan: Plan, scatter: float, draws: int) -> dict[str, float]:
    """What the plan takes and gives at a scatter."""
    response, margin = Response(LEVEL_DEG, effects()), plan.margin
    targets = LEVEL_DEG + np.linspace(-0.6, 0.6, TARGETS) * np.abs(response.slopes).sum()
    target = np.repeat(targets, draws // TARGETS)
    rng = np.random.default_rng(1)

    def noise() -> np.ndarray:
        return rng.normal(size=(len(target), few_heaps.MOST))

    every = computed(plan, response, scatter, target, noise())
    edge = computed(plan, response, scatter, target, noise(), beyond=margin)
    bent = computed(plan, replace(response, bend=BEND), scatter, target, noise())
    heaps = every.heaps.reshape(TARGETS, -1)
    validating = max(FULL.fewest, int(np.ceil((scatter / FULL.wanted_error) ** 2)))
    seconds = seconds_of_a_heap()
    return {
        "scatter_deg": scatter,
        "margin_deg": margin,
        "draws": len(target),
        "median_heaps": float(np.median(heaps)),
        "lowest_median_of_a_target": float(np.median(heaps, axis=1).min()),
        "highest_median_of_a_target": float(np.median(heaps, axis=1).max()),
        "ninth_decile_heaps": float(np.quantile(heaps, 0.9)),
        "tens_of_targets_with_median_25_or_less": float(np.mean(np.median(heaps, axis=0) <= 25)),
        "shown_equivalent": float(every.called.mean()),
        "setting_error_rms_deg": float(np.sqrt(np.mean(every.off[every.called] ** 2))),
        "false_equivalence": every.false_equivalence(margin),
        "false_equivalence_at_the_edge": edge.false_equivalence(margin),
        "false_equivalence_where_it_bends": bent.false_equivalence(margin),
        "least_heaps_on_the_path": few_heaps.needed(scatter, plan),
        "own_heaps_to_pass_at_all": least(margin, scatter),
        "own_heaps_to_pass_half": least(margin, scatter, power=0.5),
        "own_heaps_to_pass_four_in_five": least(margin, scatter, power=0.8),
        "least_median_with_own_heaps": sum(least_apart(margin, scatter)),
        "full_chain_heaps": 41 + 18 + 41 + validating,  # screening, climb, one box, one validation
        "a_heap_a_point_heaps": 17 + 6 + 17 + validating,
        "median_cpu_seconds": seconds * float(np.median(every.cost)),
        "full_chain_cpu_seconds": seconds * float(np.median(chain_cost(plan, every.there, 3, validating))),
        "a_heap_a_point_cpu_seconds": seconds * float(np.median(chain_cost(plan, every.there, 1, validating))),
    }


def chain_cost(plan: Plan, there: np.ndarray, repeats: int, validating: int) -> np.ndarray:
    """Cost of the chain that finds the same setting: screening, and 6 points of a climb, 12 and 5 of a box and a validation beside it."""
    screening = repeats * cost_of(plan, screening_designs.coded_matrix(len(plan.factors))).sum() + 5
    return screening + (18 * repeats + 5 + validating) * there


def seconds_of_a_heap() -> float:
    """Cpu seconds of a heap of the default rig in the middle of Table 6 (`benchmarks/heap_cost.py`)."""
    table = pd.read_csv(ROOT / "results" / "checks" / "heap_cost.csv")
    row = table[(table["surface_energy_j_m2"] == 0.2) & (table["grains"] == 1503)]
    return float(row["cpu_seconds"].iloc[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=10_000)
    draws = parser.parse_args().draws
    plan = plan_of(load(ROOT / "results" / "full"))
    table = pd.DataFrame([row_of(plan, scatter, draws) for scatter in SCATTERS]).round(4)
    table.to_csv(ROOT / "results" / "checks" / "few_heaps.csv", index=False, lineterminator="\n")
    print(table.T.to_string(header=False))


if __name__ == "__main__":
    main()
