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

import numpy as np

from yade_scripts import particles, seed_scene
from yade_scripts.acting import Effects, declared
from yade_scripts.case import Failed, quantity
from yade_scripts.effects import acting_in
from yade_scripts.seed_scene import GRAVITY, SeedScene

EFFECTS = acting_in("rebound", "SEED_SCENE")
RIG = {
    "name": "rebound",
    "contact_laws": seed_scene.CONTACT_LAWS,
    "parameters": seed_scene.PARAMETERS,
    "conditions": {
        "drop_height_mm": quantity(115.0, 20.0, 450.0, "mm", "inferred from Table 3, not printed in the paper"),
        "seed_length_mm": seed_scene.SEED_LENGTH,
        "plate_tilt_deg": quantity(0.0, 0.0, 45.0, "deg", "tilt of the plate"),
    },
    "effects": declared(EFFECTS),
    "numerics": seed_scene.numerics(time_step_fraction=0.05, stiffness_scale=1.0),
    "observables": {
        "rebound_height_mm": "apex of the centre of mass above its height at rest",
        "tangential_restitution": "downhill speed the contacts leave over that before the impact (tilted plate only)",
    },
    "random": True,
    "seeds": 32,
    "paired": True,
    "time_limit_s": 60.0,
}

STEPS_BETWEEN_LOOKS = 30
MOST_STEPS = 2_000_000
FLIGHT_STEPS = 20  # Runge-Kutta steps of a flight that is solved as an equation of motion


def simulate(case: dict) -> dict:
    """One drop; heights in mm."""
    from yade import O

    conditions = case["conditions"]
    effects = Effects(EFFECTS, case)
    tilt = radians(effects.at("slope_deg", conditions["plate_tilt_deg"]))
    fastest = sqrt(2e-3 * GRAVITY * (conditions["drop_height_mm"] + conditions["seed_length_mm"]))
    scene = SeedScene(case, particles.orientation(case["seed"]), effects=effects, fastest=fastest)
    down = (sin(tilt), 0.0, -cos(tilt))  # the plate stays level, gravity is tilted
    touch = -seed_scene.lowest(scene.points, scene.radii, (0, 0, 1))  # height of the centre at the touch
    fall = 1e-3 * conditions["drop_height_mm"] + scene.rest_height - touch
    if fall <= 0:
        raise Failed(
            "the seed touches the plate before it is dropped: drop_height_mm is less than half the seed's length"
        )
    speed = sqrt(2 * GRAVITY * fall) if "force" not in effects else speed_after_fall(scene, fall)
    scene.place((0, 0, touch))
    scene.plate((0, 0, -0.005), (10, 10, 0.005))
    scene.start([GRAVITY * d for d in down], damp_gravity=False)
    state = scene.state
    state.vel = [speed * d for d in down]
    start = state.pos

    def rise() -> float:
        """Height of the centre above its height at rest on the plate, along the vertical."""
        position = state.pos
        return touch - scene.rest_height - (down[0] * (position[0] - start[0]) + down[2] * (position[2] - start[2]))

    highest, looks = -scene.reach, 0
    while True:
        scene.run(STEPS_BETWEEN_LOOKS)
        looks += 1
        velocity, here = state.vel, rise()
        upward = -(down[0] * velocity[0] + down[2] * velocity[2])
        highest = max(highest, here)
        clear_now = state.pos[2] > scene.reach
        if clear_now:  # height over the plate is concave in time: clear all the way to the apex if clear there
            if "force" in effects:
                apex, over_plate = apex_of_flight(scene, down, upward)
            else:
                t = max(upward, 0.0) / GRAVITY
                apex, over_plate = 0.5 * upward * t, state.vel[2] * t - 0.5 * GRAVITY * cos(tilt) * t * t
            if state.pos[2] + over_plate > scene.reach:
                height = max(highest, here + apex)
                break
        energy = scene.kinetic_energy() + GRAVITY * here
        if energy < GRAVITY * highest and energy + scene.elastic_energy() < GRAVITY * highest:
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


def speed_after_fall(scene: SeedScene, fall: float) -> float:
    """Speed (m/s) after a fall from rest through a height (m), from d(v^2)/dz = 2 (g + F/m), by Runge-Kutta steps."""

    def gain(square: float) -> float:
        return 2 * (GRAVITY - scene.force((0.0, 0.0, -sqrt(max(square, 0.0))))[2] / scene.mass)

    square, h = 0.0, fall / FLIGHT_STEPS
    for _ in range(FLIGHT_STEPS):
        first = gain(square)
        second = gain(square + 0.5 * h * first)
        third = gain(square + 0.5 * h * second)
        square += h / 6 * (first + 2 * second + 2 * third + gain(square + h * third))
    return sqrt(square)


def apex_of_flight(scene: SeedScene, down, upward: float) -> tuple[float, float]:
    """Rise (m) from here to the apex of the flight, and the height over the plate gained meanwhile (m).

    The equation of motion under gravity and the effects' force, by Runge-Kutta steps, the last of them shortened.
    """
    velocity, place = np.array(scene.state.vel), np.zeros(3)
    gravity = GRAVITY * np.array(down)

    def acceleration(v):
        return gravity + np.array(scene.force(v.tolist())) / scene.mass

    step = max(upward, 0.0) / GRAVITY / FLIGHT_STEPS
    for _ in range(FLIGHT_STEPS):
        first = acceleration(velocity)
        h = min(step, max(0.0, -(velocity @ down) / (first @ down)))
        second = acceleration(velocity + 0.5 * h * first)
        third = acceleration(velocity + 0.5 * h * second)
        place = place + h * (velocity + h / 6 * (first + second + third))
        velocity = velocity + h / 6 * (first + 2 * second + 2 * third + acceleration(velocity + h * third))
    return float(-(place @ down)), float(place[2])
