"""The three bench readings on both YADEs: the YADE here, and that of Debian 13.

    .venv/bin/python benchmarks/bench_versions.py [--seeds 64]

Every rig of the bench at the calibrated constants of results/bench, the same seeds on both. Writes
results/checks/bench_versions.csv: mean and standard deviation over the seeds on each, the difference with its 95 % interval
(Welch), and whether the whole interval lies within one standard deviation over seeds: `within scatter`; some cpu minutes.
"""

import argparse
import tempfile
from pathlib import Path

import other_yade
import pandas as pd
from scipy import stats

from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch, yade

FILE = other_yade.ROOT / "results" / "checks" / "bench_versions.csv"
READINGS = {"rebound": "rebound_height_mm", "slope_slip": "slip_angle_deg", "inclined_roll": "roll_distance_mm"}
FIRST_SEED = 91_000
POWDER = {  # the calibrated ones of results/bench, rounded
    "seed_powder_restitution": 0.23,
    "seed_powder_static_friction": 0.62,
    "seed_powder_rolling_friction": 0.25,
}


def here(seeds: int) -> pd.DataFrame:
    """Every reading of the YADE here, a row a simulation."""
    rows = []
    for rig, reading in READINGS.items():
        known = {name: value for name, value in POWDER.items() if name in on_yade.rig(rig).parameters}
        cases = [on_yade.case(rig, seed=FIRST_SEED + k, parameters=known) for k in range(seeds)]
        with tempfile.TemporaryDirectory() as folder:
            found = dispatch.run(cases, Path(folder) / ".store", quiet=True)
        rows += [{"yade": yade.version(), "rig": rig, "value": value} for value in found[reading]]
    return pd.DataFrame(rows)


def compared(rows: pd.DataFrame) -> pd.DataFrame:
    """Differences of the later version from the earlier, a line a rig."""
    lines = []
    for rig, reading in READINGS.items():
        of_rig = rows[rows["rig"] == rig].groupby("yade")["value"]
        (one, before), (other, after) = ((version, values.to_numpy()) for version, values in of_rig)
        test = stats.ttest_ind(after, before, equal_var=False)
        interval = test.confidence_interval()
        scatter = (0.5 * (before.var(ddof=1) + after.var(ddof=1))) ** 0.5
        line = {"rig": rig, "reading": reading, "seeds": len(before)}
        line |= {one: before.mean(), other: after.mean(), "sd_over_seeds": scatter}
        line |= {"difference": after.mean() - before.mean(), "low": interval.low, "high": interval.high}
        lines.append(line | {"within_scatter": max(abs(interval.low), abs(interval.high)) <= scatter})
    return pd.DataFrame(lines)


def main() -> None:
    """Simulate on both and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=64)
    parser.add_argument(
        "--here", action="store_true", help="on this YADE alone, a row a simulation, on standard output"
    )
    given = parser.parse_args()
    rows = here(given.seeds)
    if given.here:
        print(rows.to_csv(index=False, float_format="%.9g"))
        return
    there = other_yade.table(Path(__file__).name, "yade", "--seeds", str(given.seeds))
    table = compared(pd.concat([rows, there]))
    table.to_csv(FILE, index=False, lineterminator="\n", float_format="%.5g")
    print(table.to_string(index=False))


if __name__ == "__main__":
    main()
