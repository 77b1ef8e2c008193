"""Cpu seconds of a heap against its number of grains: funnels of one shape, 500 to 8,000 grains of one size.

    .venv/bin/python benchmarks/heap_cost.py [--results results/checks]

Outlet, funnel and outlet height go with the cube root of the mass of powder; all else is the heap of release 0.1 (its contact
law, a fixed mass on a plate) at the middle of the paper's Table 6, one heap a size. Cpu seconds are user plus system time of YADE, its start included. Writes
heap_cost.csv and figures/heap_cost.png; some 4 cpu minutes.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
from heap_liggghts import by_hand
from repose_checks import case

from pellet_study.rigs import on_yade
from yade_scripts import contacts, laws, powder_scene

SIZES = (500, 1000, 2000, 4000, 8000)
SEED = 92_000
LAW = laws.LOCAL_DAMPING
PLATE = {"protocol": "funnel", "outlet_height_mm": 60.0}


def scaled(grains: int) -> dict:
    """The heap of release 0.1 with so many grains in a funnel of the same shape."""
    known = on_yade.rig("repose")
    base = on_yade.case("repose", contact_law=LAW, conditions=PLATE)
    defaults = base["conditions"] | base["numerics"]
    radius = powder_scene.grain_radius(defaults["particle_diameter_um"], defaults["amplification"])
    mass = 1e3 * grains * powder_scene.grain_mass(radius, known.parameters["powder_density_kg_m3"]["default"])
    larger = (mass / defaults["powder_mass_g"]) ** (1 / 3)
    lengths = ("outlet_diameter_mm", "funnel_diameter_mm", "outlet_height_mm")
    return case(SEED, PLATE | {"powder_mass_g": mass} | {name: larger * defaults[name] for name in lengths}, LAW)


def step(case: dict) -> float:
    """Time step of a case, s."""
    given, numerics = case["parameters"], case["numerics"]
    softer = numerics["stiffness_scale"] * given["powder_shear_modulus_pa"]
    powder = contacts.Material(given["powder_density_kg_m3"], softer, given["powder_poisson_ratio"])
    radius = powder_scene.grain_radius(*(case["conditions"][n] for n in ("particle_diameter_um", "amplification")))
    share = numerics["time_step_fraction"] * powder_scene.damper_share(given["powder_steel_restitution"])
    return share * contacts.rayleigh_step(radius * (1 - numerics["size_spread"]), powder)


def measured(grains: int) -> dict:
    """One heap."""
    wanted = scaled(grains)
    with tempfile.TemporaryDirectory(prefix="heap-") as folder:
        row, seconds = by_hand(wanted, Path(folder))
    steps = 1e-6 * grains * row["end_time_s"] / step(wanted)
    return {
        "grains": grains,
        "cpu_seconds": round(seconds, 2),
        "million_grain_steps": round(steps, 2),
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

    from pellet_study.output.style import LINE, MODEL, STYLE

    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(4.4, 3.2), layout="constrained")
        axes.loglog(table["grains"], table["cpu_seconds"], "o-", color=MODEL, label="measured")
        middle = table.iloc[len(table) // 2]
        even = middle["cpu_seconds"] * table["grains"] / middle["grains"]
        axes.loglog(table["grains"], even, ":", color=LINE, label="in proportion to the grains")
        axes.set(xlabel="grains", ylabel="cpu seconds a heap")
        axes.set_xticks(table["grains"], [f"{grains:,}" for grains in table["grains"]])
        axes.set_yticks((5, 10, 20, 50, 100), ("5", "10", "20", "50", "100"))
        axes.minorticks_off()
        axes.legend()
        file.parent.mkdir(exist_ok=True)
        figure.savefig(file, dpi=150)


def main() -> None:
    """Measure, write, draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", type=Path, default=Path("results/checks"), metavar="FOLDER")
    folder = parser.parse_args().results
    rows = []
    for grains in SIZES:
        rows.append(measured(grains))
        print(*rows[-1].values(), flush=True)
        pd.DataFrame(rows).to_csv(folder / "heap_cost.csv", index=False, lineterminator="\n")
    table = pd.DataFrame(rows)
    draw(table, folder / "figures" / "heap_cost.png")
    print(f"cpu seconds go with the number of grains to the power {exponent(table):.2f}")


if __name__ == "__main__":
    main()
