"""Our heap against LIGGGHTS on the same grains in the same funnel: cpu seconds and repose angles of both.

    .venv/bin/python benchmarks/heap_liggghts.py [--results results/checks] [--most N]

The LIGGGHTS twin (Debian's package liggghts, 3.8.0) starts from the same places, radii and velocities, in the same funnel
of 24 facets, with gate, plate and vibration, and goes through the same fill, flow and rest with the same looks. Its
laws: `hertz`, `tangential history`, `rolling_friction epsd2` with the same largest moment, `cohesion sjkr2` with the energy
density whose greatest pull is the pull-off force. It runs at customary settings (the paper's shear modulus, 0.2 of the
Rayleigh step) and with grains as soft as ours. At our step of 0.18 neither engine's Hertz-Mindlin heap is right (one
heap of each shows it), so that both run at half of it. Both angles are read by yade_scripts/heap.py. Cpu seconds are user plus
system time of the process, its start included. Writes a row a heap to liggghts_heaps.csv as they come (a second call
goes on where the first was stopped) and liggghts.csv; some 16 cpu minutes.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from math import cos, pi, sin, sqrt
from pathlib import Path

import numpy as np
import pandas as pd
from engines.liggghts import write_facets
from repose_checks import MIDDLE

from pellet_study.rigs import on_yade
from pellet_study.rigs.scripts import SCRIPTS
from pellet_study.simulation import yade
from yade_scripts import apparatus, contacts, heap, pouring, powder_scene

FRICTIONAL, COHESIVE = 0.0, 0.2  # J/m2
FUNNEL = {"protocol": "funnel", "outlet_height_mm": 60.0}  # the twin has this one
FIRST_SEED = 91_000
ERROR_DEG = 0.5  # whose cost is asked for
LONGEST_FLOW = 150.0  # in fall times of a grain, 1.7 s; ours flows for 0.8 s
LEAST_MODULUS = 5e6  # Pa, below which LIGGGHTS wants to be told that the grains are soft


def middle(seed: int, surface_energy: float, law: str, numerics: dict) -> dict:
    """The middle of the paper's Table 6 with another surface energy."""
    parameters = MIDDLE | {"powder_surface_energy": surface_energy}
    return on_yade.case(
        "repose", contact_law=law, seed=seed, parameters=parameters, conditions=FUNNEL, numerics=numerics
    )


def child(command: list[str], folder: Path, environment: dict | None = None) -> float:
    """Run a program, what it says in said.txt; its user and system seconds, children included."""
    with open(folder / "said.txt", "w") as said:
        started = subprocess.Popen(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=said, stderr=subprocess.STDOUT
        )
        *_, used = os.wait4(started.pid, 0)
    return used.ru_utime + used.ru_stime


def by_hand(case: dict, folder: Path) -> tuple[pd.Series, float]:
    """The rig's row of one case run by hand, as the README says, and its cpu seconds."""
    (folder / "cases.json").write_text(json.dumps([{"id": "heap"} | {k: v for k, v in case.items() if k != "rig"}]))
    command = yade.command(SCRIPTS / "repose.py", "cases.json", "observables.csv")
    seconds = child(command, folder, yade.environment(str(folder)))
    if not (folder / "observables.csv").exists():
        sys.exit(f"YADE left no result; it said at last:\n{(folder / 'said.txt').read_text()[-2000:]}")
    return pd.read_csv(folder / "observables.csv").iloc[0], seconds


def ours(case: dict, folder: Path) -> dict:
    """One heap by YADE."""
    row, seconds = by_hand(case, folder)
    return {"angle_deg": row["repose_angle_deg"], "cpu_seconds": seconds, "status": row["status"]}


def grains(case: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray, apparatus.Funnel]:
    """Radii, places and velocities at the start, and the funnel, drawn as the rig draws them."""
    conditions, numerics = case["conditions"], case["numerics"]
    draw = np.random.default_rng(case["seed"])
    radius = powder_scene.grain_radius(conditions["particle_diameter_um"], conditions["amplification"])
    mass = powder_scene.grain_mass(radius, case["parameters"]["powder_density_kg_m3"])
    number = round(1e-3 * conditions["powder_mass_g"] / mass)
    radii = powder_scene.radii(number, radius, numerics["size_spread"], draw)
    funnel = apparatus.Funnel(
        0.5e-3 * conditions["outlet_diameter_mm"],
        0.5e-3 * numerics["funnel_diameter_mm"],
        1e-3 * conditions["outlet_height_mm"],
    )
    places = funnel.lattice(number, float(radii.max()))
    turn = draw.uniform(0, 2 * pi)
    x = cos(turn) * places[:, 0] - sin(turn) * places[:, 1]
    y = sin(turn) * places[:, 0] + cos(turn) * places[:, 1]
    speeds = powder_scene.FASTEST_START * draw.uniform(-1, 1, (number, 3))
    return radii, np.column_stack([x, y, places[:, 2]]), speeds, funnel


