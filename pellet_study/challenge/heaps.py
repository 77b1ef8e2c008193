"""The heap demonstration: 5 conditions of the rig `repose` on YADE, one free parameter, heaps of 320 to 400 grains.

Grains of nearly one simulated size (R about 1.9 mm) stand for powders of 450 to 1,500 um: what goes with the real size,
as cohesion does, shows against what goes with the heap. The plate's rolling friction is known (grains that roll freely
on it never come to rest); friction between the grains is to be calibrated. One row is held out.
"""

from pellet_study.challenge.demonstration import Demonstration

NAMES = ("protocol", "particle_diameter_um", "amplification", "powder_mass_g", "outlet_height_mm")
ROWS = (
    ("funnel", 450.0, 8.5, 20.0, 32.0),
    ("funnel", 600.0, 6.4, 18.0, 30.0),
    ("funnel", 900.0, 4.2, 20.0, 32.0),
    ("funnel", 1500.0, 2.5, 20.0, 34.0),
    ("funnel", 1500.0, 2.6, 18.0, 30.0),
)

HEAPS = Demonstration(
    title="Heaps of a frictional powder",
    observables={"repose": "repose_angle_deg"},
    conditions=tuple(("repose", dict(zip(NAMES, row, strict=True))) for row in ROWS),
    ranges={"powder_static_friction": (0.8, 0.6, 1.2)},
    truth={"powder_static_friction": (0.75, 0.95)},
    repeats={"repose": 3},
    scatter={"repose": 0.08},
    other_numerics={"repose": {"time_step_fraction": 0.12, "stiffness_scale": 4e-4}},
    trials={"one": 8, "nothing": 2},
    known={"powder_steel_rolling_friction": 0.3},
    held_out=frozenset({2}),
    candidates=("cohesion", "rolling_resistance", "liquid_bridges"),
    hides=("cohesion", "rolling_resistance", "cohesion", "liquid_bridges"),
    same={"liquid_bridges": "cohesion"},
    effort=0.6,
    contact_law="cohesive_frictional_local_damping",  # the committed trials are those of release 0.1
)
