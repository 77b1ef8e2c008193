"""What the quantities of the package's own rigs can be, and usually are, with where that is from.

The scripts of rigs on YADE are hashed with every result and say what a quantity means and how far the rig takes it; what is
usual of it in the world stands here, so that a reading or a value in another unit is seen.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

from pellet_study.rigs.declared import Rig
from yade_scripts import laws

Span = tuple[float, float]
NEVER_NEGATIVE: Span = (0.0, float("inf"))
FLAT_TO_UPRIGHT: Span = (0.0, 90.0)
SHARE: Span = (0.0, 1.0)


class Observable(NamedTuple):
    """What is read: its unit, what can be read of it at all, what usually is, and where that is from."""

    unit: str
    possible: Span
    usual: Span
    source: str


class Usual(NamedTuple):
    """The usual range of a parameter, where that is from, whether it is the tangent of an angle, the one law that has it."""

    usual: Span
    source: str
    tangent: bool = False
    only_law: str | None = None


REPOSE = Observable(
    "deg",
    FLAT_TO_UPRIGHT,
    (10.0, 75.0),
    "25 to 66 from free-flowing to very poor (Carr 1965; USP <1174>), with a margin",
)
OBSERVABLES: Mapping[str, Observable] = {
    "rebound_height_mm": Observable("mm", NEVER_NEGATIVE, (0.1, 450.0), "up to the highest drop of the rig"),
    "tangential_restitution": Observable("1", (-1.0, 1.0), (0.0, 1.0), "a share of the speed before the impact"),
    "slip_angle_deg": Observable(
        "deg", FLAT_TO_UPRIGHT, (3.0, 85.0), "friction of 0.05, to cohesion that holds a wall"
    ),
    "roll_distance_mm": Observable("mm", NEVER_NEGATIVE, (0.0, 2000.0), "the paper's bench reads 40 to 115"),
    "repose_angle_deg": REPOSE,
    "repose_flank_deg": REPOSE,
    "repose_triangle_deg": REPOSE,
    "repose_moment_deg": REPOSE,
    "repose_height_deg": REPOSE,
    "direction_error_deg": Observable(
        "deg", FLAT_TO_UPRIGHT, (0.0, 15.0), "of one heap; 1 to 3 in docs/heap_checks.md"
    ),
    "discharge_time_s": Observable(
        "s", NEVER_NEGATIVE, (0.05, 600.0), "from the few grams that are simulated to a bench test"
    ),
    "fill_bulk_density_kg_m3": Observable("kg/m3", NEVER_NEGATIVE, (50.0, 5000.0), "powders from silica to iron ore"),
    "dynamic_angle_deg": REPOSE,
    "shear_stress_pa": Observable(
        "Pa", NEVER_NEGATIVE, (20.0, 30000.0), "usual frictions, and cohesion, at the normal stresses of the cell"
    ),
    "bond_number": Observable("1", NEVER_NEGATIVE, (0.0, 1000.0), "pull-off force over weight: 1,000 in fine powders"),
    "grains": Observable("1", NEVER_NEGATIVE, (10.0, 1e6), "what a machine simulates"),
    "over_edge_share": Observable("1", SHARE, (0.0, 1.0), "a share"),
    "heap_height_mm": Observable("mm", NEVER_NEGATIVE, (1.0, 200.0), "up to the outlet above the base"),
    "end_time_s": Observable("s", NEVER_NEGATIVE, (0.01, 100.0), "what a machine simulates"),
    "largest_overlap": Observable("1", NEVER_NEGATIVE, (0.0, 0.5), "beyond half a radius contacts are no contacts"),
}

FRICTION = Usual((0.0, 1.2), "none, by choice of a law, to 50 deg", tangent=True)
ROLLING = Usual((0.0, 0.6), "that of the effect rolling_resistance")
RESTITUTION = Usual((0.05, 0.95), "plastic impact to steel on steel (Goldsmith 1960, Impact)")
POISSON = Usual((0.0, 0.49), "elastic solids from cork to rubber (doi:10.1038/nmat3134)")
SOFT_SOLID = Usual((1e5, 1e9), "a choice: seeds to horn, softened up to a hundredfold to simulate")
SOLID = Usual((1e5, 8e10), "minerals to steel, softened as usual (doi:10.1016/j.partic.2013.03.006)")
DAMPING = Usual((0.0, 0.9), "the rig's range: what YADE keeps stable", only_law=laws.LOCAL_DAMPING)
PARAMETERS: Mapping[str, Usual] = {
    "internal_friction": Usual((0.05, 1.5), "3 to 56 deg: polished beads to crushed rock at low stress", tangent=True),
    "seed_powder_restitution": RESTITUTION,
    "seed_powder_static_friction": FRICTION,
    "seed_powder_rolling_friction": ROLLING,
    "seed_density_kg_m3": Usual((600.0, 1800.0), "grains and seeds (ASAE D241), coated ones with a margin"),
    "seed_shear_modulus_pa": SOFT_SOLID,
    "seed_poisson_ratio": POISSON,
    "powder_restitution": RESTITUTION,
    "powder_static_friction": FRICTION,
    "powder_rolling_friction": ROLLING,
    "powder_steel_restitution": RESTITUTION,
    "powder_steel_static_friction": FRICTION,
    "powder_steel_rolling_friction": ROLLING,
    "powder_surface_energy": Usual((0.0, 1.0), "van der Waals to wet surfaces, at the amplification of 6"),
    "powder_density_kg_m3": Usual((800.0, 8000.0), "organic powders to steel"),
    "powder_shear_modulus_pa": SOLID,
    "powder_poisson_ratio": POISSON,
    "cohesive_frictional_damping": DAMPING,
    "adhesion_load": Usual((1.1, 5.0), "2 for JKR contacts (Thornton & Yin 1991), and the rig's range about it"),
}
CONDITIONS: Mapping[str, str] = {
    "slope_deg": "steep enough to roll, flat enough to land",
    "release_distance_mm": "a bench slope",
    "drop_height_mm": "a bench; the paper's drops are below 250",
    "seed_length_mm": "clump alfalfa seed, 1.5 to 3",
    "plate_tilt_deg": "so that the seed bounces off the plate",
    "added_mass_mg": "to 12 times a seed's mass, beyond which it creeps",
    "base_diameter_mm": "a bench",
    "powder_mass_g": "what a machine simulates",
    "outlet_height_mm": "a bench",
    "outlet_diameter_mm": "10 in ISO 4324; wider for grains that are amplified",
    "lift_speed_mm_s": "3 to 50 on benches, slow ones advised (Roessler & Katterfeld 2018, Powder Technology 330, 58)",
    "particle_diameter_um": "powders that flow",
    "amplification": "enough to simulate, not so much that the heap is of a few grains",
    "layer_height_mm": "layers on a bench incline",
    "particle_diameter_mm": "grains from powder to gravel",
    "bulk_density_kg_m3": "silica to iron ore",
    "channel_width_mm": "a bench incline",
    "normal_stress_pa": "shear cells (Schulze 2021, Powders and Bulk Solids)",
    "protocol": "choices of the rig",
    "base": "choices of the rig",
}
ON_A_BASE, FROM_A_FUNNEL = ("defined_base", "lifted_cylinder"), ("defined_base", "funnel")
UNDER: Mapping[str, tuple[str, tuple[str, ...]]] = {  # what a condition means something under
    "base": ("protocol", ON_A_BASE),
    "base_diameter_mm": ("protocol", ON_A_BASE),
    "outlet_height_mm": ("protocol", FROM_A_FUNNEL),
    "outlet_diameter_mm": ("protocol", FROM_A_FUNNEL),
    "lift_speed_mm_s": ("protocol", ("lifted_cylinder",)),
}


def with_ranges(rig: Rig) -> Rig:
    """One of the package's rigs with the usual ranges of its parameters, where its ranges are from, and what a condition needs."""
    parameters = {}
    for name, quantity in rig.parameters.items():
        known = PARAMETERS[name]
        low, high = max(known.usual[0], quantity["min"]), min(known.usual[1], quantity["max"])
        more: dict[str, object] = {"tangent": True} if known.tangent else {}
        more |= {"only_law": known.only_law} if known.only_law else {}
        parameters[name] = {**quantity, "physical": (low, high), "source": known.source, **more}
    conditions = {
        name: {**quantity, "source": CONDITIONS[name]} | ({"under": UNDER[name]} if name in UNDER else {})
        for name, quantity in rig.conditions.items()
    }
    return replace(rig, parameters=parameters, conditions=conditions)
