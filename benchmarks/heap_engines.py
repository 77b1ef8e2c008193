"""Our heap against two other engines, LIGGGHTS and LAMMPS, on the same grains: results/checks/heap_engines.csv.

    .venv/bin/python benchmarks/heap_engines.py [--heaps 12] [--what "LIGGGHTS" "LAMMPS G 0.2"] [--small] [--results results/checks]

All heaps are of the default protocol at the middle of the paper's Table 6, where a cell does not say otherwise: ours in the default law
by YADE, the others by Debian's packages liggghts (3.8.0) and lammps (of January 2022). A seed has the same radii, places,
velocities and rough base in all, at the same time step of 0.09 of the Rayleigh step (ours shortens it by an eighth at e = 0.15), and the
rig's own code does in all of them what is not mechanics: looks, taking away what ran over the edge, rest criterion, refusals, the
reading (benchmarks/engine_heap.py). So what differs is the law.

| | YADE, `cohesive_frictional` | LIGGGHTS, `hertz` | LAMMPS, `granular` |
|---|---|---|---|
| spring | linear | Hertz | Hertz; JKR where G > 0 |
| damper | only pushes | may pull | only pushes; may pull: `damper pulls` |
| restitution | the same at any speed | the same at any speed | that asked for at 0.3 m/s, 0.22 to 0.10 for 0.15 from 0.05 to 1 m/s; the same at any speed: `damper pulls` |
| tangential damper | none | as the normal one; none: `no tangential damper` | none; as that of LIGGGHTS: `tangential damper` |
| sliding limit, rolling limit | mu (N + 2 F), mu_r R (N + 2 F), N elastic | mu N, mu_r R N, N with damper | as ours; mu N, mu_r R N: `dmt`; with damper where G = 0: `damper pulls` |
| rolling spring | 0.5 of the tangential one, times R^2 | the tangential one, times R^2/4 | as ours |
| cohesion | JKR pull-off force; sticks as the stiff grain does | not used | JKR, as sticky as the soft grain is; `dmt`: the force alone |

So the steps from ours to another level are cells of their own. Without cohesion: LAMMPS has another spring than ours; with `damper pulls`
it has besides the damper of LIGGGHTS without its tangential one, and with `tangential damper` it should be LIGGGHTS but for the
stiffness of the rolling spring, which neither shows as an angle if both engines are right. With it: `dmt` takes cohesion out of
the limits, and stiffer cells take away what softness adds to JKR's sticking; at full stiffness 500 grains, in proportion smaller
apparatus, are what can be afforded. benchmarks/engine_checks.py has the restitution, pull-off and limits of two grains in each.

Heaps of ours that results/checks/default_heaps.csv has are not made again, but for four of a cell, by whose time its cost goes.
Every heap is a row of heap_engines_heaps.csv as it comes, and a second call goes on where the first was stopped; first seeds of all
cells come first. heap_engines.csv has a line a cell and reading: the mean with its 95 % interval, and its difference to ours in the
same powder and apparatus with Welch's interval. Cpu seconds are user plus system time of the process, its start included;
`cpu_seconds_quarter_deg` are those of a mean known to a standard error of 0.25 deg, cpu_seconds (sd/0.25)^2, lost heaps paid for.
For that cost there are cells at settings customary in those engines (the powder's own modulus, a fifth of the Rayleigh step) and
of release 0.1's law, protocol and step. `--small` is the same with 500 grains.
"""

import argparse
import json
import os
import shutil
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import pandas as pd
from by_hand import by_hand, child
from engines.lammps import DAMPER_PULLS, DMT, TANGENTIAL_DAMPER
from engines.library import SAID
from engines.liggghts import NO_TANGENTIAL_DAMPER
from repose_checks import FIRST_SEED as FIRST_OF_DEFAULT
from repose_checks import MOST, READINGS, Heaps, case, difference, shaped
from scipy import stats

ROOT = Path(__file__).resolve().parents[1]
FIRST_SEED = 96_000
YADE = "YADE"
VERSION = "2023.02a"  # of the YADE that made the heaps of default_heaps.csv which count here
TIMED = 4  # heaps of a cell at least that are simulated here, for its cpu seconds
COMMANDS = {YADE: "yade", "LIGGGHTS": "liggghts", "LAMMPS": "lmp"}
KEPT = (*READINGS, "over_edge_share", "discharge_time_s", "end_time_s", "largest_overlap")


