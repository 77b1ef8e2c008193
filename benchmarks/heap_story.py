"""The readings of results/heap_story: heaps of a powder whose grains resist rolling, which the study's model does not know.

    .venv/bin/python benchmarks/heap_story.py [--workers 1]      # 15 heaps of 500 grains, some 3 cpu minutes
    .venv/bin/pellet-study refine results/heap_story --figures

Rolling friction 0.218 and sliding friction 0.814, by seeds that no model has, contacts 0.4 times as stiff and two thirds of the
time step. The conditions are those of the heap trials (pellet_study/challenge/heaps.py).
"""

import argparse
from pathlib import Path

import numpy as np

from pellet_study.challenge import sealed
from pellet_study.challenge.heaps import HEAPS
from pellet_study.simulation import dispatch

FOLDER = Path(__file__).resolve().parents[1] / "results" / "heap_story"
NUMBER = 99  # of a trial; there are not so many
TRUTH = {
    "parameters": {"powder_static_friction": 0.814},
    "effects": {"rolling_resistance": 0.218},
    "numerics": "other",
}


def main() -> None:
    """Simulate the readings and write measurements.csv."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int)
    cases = sealed.cases_of(HEAPS, NUMBER, TRUTH)
    found = dispatch.run(cases, FOLDER / ".store", workers=parser.parse_args().workers)
    heights = found[HEAPS.observables["repose"]].to_numpy(dtype=float)
    told = (FOLDER / "study.toml").read_bytes()  # which has more than a trial's
    HEAPS.write(FOLDER, HEAPS.rows(np.split(heights, len(HEAPS.conditions))))
    (FOLDER / "study.toml").write_bytes(told)
    print((FOLDER / "measurements.csv").read_text())


if __name__ == "__main__":
    main()
