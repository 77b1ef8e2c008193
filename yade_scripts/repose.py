"""Repose angle: powder is poured onto a base and comes to rest; how steep is the heap?

`protocol` says how, as on the bench:

- `defined_base`: a vibrated funnel pours the powder onto a disc until it has run over the edge all around; what lies
  beyond the edge is taken away, and the heap is the cone that the disc carries, whatever the mass. Of this kind are the
  testers of ISO 4324 and GB/T 11986 (outlet 10 mm, 75 mm above a base of 100 mm) and the fixed base of USP <1174>, whose lip
  keeps a layer of powder on it: the rough base. Ours has half that size, and an outlet of nine grains, the least through which the stickiest powder of Table 6 flows.
- `lifted_cylinder`: the powder settles in a cylinder that stands on the same disc and is lifted slowly.
- `funnel`: the vibrated funnel pours a fixed mass onto an endless steel plate (release 0.1).

The grains settle in the closed funnel under gravity; the gate goes and the funnel vibrates along its axis until it is
empty (the cohesive powders of the source paper's Table 6 arch over a still outlet); the funnel is taken away and the heap
comes to rest. A run says of itself what went wrong: an arch that holds (`jammed`), grains lost, a blow-up, a heap that
reaches the outlet, does not cover its base or does not come to rest. A flat heap is no failure.

The grains are amplified spheres. The source paper prints no radius; its time step is 20 % of the Rayleigh step for
R = 1.294 mm, the usual share (as 100 % it would mean R = 0.26 mm and pull-off forces of 46 to 140 weights, with which
nothing flows). So the grains of amplification 6 have R = 1.294 mm, 431.3 um in diameter before.

Each run may leave its grains: the environment variable PELLET_STUDY_GRAINS names a folder for ID.csv (x, y, z, radius
in m).
"""

if __name__ == "__main__":  # by hand: yade -x -n repose.py cases.json observables.csv
    import os
    import runpy
    import sys

    sys.argv.insert(1, os.path.abspath(sys.argv[0]))
    runpy.run_path(os.path.join(os.path.dirname(sys.argv[1]), "case.py"), run_name="__main__")

import os
from pathlib import Path

import numpy as np

from yade_scripts import fill, heap, laws
from yade_scripts.acting import Effects, declared
from yade_scripts.apparatus import Base, Funnel
from yade_scripts.case import Failed, choice, quantity
from yade_scripts.contacts import Material, Pair
from yade_scripts.effects import acting_in
from yade_scripts.pouring import Pouring
from yade_scripts.powder_scene import (
    REFERENCE_AMPLIFICATION,
    STEEL,
    PowderScene,
    bond_number,
    grain_mass,
    grain_radius,
    radii,
)

