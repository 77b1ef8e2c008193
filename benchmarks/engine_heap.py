"""One heap of the rig `repose` whose grains another engine moves: what heap_engines.py runs, a process a heap.

    .venv/bin/python benchmarks/engine_heap.py FOLDER

FOLDER/asked.json names the engine, the switches of its law and a case; FOLDER/row.json gets the observables, or a status that says
why there are none.

The rig's own code makes the heap: the draw of radii, places, velocities and base, the looks of yade_scripts/pouring.py, what is
taken away over the edge, the rest criterion, all refusals and the reading. It asks a scene for the places and speeds of the grains
and tells it to step; that scene, which is YADE's otherwise, is this file's. What remains different besides the law: the gate is
an endless plane while the powder settles in the funnel, and the funnel of LAMMPS is round, not of 24 facets.
"""

import json
import sys
from functools import partial
from math import cos, inf, pi, sin
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
from engines import lammps, liggghts
from engines.library import Library
from engines.powder import Powder
from scipy.spatial import cKDTree

from yade_scripts import contacts, repose
from yade_scripts.apparatus import Base, Funnel
from yade_scripts.case import Failed
from yade_scripts.powder_scene import FASTEST_START, GRAVITY, grain_mass

LAWS = {"LIGGGHTS": liggghts, "LAMMPS": lammps}
SKIN = 0.4  # of the neighbour lists, in the mean radius
ROOM = 0.03  # m around base and funnel, where grains that run over the edge are until the next look


