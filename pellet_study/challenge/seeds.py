"""The bench demonstration: 28 conditions in three rigs on YADE, three free parameters, readings of single seeds.

14 rebounds (7 drop heights, 2 seeds), 12 slip angles (3 seeds, loads), 2 roll-outs (slopes and lengths). A rebound or
roll-out scatters because seeds land anyhow; a slip angle is read with half a degree.
"""

from functools import cache
from pathlib import Path

from pellet_study.challenge.demonstration import Demonstration
from pellet_study.rigs.declarations import effect_from
from pellet_study.rigs.declared import Effect
from yade_scripts.case import load

OUTSIDE = Path(__file__).parent / "outside"
LOADS = {1.5: (0, 2, 4.5), 2.2: (0, 2, 5, 15), 3.0: (0, 6, 18, 28, 38)}  # mg; slender seeds carry no more

BENCH = Demonstration(
    title="Seeds on a powder plate",
    observables={
        "rebound": "rebound_height_mm",
        "slope_slip": "slip_angle_deg",
        "inclined_roll": "roll_distance_mm",
    },
    conditions=(
        *(
            ("rebound", {"drop_height_mm": float(h), "seed_length_mm": d})
            for d in (1.5, 2.4)
            for h in (60, 85, 120, 170, 240, 330, 450)
        ),
        *(
            ("slope_slip", {"seed_length_mm": d, "added_mass_mg": float(m)})
            for d, masses in LOADS.items()
            for m in masses
        ),
        *(
            ("inclined_roll", {"seed_length_mm": 2.2, "slope_deg": slope, "release_distance_mm": length})
            for slope, length in ((30.0, 60.0), (45.0, 150.0))
        ),
    ),
    ranges={
        "seed_powder_restitution": (0.35, 0.15, 0.6),
        "seed_powder_static_friction": (0.6, 0.3, 0.9),
        "seed_powder_rolling_friction": (0.25, 0.12, 0.4),
    },
    truth={
        "seed_powder_restitution": (0.28, 0.45),
        "seed_powder_static_friction": (0.5, 0.7),
        "seed_powder_rolling_friction": (0.2, 0.3),
    },
    repeats={"rebound": 60, "slope_slip": 10, "inclined_roll": 10},
    scatter={"rebound": 0.55, "inclined_roll": 0.42},
    instrument_sd={"slope_slip": 0.5},
    other_numerics={
        "rebound": {"time_step_fraction": 0.035, "stiffness_scale": 0.4},
        "slope_slip": {"time_step_fraction": 0.07, "stiffness_scale": 0.4},
        "inclined_roll": {"time_step_fraction": 0.035, "stiffness_scale": 0.05},
    },
    trials={"one": 40, "nothing": 15, "outside": 5},
    later={4.0: 30, 8.0: 12},
    strength_seeds={"rebound": 120, "slope_slip": 2, "inclined_roll": 16},
)


@cache
def outside() -> dict[str, Effect]:
    """Effects that no candidate describes, by name; each has its `file`."""
    files = sorted((OUTSIDE / "effects").glob("*.py"))
    return {file.stem: effect_from(load(file), file, file) for file in files}