TABLE_1 = "source paper, Table 1"
DEFINED_BASE, LIFTED_CYLINDER, FUNNEL = PROTOCOLS = ("defined_base", "lifted_cylinder", "funnel")
EFFECTS = acting_in("repose", "POWDER_SCENE")
RIG = {
    "name": "repose",
    "contact_laws": tuple(laws.LAWS),
    "parameters": {
        "powder_restitution": quantity(0.15, 0.05, 0.95, "1", "A, powder-powder; no meaning under local damping"),
        "powder_static_friction": quantity(0.8, 0.0, 1.5, "1", "B, powder-powder"),
        "powder_rolling_friction": quantity(0.0, 0.0, 1.0, "1", "C, powder-powder; of the effect rolling_resistance"),
        "powder_steel_restitution": quantity(0.15, 0.05, 0.95, "1", "D, powder-steel"),
        "powder_steel_static_friction": quantity(0.72, 0.0, 1.5, "1", "E, powder-steel"),
        "powder_steel_rolling_friction": quantity(0.0, 0.0, 1.0, "1", "F, powder-steel; of rolling_resistance"),
        "powder_surface_energy": quantity(0.0, 0.0, 2.0, "J/m2", "G, JKR, at amplification 6; of the effect cohesion"),
        "powder_density_kg_m3": quantity(1833.0, 500.0, 8000.0, "kg/m3", TABLE_1),
        "powder_shear_modulus_pa": quantity(3e7, 1e5, 1e11, "Pa", TABLE_1),
        "powder_poisson_ratio": quantity(0.296, 0.0, 0.49, "1", TABLE_1),
        "cohesive_frictional_damping": quantity(
            0.3, 0.05, 0.9, "1", "local damping in place of the restitution A; of cohesive_frictional_local_damping"
        ),
        "adhesion_load": quantity(
            2.0,
            1.1,
            5.0,
            "1",
            "load that cohesion adds to the limits of friction and rolling, in pull-off forces: 2 in Thornton & Yin 1991; of "
            "cohesive_frictional",
        ),
    },
    "conditions": {
        "protocol": choice(DEFINED_BASE, PROTOCOLS, "how the heap is made"),
        "base": choice(
            "rough", ("rough", "smooth"), "disc of fixed grains, or of steel; the funnel's plate is of steel"
        ),
        "base_diameter_mm": quantity(50.0, 10.0, 200.0, "mm", "diameter of the disc; the funnel's plate is endless"),
        "powder_mass_g": quantity(25.0, 1.0, 500.0, "g", "mass of the powder; 1,503 grains at the default"),
        "outlet_height_mm": quantity(37.5, 10.0, 200.0, "mm", "height of the funnel's outlet above the base"),
        "outlet_diameter_mm": quantity(24.0, 4.0, 100.0, "mm", "of the funnel, whose cone slopes at 60 deg"),
        "lift_speed_mm_s": quantity(30.0, 1.0, 500.0, "mm/s", "of the lifted cylinder"),
        "particle_diameter_um": quantity(431.3, 100.0, 2000.0, "um", "diameter before amplification"),
        "amplification": quantity(6.0, 2.0, 12.0, "1", "amplified over original diameter"),
    },
    "effects": declared(EFFECTS, "repose"),
    "numerics": {
        "time_step_fraction": quantity(
            0.09,
            0.005,
            0.4,
            "1",
            "of the Rayleigh step of the smallest grain; less where e < 0.3 (Hertz-Mindlin: 0.15)",
        ),
        "stiffness_scale": quantity(1e-3, 1e-5, 1.0, "1", "the shear moduli are multiplied by it"),
        "rolling_spring": quantity(
            0.1, 1e-3, 0.5, "1", "stiffness of Mindlin rolling moments below the limit, in I/dt^2"
        ),
        "funnel_diameter_mm": quantity(44.0, 8.0, 200.0, "mm", "of the funnel's cylinder: a wide one fills less high"),
        "cylinder_diameter_mm": quantity(26.0, 8.0, 100.0, "mm", "of the lifted cylinder"),
        "vibration_mm": quantity(0.4, 0.0, 5.0, "mm", "amplitude of the open funnel, along its axis"),
        "vibration_hz": quantity(60.0, 1.0, 500.0, "Hz", "frequency of the open funnel"),
        "surface_energy_exponent": quantity(
            2.0, 0.0, 2.0, "1", "G goes with (amplification/6)^this: 2 keeps the Bond number, 0 is the paper's way"
        ),
        "size_spread": quantity(0.05, 0.0, 0.3, "1", "half-width of the radii, as a share of their mean"),
        "rest_energy": quantity(2e-3, 1e-6, 0.1, "1", "mean kinetic energy at rest, in a grain's weight times radius"),
    },
    "observables": {
        "repose_angle_deg": "the triangle, nearest of the readings to the angle of a made-up heap",
        "direction_error_deg": "standard error of the angle over the silhouettes of this one heap",
        "repose_flank_deg": "mean slope of both flanks between 20 and 80 % of the height, over the silhouettes",
        "repose_triangle_deg": "slope of the least-squares triangle through each silhouette",
        "repose_moment_deg": "slope of the cone that has the moments of all grains' heights and distances from the axis",
        "repose_height_deg": "atan(height / radius of the base), as the tester of ISO 4324 is read; none on an endless plate",
        "bond_number": "pull-off force of two grains over the weight of one",
        "grains": "number of grains poured",
        "over_edge_share": "share of them that ran over the edge of the base",
        "heap_height_mm": "highest point of the heap",
        "discharge_time_s": "from opening until the funnel is empty but for 1 % of the grains at most, to 2 sqrt(R/g); none of a lifted cylinder",
        "fill_bulk_density_kg_m3": "mass over volume in the middle of the settled fill; none where the fill is too low",
        "end_time_s": "simulated time",
        "largest_overlap": "of two bodies at any look, in the mean radius",
    },
    "random": True,
    "seeds": 4,
    "time_limit_s": 3600.0,
}


