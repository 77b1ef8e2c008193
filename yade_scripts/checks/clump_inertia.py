"""Mass and moments of inertia of the seed as YADE moves it, against those of the union of its spheres.

The seed, turned some way, is given a spin about its length, width and thickness in turn; the moment of inertia is
angular momentum over angular velocity about that axis.
"""

if __name__ == "__main__":  # by hand: yade -x -n clump_inertia.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from yade_scripts import particles, seed_scene
from yade_scripts.seed_scene import SeedScene

AXES = ("length", "width", "thickness")
RIG = {
    "name": "clump_inertia",
    "contact_laws": seed_scene.CONTACT_LAWS,
    "parameters": seed_scene.PARAMETERS,
    "conditions": {"seed_length_mm": seed_scene.SEED_LENGTH},
    "effects": {},
    "numerics": seed_scene.numerics(time_step_fraction=0.01, stiffness_scale=1.0),
    "observables": {"mass_kg": "of the seed", **{f"inertia_{axis}_kg_m2": f"about its {axis}" for axis in AXES}},
    "random": True,
    "time_limit_s": 60.0,
}
SETTING = ("seed_length_mm", "seed_density_kg_m3")


def expected(case: dict) -> dict:
    """Mass and inertia of the union, integrated."""
    seed = particles.alfalfa_seed(case["conditions"]["seed_length_mm"])
    mass, _, inertia = particles.mass_properties(*seed, case["parameters"]["seed_density_kg_m3"])
    return {"mass_kg": mass, **{f"inertia_{axis}_kg_m2": inertia[k, k] for k, axis in enumerate(AXES)}}


def instead(case: dict) -> dict:
    """Nothing: the scene can."""
    return {}


def simulate(case: dict) -> dict:
    """Three spins in free space."""
    from yade import O, Vector3

    rotation = particles.orientation(case["seed"])
    read = {}
    for k, axis in enumerate(AXES):
        scene = SeedScene(case, rotation)
        scene.place((0, 0, 0))
        scene.start((0, 0, 0))
        scene.newton.damping = 0.0
        direction = Vector3(*rotation[:, k])
        momentum = 1e-12  # kg m2/s, a few turns a second
        scene.spin(momentum * direction)
        O.step()
        read["mass_kg"] = scene.state.mass
        read[f"inertia_{axis}_kg_m2"] = momentum / scene.state.angVel.dot(direction)
    return read
