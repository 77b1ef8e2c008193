"""Finite thickness: a thin granular layer on a rough plane starts at a steeper angle than a thick one."""

import numpy as np

EFFECT = {
    "name": "finite_thickness",
    "means": "the rough base holds back a layer only some grains thick",
    "formula": "tan a = mu + excess exp(-h / (decay d))",
    "parameters": {
        "excess_friction": {
            "absent": 0.0,
            "min": 0.0,
            "max": 10.0,
            "physical": (0.0, 1.0),
            "unit": "1",
            "meaning": "friction a vanishing layer has beyond a thick one, tan(theta_2) - tan(theta_1)",
        },
        "decay_diameters": {
            "default": 3.0,
            "min": 1.0,
            "max": 30.0,
            "physical": (1.0, 10.0),
            "unit": "1",
            "meaning": "layer height, in grain diameters, over which the excess falls by e",
        },
    },
    "sides": 1,
    "rigs": {"layer_on_incline": "layers of some grain diameters hold to steeper angles, thick ones do not"},
    "signature": "the angle rises exponentially as the layer thins, on the scale of the grain diameter",
    "source": "Pouliquen 1999, Physics of Fluids 11, 542, doi:10.1063/1.869928",
}


def yield_stress(shear_pa, normal_pa, conditions, values):
    """Shear stress carried, Pa: tau + sigma excess exp(-h/(A d)); h and d in mm."""
    diameters = conditions["layer_height_mm"] / conditions["particle_diameter_mm"]
    return shear_pa + normal_pa * values["excess_friction"] * np.exp(-diameters / values["decay_diameters"])


CLOSED_FORM = {"layer_on_incline": yield_stress}
