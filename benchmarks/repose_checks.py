"""What the simulated repose angle depends on besides the powder: tables with error bars in results/checks.

    .venv/bin/python benchmarks/repose_checks.py [TABLE ...] [--seeds 2] [--workers 1] [--stored]

`repose` changes one setting after the other at the middle of the paper's Table 6, most of them on a third of the grains
in a funnel of the same shape; `repose_amplification` has the angle of that powder at amplifications 4, 6 and 8 with the
surface energy scaled and unscaled; `repose_time_steps` looks for the step at which low restitution with adhesion goes wrong. All three together take some 35
cpu minutes; finished heaps are kept in results/checks/.store. Every table has a file of its heaps, a row each, beside it.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch
from pellet_study.simulation.store import Store, key
from yade_scripts import contacts, powder_scene

FOLDER = Path(__file__).resolve().parent.parent / "results" / "checks"
FIRST_SEED = 90_000
MIDDLE = {
    "powder_restitution": 0.15,
    "powder_static_friction": 0.8,
    "powder_rolling_friction": 0.35,
    "powder_steel_restitution": 0.15,
    "powder_steel_static_friction": 0.72,
    "powder_steel_rolling_friction": 0.29,
    "powder_surface_energy": 0.2,
}
FUNNEL = {"protocol": "funnel", "outlet_height_mm": 60.0}  # of release 0.1
LIGHT = {  # 500 grains in a funnel of the same shape: what a dozen settings with seeds can be had for
    "powder_mass_g": 8.32,
    "outlet_height_mm": 41.6,
    "outlet_diameter_mm": 16.6,
    "funnel_diameter_mm": 30.5,
}
FULL = {}  # 1,503 grains
LAW = "cohesive_frictional_local_damping"  # in which these tables were made
SETTINGS = [  # what, base, changes, heaps
    ("500 grains", LIGHT, {}, 8),
    ("time step", LIGHT, {"time_step_fraction": 0.09}, 3),
    ("time step", LIGHT, {"time_step_fraction": 0.25}, 3),
    ("stiffness", LIGHT, {"stiffness_scale": 3e-4}, 3),
    ("stiffness", LIGHT, {"stiffness_scale": 1e-2}, 3),
    ("rest detection", LIGHT, {"rest_energy": 1e-2}, 3),
    ("rest detection", LIGHT, {"rest_energy": 2e-4}, 3),
    ("damping", LIGHT, {"cohesive_frictional_damping": 0.1}, 3),
    ("damping", LIGHT, {"cohesive_frictional_damping": 0.5}, 3),
    ("vibration", LIGHT, {"vibration_mm": 0.0}, 3),
    ("vibration", LIGHT, {"vibration_mm": 0.8}, 3),
    ("outlet height", LIGHT, {"outlet_height_mm": 35.0}, 3),
    ("outlet height", LIGHT, {"outlet_height_mm": 60.0}, 3),
    ("outlet size", LIGHT, {"outlet_diameter_mm": 14.0}, 3),
    ("outlet size", LIGHT, {"outlet_diameter_mm": 21.0}, 3),
    ("fill height", LIGHT, {"funnel_diameter_mm": 25.0}, 3),
    ("fill height", LIGHT, {"funnel_diameter_mm": 42.0}, 3),
    ("1,503 grains", FULL, {}, 6),
    ("powder in the same funnel", FULL, {"powder_mass_g": 8.32}, 2),
    ("powder in the same funnel", FULL, {"powder_mass_g": 49.9}, 1),
]
AMPLIFICATION = [("either way", LIGHT, {"amplification": 6.0}, 8)] + [
    (way, LIGHT, {"amplification": k, "surface_energy_exponent": exponent}, 3)
    for k in (8.0, 4.0)
    for way, exponent in (("scaled", 2.0), ("unscaled", 0.0))
]
STEPS = [
    (what, LIGHT | low, {"time_step_fraction": fraction}, 2)
    for what, low, fractions in (
        ("cohesive_frictional_local_damping, D = 0.05", {"powder_steel_restitution": 0.05}, (0.18, 0.32, 0.4)),
        ("hertz_mindlin, A = D = 0.05", {"powder_restitution": 0.05, "powder_steel_restitution": 0.05}, (0.18, 0.32)),
        ("cohesive_frictional_local_damping, D = 0.15", {}, (0.09, 0.18, 0.25)),
        ("hertz_mindlin, A = D = 0.15", {}, (0.06, 0.09, 0.18)),
    )
    for fraction in fractions
]
TABLES = {"repose": SETTINGS, "repose_amplification": AMPLIFICATION, "repose_time_steps": STEPS}


def case(seed: int, changes: dict, law: str | None = None) -> dict:
    """The middle of Table 6 with changes to any group."""
    known = on_yade.rig("repose")
    groups = {g: {k: v for k, v in changes.items() if k in getattr(known, g)} for g in ("conditions", "numerics")}
    groups["conditions"] = FUNNEL | groups["conditions"]
    parameters = MIDDLE | {k: v for k, v in changes.items() if k in known.parameters}
    assert set(changes) <= {*parameters, *groups["conditions"], *groups["numerics"]}, changes
    return on_yade.case("repose", contact_law=law, seed=seed, parameters=parameters, **groups)


def cases(name: str, most: int) -> list[tuple[str, str, dict]]:
    """(what, setting in words, case) of every heap of a table, at most so many of a setting; first seeds first."""
    found = []
    for k in range(min(most, max(heaps for *_, heaps in TABLES[name]))):
        for what, base, changes, heaps in TABLES[name]:
            if k < heaps:
                setting = ", ".join(f"{name} {value:g}" for name, value in changes.items()) or "all defaults"
                law = "hertz_mindlin" if "hertz_mindlin" in what else LAW
                found.append((what, setting, case(FIRST_SEED + k, base | changes, law)))
    return found


def step(case: dict) -> tuple[float, float]:
    """Time step of a case in s, and in Rayleigh steps of its smallest grain."""
    given, conditions, numerics = case["parameters"], case["conditions"], case["numerics"]
    powder = contacts.Material(
        given["powder_density_kg_m3"],
        numerics["stiffness_scale"] * given["powder_shear_modulus_pa"],
        given["powder_poisson_ratio"],
    )
    radius = powder_scene.grain_radius(conditions["particle_diameter_um"], conditions["amplification"])
    restitution = given["powder_steel_restitution"]
    if case["contact_law"] == "hertz_mindlin":
        restitution = min(restitution, given["powder_restitution"])
    share = numerics["time_step_fraction"] * powder_scene.damper_share(restitution)
    return share * contacts.rayleigh_step(radius * (1 - numerics["size_spread"]), powder), share


def heaps(name: str, most: int, workers: int | None, stored: bool) -> pd.DataFrame:
    """A row a heap, simulated or from the store; only those in the store where asked so."""
    wanted = cases(name, most)
    if stored:
        with Store(FOLDER / ".store") as store:
            rig = on_yade.rig("repose")
            known = store.rows(rig).index
        wanted = [each for each in wanted if key(each[2], rig) in known]
    rows = dispatch.run([case for *_, case in wanted], FOLDER / ".store", workers=workers, quiet=True)
    steps = [step(case) for *_, case in wanted]
    told = pd.DataFrame(
        {
            "what": [what for what, *_ in wanted],
            "setting": [setting for _, setting, _ in wanted],
            "seed": rows["seed"],
            "contact_law": rows["contact_law"],
            "of_rayleigh_step": [round(share, 4) for _, share in steps],
            "status": rows["status"],
        }
    )
    observables = list(on_yade.rig("repose").observables)
    told[observables] = rows[observables].astype(float)
    told["million_grain_steps"] = told["grains"] * told["end_time_s"] / [1e6 * seconds for seconds, _ in steps]
    return told


def summary(told: pd.DataFrame) -> pd.DataFrame:
    """A row a setting: mean angle with its standard error, and its change from the first of the table.

    Two or three heaps know little of their own scatter: both errors come from the standard deviation over seeds pooled
    over the whole table. In the table of time steps the change is from the smallest step of the same law.
    """
    groups = dict(list(told.groupby(["what", "setting"], sort=False)))
    angles = {group: heaps["repose_angle_deg"].dropna() for group, heaps in groups.items()}
    several = [angle for angle in angles.values() if len(angle) > 1]
    freedom = sum(len(angle) - 1 for angle in several)
    squares = sum(((angle - angle.mean()) ** 2).sum() for angle in several)
    pooled = np.sqrt(squares / freedom) if freedom else np.nan
    rows, by_what = [], told["contact_law"].nunique() > 1
    for (what, setting), heaps in groups.items():
        angle = angles[what, setting]
        base = angles[next(group for group in groups if group[0] == what or not by_what)]
        good = heaps[heaps["status"] == "ok"]
        rows.append(
            {
                "what": what,
                "setting": setting,
                "of_rayleigh_step": heaps["of_rayleigh_step"].iloc[0],
                "heaps": len(heaps),
                "lost": len(heaps) - len(good),
                "grains": good["grains"].mean(),
                "bond_number": round(good["bond_number"].mean(), 3),
                "angle_deg": round(angle.mean(), 2),
                "standard_error_deg": round(pooled / np.sqrt(len(angle)), 2) if len(angle) else None,
                "sd_over_seeds_deg": round(angle.std(ddof=1), 2),
                "change_deg": round(angle.mean() - base.mean(), 2),
                "change_error_deg": round(pooled * np.sqrt(1 / len(angle) + 1 / len(base)), 2)
                if len(angle) and len(base) and base is not angle
                else None,
                "direction_error_deg": round(good["direction_error_deg"].mean(), 2),
                "largest_overlap": round(good["largest_overlap"].max(), 3),
                "flow_time_s": round(good["flow_time_s"].mean(), 2),
                "end_time_s": round(good["end_time_s"].mean(), 2),
                "million_grain_steps": round(good["million_grain_steps"].mean(), 1),
                "first_loss": next(iter(heaps.loc[heaps["status"] != "ok", "status"]), ""),
            }
        )
    table = pd.DataFrame(rows)
    table["grains"] = table["grains"].astype("Int64")
    return table


def draw(tables: dict, file: Path) -> None:
    """Mean angle of every setting with its standard error, that of the 500 grains as a band."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from pellet_study.output.style import BAND, MEASURED, MODEL, STYLE

    rows = pd.concat([tables["repose"], tables["repose_amplification"].iloc[1:]]).reset_index(drop=True)
    named = rows["what"].where(rows["setting"] == "all defaults", rows["setting"])
    named = named.str.replace(", surface_energy_exponent 2", ", G scaled").str.replace("_", " ")
    named = named.str.replace(", surface energy exponent 0", ", G unscaled")
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(6.5, 0.2 * len(rows) + 0.8), layout="constrained")
        place = np.arange(len(rows))[::-1]
        middle, error = rows.loc[0, ["angle_deg", "standard_error_deg"]]
        axes.axvspan(middle - error, middle + error, color=BAND, zorder=0)
        axes.errorbar(rows["angle_deg"], place, xerr=rows["standard_error_deg"], fmt="o", color=MODEL, markersize=4)
        for at, row in zip(place, rows.itertuples(), strict=True):
            if row.lost:
                axes.text(0.99, at, f"{row.lost} of {row.heaps} lost", va="center", ha="right", color=MEASURED,
                          fontsize=7, transform=axes.get_yaxis_transform())  # fmt: skip
        axes.set_yticks(place, named)
        axes.set_xlim(0, 65)
        axes.set_xlabel("repose angle, deg (bars and band: one standard error)")
        file.parent.mkdir(exist_ok=True)
        figure.savefig(file, dpi=150)
        plt.close(figure)


def main() -> None:
    """Simulate what is missing, write the tables, and the figure where its two tables are there."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"any of {', '.join(TABLES)}; default all")
    parser.add_argument("--seeds", type=int, default=100, help="at most so many heaps of a setting; default all")
    parser.add_argument("--workers", type=int)
    parser.add_argument("--stored", action="store_true", help="simulate nothing: what the store has")
    given = parser.parse_args()
    unknown = set(given.tables) - set(TABLES)
    if unknown:
        parser.error(f"no table {', '.join(sorted(unknown))}; expected any of {', '.join(TABLES)}")
    for name in given.tables or TABLES:
        told = heaps(name, given.seeds, given.workers, given.stored)
        told.to_csv(FOLDER / f"{name}_heaps.csv", index=False, float_format="%.6g", lineterminator="\n")
        table = summary(told)
        table.to_csv(FOLDER / f"{name}.csv", index=False, lineterminator="\n")
        print(table.to_string(index=False), flush=True)
    drawn = ("repose", "repose_amplification")
    if all((FOLDER / f"{name}.csv").exists() for name in drawn):
        draw({name: pd.read_csv(FOLDER / f"{name}.csv") for name in drawn}, FOLDER / "figures" / "repose.png")


if __name__ == "__main__":
    main()
