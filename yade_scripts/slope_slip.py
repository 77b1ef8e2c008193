"""Slope slip: a seed lies on a powder plate that is tilted; at which angle does it start to slide?

The seed lies flat, its long axis down the slope within `YAW_DEG` (drawn per seed number), free to move and turn. The
angle is bracketed: the tilt is raised from the last angle that held to a trial angle, held there, and the seed is
asked whether it moves; the bracket, at first one round the angle that Coulomb's law gives, is halved until it is
narrower than `bracket_deg`. The plate stays level and gravity is tilted, which is the same.
"""

if __name__ == "__main__":  # by hand: yade -x -n slope_slip.py cases.json observables.csv
    import os
    import runpy
    import sys

    sys.argv.insert(1, os.path.abspath(sys.argv[0]))
    runpy.run_path(os.path.join(os.path.dirname(sys.argv[1]), "case.py"), run_name="__main__")

from math import atan, ceil, cos, degrees, log2, pi, radians, sin

from yade_scripts import contacts, particles, seed_scene
from yade_scripts.acting import Effects, declared
from yade_scripts.case import Failed, quantity
from yade_scripts.effects import acting_in
from yade_scripts.seed_scene import GRAVITY, SeedScene

EFFECTS = acting_in("slope_slip", "SEED_SCENE")
RIG = {
    "name": "slope_slip",
    "contact_laws": seed_scene.CONTACT_LAWS,
    "parameters": seed_scene.PARAMETERS,
    "conditions": {
        "seed_length_mm": seed_scene.SEED_LENGTH,
        "added_mass_mg": quantity(0.0, 0.0, 50.0, "mg", "a weight carried at the seed's centre"),
    },
    "effects": declared(EFFECTS),
    "numerics": {
        **seed_scene.numerics(time_step_fraction=0.1, stiffness_scale=1.0),
        "hold_ms": quantity(4.0, 1.0, 100.0, "ms", "time at each trial angle"),
        "bracket_deg": quantity(0.02, 0.001, 1.0, "deg", "width of the last bracket"),
    },
    "observables": {"slip_angle_deg": "tilt at which the seed starts to slide"},
    "random": True,
    "seeds": 1,
    "paired": True,
    "time_limit_s": 60.0,
}

YAW_DEG = 10.0
STEEPEST_DEG = 80.0
MOST_ADDED = 12.0  # times the seed's mass; a heavier one reads wrong by a quarter of a degree and more
TIPPED = 5e-3  # rad
MOST_HOLDS = 10  # to bring a seed that was laid flat again to rest
SPAN = 8  # cells of the final width, of the bracket the search begins with
ROUNDS = 20
SLIDING = 1e-3  # share of the speed free of friction that tells sliding from creaking
CREEPING, STEADY = 0.05, 0.2  # share of that speed; change within half a hold that tells creeping from dying away


