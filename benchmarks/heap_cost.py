"""Cpu seconds of a heap against its number of grains: the default rig, 500 to 8,000 grains of one size.

    .venv/bin/python benchmarks/heap_cost.py [--results results/checks] [--most 4000]

All lengths of the rig go with the cube root of the mass of powder (`shaped` of repose_checks.py); powders of the middle of the paper's
Table 6 with surface energy 0.2 J/m2 and without, one heap a size. Cpu seconds are user plus system time of YADE, its start
included: on a machine whose other core works too they are up to twice as many. Writes heap_cost.csv and
figures/heap_cost.png; some 10 cpu minutes up to 4,000 grains.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
from by_hand import by_hand
from repose_checks import case, shaped

SIZES = (500, 1000, 1503, 2000, 4000, 8000)
ENERGIES = (0.0, 0.2)  # J/m2
SEED = 92_000


def measured(grains: int, surface_energy: float) -> dict:
    """One heap."""
    wanted = case(SEED, shaped(grains) | {"powder_surface_energy": surface_energy})
    with tempfile.TemporaryDirectory(prefix="heap-") as folder:
        row, seconds = by_hand(wanted, Path(folder))
    return {
        "surface_energy_j_m2": surface_energy,
        "grains": grains,
        "cpu_seconds": round(seconds, 2),
        "end_time_s": round(row["end_time_s"], 3),
        "angle_deg": round(row["repose_angle_deg"], 2),
        "status": row["status"],
    }


def exponent(table: pd.DataFrame) -> float:
    """Slope of log cpu seconds against log grains, least squares."""
    return float(np.polyfit(np.log(table["grains"]), np.log(table["cpu_seconds"]), 1)[0])


def draw(table: pd.DataFrame, file: Path) -> None:
    """Cpu seconds against grains, and a straight line of slope 1."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from pellet_study.output.style import LINE, SERIES, STYLE

    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(4.4, 3.2), layout="constrained")
        for (energy, heaps), marker, colour in zip(table.groupby("surface_energy_j_m2"), "so", SERIES, strict=False):
            axes.loglog(heaps["grains"], heaps["cpu_seconds"], f"{marker}-", color=colour, label=f"G = {energy:g} J/m2")
        first = heaps.iloc[0]
        even = first["cpu_seconds"] * heaps["grains"] / first["grains"]
        axes.loglog(heaps["grains"], even, ":", color=LINE, label="in proportion to the grains")
        axes.set(xlabel="grains", ylabel="cpu seconds a heap")
        axes.set_xticks(heaps["grains"], [f"{grains:,}" for grains in heaps["grains"]])
        low, high = axes.get_ylim()
        seconds = [value for value in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000) if low <= value <= high]
        axes.set_yticks(seconds, [str(value) for value in seconds])
        axes.minorticks_off()
        axes.legend()
        file.parent.mkdir(exist_ok=True)
        figure.savefig(file, dpi=150)


def main() -> None:
    """Measure, write, draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", type=Path, default=Path("results/checks"), metavar="FOLDER")
    parser.add_argument("--most", type=int, default=4000, metavar="GRAINS")
    given = parser.parse_args()
    rows = []
    for grains in SIZES:
        for energy in ENERGIES if grains <= given.most else ():
            rows.append(measured(grains, energy))
            print(*rows[-1].values(), flush=True)
    table = pd.DataFrame(rows).sort_values(["surface_energy_j_m2", "grains"])
    table.to_csv(given.results / "heap_cost.csv", index=False, lineterminator="\n")
    draw(table, given.results / "figures" / "heap_cost.png")
    for energy, heaps in table.groupby("surface_energy_j_m2"):
        print(f"G {energy:g}: cpu seconds go with the number of grains to the power {exponent(heaps):.2f}")


if __name__ == "__main__":
    main()
