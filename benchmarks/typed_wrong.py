"""How often `diagnose` names a row as typed wrong, where one is and where none is.

    .venv/bin/python benchmarks/typed_wrong.py [--sets 500]

Sets of eight shear-cell readings (normal stress 500 to 4,000 Pa, sd 20 Pa) of friction 0.6, with and without a hidden
cohesion of 150 Pa, as they are and with two digits of one reading swapped (by 90 Pa or more). Writes
results/checks/typed_wrong.csv: sets, how many have a row named, and how many the row that is wrong; some 80 cpu seconds.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

import pellet_study as ps

FILE = Path(__file__).resolve().parents[1] / "results" / "checks" / "typed_wrong.csv"
STRESS_PA, FRICTION, COHESION_PA, SD_PA = np.arange(500.0, 4001.0, 500.0), 0.6, 150.0, 20.0
LEAST_PA = 90.0  # that two digits must differ by to count as wrong


def swapped(value: float, draw: np.random.Generator) -> float:
    """A reading with two neighbouring digits swapped, by `LEAST_PA` or more."""
    digits = list(f"{value:.0f}")
    for place in draw.permutation(len(digits) - 1):
        changed = digits.copy()
        changed[place], changed[place + 1] = changed[place + 1], changed[place]
        if abs(float("".join(changed)) - value) >= LEAST_PA:
            return float("".join(changed))
    return value + 10 ** (len(digits) - 1)  # all digits alike: the first one


def named(cohesion_pa: float, wrong: bool, seed: int) -> tuple[bool, bool]:
    """Whether a row is named in one set, and whether it is the wrong one."""
    draw = np.random.default_rng([92_500, seed])
    stress = FRICTION * STRESS_PA + cohesion_pa + SD_PA * draw.standard_normal(len(STRESS_PA))
    place = int(draw.integers(len(stress)))
    if wrong:
        stress[place] = swapped(stress[place], draw)
    readings = pd.DataFrame({"normal_stress_pa": STRESS_PA, "value": stress.round(0), "sd": SD_PA})
    readings = readings.assign(rig="shear_cell", observable="shear_stress_pa")
    row = ps.diagnose(ps.study_of(readings, parameters={"internal_friction": (0.1, 1.5)})).lone_row
    return row is not None, row is not None and row["conditions"]["normal_stress_pa"] == STRESS_PA[place]


def main() -> None:
    """Count them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=500)
    sets = parser.parse_args().sets
    lines = []
    for cohesion in (0.0, COHESION_PA):
        for wrong in (False, True):
            found = np.array([named(cohesion, wrong, seed) for seed in range(sets)])
            line = {"hidden_cohesion_pa": cohesion, "one_reading_wrong": wrong, "sets": sets}
            lines.append(line | {"a_row_named": found[:, 0].sum(), "the_wrong_one": found[:, 1].sum() if wrong else ""})
            print(lines[-1], flush=True)
    pd.DataFrame(lines).to_csv(FILE, index=False, lineterminator="\n")


if __name__ == "__main__":
    main()