def simulate(case: dict) -> dict:
    """One seed; the angle in degrees."""
    from yade import Vector3

    numerics, effects = case["numerics"], Effects(EFFECTS, case)
    yaw = radians(YAW_DEG) * (2 * particles.even_points(case["seed"])[0] - 1)
    added = 1e-6 * case["conditions"]["added_mass_mg"]
    scene = SeedScene(case, particles.about(2, yaw), added, effects)
    if added > MOST_ADDED * (scene.mass - added):
        raise Failed(f"added_mass_mg is more than {MOST_ADDED:g} times the seed's mass: it would creep on its contacts")
    scene.place((0, 0, scene.rest_height))
    scene.plate((0, 0, -0.005), (10, 10, 0.005))
    scene.start((0, 0, -GRAVITY))
    hold_steps = max(1, round(1e-3 * numerics["hold_ms"] / scene.time_step))
    sliding = SLIDING * (GRAVITY * hold_steps * scene.time_step) * 0.5

    def tilt(angle_deg: float, steps: int) -> None:
        """Turn gravity smoothly from where it is to an angle, over so many steps."""
        for k in range(1, steps + 1):
            if k % 10 == 0 or k == steps:
                part = 0.5 - 0.5 * cos(pi * k / steps)
                angle = radians(effects.at("slope_deg", tilt.angle_deg + part * (angle_deg - tilt.angle_deg)))
                scene.newton.gravity = (GRAVITY * sin(angle), 0, -GRAVITY * cos(angle))
            scene.step()
        tilt.angle_deg = angle_deg

    tilt.angle_deg = 0.0

    def slides(angle_deg: float) -> bool:
        """Whether the seed is moving after a hold at an angle, be it that it creeps at a steady speed."""
        tilt(angle_deg, hold_steps)
        for _ in range(hold_steps // 2):
            scene.step()
        halfway = scene.state.vel.norm()
        for _ in range(hold_steps - hold_steps // 2):
            scene.step()
        speed = scene.state.vel.norm()
        return speed > sliding or (speed > CREEPING * sliding and abs(speed / halfway - 1) < STEADY)

    def settle(angle_deg: float) -> None:
        """Bring the seed to rest at an angle that holds it; one that has tipped over is laid flat again."""
        own, scene.newton.damping = scene.newton.damping, 0.5
        scene.state.vel, scene.state.angMom, scene.state.angVel = (0, 0, 0), (0, 0, 0), (0, 0, 0)
        tipped = (scene.state.ori * upright).cross(up).norm() > TIPPED
        if tipped:
            scene.state.pos, scene.state.ori = rest
            scene.forget_contacts()
            tilt.angle_deg = angle_deg
        for _ in range(MOST_HOLDS if tipped else 1):
            tilt(angle_deg, hold_steps)
            for _ in range(hold_steps):
                scene.step()
            if scene.state.vel.norm() < 0.1 * sliding:
                break
        scene.newton.damping = own

    up = Vector3(0, 0, 1)
    upright = scene.state.ori.conjugate() * up
    rest = scene.state.pos, scene.state.ori
    settle(0.0)
    rest = scene.state.pos, scene.state.ori
    if slides(0.0):
        raise Failed("the seed moves on a level plate")
    cells = 2 ** ceil(log2(STEEPEST_DEG / numerics["bracket_deg"]))
    cell = STEEPEST_DEG / cells
    holds, slips, stride = 0, cells, SPAN
    trial = min(max(SPAN, int(expected_deg(scene) / cell) // SPAN * SPAN), cells - 1)
    settle(trial * cell)
    while slips - holds > 1:
        if slides(trial * cell):
            slips = trial
            if slips - holds > 1:
                settle(holds * cell)
        else:
            holds = trial
        if slips == cells:  # nothing has slid yet
            trial, stride = min(holds + stride, cells - 1), 2 * stride
        elif holds == 0:  # nothing has held yet
            trial, stride = max(slips - stride, slips // 2), 2 * stride
        else:
            trial = (holds + slips) // 2
    holds, slips = holds * cell, slips * cell
    if slips == STEEPEST_DEG:
        raise Failed(f"no sliding up to {STEEPEST_DEG:g} deg")
    return {"slip_angle_deg": 0.5 * (holds + slips)}


def expected_deg(scene: SeedScene) -> float:
    """Where Coulomb's law with adhesion, tan a = mu (1 + F/N), has the seed slide, deg: where the search begins."""
    weight, mu = GRAVITY * scene.mass, scene.pair.static_friction
    pull = sum(contacts.pull_off_force(scene.pair.surface_energy, radius) for radius in scene.radii)
    angle = atan(mu)
    for _ in range(ROUNDS):
        load = weight * max(cos(angle), 0.1)
        angle = atan(scene.effects.at("friction", mu, load + pull) * (1 + pull / load))
    return 2 * degrees(angle) - scene.effects.at("slope_deg", degrees(angle))
