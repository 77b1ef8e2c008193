"""What the air does to the grains of the repose rig's scene, read off their motion in one step far from any contact."""

import numpy as np

from yade_scripts import repose

RIG = {
    **repose.RIG,
    "name": "powder_air",
    "observables": {"deceleration_m_s2": "of a grain that moves sideways", "after_gone_m_s2": "with half of them gone"},
    "random": False,
}
SPEED = 1.0  # m/s


def simulate(case: dict) -> dict:
    """All grains get one sideways speed; two steps later, without contacts, what has it become?"""
    from yade import InteractionLoop, O

    scene, _ = repose.build(case)
    for engine in O.engines:
        if isinstance(engine, InteractionLoop):
            engine.dead = True
    found = []
    for gone in (False, True):
        if gone:
            scene.take_away(np.arange(len(scene.bodies)) % 2 == 0)
        for body in scene.bodies:
            body.state.vel = (SPEED, 0, 0)
        started = O.time
        scene.run(2)
        slower = [SPEED - body.state.vel[0] for body in scene.bodies]
        found.append(float(np.mean(slower)) / (O.time - started))
    return dict(zip(RIG["observables"], found, strict=True))