class Cell(NamedTuple):
    """An engine with the switches of its law, and a powder."""

    engine: str
    surface_energy: float
    restitution: float = 0.15
    switches: tuple[str, ...] = ()
    small: bool = False
    softness: float = 1e-3
    step: float = 0.09  # of the Rayleigh step
    release: bool = False  # the law, protocol and step of release 0.1

    @property
    def what(self) -> str:
        """In words."""
        words = [f"{self.engine} G {self.surface_energy:.1f} e {self.restitution:g}", *self.switches]
        words += ["500 grains"] if self.small else []
        words += [f"stiffness {self.softness:g}"] if self.softness != 1e-3 else []
        words += [f"step {self.step:g}"] if self.step != 0.09 else []
        return ", ".join(words + (["release 0.1"] if self.release else []))

    @property
    def ours(self) -> "Cell":
        """What it is compared with."""
        return Cell(YADE, self.surface_energy, self.restitution, small=self.small)

    @property
    def aim(self) -> float | None:
        """How near to ours its heap should stand, deg: 1 without cohesion, 1.5 with; None where it is here for a switch or its cost."""
        if self.engine == YADE or self.switches or self.step != 0.09 or (self.small and self.softness != 1.0):
            return None
        return 1.5 if self.surface_energy else 1.0

    def case(self, seed: int) -> dict:
        """A case of the rig."""
        changes = {
            "powder_surface_energy": self.surface_energy,
            "powder_restitution": self.restitution,
            "stiffness_scale": self.softness,
        }
        if self.release:
            return case(
                seed, changes | {"protocol": "funnel", "outlet_height_mm": 60.0}, "cohesive_frictional_local_damping"
            )
        changes |= {"time_step_fraction": self.step} if self.step != 0.09 else {}
        return case(seed, (shaped(500) if self.small else {}) | changes)


CELLS = [
    *(Cell(engine, 0.0, restitution) for restitution in (0.15, 0.3) for engine in COMMANDS),
    Cell("LIGGGHTS", 0.0, switches=(NO_TANGENTIAL_DAMPER,)),
    Cell("LAMMPS", 0.0, switches=(DAMPER_PULLS,)),
    Cell("LAMMPS", 0.0, switches=(DAMPER_PULLS, TANGENTIAL_DAMPER)),
    *(Cell(engine, energy) for energy in (0.1, 0.2, 0.3) for engine in (YADE, "LAMMPS")),
    *(Cell("LAMMPS", 0.2, switches=(switch,)) for switch in (DMT, DAMPER_PULLS)),
    *(Cell(engine, energy, small=True) for energy in (0.0, 0.1, 0.2, 0.3) for engine in (YADE, "LAMMPS")),
    *(Cell("LAMMPS", energy, small=True, softness=1.0) for energy in (0.0, 0.1, 0.2, 0.3)),
    # for their cost: settings that are customary in these engines, and release 0.1
    *(Cell(engine, 0.0, softness=1.0, step=0.2) for engine in ("LIGGGHTS", "LAMMPS")),
    Cell("LAMMPS", 0.2, softness=1.0, step=0.2),
    *(Cell(YADE, energy, release=True) for energy in (0.0, 0.2)),
]


def other(cell: Cell, seed: int, folder: Path) -> tuple[dict, float]:
    """The rig's row of one heap by LIGGGHTS or LAMMPS, and its cpu seconds."""
    asked = {"engine": cell.engine, "switches": cell.switches, "case": cell.case(seed)}
    (folder / "asked.json").write_text(json.dumps(asked))
    alone = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
    script = [sys.executable, str(Path(__file__).with_name("engine_heap.py")), str(folder)]
    seconds = child(script, folder, os.environ | alone | {"PYTHONPATH": str(ROOT)})
    if not (folder / "row.json").exists():
        said = "\n".join(file.read_text()[-2000:] for file in (folder / "said.txt", folder / SAID) if file.exists())
        sys.exit(f"{cell.what}, seed {seed}, left no result; it said at last:\n{said}")
    return json.loads((folder / "row.json").read_text()), seconds


def heap(cell: Cell, seed: int) -> dict:
    """A row of the heaps."""
    with tempfile.TemporaryDirectory(prefix="heap-") as name:
        folder = Path(name)
        row, seconds = by_hand(cell.case(seed), folder) if cell.engine == YADE else other(cell, seed, folder)
    found = {"what": cell.what, "seed": seed, "status": row["status"], "cpu_seconds": round(seconds, 2)}
    return found | {key: row.get(key) for key in KEPT}


def known(cell: Cell) -> pd.DataFrame:
    """The heaps of results/checks/default_heaps.csv that are of this cell; none where it is of another engine."""
    if cell.engine != YADE:
        return pd.DataFrame(columns=["status", *READINGS])
    return Heaps(False, None).frame((cell.case(FIRST_OF_DEFAULT + k) for k in range(MOST)), VERSION)


def heaps(file: Path, cells: list[Cell], number: int) -> pd.DataFrame:
    """The rows of the file, and those of these cells that are missing there."""
    rows = pd.read_csv(file) if file.exists() else pd.DataFrame(columns=["what", "seed"])
    done = set(rows[["what", "seed"]].itertuples(index=False, name=None))
    wanted = {cell: max(min(number, TIMED), number - len(known(cell))) for cell in cells}
    for seed in range(FIRST_SEED, FIRST_SEED + number):
        for cell in cells:
            if (cell.what, seed) not in done and seed - FIRST_SEED < wanted[cell]:
                row = heap(cell, seed)
                rows = pd.concat([rows, pd.DataFrame([row])], ignore_index=True)
                rows.to_csv(file, index=False, float_format="%.6g", lineterminator="\n")
                print(row["what"], seed, row["status"], row["repose_angle_deg"], f"{row['cpu_seconds']} s", flush=True)
    return pd.read_csv(file) if file.exists() else rows


