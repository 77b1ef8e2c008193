"""The source paper's 13 + 17 simulated heaps and its optimum in our rig: theirs and ours, results/paper_heaps.

    .venv/bin/python benchmarks/paper_heaps.py [--seeds 4] [--workers 1]

Every row of results/paper_heaps/measurements.csv (Tables 7 and 12 and the verification) is simulated with its own
parameters; nothing is calibrated. heaps.csv has a row a heap; beside.csv a row a point; effects.csv what a half range
of each factor of Table 6 does to the angle, theirs, ours and the difference, by least squares over all points. Stored:
resumable.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd
import statsmodels.api as sm

from pellet_study.output import style
from pellet_study.paper.designs import screening_factors
from pellet_study.powder.plan import IDLE, OBSERVABLE, RIG, SYMBOLS
from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch
from pellet_study.study import load

FOLDER = Path(__file__).resolve().parent.parent / "results" / "paper_heaps"
FIRST_SEED = 70_000


def simulated(rows, law: str, seeds: int, workers: int | None) -> pd.DataFrame:
    """A row a heap: point, seed, angle, verdict."""
    cases = [
        on_yade.case(RIG, contact_law=law, seed=FIRST_SEED + k * 100 + s, parameters=row.parameters, conditions=row.conditions)
        for k, row in enumerate(rows)
        for s in range(seeds)
    ]  # fmt: skip
    found = dispatch.run(cases, FOLDER / ".store", workers=workers)
    return pd.DataFrame(
        {
            "point": np.repeat([row.note for row in rows], seeds),
            "seed": [case["seed"] for case in cases],
            OBSERVABLE: pd.to_numeric(found[OBSERVABLE], errors="coerce").round(4),
            "verdict": found["status"],
        }
    )


def effects(beside: pd.DataFrame, coded: np.ndarray, names: list[str]) -> pd.DataFrame:
    """Slopes over all points for their angles, ours, and the difference, with standard errors, deg a half range."""
    terms = sm.add_constant(coded)
    table = pd.DataFrame({"factor": ["level", *names]})
    for what in ("paper_deg", "ours_deg", "difference_deg"):
        found = sm.OLS(beside[what].to_numpy(), terms, missing="drop").fit()
        table[what.replace("_deg", "_slope_deg")] = found.params.round(3)
        table[what.replace("_deg", "_error_deg")] = found.bse.round(3)
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--workers", type=int)
    given = parser.parse_args()
    loaded = load(FOLDER)
    heaps = simulated(loaded.rows, loaded.contact_law, given.seeds, given.workers)
    heaps.to_csv(FOLDER / "heaps.csv", index=False, lineterminator="\n")
    groups = heaps.groupby("point", sort=False)[OBSERVABLE]
    beside = pd.DataFrame(
        {
            "point": [row.note for row in loaded.rows],
            "paper_deg": [row.value for row in loaded.rows],
            "ours_deg": groups.mean().round(3).to_numpy(),
            "standard_error_deg": groups.sem().round(3).to_numpy(),
            "heaps": groups.count().to_numpy(),
        }
    )
    beside["difference_deg"] = (beside["paper_deg"] - beside["ours_deg"]).round(3)
    beside.to_csv(FOLDER / "beside.csv", index=False, lineterminator="\n")
    factors = [f for f in screening_factors() if f.name not in IDLE[loaded.contact_law]]
    coded = np.array([[f.coded(row.parameters[SYMBOLS[f.name]]) for f in factors] for row in loaded.rows])
    told = effects(beside, coded, [f.name for f in factors])
    told.to_csv(FOLDER / "effects.csv", index=False, lineterminator="\n")
    style.save(drawn(beside), FOLDER / "beside.png")
    print(told.to_string(index=False))
    for table in ("", "Table 7", "Table 12"):
        mine = beside[beside["point"].str.startswith(table)].dropna(subset="ours_deg")
        slope, _ = np.polyfit(mine["ours_deg"], mine["paper_deg"], 1)
        print(
            f"paper against ours, {table or 'all'}, {len(mine)} points: correlation "
            f"{mine['paper_deg'].corr(mine['ours_deg']):.2f}, rank correlation "
            f"{mine['paper_deg'].corr(mine['ours_deg'], method='spearman'):.2f}, slope {slope:.2f}"
        )


@style.styled
def drawn(beside: pd.DataFrame):
    """Theirs against ours, a point a setting."""
    figure, axes = style.new_axes(5.0, 4.4)
    for table, colour, marker in (
        ("Table 7", style.MODEL, "o"),
        ("Table 12", style.MEASURED, "s"),
        ("verification", "black", "*"),
    ):
        mine = beside[beside["point"].str.startswith(table)]
        axes.errorbar(
            mine["ours_deg"],
            mine["paper_deg"],
            xerr=mine["standard_error_deg"],
            fmt=marker,
            color=colour,
            label=table,
            capsize=2,
        )
    ends = [beside[["ours_deg", "paper_deg"]].min().min() - 1, beside[["ours_deg", "paper_deg"]].max().max() + 1]
    axes.plot(ends, ends, color="black", linewidth=0.8)
    axes.set_xlabel("our heaps (deg)")
    axes.set_ylabel("the source paper's heaps (deg)")
    axes.legend()
    return figure


if __name__ == "__main__":
    main()