def energy_density(pull_off: float, young: float, effective_radius: float) -> float:
    """Energy density k of `sjkr2` whose greatest pull is the pull-off force F, J/m3.

    The contact pulls with k 2 pi (2 R*) d - 4/3 E* R*^(1/2) d^(3/2) = b d - a d^(3/2), at most 4 b^3/(27 a^2).
    """
    a = 4 / 3 * young * sqrt(effective_radius)
    return (27 / 4 * a**2 * pull_off) ** (1 / 3) / (4 * pi * effective_radius)


def effective_young(first: contacts.Material, second: contacts.Material) -> float:
    """E* of two solids, Pa."""
    return 1 / sum((1 - each.poisson_ratio**2) / each.young for each in (first, second))


def script(case: dict, radius: float, bottom: float, option: str) -> str:
    """The twin's input: the rig's protocol, looked at as often."""
    given, numerics = case["parameters"], case["numerics"]
    softer = numerics["stiffness_scale"]
    powder = contacts.Material(
        given["powder_density_kg_m3"], softer * given["powder_shear_modulus_pa"], given["powder_poisson_ratio"]
    )
    steel = powder_scene.STEEL._replace(shear_modulus=softer * powder_scene.STEEL.shear_modulus)
    step = numerics["time_step_fraction"] * contacts.rayleigh_step(radius * (1 - numerics["size_spread"]), powder)
    fall = sqrt(radius / powder_scene.GRAVITY)
    look = round(pouring.LOOK * fall / step)
    unit = powder_scene.grain_mass(radius, powder.density) * powder_scene.GRAVITY * radius
    pull_off = contacts.pull_off_force(given["powder_surface_energy"], radius / 2)
    density = energy_density(pull_off, effective_young(powder, powder), radius / 2)
    cohesion = "cohesion sjkr2" if density else ""
    law = f"model hertz tangential history {cohesion} rolling_friction epsd2"

    def pairs(name: str, grain: float, wall: float) -> str:
        return f"fix {name} all property/global {name} peratomtypepair 2 {grain:g} {wall:g} {wall:g} {wall:g}"

    def until(phase: str, done: str, longest: float, verdict: bool = True) -> list[str]:
        """Look again and again until it is done or took too long (in fall times of a grain)."""
        return [
            f"variable looks loop {max(2, round(longest / pouring.LOOK))}",
            f"label {phase}",
            f"run {look}",
            f'if "{done}" then "jump SELF {phase}_done"',
            "next looks",
            f"jump SELF {phase}",
            *([f'print "VERDICT the {phase} takes too long"', "quit"] if verdict else []),
            f"label {phase}_done",
            "variable looks delete",
        ]

    moduli = [min(m.young for m in (powder, steel)), max(m.young for m in (powder, steel))]
    return "\n".join(
        [
            "log none",
            "units si",
            "atom_style granular",
            "atom_modify map array",
            "boundary f f f",
            "newton off",
            "communicate single vel yes",
            *(["soft_particles yes"] if moduli[0] < LEAST_MODULUS else []),
            *(["hard_particles yes"] if moduli[1] > 1e9 else []),
            "read_data grains.data",
            f"neighbor {0.4 * radius:g} bin",
            "neigh_modify delay 0",
            f"fix youngsModulus all property/global youngsModulus peratomtype {powder.young:g} {steel.young:g}",
            f"fix poissonsRatio all property/global poissonsRatio peratomtype {powder.poisson_ratio:g} {steel.poisson_ratio:g}",
            pairs("coefficientRestitution", given["powder_restitution"], given["powder_steel_restitution"]),
            pairs("coefficientFriction", given["powder_static_friction"], given["powder_steel_static_friction"]),
            # the largest moment is coefficient x R* x force, R* = R/2 between grains and R at a wall
            pairs(
                "coefficientRollingFriction",
                2 * given["powder_rolling_friction"],
                given["powder_steel_rolling_friction"],
            ),
            *([pairs("cohesionEnergyDensity", density, 0.0)] if density else []),
            f"pair_style gran {law} {option}",
            "pair_coeff * *",
            f"timestep {step:g}",
            f"fix gravity all gravity {powder_scene.GRAVITY} vector 0 0 -1",
            "fix funnel all mesh/surface file funnel.stl type 2 curvature 1e-6",
            f"fix plate_wall all wall/gran {law} primitive type 2 zplane 0.0 {option}",
            f"fix funnel_wall all wall/gran {law} mesh n_meshes 1 meshes funnel {option}",
            f"fix gate_wall all wall/gran {law} primitive type 2 zplane {bottom:g} {option}",
            "fix move all nve/sphere",
            "compute energy all ke",
            f'variable above atom "z > {bottom:g}"',
            "compute inside all reduce sum v_above",
            "thermo_style custom step atoms c_energy c_inside",
            f"thermo {look}",
            "thermo_modify norm no lost ignore",
            "variable number equal atoms",
            "run 0",
            f'variable unit equal "{unit:g} * v_number"',
            *until("fill", f"$(c_energy) < $({pouring.SETTLED:g} * v_unit)", pouring.MOST_FILL),
            "unfix gate_wall",
            f"fix shake all move/mesh mesh funnel wiggle amplitude 0. 0. {1e-3 * numerics['vibration_mm']:g} "
            f"period {1 / numerics['vibration_hz']:g}",
            *until("flow", f"$(c_inside) <= $({pouring.LEFT_BEHIND:g} * v_number)", LONGEST_FLOW),
            *until("drip", "$(c_inside) == 0", pouring.PATIENCE, verdict=False),
            "unfix shake",
            "unfix funnel_wall",
            "unfix funnel",
            *until("rest", f"$(c_energy) < $({numerics['rest_energy']:g} * v_unit)", pouring.MOST_REST),
            *until("stay", f"$(c_energy) < $({numerics['rest_energy']:g} * v_unit)", pouring.MOST_REST),
            "write_dump all custom heap.dump x y z radius",
            'print "VERDICT ok"',
            "",
        ]
    )


