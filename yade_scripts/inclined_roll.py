"""Inclined roll: a seed let go on a slope rolls down and out on a level plate; how far from the foot does it come to rest?

The seed is released at rest, touching the slope `release_distance_mm` up from the foot, in an orientation drawn evenly
from all. The reading is the distance of its centre of mass from the foot's line; a seed that stays on the slope
reads 0. Slope and plate are of the powder's material and meet in a sharp inner edge.
"""

if __name__ == "__main__":  # by hand: yade -x -n inclined_roll.py cases.json observables.csv
    import os
    import runpy
    import sys

    sys.argv.insert(1, os.path.abspath(sys.argv[0]))
    runpy.run_path(os.path.join(os.path.dirname(sys.argv[1]), "case.py"), run_name="__main__")

from math import radians

import numpy as np

from yade_scripts import particles, seed_scene
from yade_scripts.acting import Effects, declared
from yade_scripts.case import Failed, quantity
from yade_scripts.effects import acting_in
from yade_scripts.seed_scene import GRAVITY, SeedScene

EFFECTS = acting_in("inclined_roll", "SEED_SCENE")
RIG = {
    "name": "inclined_roll",
    "contact_laws": seed_scene.CONTACT_LAWS,
    "parameters": seed_scene.PARAMETERS,
    "conditions": {
        "slope_deg": quantity(33.0, 20.0, 60.0, "deg", "inferred from Table 5, not printed in the paper"),
        "release_distance_mm": quantity(400.0, 20.0, 600.0, "mm", "along the slope; inferred from Table 5"),
        "seed_length_mm": seed_scene.SEED_LENGTH,
    },
    "effects": declared(EFFECTS),
    "numerics": {
        **seed_scene.numerics(time_step_fraction=0.05, stiffness_scale=0.1),
        "rest_speed_mm_s": quantity(3.0, 0.01, 20.0, "mm/s", "at rest when slower for 20 ms, rotation included"),
    },
    "observables": {"roll_distance_mm": "distance of the centre of mass from the foot of the slope, at rest"},
    "random": True,
    "seeds": 4,
    "time_limit_s": 120.0,
}

STEPS_BETWEEN_LOOKS = 30
REST_TIME = 0.02  # s
LONGEST = 20.0  # s
THICKNESS = 0.01  # m


def simulate(case: dict) -> dict:
    """One release; the distance in mm."""
    from yade import O, Quaternion

    conditions, effects = case["conditions"], Effects(EFFECTS, case)
    slope = radians(effects.at("slope_deg", conditions["slope_deg"]))
    release = 1e-3 * conditions["release_distance_mm"]
    turn = particles.about(1, slope)
    downhill, normal = turn[:, 0], turn[:, 2]
    scene = SeedScene(case, turn @ particles.orientation(case["seed"]), effects=effects)
    scene.place(-release * downhill - seed_scene.lowest(scene.points, scene.radii, normal) * normal)
    buried = 0.5 * THICKNESS  # both plates run on below the other, so that the inner edge has no gap
    scene.plate((5 - buried, 0, -THICKNESS / 2), (5, 5, THICKNESS / 2))
    length = release + 0.02
    centre = (buried - length) / 2 * downhill - THICKNESS / 2 * normal
    scene.plate(centre, ((length + buried) / 2, 5, THICKNESS / 2), Quaternion((0, 1, 0), slope))
    scene.start((0, 0, -GRAVITY))
    state = scene.state
    at_rest = 0.5 * (1e-3 * case["numerics"]["rest_speed_mm_s"]) ** 2
    most = GRAVITY * (state.pos[2] + scene.reach)
    quiet = 0.0
    while quiet < REST_TIME:
        scene.run(STEPS_BETWEEN_LOOKS)
        energy = scene.kinetic_energy()
        quiet = quiet + STEPS_BETWEEN_LOOKS * O.dt if energy < at_rest else 0.0
        if not energy < 1.05 * most:
            raise Failed("gained energy; a smaller time_step_fraction is needed")
        if O.time > LONGEST:
            raise Failed(f"still moving {LONGEST:g} s after the release")
    if not np.isfinite(state.pos[0]) or state.pos[2] < 0:
        raise Failed("the seed went through the plate")
    return {"roll_distance_mm": max(0.0, 1e3 * state.pos[0])}
