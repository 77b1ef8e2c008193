"""Two grains in each engine of heap_engines.py, against what its law was asked for: results/checks/engine_checks.csv.

    .venv/bin/python benchmarks/engine_checks.py [--results results/checks]

| check | what is done | asked for |
|---|---|---|
| `restitution` | two grains meet at a speed; the mean over phases of the first step | the restitution |
| `pull_off` | two grains that touch are drawn apart at a speed; the largest pull | 3/2 pi G R* |
| `sliding` | two grains are pressed together and one is drawn along the contact | mu (N + a F), over N |
| `rolling` | they are pressed together and roll on each other; the largest moment over R | mu_r (N + a F), over N |

Where there is surface energy, F is the pull-off force and a what the law adds to its limits: 2 in JKR, 0 in the DMT of LAMMPS, which
takes the net force. There the restitution has nothing to be held against, and shows up to which speed grains stick. The steps
are those of the heaps, 0.09 of the Rayleigh step.
"""

import argparse
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from engines import lammps, liggghts
from engines.library import Library
from engines.powder import Powder
from repose_checks import MIDDLE

from yade_scripts.contacts import Material, Pair, pull_off_force, rayleigh_step
from yade_scripts.powder_scene import STEEL, grain_radius

ENGINES = {"LIGGGHTS": liggghts, "LAMMPS": lammps}
RADIUS = grain_radius(431.3, 6.0)
GRAIN = Material(1833.0, 3e7, 0.296)
STEP = 0.09  # of the Rayleigh step
PHASES = 8
FLAT = 8e-4  # overlap of stiff grains that are pressed together, in the radius; 0.08 at a softness of 0.001
SPEEDS = (0.05, 0.1, 0.3, 0.6, 1.0)  # m/s, of impacts
PULLS = (1e-3, 5e-2)  # m/s
FLIGHT = 0.1  # s, after which grains that have parted are far from each other


class Setting(NamedTuple):
    """A law with its constants."""

    engine: str
    switches: tuple[str, ...]
    restitution: float = 0.3
    surface_energy: float = 0.0
    softness: float = 1e-3


def step_of(setting: Setting) -> float:
    """Time step, s."""
    return STEP * rayleigh_step(RADIUS, GRAIN._replace(shear_modulus=setting.softness * GRAIN.shear_modulus))


def flat(setting: Setting) -> float:
    """Overlap at which the contact presses about as much as the adhesion pulls, m."""
    return FLAT * setting.softness ** (-2 / 3) * RADIUS


class Two:
    """Two grains along x in an engine, a gap apart (m; below 0: an overlap)."""

    def __init__(self, engine: Library, setting: Setting, gap: float, folder: Path):
        kind = ENGINES[setting.engine]
        grain, steel = (
            solid._replace(shear_modulus=setting.softness * solid.shear_modulus) for solid in (GRAIN, STEEL)
        )
        pair = Pair(
            setting.restitution,
            MIDDLE["powder_static_friction"],
            MIDDLE["powder_rolling_friction"],
            setting.surface_energy,
        )
        law = kind.Law(Powder(grain, steel, pair, pair, RADIUS, step_of(setting), 1.0), frozenset(setting.switches))
        self.engine, self.step = engine, step_of(setting)
        half = RADIUS + gap / 2
        atoms = [f"{k} 1 {2 * RADIUS:.9e} {GRAIN.density:g} {x:.12e} 0 0" for k, x in ((1, -half), (2, half))]
        box = [f"-0.02 0.02 {axis}lo {axis}hi" for axis in "xyz"]
        (folder / "two.data").write_text(
            "\n".join(["two", "", "2 atoms", "2 atom types", *box, "", "Atoms", "", *atoms, ""])
        )
        engine.do(
            "clear",
            "units si",
            f"atom_style {kind.ATOMS}",
            "atom_modify map array",
            "boundary f f f",
            "newton off",
            *law.before(),
            f"read_data {folder / 'two.data'}",
            f"neighbor {RADIUS:g} bin",
            *law.between_grains(),
            f"timestep {self.step:.12g}",
            "group left id 1",
            "group right id 2",
        )

    def of_right(self, name: str) -> np.ndarray:
        """A vector of the grain on the right."""
        return self.engine.vectors(name)[self.engine.numbers() == 2][0]


