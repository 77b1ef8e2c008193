"""What the simulated repose angle depends on besides the powder: tables with intervals in results/checks.

    .venv/bin/python benchmarks/repose_checks.py [TABLE ...] [--heaps 12] [--workers 1] [--stored]

`invariance` changes one setting of the default protocol after the other at the middle of the paper's Table 6 and several
surface energies; `protocols` does the least of that for the other protocols. A row compares a setting with the same rig
unchanged: the difference of the mean angles and its 95 % interval (Welch), beside the aim fixed beforehand. An aim is met
where the whole interval lies within it, missed where it lies wholly outside, else open. Numerics are compared in a rig of
500 grains, of the default's shape. First heaps of every row come first, so that a campaign that is stopped leaves a whole
table with wider intervals; finished heaps are kept in results/checks/.store. Every table has a file of its heaps beside it.
"""

import argparse
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch
from pellet_study.simulation.store import Store, key

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
FULL: dict = {}  # 1,503 grains
LENGTHS = (
    "base_diameter_mm",
    "outlet_height_mm",
    "outlet_diameter_mm",
    "funnel_diameter_mm",
    "cylinder_diameter_mm",
)
READINGS = ("repose_angle_deg", "repose_flank_deg", "repose_triangle_deg", "repose_moment_deg")


def shaped(grains: int) -> dict:
    """The default rig with another number of the same grains, all lengths scaled alike."""
    known = on_yade.rig("repose")
    default = {name: quantity["default"] for name, quantity in (known.conditions | known.numerics).items()}
    larger = (grains / 1503) ** (1 / 3)
    scaled = {name: round(larger * default[name], 2) for name in LENGTHS}
    scaled["lift_mm_s"] = round(larger**0.5 * default["lift_mm_s"], 2)  # of the same Froude number
    return {"powder_mass_g": round(default["powder_mass_g"] * grains / 1503, 3)} | scaled


class Row(NamedTuple):
    """A setting of a table: `changes` to a `rig`, compared with `base`; its aim (deg), and the least and most heaps."""

    what: str
    surface_energy: float
    rig: dict
    changes: dict
    base: dict
    aim: float | None = None
    heaps: int = 12

    @property
    def setting(self) -> str:
        """In words."""
        return ", ".join(
            f"{name} {value if isinstance(value, str) else format(value, 'g')}" for name, value in self.changes.items()
        )

    def cases(self, compared: bool) -> list[dict]:
        """Of the row, or of what it is compared with."""
        given = {"powder_surface_energy": self.surface_energy} | (self.base if compared else self.rig | self.changes)
        return [case(FIRST_SEED + k, given) for k in range(self.heaps)]


def one_at_a_time() -> list[Row]:
    """Rows of the table `invariance`."""
    small = shaped(500)
    rows = []
    for energy in (0.0, 0.2, 0.1, 0.3):
        numerics = [("time step", {"time_step_fraction": 0.045}, 1.0)]
        numerics += [("stiffness", {"stiffness_scale": scale}, 1.0) for scale in (3e-3, 3.3e-4)]
        if energy in (0.0, 0.2):
            numerics += [("rest", {"rest_energy": value}, 1.0) for value in (1e-2, 4e-4)]
        rows += [Row(what, energy, small, changes, small, aim, 24) for what, changes, aim in numerics]
        rows.append(Row("number of grains", energy, small, {}, FULL, None, 12)._replace(what="500 grains"))
        rows.append(Row("4,000 grains", energy, shaped(4000), {}, FULL, 1.5, 8))
    for energy in (0.0, 0.2):
        rows += [
            Row("steel pair", energy, FULL, {f"powder_steel_{name}": value for name, value in steel.items()}, FULL)
            for steel in (
                {"static_friction": 0.36, "rolling_friction": 0.15},
                {"restitution": 0.5},
            )
        ]
        rows += [Row("fall height", energy, FULL, {"outlet_height_mm": value}, FULL) for value in (50.0, 75.0)]
        rows += [Row("mass", energy, FULL, {"powder_mass_g": value}, FULL) for value in (30.0,)]
        rows += [Row("base", energy, FULL, {"base": "smooth"}, FULL)]
        rows += [Row("outlet", energy, FULL, {"outlet_diameter_mm": value}, FULL) for value in (30.0,)]
        rows += [
            Row("amplification", energy, FULL, {"amplification": value}, FULL, None, n)
            for value, n in ((8.0, 12), (4.0, 6))
        ]
        rows += [Row("stiffness", energy, small, {"stiffness_scale": 1.0}, small, 1.0, 3)]
    return rows


def other_protocols() -> list[Row]:
    """Rows of the table `protocols`."""
    small, rows = shaped(500), []
    for protocol in ("lifted_cylinder", "funnel"):
        told = {"protocol": protocol}
        rows += [
            Row(protocol, 0.2, small, told | {"time_step_fraction": 0.045}, small | told),
            Row(protocol, 0.2, small, told, FULL | told),
        ]
        if protocol == "funnel":
            rows.append(Row(protocol, 0.2, small, told | {"outlet_height_mm": 41.6}, small | told))
        else:
            rows.append(Row(protocol, 0.2, small, told | {"lift_mm_s": 10.0}, small | told))
    return rows


