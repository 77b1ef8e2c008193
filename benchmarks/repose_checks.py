"""What the simulated repose angle depends on besides the powder: a table with error bars, results/checks/repose.csv.

    .venv/bin/python benchmarks/repose_checks.py [--seeds 4] [--workers 1]

Each line of SETTINGS is changed alone, from the defaults of the rig at the middle of the paper's Table 6; every setting
has the same seeds. Finished heaps are kept in results/checks/.store. --amplification does the table of
angles at amplifications 4, 6 and 8 with the surface energy scaled and unscaled; --steps the safe time step at low
restitution.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study import dispatch, rigs

FOLDER = Path(__file__).resolve().parent.parent / "results" / "checks"
MIDDLE = {
    "powder_restitution": 0.15,
    "powder_static_friction": 0.8,
    "powder_rolling_friction": 0.35,
    "powder_steel_restitution": 0.15,
    "powder_steel_static_friction": 0.72,
    "powder_steel_rolling_friction": 0.29,
    "powder_surface_energy": 0.2,
}
SETTINGS = [
    ("defaults", {}),
    ("stiffness", {"stiffness_scale": 3e-4}),
    ("stiffness", {"stiffness_scale": 3e-3}),
    ("stiffness", {"stiffness_scale": 1e-2}),
    ("time step", {"time_step_fraction": 0.09}),
    ("time step", {"time_step_fraction": 0.25}),
    ("rest detection", {"rest_energy": 2e-4}),
    ("rest detection", {"rest_energy": 1e-2}),
    ("number of grains", {"powder_mass_g": 10.0}),
    ("number of grains", {"powder_mass_g": 50.0, "outlet_height_mm": 70.0}),
    ("outlet size", {"outlet_diameter_mm": 24.0}),
    ("outlet size", {"outlet_diameter_mm": 36.0}),
    ("fill height", {"funnel_diameter_mm": 40.0}),
    ("fill height", {"funnel_diameter_mm": 60.0}),
    ("outlet height", {"outlet_height_mm": 50.0}),
    ("outlet height", {"outlet_height_mm": 100.0}),
    ("vibration", {"vibration_mm": 0.2}),
    ("vibration", {"vibration_mm": 0.8}),
    ("damping", {"cohesive_frictional_damping": 0.1}),
    ("damping", {"cohesive_frictional_damping": 0.2}),
    ("damping", {"cohesive_frictional_damping": 0.5}),
]
AMPLIFICATION = [
    ("scaled" if exponent else "unscaled", {"amplification": k, "surface_energy_exponent": exponent})
    for k in (4.0, 6.0, 8.0)
    for exponent in (2.0, 0.0)
]
STEPS = [
    ("e = 0.05, hertz_mindlin", {"powder_restitution": 0.05, "powder_steel_restitution": 0.05, "time_step_fraction": f})
    for f in (0.02, 0.04, 0.06, 0.09, 0.13, 0.18)
] + [
    ("e = 0.15, hertz_mindlin", {"time_step_fraction": f}) for f in (0.04, 0.09, 0.13, 0.18)
] + [
    ("steel e = 0.05, cohesive_frictional", {"powder_steel_restitution": 0.05, "time_step_fraction": f})
    for f in (0.09, 0.18, 0.25, 0.32)
]  # fmt: skip


def case(seed: int, changes: dict, law: str | None = None) -> dict:
    """The middle of Table 6 with changes to any group."""
    known = rigs.rig("repose")
    groups = {g: {k: v for k, v in changes.items() if k in getattr(known, g)} for g in ("conditions", "numerics")}
    parameters = MIDDLE | {k: v for k, v in changes.items() if k in known.parameters}
    return rigs.case("repose", contact_law=law, seed=seed, parameters=parameters, **groups)


def table(settings: list, seeds: int, workers: int | None) -> pd.DataFrame:
    """A row a setting: mean angle, standard error over seeds, scatter, what was lost, seconds a heap."""
    rows = []
    for what, changes in settings:
        law = "hertz_mindlin" if "hertz" in what else None
        heaps = dispatch.run(
            [case(90_000 + k, changes, law) for k in range(seeds)], FOLDER / ".store", workers=workers, quiet=True
        )
        good = heaps[heaps["status"] == "ok"]
        angle = good["repose_angle_deg"].astype(float)
        seconds = pd.read_csv(FOLDER / ".store" / "timings.csv").drop_duplicates("id", keep="last").set_index("id")
        rows.append(
            {
                "what": what,
                "setting": ", ".join(f"{k} {v:g}" for k, v in changes.items()) or "all defaults",
                "grains": int(good["grains"].iloc[0]) if len(good) else None,
                "bond_number": round(float(good["bond_number"].iloc[0]), 3) if len(good) else None,
                "angle_deg": round(angle.mean(), 3),
                "standard_error_deg": round(angle.std(ddof=1) / np.sqrt(len(angle)), 3),
                "sd_over_seeds_deg": round(angle.std(ddof=1), 3),
                "heaps": len(heaps),
                "lost": len(heaps) - len(good),
                "largest_overlap": round(float(good["largest_overlap"].max()), 3) if len(good) else None,
                "wall_seconds": round(float(seconds["seconds"].reindex(good["id"]).mean()), 1),
                "first_loss": next(iter(heaps.loc[heaps["status"] != "ok", "status"]), ""),
            }
        )
        print(pd.DataFrame(rows[-1:]).to_string(header=False, index=False), flush=True)
    return pd.DataFrame(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--amplification", action="store_true")
    parser.add_argument("--steps", action="store_true")
    given = parser.parse_args()
    name, settings = "repose", SETTINGS
    if given.amplification:
        name, settings = "repose_amplification", AMPLIFICATION
    if given.steps:
        name, settings = "repose_time_steps", STEPS
    found = table(settings, given.seeds, given.workers)
    found.to_csv(FOLDER / f"{name}.csv", index=False, lineterminator="\n")


if __name__ == "__main__":
    main()
