"""What the simulated repose angle depends on besides the powder: tables with intervals in results/checks.

    .venv/bin/python benchmarks/repose_checks.py [TABLE ...] [--heaps 24] [--energies 0.2 0] [--what rest] [--anew]

| table | what it compares |
|---|---|
| `invariance` | one setting of the default protocol after the other, with the same rig unchanged |
| `protocols` | the least of that, for every protocol |
| `costly` | the same where a heap takes minutes: full stiffness, smaller grains, the standard's base of 100 mm |
| `versions` | the same heaps on the YADE here and on that of Debian 13 (.ci/debian13) |

readings.csv has what the default heaps of `invariance` are by each reading.

All heaps stand at the middle of the paper's Table 6, at the surface energies that a line names. A line has the difference
of the mean angles and its 95 % interval (Welch's; that of pairs of one seed for the rest criterion, which only decides when
the same heap is looked at), beside the aim fixed beforehand: met where the whole interval lies within it, missed where it lies
wholly outside, else open. First heaps of every row come first: calls with more and more --heaps leave whole tables at any
time, with narrower and narrower intervals.

Every heap is a row of default_heaps.csv, and is not simulated again: a heap of the file is simulated anew first, and where it does
not repeat, the file is of other scripts and refused (--anew: start from nothing). A heap repeats to the digit only where the
mathematics library rounds alike, which column `processor` tells (blank in rows made before it was written): one of a like processor
is chosen, and where there is none, a line says so.
"""

import argparse
import hashlib
import json
import re
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import other_yade
import pandas as pd
from scipy import stats

from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch, yade

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "results" / "checks"
HEAPS = FOLDER / "default_heaps.csv"
OTHER_YADE = "2025.2.0"  # of Debian 13
FIRST_SEED = 90_000
REPEATS = 1e-6  # deg, within which a heap of the file does
MOST = 60  # heaps of a setting
MIDDLE = {
    "powder_restitution": 0.15,
    "powder_static_friction": 0.8,
    "powder_rolling_friction": 0.35,
    "powder_steel_restitution": 0.15,
    "powder_steel_static_friction": 0.72,
    "powder_steel_rolling_friction": 0.29,
    "powder_surface_energy": 0.2,
}
LENGTHS = (
    "base_diameter_mm",
    "outlet_height_mm",
    "outlet_diameter_mm",
    "funnel_diameter_mm",
    "cylinder_diameter_mm",
)
READINGS = ("repose_angle_deg", "repose_flank_deg", "repose_triangle_deg", "repose_moment_deg", "repose_height_deg")
# the reading that stands for the angle, then others, by what their columns begin with
COMPARED = {"": "repose_angle_deg", "moment_": "repose_moment_deg", "height_": "repose_height_deg"}
MORE = (
    "over_edge_share",
    "heap_height_mm",
    "end_time_s",
    "largest_overlap",
)


def case(seed: int, changes: dict, law: str | None = None) -> dict:
    """The middle of Table 6 with changes to any group."""
    known = on_yade.rig("repose")
    groups = {g: {k: v for k, v in changes.items() if k in getattr(known, g)} for g in ("conditions", "numerics")}
    parameters = MIDDLE | {k: v for k, v in changes.items() if k in known.parameters}
    assert set(changes) <= {*parameters, *groups["conditions"], *groups["numerics"]}, changes
    return on_yade.case("repose", contact_law=law, seed=seed, parameters=parameters, **groups)


def shaped(grains: int) -> dict:
    """The default rig with another number of the same grains, all lengths scaled alike."""
    known = on_yade.rig("repose")
    default = {name: quantity["default"] for name, quantity in (known.conditions | known.numerics).items()}
    larger = (grains / 1503) ** (1 / 3)
    scaled = {name: round(larger * default[name], 2) for name in LENGTHS}
    scaled["lift_speed_mm_s"] = round(larger**0.5 * default["lift_speed_mm_s"], 2)  # of the same Froude number
    return {"powder_mass_g": round(default["powder_mass_g"] * grains / 1503, 3)} | scaled