class EngineScene:
    """The face of yade_scripts.powder_scene.PowderScene, with another engine behind it.

    Parameters
    ----------
    engine : of LAWS
    switches : of its law
    folder : for its files
    clock : `dt` and `time` as the rig reads them
    the others : as of PowderScene, of which the law and what belongs to it have no meaning here
    """

    def __init__(
        self,
        engine: str,
        switches: list[str],
        folder: Path,
        clock: SimpleNamespace,
        grains: np.ndarray,
        funnel: Funnel,
        base: Base,
        powder: contacts.Material,
        steel: contacts.Material,
        pair: contacts.Pair,
        wall_pair: contacts.Pair,
        law: str,
        time_step_fraction: float,
        rolling_spring: float,
        *others: object,
    ):
        draw = others[-1]
        assert isinstance(draw, np.random.Generator)
        self.grains, self.funnel, self.base, self.powder = np.asarray(grains), funnel, base, powder
        self.mean_radius, smallest = float(self.grains.mean()), float(self.grains.min())
        self.mass = grain_mass(1.0, powder.density) * self.grains**3
        self.clock = clock
        clock.time, clock.dt = 0.0, time_step_fraction * contacts.rayleigh_step(smallest, powder)
        inertia = 0.4 * grain_mass(smallest, powder.density) * smallest**2
        rolling = rolling_spring * inertia / clock.dt**2
        self.law = LAWS[engine].Law(
            Powder(powder, steel, pair, wall_pair, self.mean_radius, clock.dt, rolling), frozenset(switches)
        )
        self.numbers = np.arange(1, len(self.grains) + 1)
        self.shaken = self.empty = False
        places, speeds = self._drawn(draw)
        self.fixed = base.places(self.mean_radius, draw.uniform(0, 2 * pi)) if base.rough else np.empty((0, 3))
        self._write(folder / "grains.data", places, speeds)
        self.engine = Library(LAWS[engine].LIBRARY, folder)
        self._begin(LAWS[engine].ATOMS, folder)

    def _drawn(self, draw: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Places and velocities, drawn as the rig draws them."""
        places = self.funnel.lattice(len(self.grains), float(self.grains.max()))
        turn = draw.uniform(0, 2 * pi)
        x = cos(turn) * places[:, 0] - sin(turn) * places[:, 1]
        y = sin(turn) * places[:, 0] + cos(turn) * places[:, 1]
        return np.column_stack([x, y, places[:, 2]]), FASTEST_START * draw.uniform(-1, 1, (len(places), 3))

    def _write(self, file: Path, places: np.ndarray, speeds: np.ndarray) -> None:
        """The grains, and behind them those of the base, as both engines read them."""
        radii = np.concatenate([self.grains, np.full(len(self.fixed), self.mean_radius)])
        wide = max(self.base.radius or 0.0, self.funnel.width) + ROOM
        high = self.funnel.bottom + self.funnel.top + ROOM
        lines = ["grains", "", f"{len(radii)} atoms", "2 atom types"]
        lines += [f"{-wide:g} {wide:g} {axis}lo {axis}hi" for axis in "xy"] + [f"{-ROOM:g} {high:g} zlo zhi"]
        lines += ["", "Atoms", ""]
        for k, (radius, place) in enumerate(zip(radii, np.vstack([places, self.fixed]), strict=True), 1):
            lines.append(f"{k} 1 {2 * radius:.9e} {self.powder.density:g} " + " ".join(f"{v:.9e}" for v in place))
        lines += ["", "Velocities", ""]
        resting = np.zeros_like(self.fixed)
        for k, speed in enumerate(np.vstack([speeds, resting]), 1):
            lines.append(f"{k} " + " ".join(f"{v:.9e}" for v in speed) + " 0 0 0")
        file.write_text("\n".join([*lines, ""]))

    def _begin(self, atoms: str, folder: Path) -> None:
        """Grains, law and walls at the start of the fill."""
        last = len(self.grains)
        self.engine.do(
            "units si",
            f"atom_style {atoms}",
            "atom_modify map array",
            "boundary f f f",
            "newton off",
            *self.law.before(),
            f"read_data {folder / 'grains.data'}",
            f"neighbor {SKIN * self.mean_radius:g} bin",
            f"neigh_modify delay 0 binsize {4 * self.mean_radius:g}",
            f"group powder id <= {last}",
            f"group base id > {last}",
            *self.law.between_grains(),
            f"timestep {self.clock.dt:.12g}",
            f"fix gravity powder gravity {GRAVITY} vector 0 0 -1",
            "fix move powder nve/sphere",
            "thermo_modify lost ignore",
            *(
                ["fix stay base freeze", "neigh_modify exclude group base base"]
                if last < last + len(self.fixed)
                else []
            ),
            *([] if self.base.rough else self.law.plane("plate", 0.0)),
            *self.law.funnel(self.funnel, folder),
            *self.law.plane("gate", self.funnel.bottom),
        )

    def run(self, steps: int) -> None:
        """Step on."""
        self.engine.do(f"run {steps}")
        self.clock.time += steps * self.clock.dt

    def open(self) -> None:
        """Take the gate away."""
        self.engine.do("unfix gate")

    def shake(self, amplitude: float, frequency: float) -> None:
        """Vibrate the funnel along its axis (m, Hz)."""
        self.shaken = amplitude > 0
        if self.shaken:
            self.engine.do(*self.law.shake(amplitude, frequency))

    def bottom(self) -> float:
        """Height of the outlet, m, without the vibration; infinite once the funnel is taken away."""
        return inf if self.empty else self.funnel.bottom

    def remove_funnel(self) -> None:
        """Take the funnel away."""
        self.empty = True
        self.engine.do(*self.law.remove_funnel(self.shaken))

    def take_away(self, gone: np.ndarray) -> None:
        """Take grains out of the scene ((n,) booleans)."""
        if gone.any():
            self.engine.erase(self.numbers[gone])
            self.numbers, self.grains, self.mass = self.numbers[~gone], self.grains[~gone], self.mass[~gone]

    def _each(self, name: str) -> np.ndarray:
        """A vector of every moving grain, in the order of the radii."""
        numbers, values = self.engine.numbers(), self.engine.vectors(name)
        place = np.full(max(numbers.max(), self.numbers.max()) + 1, -1)
        place[numbers] = np.arange(len(numbers))
        found = place[self.numbers]
        if (found < 0).any():
            raise Failed(f"{int((found < 0).sum())} grains were lost")
        return values[found]

    def centres(self) -> np.ndarray:
        """(n, 3) array, m."""
        return self._each("x")

    def kinetic_energy(self) -> float:
        """Of translation, J."""
        return float(0.5 * self.mass @ (self._each("v") ** 2).sum(axis=1))

    def largest_speed(self) -> float:
        """m/s."""
        return float(np.linalg.norm(self._each("v"), axis=1).max())

    def largest_overlap(self) -> float:
        """Of two grains, in the mean radius."""
        places = np.vstack([self.centres(), self.fixed])
        radii = np.concatenate([self.grains, np.full(len(self.fixed), self.mean_radius)])
        if not np.isfinite(places).all():
            return inf
        pairs = cKDTree(places).query_pairs(2 * radii.max(), output_type="ndarray")
        pairs = pairs[pairs.min(axis=1) < len(self.grains)]
        apart = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1)
        return float((radii[pairs].sum(axis=1) - apart).max(initial=0.0)) / self.mean_radius


def heap(asked: dict, folder: Path) -> dict:
    """The rig's observables of one case, or the status of a heap that failed."""
    clock = SimpleNamespace(dt=0.0, time=0.0)
    stub = ModuleType("yade")  # of YADE the rig reads step and time here, and nothing else
    stub.O = clock  # type: ignore[attr-defined]
    sys.modules["yade"] = stub
    repose.PowderScene = partial(EngineScene, asked["engine"], asked["switches"], folder, clock)
    try:
        return {"status": "ok"} | repose.simulate(asked["case"])
    except Failed as reason:
        return {"status": str(reason)}


def main() -> None:
    """The heap that FOLDER asks for."""
    folder = Path(sys.argv[1])
    asked = json.loads((folder / "asked.json").read_text())
    (folder / "row.json").write_text(json.dumps(heap(asked, folder)))


if __name__ == "__main__":
    main()