def twin(case: dict, folder: Path, option: str = "") -> dict:
    """One heap by LIGGGHTS, with a further option of its contact model."""
    radii, places, speeds, funnel = grains(case)
    write_facets(
        folder / "funnel.stl",
        [
            (funnel.outlet, funnel.width, funnel.bottom, funnel.bottom + funnel.cone),
            (funnel.width, funnel.width, funnel.bottom + funnel.cone, funnel.bottom + funnel.top),
        ],
    )
    data = [
        "grains",
        "",
        f"{len(radii)} atoms",
        "2 atom types",
        "-0.2 0.2 xlo xhi",
        "-0.2 0.2 ylo yhi",
        f"-0.01 {funnel.bottom + funnel.top + 0.02:g} zlo zhi",
    ]
    density = case["parameters"]["powder_density_kg_m3"]
    data += ["", "Atoms", ""]
    data += [
        f"{k} 1 {2 * r:.9e} {density:g} " + " ".join(f"{v:.9e}" for v in place)
        for k, (r, place) in enumerate(zip(radii, places, strict=True), 1)
    ]
    data += ["", "Velocities", ""]
    data += [f"{k} " + " ".join(f"{v:.9e}" for v in speed) + " 0 0 0" for k, speed in enumerate(speeds, 1)]
    (folder / "grains.data").write_text("\n".join([*data, ""]))
    (folder / "in.heap").write_text(script(case, float(radii.mean()), funnel.bottom, option))
    seconds = child(["liggghts", "-in", "in.heap"], folder)
    said = (folder / "said.txt").read_text()
    status = next((line[8:] for line in said.splitlines() if line.startswith("VERDICT ")), None)
    if status is None:
        sys.exit(f"liggghts came to no verdict; it said at last:\n{said[-2000:]}")
    angle = np.nan
    if status == "ok":
        table = np.loadtxt(folder / "heap.dump", skiprows=9)
        angle = heap.readings(table[:, :3], table[:, 3]).repose.angle_deg
        if len(table) < len(radii):
            status = f"{len(radii) - len(table)} grains were lost"
    return {"angle_deg": angle, "cpu_seconds": seconds, "status": status}


def undamped(case: dict, folder: Path) -> dict:
    """One heap by LIGGGHTS, whose tangential damper is as strong as the normal one, without it."""
    return twin(case, folder, "tangential_damping off")