def all_of(cell: Cell, rows: pd.DataFrame) -> pd.DataFrame:
    """The heaps of a cell: those made here and those known."""
    each = [rows[rows["what"] == cell.what], known(cell)]
    return pd.concat([some[["status", *READINGS]] for some in each if len(some)] or each[1:], ignore_index=True)


def lines(cell: Cell, rows: pd.DataFrame) -> list[dict]:
    """Lines of the table: a cell by each reading."""
    here = rows[rows["what"] == cell.what]
    good, ours = (found[found["status"] == "ok"] for found in (all_of(each, rows) for each in (cell, cell.ours)))
    number = len(all_of(cell, rows))
    found = []
    for reading in READINGS[1:]:
        angles, base = good[reading].dropna(), ours[reading].dropna()
        line = {"what": cell.what, "reading": reading, "heaps": len(angles), "lost": number - len(angles)}
        line["angle_deg"] = angles.mean()
        if len(angles) > 1:
            half = stats.t.ppf(0.975, len(angles) - 1) * stats.sem(angles)
            line |= {"sd_deg": angles.std(), "low_deg": angles.mean() - half, "high_deg": angles.mean() + half}
        if cell != cell.ours and min(len(angles), len(base)) > 1:
            changed = difference(angles.to_numpy(), base.to_numpy(), cell.aim)
            line |= {f"to_ours_{key}": value for key, value in changed.items()}
        line["cpu_seconds"] = here["cpu_seconds"].mean()
        if len(angles) > 1:  # lost heaps are paid for too
            line["cpu_seconds_quarter_deg"] = line["cpu_seconds"] * number / len(angles) * (angles.std() / 0.25) ** 2
        found.append(line | {"first_loss": next(iter(here.loc[here["status"] != "ok", "status"]), "")})
    return found


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """The table of all cells that have heaps, small ones last."""
    cells = list(dict.fromkeys([*CELLS, *(cell._replace(small=True) for cell in CELLS)]))
    return pd.DataFrame(
        [line for cell in cells if (rows["what"] == cell.what).any() for line in lines(cell, rows)]
    ).round(2)


SHOWN = {"repose_triangle_deg": "triangle", "repose_moment_deg": "moment", "repose_height_deg": "height"}


def page(table: pd.DataFrame) -> list[str]:
    """The lines of the table as they stand in docs/heap_physics.md, a cell each."""
    found = []
    for what, rows in table.groupby("what", sort=False):
        rows = rows.set_index("reading").loc[list(SHOWN)].astype(object)
        rows = rows.where(rows.notna(), None)
        first = rows.iloc[0]  # a heap on a plate has no height
        cells = [what, f"{first['heaps']}" + (f" of {first['heaps'] + first['lost']}" if first["lost"] else "")]
        if first["angle_deg"] is None:
            cells.append(f"none: {first['first_loss']}")
        else:
            means = (row["angle_deg"] for _, row in rows.iterrows())
            cells.append(" / ".join("-" if mean is None else f"{mean:.1f}" for mean in means))
        for _, row in rows.iterrows():
            change = [row.get(f"to_ours_{key}_deg") for key in ("change", "low", "high")]
            words = "" if None in change else "{:+.1f} ({:.1f} to {:.1f})".format(*change)
            cells.append(words + (f", {row['to_ours_aim_is']}" if row.get("to_ours_aim_is") else ""))
        cells.append(f"{first['cpu_seconds']:.0f}")
        spent = {SHOWN[name]: row["cpu_seconds_quarter_deg"] for name, row in rows.iterrows()}
        best = min((name for name in spent if spent[name] is not None), key=spent.get, default=None)
        cells.append("" if best is None else f"{spent[best]:.0f} ({best})")
        found.append("| " + " | ".join(cells) + " |")
    return found


def main() -> None:
    """Simulate what is missing and write both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--heaps", type=int, default=12, metavar="N", help="of a cell; default 12")
    parser.add_argument(
        "--what", nargs="+", metavar="CELL", help="simulate the cells alone that have one of these words"
    )
    parser.add_argument("--small", action="store_true", help="500 grains in every cell")
    parser.add_argument("--results", type=Path, default=Path("results/checks"), metavar="FOLDER")
    given = parser.parse_args()
    cells = list(dict.fromkeys(cell._replace(small=True) for cell in CELLS)) if given.small else CELLS
    cells = [cell for cell in cells if not given.what or any(words in cell.what for words in given.what)]
    for engine in {cell.engine for cell in cells}:
        if not shutil.which(COMMANDS[engine]):
            sys.exit(f"{COMMANDS[engine]} was not found; on Debian: apt-get install yade liggghts lammps")
    table = summary(heaps(given.results / "heap_engines_heaps.csv", cells, given.heaps))
    table.to_csv(given.results / "heap_engines.csv", index=False, lineterminator="\n")
    print("\n".join(page(table)))


if __name__ == "__main__":
    main()