def rebound(engine: Library, setting: Setting, speed: float, folder: Path) -> float:
    """Mean restitution over the phases of the first step."""
    found = []
    for phase in range(PHASES):
        two = Two(engine, setting, (1 + (phase + 0.5) / PHASES) * speed * step_of(setting), folder)
        for side, sign in (("left", 1), ("right", -1)):
            engine.do(f"velocity {side} set {sign * speed / 2:g} 0 0")
        engine.do("fix move all nve/sphere", f"run {round(FLIGHT / two.step)}")
        apart = two.of_right("x")[0] > 1.1 * RADIUS
        found.append(2 * two.of_right("v")[0] / speed if apart else 0.0)
    return float(np.mean(found))


def pull_off(engine: Library, setting: Setting, speed: float, folder: Path) -> float:
    """Largest force with which one grain holds the other that is drawn away, N."""
    two, largest = Two(engine, setting, -flat(setting), folder), 0.0
    engine.do(f"fix move right move linear {speed:g} 0 0", "fix stay left move linear 0 0 0")
    steps = max(1, round(flat(setting) / 400 / speed / two.step))
    for _ in range(1000):
        engine.do(f"run {steps}")
        largest = max(largest, -two.of_right("f")[0])
    return largest


def sliding(engine: Library, setting: Setting, folder: Path) -> tuple[float, float]:
    """Friction of two grains pressed together, and the force that presses, N."""
    two = Two(engine, setting, -flat(setting), folder)
    engine.do("fix move right move linear 0 1e-3 0", "fix stay left move linear 0 0 0")
    engine.do(f"run {round(3 * flat(setting) / 1e-3 / two.step)}")
    force, place = two.of_right("f"), two.engine.vectors("x")
    normal = np.diff(place, axis=0)[0] if two.engine.numbers()[0] == 1 else -np.diff(place, axis=0)[0]
    normal /= np.linalg.norm(normal)
    along = force - force @ normal * normal
    return float(np.linalg.norm(along)), float(force @ normal)


def rolling(engine: Library, setting: Setting, folder: Path) -> tuple[float, float]:
    """Moment of two grains that roll on each other over their radius, and the force that presses, N."""
    two = Two(engine, setting, -flat(setting), folder)
    engine.do("velocity all set 0 0 0")
    spin = {"LIGGGHTS": "omegaz", "LAMMPS": "omega 0 0"}[setting.engine]
    engine.do(f"set group left {spin} 1.0", f"set group right {spin} -1.0")
    engine.do(f"run {round(0.2 / two.step)}")
    return float(np.linalg.norm(two.of_right("torque"))) / RADIUS, float(two.of_right("f")[0])


def main() -> None:
    """All checks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", type=Path, default=Path("results/checks"), metavar="FOLDER")
    given = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory(prefix="two-") as name:
        folder = Path(name)
        engines = {engine: Library(kind.LIBRARY, folder) for engine, kind in ENGINES.items()}

        def row(check: str, setting: Setting, speed: float, wanted: float, found: float) -> None:
            rows.append({"check": check} | setting._asdict() | {"speed_m_s": speed, "wanted": wanted, "found": found})
            rows[-1]["switches"] = ", ".join(setting.switches)
            print(*rows[-1].values(), flush=True)

        for setting in SETTINGS:
            engine = engines[setting.engine]
            pull = pull_off_force(setting.surface_energy, RADIUS / 2)
            for speed in SPEEDS:
                wanted = setting.restitution if pull == 0 else np.nan
                row("restitution", setting, speed, wanted, rebound(engine, setting, speed, folder))
            for speed in PULLS if pull > 0 else ():
                row("pull_off", setting, speed, 1.0, pull_off(engine, setting, speed, folder) / pull)
            for check, measure, limit in (
                ("sliding", sliding, MIDDLE["powder_static_friction"]),
                ("rolling", rolling, MIDDLE["powder_rolling_friction"]),
            ):
                found, force = measure(engine, setting, folder)
                load = 0.0 if lammps.DMT in setting.switches else 2 * pull
                row(check, setting, np.nan, limit * (force + load) / force, found / force)
    table = pd.DataFrame(rows)
    table.to_csv(given.results / "engine_checks.csv", index=False, float_format="%.4g", lineterminator="\n")


PULLS_TOO = (lammps.DAMPER_PULLS,)
SETTINGS = [
    *(
        Setting(engine, switches, restitution)
        for restitution in (0.15, 0.3)
        for engine, switches in (("LIGGGHTS", ()), ("LAMMPS", ()), ("LAMMPS", PULLS_TOO))
    ),
    *(Setting("LAMMPS", switches, 0.15, 0.2) for switches in ((), PULLS_TOO, (lammps.DMT,))),
    Setting("LAMMPS", (), 0.15, 0.2, 1.0),
]

if __name__ == "__main__":
    main()
