"""Powders whose parameters are known, calibrated by one reading of a pouring and by more: results/identify.

    .venv/bin/python benchmarks/identify.py [--surface results/full] [--powders 6] [--heaps 6]

A powder is a setting of all seven parameters: those of the surface drawn in its box, the others in their ranges of Table 6. Its
measurements are HEAPS pourings by our rig with seeds that no surface has, every second powder with grains three times as
stiff: the mean of each reading, and the scatter of the pourings as its sd. They are calibrated on the surface that is there, as
`calibrate --surface` does: by the angle alone, and by adding one reading after the other. Nothing of the powder is told but its
readings.

Writes a row a pouring to powders.csv as they come (a second call goes on where the first was stopped), a row a powder and set of
readings to identify.csv: the share of the box in the region that holds 95 %, whether it holds the truth, each parameter's
interval; summary.csv, a row a set of readings; shrinking.png, one powder's regions.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.doe import figures
from pellet_study.powder.decisions import Surface, read_decision
from pellet_study.powder.figures import corner
from pellet_study.powder.from_study import plan_of
from pellet_study.powder.identified import SurfaceHeaps, heaps_in, posteriors
from pellet_study.powder.plan import SYMBOLS, Plan, Reading
from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch
from pellet_study.study import load

ROOT = Path(__file__).resolve().parents[1]
ADDED = ("repose_flank_deg", "discharge_time_s", "fill_bulk_density_kg_m3", "repose_height_deg")
FIRST_SEED = 97_000
EDGE = 0.9  # of the box, in which the powders lie
STIFFER = {"stiffness_scale": 0.003}  # of every second powder: another simulator than that of the surface


def powders(heaps: SurfaceHeaps, number: int) -> list[dict[str, float]]:
    """{factor: level} of so many powders; more of them begin with the same ones."""
    factors = [*heaps.factors, *heaps.others]
    drawn = [np.random.default_rng([FIRST_SEED, k]).uniform(-EDGE, EDGE, len(factors)) for k in range(number)]
    return [{f.name: float(f.physical(x)) for f, x in zip(factors, one, strict=True)} for one in drawn]


def cases(plan: Plan, powder: dict[str, float], number: int, pourings: int) -> list[dict]:
    """The pourings of a powder."""
    numerics = plan.numerics | (STIFFER if number % 2 else {})
    return [
        on_yade.case(
            "repose",
            contact_law=plan.contact_law,
            seed=FIRST_SEED + 100 * number + k,
            parameters=plan.fixed | {SYMBOLS[name]: value for name, value in powder.items()},
            conditions=plan.conditions,
            numerics=numerics,
        )
        for k in range(pourings)
    ]


def engine_of(number: int) -> str:
    """What simulated a powder, in words."""
    return "YADE, stiffer grains" if number % 2 else "YADE"


def poured(
    plan: Plan, heaps: SurfaceHeaps, number: int, pourings: int, file: Path, workers: int | None
) -> pd.DataFrame:
    """The pourings of all powders, those of the file and what is missing there."""
    known = pd.read_csv(file) if file.exists() else pd.DataFrame(columns=["powder", "seed"])
    for k, powder in enumerate(powders(heaps, number)):
        there = set(known.loc[known["powder"] == k, "seed"])
        missing = [case for case in cases(plan, powder, k, pourings) if case["seed"] not in there]
        for start in range(0, len(missing), 2):  # two at a time, so that what is done is kept
            batch = missing[start : start + 2]
            found = dispatch.run(batch, file.parent / ".store", workers=workers, quiet=True)
            kept = found[["seed", "status", *ADDED]].assign(powder=k, engine=engine_of(k), **powder)
            known = pd.concat([known, kept[["powder", "engine", *powder, "seed", "status", *ADDED]]], ignore_index=True)
            known.to_csv(file, index=False, lineterminator="\n")
    return known


def measured(heaps: pd.DataFrame) -> list[Reading]:
    """Mean and scatter of a powder's pourings by each reading."""
    good = heaps[heaps["status"] == "ok"]
    return [
        Reading(name, float(values.mean()), float(values.std(ddof=1)), len(values), len(values) - 1)
        for name in ADDED
        for values in [good[name].dropna().astype(float)]
    ]


