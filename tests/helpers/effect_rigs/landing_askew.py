"""A seed that lands askew on one of its members, without gravity and friction: what becomes of the speed of that point?"""

from math import radians

from yade_scripts import particles, rebound, seed_scene
from yade_scripts.case import Failed, quantity
from yade_scripts.seed_scene import SeedScene

RIG = {
    **rebound.RIG,
    "name": "landing_askew",
    "conditions": {
        "seed_length_mm": seed_scene.SEED_LENGTH,
        "pitch_deg": quantity(40.0, 0.0, 90.0, "deg", "turn of the long axis out of the plate"),
        "speed_m_s": quantity(1.0, 0.1, 5.0, "m/s", "toward the plate"),
    },
    "observables": {"restitution_there": "normal speed of the point that touches, after over before"},
    "random": False,
}


def simulate(case: dict) -> dict:
    """One contact."""
    from yade import O, Vector3

    given = case["conditions"]
    scene = SeedScene(case, particles.about(1, radians(given["pitch_deg"])))
    touch = -seed_scene.lowest(scene.points, scene.radii, (0, 0, 1))
    scene.place((0, 0, touch))
    scene.plate((0, 0, -0.005), (10, 10, 0.005))
    scene.start((0, 0, 0))
    state = scene.state
    state.vel = (0, 0, -given["speed_m_s"])
    met, steps, arm = False, 0, Vector3(0, 0, 0)
    while steps < 100_000:
        scene.step()
        steps += 1
        real = [contact for contact in O.interactions if contact.isReal]
        if len(real) > 1:
            raise Failed("it touches with two members")
        if real:
            met, arm = True, real[0].geom.contactPoint - state.pos
        elif met:
            return {"restitution_there": (state.vel + state.angVel.cross(arm))[2] / given["speed_m_s"]}
    raise Failed("the contact does not end")