def simulate(case: dict) -> dict:
    """One heap."""
    from yade import O

    scene, bond = build(case)
    protocol, numerics, pouring = case["conditions"]["protocol"], case["numerics"], Pouring(scene)
    pouring.fill()
    filled = fill.bulk_density(scene.centres(), scene.grains, scene.powder.density, scene.funnel.outlet)
    opened = O.time
    if protocol == LIFTED_CYLINDER:
        emptied = pouring.lift(1e-3 * case["conditions"]["lift_speed_mm_s"])
    else:
        emptied = pouring.pour(1e-3 * numerics["vibration_mm"], numerics["vibration_hz"])
    pouring.rest(numerics["rest_energy"], emptied)
    centres = scene.centres()
    keep_grains(case, centres, scene.grains)
    if protocol != LIFTED_CYLINDER:
        pouring.below_outlet()
    try:
        read = heap.readings(centres, scene.grains, scene.base.radius)
    except heap.NoHeap as reason:
        raise Failed(f"no heap: {reason}") from None
    return {
        "repose_angle_deg": read.repose.angle_deg,
        "direction_error_deg": read.repose.standard_error_deg,
        "repose_flank_deg": None if read.no_flank else read.flank.angle_deg,
        "repose_triangle_deg": read.triangle.angle_deg,
        "repose_moment_deg": read.moment.angle_deg,
        "repose_height_deg": heap.height_deg(centres, scene.grains, scene.base.radius),
        "bond_number": bond,
        "grains": pouring.number,
        "over_edge_share": None if scene.base.radius is None else float(pouring.over_edge.sum() / pouring.number),
        "heap_height_mm": 1e3 * float((centres[:, 2] + scene.grains).max()),
        "discharge_time_s": None if protocol == LIFTED_CYLINDER else emptied - opened - 0.5 * pouring.between_looks,
        "fill_bulk_density_kg_m3": filled,
        "end_time_s": O.time,
        "largest_overlap": pouring.overlap,
    }


def build(case: dict) -> tuple[PowderScene, float]:
    """The scene at the start of the fill, and the Bond number."""
    given, conditions, numerics = case["parameters"], case["conditions"], case["numerics"]
    effects = Effects(EFFECTS, case, "POWDER_SCENE", "repose")
    radius = grain_radius(conditions["particle_diameter_um"], conditions["amplification"])
    exponent = effects.at("exponent", numerics["surface_energy_exponent"])
    pair = Pair(
        *(given[f"powder_{k}"] for k in ("restitution", "static_friction", "rolling_friction", "surface_energy"))
    )
    wall_pair = Pair(*(given[f"powder_steel_{k}"] for k in ("restitution", "static_friction", "rolling_friction")))
    pair, wall_pair = effects.at("pair", pair), effects.at("wall_pair", wall_pair)
    energy = pair.surface_energy * (conditions["amplification"] / REFERENCE_AMPLIFICATION) ** exponent
    softer = numerics["stiffness_scale"]
    density = given["powder_density_kg_m3"]
    powder = Material(density, softer * given["powder_shear_modulus_pa"], given["powder_poisson_ratio"])
    number = round(1e-3 * conditions["powder_mass_g"] / grain_mass(radius, density))
    if number < 50:
        raise Failed(f"{number} grains make no heap; take more powder or a smaller amplification")
    draw = np.random.default_rng(case["seed"])
    funnel = Funnel(
        0.5e-3 * conditions["outlet_diameter_mm"],
        0.5e-3 * numerics["funnel_diameter_mm"],
        1e-3 * conditions["outlet_height_mm"],
    )
    base = Base(0.5e-3 * conditions["base_diameter_mm"], conditions["base"] == "rough")
    if conditions["protocol"] == LIFTED_CYLINDER:
        cylinder = 0.5e-3 * numerics["cylinder_diameter_mm"]
        funnel = Funnel(cylinder, cylinder, radius)
    elif conditions["protocol"] == FUNNEL:
        base = Base()
    scene = PowderScene(
        radii(number, radius, effects.at("spread", numerics["size_spread"]), draw),
        funnel,
        base,
        powder,
        STEEL._replace(shear_modulus=softer * STEEL.shear_modulus),
        pair._replace(surface_energy=energy),
        wall_pair,
        case["contact_law"],
        numerics["time_step_fraction"],
        numerics["rolling_spring"],
        given["cohesive_frictional_damping"],
        given["adhesion_load"],
        softer,
        air(effects),
        draw,
    )
    return scene, bond_number(energy, radius, density)


def air(effects: Effects):
    """(diameters, speeds) of grains to what the air does to them (`PowderScene`); None where it does nothing."""
    if "drag" not in effects:
        return None
    return lambda diameter, speed: effects.at("drag", 0.0, diameter, speed)


def keep_grains(case: dict, centres: np.ndarray, grains: np.ndarray) -> None:
    """Write x, y, z, radius (m) into the folder PELLET_STUDY_GRAINS names, if it does."""
    folder = os.environ.get("PELLET_STUDY_GRAINS")
    if folder:
        table = np.column_stack([centres, grains])
        np.savetxt(Path(folder) / f"{case['id']}.csv", table, delimiter=",", header="x_m,y_m,z_m,radius_m", comments="")
