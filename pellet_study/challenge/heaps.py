"""The heap demonstration: 6 conditions of the rig `repose` on YADE, one free parameter, heaps of 480 to 540 grains.

Grains of nearly one simulated size (R about 1.6 mm) stand for powders of 450 to 1,600 um: what goes with the real size,
as cohesion does, shows against what goes with the heap. The plate's rolling friction is known (grains that roll freely
on it never come to rest); friction between the grains is to be calibrated. One row is held out.
"""

from pellet_study.challenge.demonstration import Demonstration

NAMES = ("particle_diameter_um", "amplification", "powder_mass_g", "outlet_height_mm")
ROWS = (
    (450.0, 7.0, 16.0, 35.0),
    (600.0, 5.5, 18.0, 35.0),
    (650.0, 5.0, 16.0, 30.0),
    (800.0, 4.0, 16.0, 32.0),
    (1000.0, 3.2, 16.0, 30.0),
    (1600.0, 2.0, 16.0, 35.0),
)

HEAPS = Demonstration(
    title="Heaps of a frictional powder",
    observables={"repose": "repose_angle_deg"},
    conditions=tuple(("repose", dict(zip(NAMES, row, strict=True))) for row in ROWS),
    ranges={"powder_static_friction": (0.8, 0.6, 1.2)},
    truth={"powder_static_friction": (0.75, 0.95)},
    repeats={"repose": 4},
    scatter={"repose": 0.06},
    other_numerics={"repose": {"time_step_fraction": 0.12, "stiffness_scale": 4e-4}},
    trials={"one": 8, "nothing": 2},
    known={"powder_steel_rolling_friction": 0.3},
    held_out=frozenset({3}),
    candidates=("cohesion", "rolling_resistance", "liquid_bridges", "size_spread", "wall_friction", "air_drag"),
    hides=("cohesion", "rolling_resistance", "wall_friction"),
    same={"liquid_bridges": "cohesion"},
    effort=0.6,
)
