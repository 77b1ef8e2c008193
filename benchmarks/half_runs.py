"""A calibration in few heaps against the whole chain, on five targets: results/checks/half_runs.csv and figure.

    .venv/bin/python benchmarks/half_runs.py [--workers 1]

Heaps of 8 g (481 grains, cheap), 40 mm below the outlet. For each target angle `calibrate --few` runs until its line has a
standard error of 0.5 deg; then CHECKS heaps at the setting it found, with seeds of their own, say what its angle is (they
count for neither). The chain's heaps need no target: its designs (a heap a point as in the paper: 17 + 6 + 17; three a point
as in results/full: 41 + 18 + 41) and as many heaps in the validation as the scatter of a heap asks for the same standard
error. The cost of a heap is its number of time steps. Stored: resumable.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.output import style
from pellet_study.powder import few_heaps
from pellet_study.powder.from_study import plan_of
from pellet_study.powder.heaps import Heaps
from pellet_study.powder.plan import OBSERVABLE
from pellet_study.powder.results import Results
from pellet_study.study import load
from yade_scripts.powder_scene import damper_share

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "results" / "checks"
MASS_G, HEIGHT_MM = 8.0, 40.0
TARGETS = (33.5, 34.5, 35.5, 36.5, 37.5)
WANTED_ERROR = 0.5  # deg
CHECKS = 12


def steps(runs: pd.DataFrame, store: Path) -> float:
    """Relative cost of heaps: simulated time over the share of the time step that their dampers leave."""
    rows = pd.concat(pd.read_csv(f) for f in store.glob("repose-*.csv")).drop_duplicates("id").set_index("id")
    kept = runs[runs["id"].isin(rows.index)]
    share = kept["D"].map(damper_share).to_numpy()
    return float(np.nansum(pd.to_numeric(rows.loc[kept["id"], "end_time_s"]).to_numpy() / share))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int)
    workers = parser.parse_args().workers
    plan = plan_of(load(ROOT / "results" / "full"))
    plan = replace(plan, conditions={"powder_mass_g": MASS_G, "outlet_height_mm": HEIGHT_MM})
    rows = []
    for target in TARGETS:
        folder = FOLDER / ".half_runs" / f"{target:g}"
        store = FOLDER / ".half_runs" / "store"
        aimed = replace(plan, target=target)
        heaps = Heaps(aimed, store, workers=workers, quiet=True, say=print)
        found = few_heaps.calibrate(heaps, Results(aimed, folder), WANTED_ERROR)
        screening, path = (pd.read_csv(folder / "path" / f"{name}.csv") for name in ("screening", "runs"))
        checked = heaps.at("validation", [found.point] * CHECKS, first=5_000)
        angle = checked.loc[checked["verdict"] == "ok", OBSERVABLE]
        validation = np.ceil((found.scatter_deg / WANTED_ERROR) ** 2)
        beside = steps(path, store) / len(path)  # of a heap that is not in the screening
        first = steps(screening, store)
        whole = {n: n * first + (5 + n * 6 + n * 12 + 5 + validation) * beside for n in (1, 3)}
        few = first + steps(path, store)
        rows.append(
            {
                "target_deg": target,
                "found_deg": float(angle.mean()),
                "found_error_deg": float(angle.std(ddof=1) / np.sqrt(len(angle))),
                "line_error_deg": found.standard_error_deg,
                "met": found.met,
                "few_heaps": found.heaps,
                "paper_design_heaps": 40 + validation,
                "full_chain_heaps": 100 + validation,
                "cost_over_paper_design": few / whole[1],
                "cost_over_full_chain": few / whole[3],
                "setting": ", ".join(f"{n} {found.point[n]:.3f}" for n in found.factors),
            }
        )
        print(pd.DataFrame(rows[-1:]).round(3).to_string(index=False, header=len(rows) == 1), flush=True)
    table = pd.DataFrame(rows).round(4)
    table.to_csv(FOLDER / "half_runs.csv", index=False, lineterminator="\n")
    style.save(drawn(table), FOLDER / "figures" / "half_runs.png")
    for name in ("paper_design", "full_chain"):
        share = table[f"cost_over_{name}"]
        print(f"time steps of --few over {name}: median {share.median():.2f} ({share.min():.2f} to {share.max():.2f})")


@style.styled
def drawn(table: pd.DataFrame):
    """Heaps of each way, and what the setting of --few gives, for each target."""
    figure, (cost, angle) = style.new_axes(8.0, 3.6, ncols=2)
    place = np.arange(len(table))
    for shift, name, label, colour in (
        (-0.27, "full_chain", "chain, three heaps a point", style.MODEL),
        (0.0, "paper_design", "chain, a heap a point", style.LIGHT),
        (0.27, "few", "calibrate --few", style.MEASURED),
    ):
        cost.bar(place + shift, table[f"{name}_heaps"], 0.27, color=colour, label=label)
    cost.set_xticks(place, [f"{t:g}" for t in table["target_deg"]])
    cost.set_xlabel("target (deg)")
    cost.set_ylabel("heaps to a standard error of 0.5 deg")
    cost.set_ylim(0, 1.35 * table["full_chain_heaps"].max())
    cost.legend(loc="upper right")
    angle.errorbar(
        table["target_deg"], table["found_deg"] - table["target_deg"], 1.96 * table["found_error_deg"],
        fmt="o", color=style.MEASURED, capsize=3,
    )  # fmt: skip
    angle.axhline(0, color="black", linewidth=0.8)
    angle.set_xlabel("target (deg)")
    angle.set_ylabel("angle at the setting found\nby --few, minus target (deg)")
    return figure


if __name__ == "__main__":
    main()
