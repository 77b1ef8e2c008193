"""Rebound: a seed falls on a powder plate; how high does its centre of mass rise?

The seed falls freely from `drop_height_mm` (its centre above its height at rest) in an orientation drawn evenly from
all. The fall is not stepped through: the run starts at the touch with the speed sqrt(2 g h). The reading is the first
apex of the centre of mass at which the seed is clear of the plate whichever way it is turned, or, where it never gets
so high, the highest its centre gets; above the height at rest, along the vertical.
"""

if __name__ == "__main__":  # by hand: yade -x -n rebound.py cases.json observables.csv
    import os
    import runpy
    import sys

    sys.argv.insert(1, os.path.abspath(sys.argv[0]))
    runpy.run_path(os.path.join(os.path.dirname(sys.argv[1]), "case.py"), run_name="__main__")

from math import cos, radians, sin, sqrt

from yade_scripts import particles, seed_scene
from yade_scripts.case import Failed, quantity
from yade_scripts.seed_scene import GRAVITY, SeedScene

RIG = {
    "name": "rebound",
    "contact_laws": seed_scene.CONTACT_LAWS,
    "parameters": seed_scene.PARAMETERS,
    "conditions": {
        "drop_height_mm": quantity(115.0, 20.0, 450.0, "mm", "inferred from Table 3, not printed in the paper"),
        "seed_length_mm": seed_scene.SEED_LENGTH,
        "plate_tilt_deg": quantity(0.0, 0.0, 45.0, "deg", "tilt of the plate"),
    },
    "effects": {},
    "numerics": seed_scene.numerics(time_step_fraction=0.05, stiffness_scale=1.0),
    "observables": {
        "rebound_height_mm": "apex of the centre of mass above its height at rest",
        "tangential_restitution": "downhill speed the contacts leave over that before the impact (tilted plate only)",
    },
    "random": True,
    "time_limit_s": 60.0,
}

STEPS_BETWEEN_LOOKS = 30
MOST_STEPS = 2_000_000


def simulate(case: dict) -> dict:
    """One drop; heights in mm."""
    from yade import O

    conditions = case["conditions"]
    tilt = radians(conditions["plate_tilt_deg"])
    scene = SeedScene(case, particles.orientation(case["seed"]))
    down = (sin(tilt), 0.0, -cos(tilt))  # the plate stays level, gravity is tilted
    touch = -seed_scene.lowest(scene.points, scene.radii, (0, 0, 1))  # height of the centre at the touch
    fall = 1e-3 * conditions["drop_height_mm"] + scene.rest_height - touch
    if fall <= 0:
        raise Failed(
            "the seed touches the plate before it is dropped: drop_height_mm is less than half the seed's length"
        )
    speed = sqrt(2 * GRAVITY * fall)
    scene.place((0, 0, touch))
    scene.plate((0, 0, -0.005), (10, 10, 0.005))
    scene.start([GRAVITY * d for d in down], damp_gravity=False)
    state = scene.state
    state.vel = [speed * d for d in down]
    start = state.pos

    def rise() -> float:
        """Height of the centre above its height at rest on the plate, along the vertical."""
        return touch - scene.rest_height - sum(d * (x - x0) for d, x, x0 in zip(down, state.pos, start, strict=True))

    highest, looks = -scene.reach, 0
    while True:
        scene.run(STEPS_BETWEEN_LOOKS)
        looks += 1
        upward = -sum(d * v for d, v in zip(down, state.vel, strict=True))
        highest = max(highest, rise())
        to_apex = max(upward, 0.0) / GRAVITY
        clear_now, clear_then = (
            state.pos[2] + state.vel[2] * t - 0.5 * GRAVITY * cos(tilt) * t * t > scene.reach for t in (0.0, to_apex)
        )
        if clear_now and clear_then:  # height over the plate is concave in time: clear all the way to the apex
            height = max(highest, rise() + 0.5 * upward * to_apex)
            break
        if scene.kinetic_energy() + GRAVITY * rise() < GRAVITY * highest:
            height = highest  # too little energy is left to get higher
            break
        if looks * STEPS_BETWEEN_LOOKS > MOST_STEPS:
            raise Failed(f"still moving {O.time:.2g} s after the touch")
    along = speed * sin(tilt)
    after = state.vel[0] - GRAVITY * sin(tilt) * O.time  # what the contacts have left of it, gravity's part taken out
    if height > 1.01e-3 * conditions["drop_height_mm"] + scene.reach:
        raise Failed(f"gained energy: rose to {1e3 * height:.3g} mm; a smaller time_step_fraction is needed")
    return {
        "rebound_height_mm": 1e3 * height,
        "tangential_restitution": after / along if along > 0 else None,
    }