class Row(NamedTuple):
    """A setting of a table: `changes`, compared with `base`; its aim (deg), and the most heaps it is worth.

    `paired`: a heap differs from that of the same seed only in when it is looked at, so they are compared seed by seed.
    """

    what: str
    surface_energy: float
    changes: dict
    base: dict | None = {}  # noqa: RUF012
    aim: float | None = None
    most: int = MOST
    paired: bool = False

    @property
    def setting(self) -> str:
        """In words."""
        changed = {k: v for k, v in self.changes.items() if (self.base or {}).get(k) != v}
        if set(LENGTHS) <= set(changed):
            return f"{changed['powder_mass_g']:g} g, all lengths of the rig in proportion"
        return ", ".join(f"{k} {v if isinstance(v, str) else format(v, 'g')}" for k, v in changed.items())

    def case(self, k: int, compared: bool = False) -> dict:
        """Its heap number k, or that of what it is compared with."""
        given = (self.base or {}) if compared else self.changes
        return case(FIRST_SEED + k, given | {"powder_surface_energy": self.surface_energy})


def one_at_a_time() -> list[Row]:
    """Rows of the table `invariance`."""
    small, rows = shaped(500), []
    for energy in (0.2, 0.0, 0.1, 0.3):
        numerics = [("time step", {"time_step_fraction": 0.045})]
        numerics += [("stiffness", {"stiffness_scale": scale}) for scale in (3e-3, 3.3e-4)]
        if energy in (0.2, 0.0):
            numerics += [("rest", {"rest_energy": value}) for value in (1e-2, 4e-4)]
        rows.append(Row("default", energy, {}, None))
        rows += [Row(what, energy, changes, aim=1.0, paired=what == "rest") for what, changes in numerics]
        rows.append(Row("500 grains", energy, small))
        rows.append(Row("4,000 grains", energy, shaped(4000), aim=1.5, most=12))
    for energy in (0.2, 0.0):
        others = [
            ("steel pair", {"powder_steel_static_friction": 0.36, "powder_steel_rolling_friction": 0.15}),
            ("steel pair", {"powder_steel_restitution": 0.5}),
            ("fall height", {"outlet_height_mm": 50.0}),
            ("mass", {"powder_mass_g": 30.0}),
            ("base", {"base": "smooth"}),
            ("outlet", {"outlet_diameter_mm": 30.0}),
            ("amplification", {"amplification": 8.0}),
            ("restitution", {"powder_restitution": 0.5}),
            ("vibration", {"vibration_mm": 0.0}),
        ]
        others += [("limits", {"adhesion_load": load}) for load in (1.25,) if energy]
        rows += [Row(what, energy, changes, most=12) for what, changes in others]
    return rows


def costly() -> list[Row]:
    """Rows of the table `costly`."""
    small, full, rows = shaped(500), {"stiffness_scale": 1.0}, []
    for energy in (0.2, 0.0):
        rows.append(Row("full stiffness, 500 grains", energy, small | full, small, aim=1.0, most=3))
        rows.append(Row("amplification", energy, {"amplification": 4.0}, most=4))
    standard, stiffer = shaped(8 * 1503), {"stiffness_scale": 3e-3}  # at the default its grains are squeezed flat
    rows.append(Row("base of 100 mm", 0.2, standard, most=1))
    return [*rows, Row("base of 100 mm, stiffer", 0.2, standard | stiffer, stiffer, most=3)]


def each_protocol() -> list[Row]:
    """Rows of the table `protocols`, at one surface energy."""
    rows = []
    for protocol in on_yade.rig("repose").conditions["protocol"]["options"]:
        told = {"protocol": protocol} if protocol != "defined_base" else {}
        other = {"lift_speed_mm_s": 60.0} if protocol == "lifted_cylinder" else {"outlet_height_mm": 50.0}
        rows += [
            Row(f"{protocol}: default", 0.2, told, None),
            Row(f"{protocol}: time step", 0.2, told | {"time_step_fraction": 0.045}, told),
            Row(f"{protocol}: 500 grains", 0.2, told | shaped(500), told),
            Row(
                f"{protocol}: {'faster lift' if 'lift_speed_mm_s' in other else 'fall height'}", 0.2, told | other, told
            ),
            Row(f"{protocol}: mass", 0.2, told | {"powder_mass_g": 50.0}, told),
        ]
    return rows