TABLES = {"invariance": one_at_a_time, "protocols": other_protocols}


def case(seed: int, changes: dict, law: str | None = None) -> dict:
    """The middle of Table 6 with changes to any group."""
    known = on_yade.rig("repose")
    groups = {g: {k: v for k, v in changes.items() if k in getattr(known, g)} for g in ("conditions", "numerics")}
    parameters = MIDDLE | {k: v for k, v in changes.items() if k in known.parameters}
    assert set(changes) <= {*parameters, *groups["conditions"], *groups["numerics"]}, changes
    return on_yade.case("repose", contact_law=law, seed=seed, parameters=parameters, **groups)


def simulated(rows: list[Row], most: int, workers: int | None, stored: bool) -> dict[str, pd.Series]:
    """Every heap of a table by its key, simulated or from the store; only those in the store where asked so."""
    rig, wanted = on_yade.rig("repose"), {}
    for k in range(most):
        for row, compared in product(rows, (True, False)):
            if k < row.heaps:
                one = row.cases(compared)[k]
                wanted.setdefault(key(one, rig), one)
    if stored:
        with Store(FOLDER / ".store") as store:
            known = store.rows(rig).index
        wanted = {name: one for name, one in wanted.items() if name in known}
    found = dispatch.run(list(wanted.values()), FOLDER / ".store", workers=workers, quiet=True)
    return dict(zip(wanted, (row for _, row in found.iterrows()), strict=True))


def compared(row: Row, heaps: dict[str, pd.Series]) -> dict:
    """A line of a table: the setting, its heaps, and the difference from what it is compared with."""
    rig = on_yade.rig("repose")
    sides = [
        pd.DataFrame([heaps[name] for one in row.cases(base) if (name := key(one, rig)) in heaps])
        for base in (False, True)
    ]
    good = [side[side["status"] == "ok"] if len(side) else side for side in sides]
    line = {
        "what": row.what,
        "surface_energy_j_m2": row.surface_energy,
        "setting": row.setting,
        "heaps": len(sides[0]),
        "compared_with": len(sides[1]),
        "lost": len(sides[0]) - len(good[0]),
    }
    if min(map(len, good)) < 2:
        return line
    angle, base = (side["repose_angle_deg"].astype(float) for side in good)
    line |= {name: round(good[0][name].astype(float).mean(), 2) for name in READINGS}
    line["sd_over_seeds_deg"] = round(angle.std(ddof=1), 2)
    line |= difference(angle.to_numpy(), base.to_numpy(), row.aim)
    line["largest_overlap"] = round(good[0]["largest_overlap"].astype(float).max(), 3)
    line["end_time_s"] = round(good[0]["end_time_s"].astype(float).mean(), 3)
    line["first_loss"] = next(iter(sides[0].loc[sides[0]["status"] != "ok", "status"]), "")
    return line


def difference(angle: np.ndarray, base: np.ndarray, aim: float | None) -> dict:
    """Difference of two means with its 95 % interval (Welch), and whether it lies within +- an aim (deg)."""
    test = stats.ttest_ind(angle, base, equal_var=False)
    interval = test.confidence_interval()
    found = {
        "change_deg": round(angle.mean() - base.mean(), 2),
        "standard_error_deg": round(float(np.hypot(stats.sem(angle), stats.sem(base))), 2),
        "low_deg": round(interval.low, 2),
        "high_deg": round(interval.high, 2),
    }
    if aim is not None:
        within = -aim <= interval.low and interval.high <= aim
        outside = interval.low > aim or interval.high < -aim
        found |= {"aim_deg": aim, "aim_is": "met" if within else "missed" if outside else "open"}
    return found


def main() -> None:
    """Simulate what is missing and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"any of {', '.join(TABLES)}; default all")
    parser.add_argument("--heaps", type=int, default=100, help="at most so many of a setting; default all")
    parser.add_argument("--workers", type=int)
    parser.add_argument("--stored", action="store_true", help="simulate nothing: what the store has")
    given = parser.parse_args()
    if unknown := set(given.tables) - set(TABLES):
        parser.error(f"no table {', '.join(sorted(unknown))}; expected any of {', '.join(TABLES)}")
    for name in given.tables or TABLES:
        rows = TABLES[name]()
        heaps = simulated(rows, given.heaps, given.workers, given.stored)
        pd.DataFrame(heaps.values()).drop(columns="id").to_csv(
            FOLDER / f"{name}_heaps.csv", index=False, float_format="%.6g", lineterminator="\n"
        )
        table = pd.DataFrame([compared(row, heaps) for row in rows])
        table.to_csv(FOLDER / f"{name}.csv", index=False, lineterminator="\n")
        print(table.to_string(index=False), flush=True)


if __name__ == "__main__":
    main()