CUSTOMARY = {"stiffness_scale": 1.0, "time_step_fraction": 0.2}
HALF = {"time_step_fraction": 0.09}
ENGINES = {  # engine: how, law, numerics, heaps without and with cohesion
    "YADE, law of release 0.1": (ours, "cohesive_frictional_local_damping", {}, (6, 2)),
    "YADE hertz_mindlin, half our step": (ours, "hertz_mindlin", HALF, (6, 2)),
    "LIGGGHTS, our stiffness, half our step": (twin, "hertz_mindlin", HALF, (6, 1)),
    "LIGGGHTS, the same without tangential damping": (undamped, "hertz_mindlin", HALF, (6, 0)),
    "LIGGGHTS, customary": (twin, "hertz_mindlin", CUSTOMARY, (6, 1)),
    "YADE hertz_mindlin, our step": (ours, "hertz_mindlin", {"time_step_fraction": 0.18}, (1, 1)),
    "LIGGGHTS, our stiffness, our step": (twin, "hertz_mindlin", {"time_step_fraction": 0.18}, (1, 0)),
}


def wanted() -> list[tuple[str, float, int]]:
    """(engine, surface energy, seed) of all heaps: without cohesion first, first seeds first."""
    found = []
    for place, energy in enumerate((FRICTIONAL, COHESIVE)):
        for k in range(max(numbers[place] for *_, numbers in ENGINES.values())):
            found += [(name, energy, FIRST_SEED + k) for name, (*_, numbers) in ENGINES.items() if k < numbers[place]]
    return found


def heaps(file: Path, most: int) -> pd.DataFrame:
    """A row a heap: those in the file, and at most so many of what is missing there."""
    names = ["engine", "surface_energy_j_m2", "seed", "angle_deg", "cpu_seconds", "status"]
    rows = pd.read_csv(file) if file.exists() else pd.DataFrame(columns=names)
    done = set(rows[names[:3]].itertuples(index=False, name=None))
    for about in [each for each in wanted() if each not in done][:most]:
        simulate, law, numerics, _ = ENGINES[about[0]]
        with tempfile.TemporaryDirectory(prefix="heap-") as folder:
            found = simulate(middle(about[2], about[1], law, numerics), Path(folder))
        rows.loc[len(rows)] = dict(zip(names, about, strict=False)) | found
        print(rows.iloc[[-1]].to_string(header=False, index=False), flush=True)
        rows.to_csv(file, index=False, float_format="%.6g", lineterminator="\n")
    return rows


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """A row an engine and surface energy.

    Few heaps know little of their scatter, so that it is pooled over all rows; what a lost heap took is paid by the others.
    """
    groups = dict(list(rows.groupby(["engine", "surface_energy_j_m2"], sort=False)))
    angles = {key: group.loc[group["status"] == "ok", "angle_deg"] for key, group in groups.items()}
    several = [angle for angle in angles.values() if len(angle) > 1]
    freedom = sum(len(angle) - 1 for angle in several)
    pooled = sqrt(sum(((angle - angle.mean()) ** 2).sum() for angle in several) / freedom)
    table = []
    for (engine, energy), group in groups.items():
        angle, cpu = angles[engine, energy], group["cpu_seconds"].mean()
        lost = group.loc[group["status"] != "ok", "status"]
        table.append(
            {
                "engine": engine,
                "surface_energy_j_m2": energy,
                "heaps": len(group),
                "lost": len(lost),
                "angle_deg": angle.mean(),
                "standard_error_deg": pooled / sqrt(len(angle)) if len(angle) else np.nan,
                "sd_deg": angle.std(ddof=1),
                "pooled_sd_deg": pooled,
                "cpu_seconds_a_heap": cpu,
                "cpu_seconds_for_half_a_degree": group["cpu_seconds"].sum() / len(angle) * (pooled / ERROR_DEG) ** 2
                if len(angle)
                else np.nan,
                "first_loss": next(iter(lost), ""),
            }
        )
    return pd.DataFrame(table).sort_values(["surface_energy_j_m2", "engine"]).round(3)


def main() -> None:
    """Simulate what is missing, write both tables, print the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", type=Path, default=Path("results/checks"), metavar="FOLDER")
    parser.add_argument("--most", type=int, default=1000, metavar="N", help="simulate at most N heaps now")
    given = parser.parse_args()
    folder = given.results
    if not shutil.which("liggghts"):
        sys.exit("liggghts was not found; on Debian or Ubuntu: apt-get install liggghts")
    table = summary(heaps(folder / "liggghts_heaps.csv", given.most))
    table.to_csv(folder / "liggghts.csv", index=False, lineterminator="\n")
    print(table.to_string(index=False))
    for energy, rows in table.groupby("surface_energy_j_m2"):
        cost = rows.set_index("engine")["cpu_seconds_for_half_a_degree"].dropna()
        for mine in (name for name in cost.index if name.startswith("YADE")):
            for other in (name for name in cost.index if name.startswith("LIGGGHTS")):
                print(f"G = {energy:g}: {mine} needs {cost[mine] / cost[other]:.2f} of the cpu seconds of {other}")


if __name__ == "__main__":
    main()