TABLES = {"invariance": one_at_a_time, "protocols": each_protocol, "costly": costly}


def name_of(case: dict) -> str:
    """A case by what it says of a heap without effects, whatever the scripts and wherever a rig declares it."""
    said = {key: case[key] for key in ("contact_law", "seed")}
    for group in ("parameters", "conditions", "numerics"):
        said |= case[group]
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()[:16]


def processor() -> str:
    """Maker, family and model of this machine's processor."""
    told = dict(re.findall(r"^(vendor_id|cpu family|model)\s*: (.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE))
    return " ".join(told.get(name, "?") for name in ("vendor_id", "cpu family", "model"))


class Heaps:
    """The heaps of the file and those made since, by version of YADE and name."""

    def __init__(self, anew: bool, workers: int | None):
        self.workers, self.version = workers, yade.version()
        known = HEAPS.exists() and not anew
        self.rows = pd.read_csv(HEAPS, dtype={"yade": str}).set_index(["yade", "name"]) if known else None

    def known(self, case: dict, version: str | None = None) -> bool:
        """Whether there is such a heap."""
        return self.rows is not None and (version or self.version, name_of(case)) in self.rows.index

    def frame(self, cases: Iterable[dict], version: str | None = None) -> pd.DataFrame:
        """Rows of those that there are."""
        found = [(version or self.version, name_of(one)) for one in cases if self.known(one, version)]
        return self.rows.loc[found] if found else pd.DataFrame(columns=["status", *READINGS])

    def check(self, rows: list[Row]) -> None:
        """Simulate a heap of those rows anew, if the file has one of a processor like this."""
        if self.rows is None:
            return
        known = (one for row in rows for one in map(row.case, range(row.most)) if self.known(one))
        like = {"processor": processor(), "status": "ok"}
        one = next((one for one in known if dict(self.frame([one]).iloc[0][list(like)]) == like), None)
        if one is None:
            print(f"no heap of {HEAPS.name} is of a processor like this one: none could be repeated", file=sys.stderr)
            return
        [again], [before] = self.simulated([one]).to_dict("records"), self.frame([one]).to_dict("records")
        if not abs(again["repose_angle_deg"] - before["repose_angle_deg"]) <= REPEATS:
            sys.exit(
                f"the heap of seed {one['seed']} had {before['repose_angle_deg']:.6f} deg and has "
                f"{again['repose_angle_deg']:.6f} now: {HEAPS.name} is of other scripts; --anew starts from nothing"
            )

    def simulated(self, cases: list[dict]) -> pd.DataFrame:
        """Those cases simulated, whatever the file has."""
        found = dispatch.run(cases, FOLDER / ".store", workers=self.workers, quiet=True)
        kept = found[["seed", "status", "grains", *READINGS, *MORE]].assign(processor=processor())
        index = pd.MultiIndex.from_arrays(
            [[self.version] * len(cases), list(map(name_of, cases))], names=["yade", "name"]
        )
        return kept.set_axis(index)

    def add(self, rows: pd.DataFrame) -> None:
        """Keep rows, in the file too."""
        self.rows = rows if self.rows is None else pd.concat([self.rows, rows])
        self.rows = self.rows[~self.rows.index.duplicated()]
        self.rows.sort_index().to_csv(HEAPS, float_format="%.9g", lineterminator="\n")

    def make(self, cases: list[dict]) -> None:
        """Simulate what is missing."""
        wanted = {name_of(one): one for one in cases if not self.known(one)}
        if wanted:
            self.add(self.simulated(list(wanted.values())))


def line(row: Row, here: pd.DataFrame, base: pd.DataFrame | None) -> dict:
    """Of a table: the setting, its heaps, and the difference from what it is compared with."""
    good = here[here["status"] == "ok"]
    found = {"what": row.what, "surface_energy_j_m2": row.surface_energy, "setting": row.setting}
    found |= {"heaps": len(here), "lost": len(here) - len(good)}
    if len(good):
        found |= {name: round(good[name].astype(float).mean(), 2) for name in READINGS}
    if len(good) > 1:
        found |= {
            f"{kind}sd_over_seeds_deg": round(good[name].astype(float).std(), 2) for kind, name in COMPARED.items()
        }
    if base is not None:
        base = base[base["status"] == "ok"]
        if row.paired:
            good, base = (each[each["seed"].isin(other["seed"])] for each, other in ((good, base), (base, good)))
        found["compared_with"] = len(base)
        if min(len(good), len(base)) > 1:
            for kind, name in COMPARED.items():
                angles = [each[name].astype(float).to_numpy() for each in (good, base)]
                changed = difference(*angles, None if kind else row.aim, row.paired)
                found |= {f"{kind}{key}": value for key, value in changed.items()}
    if len(good):
        found["largest_overlap"] = round(good["largest_overlap"].astype(float).max(), 3)
        found["end_time_s"] = round(good["end_time_s"].astype(float).mean(), 3)
    found["first_loss"] = next(iter(here.loc[here["status"] != "ok", "status"]), "")
    return found


def difference(angle: np.ndarray, base: np.ndarray, aim: float | None, paired: bool = False) -> dict:
    """Difference of two means with its 95 % interval (Welch's, or of pairs), and whether it lies within +- an aim (deg)."""
    test = stats.ttest_rel(angle, base) if paired else stats.ttest_ind(angle, base, equal_var=False)
    error = stats.sem(angle - base) if paired else np.hypot(stats.sem(angle), stats.sem(base))
    interval = test.confidence_interval()
    found = {
        "change_deg": round(angle.mean() - base.mean(), 2),
        "standard_error_deg": round(float(error), 2),
        "low_deg": round(interval.low, 2),
        "high_deg": round(interval.high, 2),
    }
    if aim is not None:
        within = -aim <= interval.low and interval.high <= aim
        outside = interval.low > aim or interval.high < -aim
        found |= {"aim_deg": aim, "aim_is": "met" if within else "missed" if outside else "open"}
    return found


def table_of(rows: list[Row], heaps: Heaps) -> pd.DataFrame:
    """A table, of the rows that have heaps."""
    lines = []
    for row in rows:
        numbers = range(row.most)
        base = None if row.base is None else heaps.frame(row.case(k, True) for k in range(MOST))
        here = heaps.frame(row.case(k) for k in numbers)
        if len(here):
            lines.append(line(row, here, base))
    return pd.DataFrame(lines)


def scatter(table: pd.DataFrame, surface_energy: float) -> float:
    """Standard deviation of the angle over seeds, pooled over the lines of 1,503 grains at a surface energy, deg."""
    full = ~table["what"].str.contains("grains|amplification") & (table["surface_energy_j_m2"] == surface_energy)
    known = table[full & (table["heaps"] - table["lost"] > 1)]
    freedom = known["heaps"] - known["lost"] - 1
    return float(np.sqrt((freedom * known["sd_over_seeds_deg"] ** 2).sum() / freedom.sum()))


def page(table: pd.DataFrame) -> list[str]:
    """The lines of a table as they stand in docs/heap_physics.md."""
    lines = []
    for row in table.astype(object).where(table.notna(), None).to_dict("records"):
        cells = [
            row["what"],
            f"{row['surface_energy_j_m2']:g}",
            row["setting"] or "",
            f"{row['heaps'] - row['lost']:g}" + (f" of {row['heaps']:g}" if row["lost"] else ""),
        ]
        angles = [row.get(name) for name in COMPARED.values()]
        words = " / ".join("-" if angle is None else f"{angle:.1f}" for angle in angles)
        cells.append(f"none: {row['first_loss']}" if angles[0] is None else words)
        for name in COMPARED:
            change = [row.get(f"{name}{key}_deg") for key in ("change", "low", "high")]
            cells.append("" if None in change else "{:+.1f} ({:.1f} to {:.1f})".format(*change))
        aim = row.get("aim_deg")
        cells.append(f"{aim:g}: {row['aim_is']}" if aim is not None and row.get("aim_is") else "")
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def written(name: str, table: pd.DataFrame) -> None:
    """Write a table."""
    table.to_csv(FOLDER / f"{name}.csv", index=False, lineterminator="\n")


def readings(heaps: Heaps) -> pd.DataFrame:
    """The default heaps by each reading: mean with its 95 % interval and standard deviation over seeds, deg."""
    lines = []
    for row in one_at_a_time():
        if row.base is None:
            found = heaps.frame(row.case(k) for k in range(row.most))
            found = found[found["status"] == "ok"]
            for name in READINGS[1:]:
                angles = found[name].dropna().astype(float)
                half = stats.t.ppf(0.975, len(angles) - 1) * stats.sem(angles)
                values = {"angle_deg": angles.mean(), "half_interval_deg": half, "sd_over_seeds_deg": angles.std()}
                said = {"surface_energy_j_m2": row.surface_energy, "reading": name, "heaps": len(angles)}
                lines.append(said | {key: round(float(value), 2) for key, value in values.items()})
    return pd.DataFrame(lines)


def readings_page(table: pd.DataFrame) -> list[str]:
    """Its lines as they stand in docs/heap_physics.md."""
    return [
        f"| {row.surface_energy_j_m2:g} | {row.reading} | {row.heaps} | {row.angle_deg:.1f} +- {row.half_interval_deg:.1f} | "
        f"{row.sd_over_seeds_deg:.1f} |"
        for row in table.itertuples()
    ]


def wanted_row(row: Row, energies: list[float] | None, what: list[str] | None) -> bool:
    """Whether a call asks for more heaps of a row."""
    return (not energies or row.surface_energy in energies) and (not what or any(words in row.what for words in what))


VERSIONS = [Row("default", energy, {}, None, 1.5) for energy in (0.0, 0.2)]


def versions(heaps: Heaps) -> pd.DataFrame:
    """The table of both YADEs, of what the file has."""
    lines = []
    for row in VERSIONS:
        cases = [row.case(k) for k in range(row.most)]
        both = [heaps.frame(cases, version) for version in (OTHER_YADE, heaps.version)]
        lines.append(line(row, *both) | {"what": f"{OTHER_YADE} against {heaps.version}"})
    return pd.DataFrame(lines)


def main() -> None:
    """Simulate what is missing and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    known = [*TABLES, "versions"]
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"any of {', '.join(known)}; default all")
    parser.add_argument("--heaps", type=int, default=MOST, help=f"at most so many of a setting; default {MOST}")
    parser.add_argument("--workers", type=int)
    parser.add_argument("--anew", action="store_true", help="forget the heaps of the file")
    parser.add_argument(
        "--here", action="store_true", help="heaps of `versions` on this YADE alone, on standard output"
    )
    parser.add_argument("--energies", type=float, nargs="+", metavar="G", help="simulate at these alone, J/m2")
    parser.add_argument(
        "--what", nargs="+", metavar="WORDS", help="simulate the lines whose first column has them alone"
    )
    given = parser.parse_args()
    if unknown := set(given.tables) - set(known):
        parser.error(f"no table {', '.join(sorted(unknown))}; expected any of {', '.join(known)}")
    heaps = Heaps(given.anew, given.workers)
    if given.here:
        cases = [row.case(k) for k in range(given.heaps) for row in VERSIONS if wanted_row(row, given.energies, None)]
        heaps.make(cases)
        print(heaps.frame(cases).reset_index().to_csv(index=False, float_format="%.9g"))
        return
    wanted = given.tables or known
    heaps.check([*VERSIONS, *(row for rows in TABLES.values() for row in rows())])
    for name in wanted:
        rows = TABLES[name]() if name in TABLES else VERSIONS
        now = [row for row in rows if wanted_row(row, given.energies, given.what)]
        sides = [(row, compared) for row in now for compared in ((False,) if row.base is None else (True, False))]
        heaps.make([row.case(k, side) for k in range(given.heaps) for row, side in sides if k < row.most])
        if name in TABLES:
            written(name, table_of(rows, heaps))
        if name == "invariance":
            written("readings", readings(heaps))
    if "versions" in wanted:
        words = ["--heaps", str(given.heaps)] + (["--energies", *map(str, given.energies)] if given.energies else [])
        there = other_yade.table(Path(__file__).name, "yade", *words)
        heaps.add(there.set_index(["yade", "name"]))
        written("versions", versions(heaps))
    for name in wanted:
        print(pd.read_csv(FOLDER / f"{name}.csv").to_string(index=False), flush=True)


if __name__ == "__main__":
    main()
