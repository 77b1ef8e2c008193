"""The heap demonstration: 5 conditions of the rig `repose` on YADE, one free parameter, heaps of 500 grains.

Grains of one simulated size (R = 1.3 mm) stand for powders of 450 to 1,200 um: what goes with the real size, as cohesion
does, shows against what goes with the heap; on a smooth base what goes with the wall shows too. The apparatus is the default
one, in proportion to the grains (500 for 1,503). The reading is the height of the heap, which scatters least from seed to
seed. The plate's rolling friction is known (grains that roll freely on it never come to rest); friction between the
grains is to be calibrated. One row is held out.
"""

from pellet_study.challenge.demonstration import Demonstration
from pellet_study.rigs.declared import Condition

APPARATUS: dict[str, Condition] = {
    "protocol": "defined_base",
    "powder_mass_g": 8.3,
    "base_diameter_mm": 34.6,
    "outlet_height_mm": 26.0,
    "outlet_diameter_mm": 16.6,
}
ROWS = (  # base, particle_diameter_um, amplification
    ("rough", 450.0, 5.75),
    ("rough", 700.0, 3.7),
    ("rough", 1200.0, 2.16),
    ("smooth", 450.0, 5.75),
    ("smooth", 1200.0, 2.16),
)

HEAPS = Demonstration(
    title="Heaps of a frictional powder",
    observables={"repose": "repose_height_deg"},
    conditions=tuple(
        ("repose", APPARATUS | {"base": base, "particle_diameter_um": size, "amplification": amplified})
        for base, size, amplified in ROWS
    ),
    ranges={"powder_static_friction": (0.8, 0.6, 1.2)},
    truth={"powder_static_friction": (0.75, 0.95)},
    repeats={"repose": 3},
    scatter={"repose": 0.06},
    other_numerics={"repose": {"time_step_fraction": 0.06, "stiffness_scale": 4e-4}},
    trials={"one": 18, "nothing": 6},
    known={"powder_steel_rolling_friction": 0.3},
    held_out=frozenset({1}),
    candidates=("cohesion", "rolling_resistance", "liquid_bridges", "size_spread", "wall_friction", "air_drag"),
    hides=("rolling_resistance", "cohesion", "size_spread", "liquid_bridges", "wall_friction", "air_drag"),
    same={"liquid_bridges": "cohesion"},
    effort=0.6,
)
