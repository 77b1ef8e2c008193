"""The tilt at which the alfalfa seed starts to slide, against atan(mu): the slope_slip rig, on its closed form."""

if __name__ == "__main__":  # by hand: yade -x -n clump_sliding.py cases.json observables.csv
    import os
    import runpy
    import sys

    _file = os.path.abspath(sys.argv[0])
    sys.argv[:1] = [os.path.join(os.path.dirname(_file), os.pardir, "case.py"), _file]
    runpy.run_path(sys.argv[0], run_name="__main__")

from math import atan, degrees

from yade_scripts import slope_slip

RIG = {
    **slope_slip.RIG,
    "name": "clump_sliding",
    "random": False,
}
SETTING = (
    "seed_powder_static_friction",
    "seed_powder_restitution",
    "cohesive_frictional_damping",
)


def expected(case: dict) -> dict:
    """atan(mu)."""
    return {"slip_angle_deg": degrees(atan(case["parameters"]["seed_powder_static_friction"]))}


def instead(case: dict) -> dict:
    """Nothing: the laws can."""
    return {}


def simulate(case: dict) -> dict:
    """One search for the angle."""
    return slope_slip.simulate(case)