def lines(number: int, truth: dict[str, float], readings: list[Reading], heaps: SurfaceHeaps) -> Iterator[dict]:
    """A row for each set of readings, one added after the other."""
    factors = heaps.factors
    coded = np.array([f.coded(truth[f.name]) for f in factors])
    for count in range(1, len(readings) + 1):
        found, _ = posteriors(heaps, readings[:count])
        row = {
            "powder": number,
            "readings": count,
            "added": readings[count - 1].observable,
            "share_of_box": found.share(),
            "holds_truth": found.holds(coded),
        }
        for i, factor in enumerate(factors):
            low, high = found.interval(i)
            row |= {
                factor.name: truth[factor.name],
                f"{factor.name}_low": low,
                f"{factor.name}_high": high,
                f"{factor.name}_in": low <= truth[factor.name] <= high,
            }
        yield row


def summary(table: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    """A row a set of readings: share of the box (median), how many regions and intervals hold the truth."""
    first = table[table["readings"] == 1].set_index("powder")["share_of_box"]
    rows = []
    for (engine, count), part in table.groupby(["engine", "readings"], sort=False):
        shrunk = part["powder"].map(first) / part["share_of_box"]
        rows.append(
            {
                "engine": engine,
                "readings": count,
                "added": part["added"].iloc[0],
                "powders": len(part),
                "share_of_box_median": part["share_of_box"].median(),
                "shrunk_by_median": shrunk.median(),
                "regions_hold_truth": int(part["holds_truth"].sum()),
                **{f"{name}_intervals_hold": int(part[f"{name}_in"].sum()) for name in names},
            }
        )
    return pd.DataFrame(rows)


def main() -> None:
    """Pour what is missing, calibrate, write the tables and the figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--surface", type=Path, default=ROOT / "results" / "full", help="results of a chain")
    parser.add_argument("--results", type=Path, default=ROOT / "results" / "identify")
    parser.add_argument("--powders", type=int, default=6)
    parser.add_argument("--heaps", type=int, default=6, help="pourings of a powder")
    parser.add_argument("--workers", type=int)
    asked = parser.parse_args()
    plan = plan_of(load(asked.surface))
    decision: Surface = read_decision(asked.surface, "surface")
    units = {f.name: f.unit for f in plan.factors}
    heaps = heaps_in(asked.surface, asked.surface, decision, plan.observable, units)
    if missing := [name for name in ADDED if name not in heaps.runs]:
        parser.error(f"--surface {asked.surface}: its heaps were kept without {', '.join(missing)}")
    asked.results.mkdir(parents=True, exist_ok=True)
    all_of_them = poured(plan, heaps, asked.powders, asked.heaps, asked.results / "powders.csv", asked.workers)
    rows, names = [], [f.name for f in heaps.factors]
    for number, mine in all_of_them.groupby("powder"):
        truth = {name: float(mine[name].iloc[0]) for name in names}
        for row in lines(number, truth, measured(mine), heaps):
            rows.append({"engine": mine["engine"].iloc[0], **row})
    table = pd.DataFrame(rows)
    table.to_csv(asked.results / "identify.csv", index=False, float_format="%.5g", lineterminator="\n")
    short = summary(table, names)
    short.to_csv(asked.results / "summary.csv", index=False, float_format="%.4g", lineterminator="\n")
    print(short.to_string(index=False))
    first = all_of_them[all_of_them["powder"] == 0]
    found, alone = posteriors(heaps, measured(first))
    figures.save({"shrinking": corner(found, alone, ADDED[0], found.recommended)}, asked.results)


if __name__ == "__main__":
    main()
