"""How many heaps `calibrate --few` takes, and how often it calls a setting equivalent that is not: results/checks/few_heaps.csv.

    .venv/bin/python benchmarks/few_heaps.py [--draws 10000]

Nothing is simulated. The response is that of our screening (results/full/screening/effects.csv): a level, seven effects, heaps that
scatter normally about it; the plan is the one that the command follows (`few_heaps.search`). Ten targets lie evenly over the
middle of what the box gives. A run that does not show equivalence counts as the most heaps there may be. A row a scatter: 1.2 and
1.4 deg (the height of the heap, `repose_height_deg`), 2.0, where the rule errs most, 3.1 (a line through the flanks).

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
from collections.abc import Callable
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
from pellet_study.powder.plan import Plan
from pellet_study.powder.uphill import Uphill, uphill
from pellet_study.study import load
from yade_scripts.powder_scene import damper_share

ROOT = Path(__file__).resolve().parent.parent
SCATTERS = (1.2, 1.4, 2.0, 3.1)
TARGETS = 10
LEVEL_DEG = 46.8  # of the heaps at the middle of Table 6
BEND = -0.5  # deg per squared half range of the path


def effects(study: Path = ROOT / "results" / "full") -> np.ndarray:
    """Half the effects of the screening, deg per coded unit of A to G."""
    return pd.read_csv(study / "screening" / "effects.csv")["effect_deg"].to_numpy() / 2


@dataclass(frozen=True)
class Drawn:
    """A calibration on a synthetic response: its heaps, whether it calls its setting equivalent, how far that is off (deg).

    `cost` is in heaps of the middle of Table 6: a steel restitution below 0.15 takes smaller time steps. `there` is that of a heap at the setting.
    """

    heaps: int
    called: bool
    off: float
    cost: float
    there: float


def draw(
    plan: Plan,
    angle_of: Callable[[np.ndarray], np.ndarray],
    scatter: float,
    rng: np.random.Generator,
    beyond: float | None = None,
) -> Drawn:
    """One calibration.

    Parameters
    ----------
    angle_of : true angles (deg) of coded levels (n, 7)
    beyond : puts the target so far (deg) beyond the end of the path
    """
    coded = screening_designs.coded_matrix(len(plan.factors), few_heaps.SCREENED)
    path = uphill(plan.factors, coded, angle_of(coded) + scatter * rng.normal(size=len(coded)))
    if beyond is not None:
        plan = replace(plan, target=past_the_end(path, angle_of, beyond))
    poured: list[float] = []

    def pour(places: list[float]) -> np.ndarray:
        new = np.outer(places[len(poured) :], path.direction)
        poured.extend(angle_of(new) + scatter * rng.normal(size=len(new)))
        return np.array(poured)

    found = few_heaps.search(path, plan, pour)
    half, miss = few_heaps.half_width(found, plan), abs(found.line.at(found.place) - plan.target)
    called = miss + half < plan.margin
    place = found.place * path.direction
    heaps = few_heaps.SCREENED + len(poured)
    on_path = cost_of(plan, np.outer(found.places, path.direction)).sum() * (
        1 if called else (few_heaps.MOST - few_heaps.SCREENED) / len(poured)
    )
    return Drawn(
        heaps if called else few_heaps.MOST,
        called,
        float(angle_of(place[None])[0]) - plan.target,
        float(cost_of(plan, coded).sum() + on_path),
        float(cost_of(plan, place[None])[0]),
    )


def cost_of(plan: Plan, coded: np.ndarray) -> np.ndarray:
    """Time steps of heaps over those of one with the full step."""
    names = [f.name for f in plan.factors]
    levels = plan.factors[names.index("D")].physical(coded[:, names.index("D")]).round(10)
    return np.array([1 / damper_share(e) for e in levels])


def past_the_end(path: Uphill, angle_of: Callable[[np.ndarray], np.ndarray], beyond: float) -> float:
    """The angle at that end of a path which is higher, and so much more."""
    ends = angle_of(np.outer([path.low, path.high], path.direction))
    return float(ends.max() + beyond)


def false_equivalence(draws: list[Drawn], margin: float) -> float:
    """Share of draws that call a setting equivalent whose angle is off by the margin or more."""
    return float(np.mean([one.called and abs(one.off) >= margin - 1e-9 for one in draws]))


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
    slopes, margin = effects(), plan.margin
    reach = np.abs(slopes).sum()

    def straight(coded: np.ndarray) -> np.ndarray:
        return LEVEL_DEG + coded @ slopes

    def bent(coded: np.ndarray) -> np.ndarray:
        along = coded @ slopes / np.linalg.norm(slopes)
        return LEVEL_DEG + coded @ slopes + BEND * along**2

    targets = LEVEL_DEG + np.linspace(-0.6, 0.6, TARGETS) * reach
    rng = np.random.default_rng(1)
    each = [
        [draw(replace(plan, target=target), straight, scatter, rng) for _ in range(draws // TARGETS)]
        for target in targets
    ]
    every = [one for some in each for one in some]
    edge = [draw(plan, straight, scatter, rng, beyond=margin) for _ in range(draws)]
    curved = [draw(replace(plan, target=rng.choice(targets)), bent, scatter, rng) for _ in range(draws)]
    called = [one.off for one in every if one.called]
    heaps = np.array([[one.heaps for one in some] for some in each])
    validating = max(FULL.fewest, int(np.ceil((scatter / FULL.wanted_error) ** 2)))
    seconds = seconds_of_a_heap()
    return {
        "scatter_deg": scatter,
        "margin_deg": margin,
        "draws": len(every),
        "median_heaps": float(np.median(heaps)),
        "lowest_median_of_a_target": float(np.median(heaps, axis=1).min()),
        "highest_median_of_a_target": float(np.median(heaps, axis=1).max()),
        "ninth_decile_heaps": float(np.quantile(heaps, 0.9)),
        "tens_of_targets_with_median_25_or_less": float(np.mean(np.median(heaps, axis=0) <= 25)),
        "shown_equivalent": len(called) / len(every),
        "setting_error_rms_deg": float(np.sqrt(np.mean(np.square(called)))) if called else np.nan,
        "false_equivalence": false_equivalence(every, margin),
        "false_equivalence_at_the_edge": false_equivalence(edge, margin),
        "false_equivalence_where_it_bends": false_equivalence(curved, margin),
        "least_heaps_on_the_path": few_heaps.needed(scatter, plan),
        "own_heaps_to_pass_at_all": least(margin, scatter),
        "own_heaps_to_pass_half": least(margin, scatter, power=0.5),
        "own_heaps_to_pass_four_in_five": least(margin, scatter, power=0.8),
        "least_median_with_own_heaps": sum(least_apart(margin, scatter)),
        "full_chain_heaps": 41 + 18 + 41 + validating,  # screening, climb, one box, one validation
        "a_heap_a_point_heaps": 17 + 6 + 17 + validating,
        "median_cpu_seconds": seconds * float(np.median([one.cost for one in every])),
        "full_chain_cpu_seconds": seconds * float(np.median([chain_cost(plan, one, 3, validating) for one in every])),
        "a_heap_a_point_cpu_seconds": seconds
        * float(np.median([chain_cost(plan, one, 1, validating) for one in every])),
    }


def chain_cost(plan: Plan, drawn: Drawn, repeats: int, validating: int) -> float:
    """Cost of the chain that finds the same setting: screening, and 6 points of a climb, 12 and 5 of a box and a validation beside it."""
    screening = repeats * cost_of(plan, screening_designs.coded_matrix(len(plan.factors))).sum() + 5
    return float(screening + (18 * repeats + 5 + validating) * drawn.there)


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
