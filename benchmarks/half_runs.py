"""A calibration in few heaps against the whole chain, on the same five targets: results/checks/half_runs.csv and figure.

    .venv/bin/python benchmarks/half_runs.py [--workers 1]

Heaps of 8 g (481 grains, cheap), 40 mm below the outlet. The targets are angles; for each the chain runs with the paper's designs (12 + 5, 6 and 17
heaps, a heap a point) until the mean at its optimum has a standard error of 0.3 deg, and `calibrate --few` until its line
has. Then CHECKS heaps at the setting that --few found, with seeds of their own, say what its angle is; they belong to
neither. The cost of a heap is its number of time steps, in cpu seconds by one heap that is timed. Stored: resumable.
"""

import argparse
import resource
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from pellet_study import look, powder_chain, powder_path, study
from pellet_study.powder_chain import OBSERVABLE
from yade_scripts.powder_scene import damper_share

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "results" / "checks"
MASS_G, HEIGHT_MM = 8.0, 40.0
TARGETS = (38.0, 39.5, 41.0, 42.5, 44.0)
SIZES = powder_chain.Sizes(repeats=1, centre_points=5, fewest=8, most=60, wanted_error=0.3)
CHECKS = 12


def steps(runs: pd.DataFrame, store: Path) -> float:
    """Relative cost of heaps: simulated time over the share of the time step that their dampers leave."""
    rows = pd.concat(pd.read_csv(f) for f in store.glob("repose-*.csv")).drop_duplicates("id").set_index("id")
    kept = runs[runs["id"].isin(rows.index)]
    share = kept["D"].map(damper_share).to_numpy()
    return float((pd.to_numeric(rows.loc[kept["id"], "end_time_s"]).to_numpy() / share).sum())


def cpu_of_a_step(plan: powder_chain.Plan) -> float:
    """Cpu seconds of one heap at the middle of the box over its relative cost."""
    with TemporaryDirectory() as folder:
        chain = powder_chain.Chain(plan, Path(folder), Path(folder) / "store", SIZES, workers=1, quiet=True)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        runs = chain.heaps("validation", [{}])
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        return spent / steps(runs, chain.store)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int)
    workers = parser.parse_args().workers
    plan = powder_chain.plan_of(study.load(ROOT / "results" / "full"))
    plan = replace(plan, conditions={"powder_mass_g": MASS_G, "outlet_height_mm": HEIGHT_MM})
    rate = cpu_of_a_step(plan)
    rows = []
    for target in TARGETS:
        folder = FOLDER / ".half_runs" / f"{target:g}"
        chain = powder_chain.Chain(
            replace(plan, target=target), folder, FOLDER / ".half_runs" / "store", SIZES, workers, quiet=True
        )
        decisions = chain.run()
        runs = pd.read_csv(folder / "runs.csv")
        whole = {"heaps": len(runs), "cpu_s": rate * steps(runs, chain.store)}
        found = powder_path.calibrate(chain)
        few = pd.concat(pd.read_csv(folder / "path" / f"{name}.csv") for name in ("screening", "runs"))
        begun = time.perf_counter()
        checked = chain.heaps("validation", [found["point"]] * CHECKS, first=5_000)
        angle = checked.loc[checked["verdict"] == "ok", OBSERVABLE]
        rows.append(
            {
                "target_deg": target,
                "chain_mean_deg": decisions["validation"]["mean_deg"],
                "chain_standard_error_deg": decisions["validation"]["standard_error_deg"],
                "chain_heaps": whole["heaps"],
                "chain_cpu_s": whole["cpu_s"],
                "few_standard_error_deg": found["standard_error_deg"],
                "few_heaps": found["heaps"],
                "few_cpu_s": rate * steps(few, chain.store),
                "few_met": found["met"],
                "few_checked_mean_deg": float(angle.mean()),
                "few_checked_standard_error_deg": float(angle.std(ddof=1) / np.sqrt(len(angle))),
                "few_point": ", ".join(f"{n} {found['point'][n]:.3f}" for n in found["factors"]),
            }
        )
        print(
            pd.DataFrame(rows[-1:]).round(3).to_string(index=False), f"{time.perf_counter() - begun:.0f} s", flush=True
        )
    table = pd.DataFrame(rows).round(4)
    table.to_csv(FOLDER / "half_runs.csv", index=False, lineterminator="\n")
    look.save(drawn(table), FOLDER / "figures" / "half_runs.png")
    share = table["few_cpu_s"] / table["chain_cpu_s"]
    print(
        f"cpu seconds of --few over the chain's: median {share.median():.2f} ({share.min():.2f} to {share.max():.2f})"
    )


@look.styled
def drawn(table: pd.DataFrame):
    """Cost of both, and what the setting of --few gives, for each target."""
    figure, (cost, angle) = look.new_axes(8.0, 3.6, ncols=2)
    place = np.arange(len(table))
    cost.bar(place - 0.2, table["chain_cpu_s"], 0.4, color=look.MODEL, label="whole chain")
    cost.bar(place + 0.2, table["few_cpu_s"], 0.4, color=look.MEASURED, label="calibrate --few")
    cost.set_xticks(place, [f"{t:g}" for t in table["target_deg"]])
    cost.set_xlabel("target (deg)")
    cost.set_ylabel("cpu seconds to a standard error of 0.3 deg")
    cost.legend()
    for name, shift, colour in (("chain", -0.06, look.MODEL), ("few_checked", 0.06, look.MEASURED)):
        angle.errorbar(
            table["target_deg"] + shift, table[f"{name}_mean_deg"] - table["target_deg"],
            1.96 * table[f"{name}_standard_error_deg"], fmt="o", color=colour, capsize=3,
        )  # fmt: skip
    angle.axhline(0, color="black", linewidth=0.8)
    angle.set_xlabel("target (deg)")
    angle.set_ylabel("angle at the setting found, minus target (deg)")
    return figure


if __name__ == "__main__":
    main()
