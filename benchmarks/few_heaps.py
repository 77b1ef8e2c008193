"""How many heaps `calibrate --few` takes, and how often it calls a setting equivalent that is not: results/checks/few_heaps.csv.

    .venv/bin/python benchmarks/few_heaps.py [--draws 10000]

Nothing is simulated. The response is that of our screening (results/full/screening/effects.csv): a level, seven effects, heaps that
scatter normally about it; the plan is the one that the command follows (`few_heaps.search`). Ten targets lie evenly over the
middle of what the box gives. A run that does not show equivalence counts as the most heaps there may be. A row a scatter: 1.2 and
1.4 deg (the height of the heap, `repose_height_deg`), 3.1 (a line through its flanks).

False equivalence: the share of draws in which a setting is called equivalent whose true angle lies at the margin, .79 deg, or
beyond. It is counted at the ten targets; at targets a margin beyond the end of the path, where the setting stays at the edge
whatever is poured; and where the response bends.

THE LEAST NUMBER. n heaps at one setting with the scatter s have a mean known to t s/sqrt(n). A test within the margin m can pass at
all only where that is below m, with the t of its level and n - 1 degrees of freedom: n = 15 on the path at s = 1.4, m = .79 (16,
in batches of two and at the level of 2 % that holds 5 % under stopping), and 8 heaps of the screening: 23 or 24. Heaps that
take no part in the choice of the setting are not to be had for that: at a setting that is exact, two one-sided t tests at 5 % need
11 to pass at all, 19 to pass every second time and 28 four times in five (`doe.validation.tost_power`), 27 with the screening even if
that placed the setting without error; and as p heaps on the path leave an error s/sqrt(p), some forty in all (`least_apart`). So
--few tests the heaps that placed the setting, at a level that allows for it.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
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

ROOT = Path(__file__).resolve().parent.parent
SCATTERS = (1.2, 1.4, 3.1)
TARGETS = 10
LEVEL_DEG = 46.8  # of the heaps at the middle of Table 6
CHAIN = {"full_chain_heaps": 41 + 18 + 41, "a_heap_a_point_heaps": 17 + 6 + 17}  # screening, climb, one box
BEND = -0.5  # deg per squared half range of the path


def effects(study: Path = ROOT / "results" / "full") -> np.ndarray:
    """Half the effects of the screening, deg per coded unit of A to G."""
    return pd.read_csv(study / "screening" / "effects.csv")["effect_deg"].to_numpy() / 2


def draw(
    plan: Plan,
    angle_of: Callable[[np.ndarray], np.ndarray],
    scatter: float,
    rng: np.random.Generator,
    beyond: float | None = None,
) -> tuple[int, bool, float]:
    """One calibration on a synthetic response: its heaps, whether it calls its setting equivalent, how far that is off (deg).

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
    off = float(angle_of(found.place * path.direction[None])[0]) - plan.target
    return few_heaps.SCREENED + len(poured), miss + half < plan.margin, off


def past_the_end(path: Uphill, angle_of: Callable[[np.ndarray], np.ndarray], beyond: float) -> float:
    """The angle at that end of a path which is higher, and so much more."""
    ends = angle_of(np.outer([path.low, path.high], path.direction))
    return float(ends.max() + beyond)


def false_equivalence(draws: list[tuple[int, bool, float]], margin: float) -> float:
    """Share of draws that call a setting equivalent whose angle is off by the margin or more."""
    return float(np.mean([called and abs(off) >= margin - 1e-9 for _, called, off in draws]))


def heaps_of(draws: list[tuple[int, bool, float]]) -> np.ndarray:
    """Heaps of each draw; the most there may be where equivalence is not shown."""
    return np.array([number if called else few_heaps.MOST for number, called, _ in draws])


def least(margin: float, scatter: float, level: float = 0.05, power: float = 0.0) -> int:
    """Least heaps at an exact setting with which the two one-sided t tests pass, at all or with a probability."""
    for n in range(2, 10_000):
        error = scatter / n**0.5
        if stdtrit(n - 1, 1 - level) * error < margin and tost_power(margin, error, n - 1, level) >= power:
            return n
    raise ValueError(f"a scatter of {scatter:g} deg and a margin of {margin:g}: expected less than 10,000 heaps")


def least_apart(margin: float, scatter: float, power: float = 0.5) -> tuple[int, int]:
    """Least heaps on the path and for a test of their own, once, that pass with a probability; the screening's come besides."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(31)
    found = None
    first = least(margin, scatter)
    for apart in range(first, 12 * first):
        for path in range(2, 12 * first) if found is None else range(2, sum(found) - apart):
            passes = [tost_power(margin, scatter / apart**0.5, apart - 1, 0.05, x * scatter / path**0.5) for x in nodes]
            if weights @ passes / weights.sum() >= power:
                found = path, apart
                break
    if found is None:
        raise ValueError(f"a scatter of {scatter:g} deg and a margin of {margin:g}: expected a larger margin")
    return found


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
        [draw(replace(plan, target=target), straight, scatter, rng) for _ in range(draws // TARGETS)] for target in targets
    ]
    every = [one for some in each for one in some]
    edge = [draw(plan, straight, scatter, rng, beyond=margin) for _ in range(draws)]
    curved = [draw(replace(plan, target=rng.choice(targets)), bent, scatter, rng) for _ in range(draws)]
    called = [off for _, yes, off in every if yes]
    medians = [float(np.median(heaps_of(some))) for some in each]
    path, apart = least_apart(margin, scatter)
    validating = int(np.ceil((scatter / FULL.wanted_error) ** 2))
    return {
        "scatter_deg": scatter,
        "margin_deg": margin,
        "draws": len(every),
        "median_heaps": float(np.median(heaps_of(every))),
        "lowest_median_of_a_target": min(medians),
        "highest_median_of_a_target": max(medians),
        "ninth_decile_heaps": float(np.quantile(heaps_of(every), 0.9)),
        "shown_equivalent": np.mean([yes for _, yes, _ in every]),
        "setting_error_rms_deg": float(np.sqrt(np.mean(np.square(called)))) if called else np.nan,
        "false_equivalence": false_equivalence(every, margin),
        "false_equivalence_at_the_edge": false_equivalence(edge, margin),
        "false_equivalence_where_it_bends": false_equivalence(curved, margin),
        "least_heaps_on_the_path": few_heaps.needed(scatter, plan),
        "own_heaps_to_pass_at_all": least(margin, scatter),
        "own_heaps_to_pass_half": least(margin, scatter, power=0.5),
        "own_heaps_to_pass_four_in_five": least(margin, scatter, power=0.8),
        "least_median_with_own_heaps": few_heaps.SCREENED + path + apart,
        **{name: before + max(FULL.fewest, validating) for name, before in CHAIN.items()},
    }


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
