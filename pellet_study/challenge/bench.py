"""The bench demonstration: 28 conditions in three rigs on YADE, three free parameters, readings of single seeds.

14 rebounds (7 drop heights, 2 seeds), 12 slip angles (3 seeds, loads), 2 roll-outs (slopes and lengths). A rebound or
roll-out scatters because seeds land anyhow; a slip angle is read with half a degree.
"""

import csv
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from pellet_study import catalogue
from pellet_study.measurements import Measurement
from pellet_study.study import Setting, Study
from yade_scripts.case import load

RANGES = {
    "seed_powder_restitution": (0.35, 0.15, 0.6),
    "seed_powder_static_friction": (0.6, 0.3, 0.9),
    "seed_powder_rolling_friction": (0.25, 0.12, 0.4),
}
TRUTH = {
    "seed_powder_restitution": (0.28, 0.45),
    "seed_powder_static_friction": (0.5, 0.7),
    "seed_powder_rolling_friction": (0.2, 0.3),
}
REPEATS = {"rebound": 60, "slope_slip": 10, "inclined_roll": 10}
SCATTER = {"rebound": 0.55, "inclined_roll": 0.42}  # of single readings over their mean, measured; for planning only
READING_SD_DEG = 0.5  # of a slip angle
OBSERVABLES = {"rebound": "rebound_height_mm", "slope_slip": "slip_angle_deg", "inclined_roll": "roll_distance_mm"}
OUTSIDE = Path(__file__).parent / "outside"


@cache
def outside() -> dict[str, catalogue.Effect]:
    """Effects that no candidate describes, by name; the file of each is its `own`."""
    files = sorted((OUTSIDE / "effects").glob("*.py"))
    return {file.stem: catalogue.effect_from(load(file), file, own=file) for file in files}


def conditions() -> list[tuple[str, dict[str, float]]]:
    """(rig, conditions) of the 28 rows; what is not named is the rig's default."""
    found = [
        ("rebound", {"drop_height_mm": float(h), "seed_length_mm": d})
        for d in (1.5, 2.4)
        for h in (60, 85, 120, 170, 240, 330, 450)
    ]
    loads = {1.5: (0, 2, 6), 2.2: (0, 2, 5, 15), 3.0: (0, 6, 18, 30, 50)}
    found += [
        ("slope_slip", {"seed_length_mm": d, "added_mass_mg": float(m)}) for d, masses in loads.items() for m in masses
    ]
    for slope, length in ((30.0, 60.0), (45.0, 150.0)):
        found.append(("inclined_roll", {"seed_length_mm": 2.2, "slope_deg": slope, "release_distance_mm": length}))
    return found


def complete(rig: str, given: Mapping[str, float]) -> dict[str, float]:
    """Conditions with the rig's defaults for those not given."""
    declared = catalogue.standard().rigs[rig].conditions
    return {name: float(given.get(name, quantity["default"])) for name, quantity in declared.items()}


def rows(readings: Sequence[np.ndarray]) -> list[Measurement]:
    """A row for each condition, from its single readings."""
    found = []
    for k, ((rig, given), values) in enumerate(zip(conditions(), readings, strict=True)):
        mean, sd = float(np.mean(values)), float(np.std(values, ddof=1))
        place = (rig, OBSERVABLES[rig], mean, sd, len(values), complete(rig, given), {}, "", 0.0, "fit", "", k + 2)
        found.append(Measurement(*place))
    return found


def study(measured: Sequence[Measurement], candidates: catalogue.Catalogue | None = None) -> Study:
    """The study a user would make of such readings: three parameters free, every bench effect a candidate."""
    return Study(
        title="Seeds on a powder plate",
        rows=tuple(measured),
        parameters={name: Setting(*values) for name, values in RANGES.items()},
        effects={},
        catalogue=candidates or catalogue.standard(),
    )


def write(folder: Path, measured: Sequence[Measurement]) -> None:
    """study.toml and measurements.csv of such a study."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ['title = "Seeds on a powder plate"', "", "[parameters]"]
    lines += [
        f"{name} = {{ value = {value}, min = {low}, max = {high} }}" for name, (value, low, high) in RANGES.items()
    ]
    (folder / "study.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    names = list(dict.fromkeys(c for rig, given in conditions() for c in given))
    with open(folder / "measurements.csv", "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["rig", "observable", "value", "sd", "n", *names])
        for (_, given), row in zip(conditions(), measured, strict=True):
            values = [f"{row.value:.6g}", f"{row.sd:.6g}", row.n, *(given.get(name, "") for name in names)]
            writer.writerow([row.rig, row.observable, *values])


def reading_sd(rig: str, mean: float) -> float:
    """Expected standard deviation of one reading."""
    return READING_SD_DEG if rig == "slope_slip" else SCATTER[rig] * abs(mean)
