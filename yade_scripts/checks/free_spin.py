"""A seed spinning freely about no axis of its own keeps its rotational energy.

YADE's integrator alone gains energy here in proportion to the time step; SeedScene.run gives it back.
"""

if __name__ == "__main__":  # by hand: yade -x -n free_spin.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

import numpy as np

from yade_scripts import particles, seed_scene
from yade_scripts.case import quantity
from yade_scripts.seed_scene import SeedScene

RIG = {
    "name": "free_spin",
    "contact_laws": seed_scene.CONTACT_LAWS,
    "parameters": seed_scene.PARAMETERS,
    "conditions": {
        "seed_length_mm": seed_scene.SEED_LENGTH,
        "spin_rad_s": quantity(1000.0, 1.0, 5000.0, "rad/s", "angular speed, about the diagonal of the seed's axes"),
        "time_ms": quantity(50.0, 1.0, 1000.0, "ms", "time of flight"),
    },
    "effects": {},
    "numerics": seed_scene.numerics(time_step_fraction=0.05, stiffness_scale=0.1),
    "observables": {"energy_kept": "rotational energy at the end over that at the start"},
    "random": True,
    "time_limit_s": 60.0,
}
SETTING = ("spin_rad_s", "time_ms")


def expected(case: dict) -> dict:
    """All of it."""
    return {"energy_kept": 1.0}


def instead(case: dict) -> dict:
    """Nothing: the scene can."""
    return {}


def simulate(case: dict) -> dict:
    """One flight without gravity."""
    from yade import O, Vector3

    conditions = case["conditions"]
    scene = SeedScene(case, particles.orientation(case["seed"]))
    scene.place((0, 0, 0))
    scene.plate((0, 0, -1), (1, 1, 0.005))  # far below: the flight's long steps are part of the check
    scene.start((0, 0, 0))
    scene.newton.damping = 0.0
    state = scene.state
    in_body = conditions["spin_rad_s"] / np.sqrt(3) * np.array(state.inertia)
    scene.spin(state.ori * Vector3(*in_body))
    start = _energy(state)
    while O.time < 1e-3 * conditions["time_ms"]:
        scene.run(30)
    return {"energy_kept": _energy(state) / start}


def _energy(state) -> float:
    """Rotational energy L.I^-1.L / 2, J."""
    in_body = state.ori.conjugate() * state.angMom
    return 0.5 * sum(m * m / inertia for m, inertia in zip(in_body, state.inertia, strict=True))
