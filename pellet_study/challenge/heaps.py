"""The heap demonstration: 8 conditions of the rig `repose` on YADE, one free parameter, heaps of 380 to 510 grains.

Grains of nearly one simulated size (R 1.5 to 1.75 mm) stand for powders of 400 to 1,000 um: what goes with the real
size, as cohesion does, shows against what goes with the heap. The plate's rolling friction is known (grains that roll
freely on it never come to rest); friction between the grains is to be calibrated. Two rows are held out.
"""

from pellet_study.challenge.demonstration import Demonstration

NAMES = ("particle_diameter_um", "amplification", "powder_mass_g", "outlet_height_mm")
ROWS = (
    (400.0, 8.0, 16.0, 35.0),
    (400.0, 8.0, 12.0, 30.0),
    (500.0, 6.0, 12.0, 35.0),
    (500.0, 7.0, 20.0, 40.0),
    (700.0, 4.5, 14.0, 30.0),
    (700.0, 5.0, 16.0, 40.0),
    (1000.0, 3.2, 16.0, 35.0),
    (1000.0, 3.2, 14.0, 28.0),
)

HEAPS = Demonstration(
    title="Heaps of a frictional powder",
    observables={"repose": "repose_angle_deg"},
    conditions=tuple(("repose", dict(zip(NAMES, row, strict=True))) for row in ROWS),
    ranges={"powder_static_friction": (0.55, 0.3, 1.0)},
    truth={"powder_static_friction": (0.45, 0.65)},
    repeats={"repose": 4},
    scatter={"repose": 0.05},
    other_numerics={"repose": {"time_step_fraction": 0.12, "stiffness_scale": 4e-4}},
    trials={"one": 8, "nothing": 2},
    known={"powder_steel_rolling_friction": 0.3},
    held_out=frozenset({1, 5}),
    candidates=("cohesion", "rolling_resistance", "liquid_bridges", "size_spread", "wall_friction", "air_drag"),
    hides=("cohesion", "rolling_resistance", "wall_friction"),
    same={"liquid_bridges": "cohesion"},
    effort=0.7,
)
