"""Our dispatch against yade-batch on the same rebound cases, side by side in one run.

    .venv/bin/python benchmarks/dispatch.py [--cases 60] [--pairs 3]

Prints, for each pair of runs: cases per second of both and their ratio; our cost per case besides the physics, the use
of the cores while YADE works, and the time of a second call with everything stored. Both run the same rig code on the
same seeds, and their rebound heights are compared to the bit.
"""

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pandas as pd

from pellet_study.rigs import on_yade
from pellet_study.rigs.scripts import SCRIPTS
from pellet_study.simulation import dispatch, yade


def ours(cases: list[dict], store: Path) -> tuple[float, pd.DataFrame]:
    """Seconds and rows of our dispatch."""
    start = time.perf_counter()
    rows = dispatch.run(cases, store, quiet=True)
    return time.perf_counter() - start, rows


def yade_batch(number: int, folder: Path) -> tuple[float, pd.DataFrame]:
    """Seconds and rows of yade-batch on the same number of cores."""
    table = folder / "params.table"
    table.write_text("seed\n" + "\n".join(map(str, range(number))) + "\n")
    script = Path(shutil.copy(Path(__file__).with_name("batch_rebound.py"), folder))  # its logs go beside it
    start = time.perf_counter()
    subprocess.run(
        [
            "yade-batch",
            f"-j{dispatch.cores()}",
            "--job-threads=1",
            "--nice=0",
            str(table),
            str(script),
        ],
        cwd=folder,
        check=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={k: v for k, v in yade.environment(str(folder), SCRIPTS=str(SCRIPTS)).items() if "OMPI" not in k},
    )
    return time.perf_counter() - start, pd.read_csv(folder / "results.csv")


def second_call(number: int, store: Path) -> float:
    """Seconds of a fresh Python that asks for the same cases again, all of them stored."""
    program = (
        "import sys; from pathlib import Path; from pellet_study import rigs; "
        "from pellet_study.simulation import dispatch; "
        f"dispatch.run([rigs.case('rebound', seed=seed) for seed in range({number})], Path(sys.argv[1]))"
    )
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", program, str(store)], check=True)
    return time.perf_counter() - start


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--pairs", type=int, default=3)
    arguments = parser.parse_args()
    number = arguments.cases
    cases = [on_yade.case("rebound", seed=seed) for seed in range(number)]
    ratios = []
    for pair in range(arguments.pairs):
        folder = Path(tempfile.mkdtemp(prefix="dispatch-"))
        try:
            few = [on_yade.case("rebound", seed=10**6 + k) for k in range(dispatch.cores())]
            startup = min(ours(few, folder / f"start{k}")[0] for k in range(3))
            seconds, rows = ours(cases, folder / "store")
            again = second_call(number, folder / "store")
            theirs, others = yade_batch(number, folder)
            physics = pd.read_csv(folder / "store" / "timings.csv")["seconds"].sum()
            heights = rows.set_index("seed")["rebound_height_mm"].astype(float)
            same = (others.set_index("seed")["rebound_height_mm"].sort_index() == heights.sort_index()).all()
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        ratios.append(theirs / seconds)
        working = max(seconds - startup, 1e-9)
        print(
            f"pair {pair + 1}: ours {number / seconds:8.1f} cases/s, yade-batch {number / theirs:6.2f} cases/s, ratio "
            f"{theirs / seconds:6.1f}; start {startup:.2f} s, besides physics "
            f"{1e3 * (working * dispatch.cores() - physics) / number:.2f} core-ms a case, cores in use "
            f"{physics / (working * dispatch.cores()):.0%}, all stored {again:.3f} s, same heights: {same}"
        )
    print(f"median ratio on {number} cases: {statistics.median(ratios):.1f} ({os.cpu_count()} cores)")


if __name__ == "__main__":
    main()
