"""Stress-dependent friction: the friction coefficient falls as the normal stress rises."""

EFFECT = {
    "name": "stress_dependent_friction",
    "means": "contact area grows less than the load, so friction falls with normal stress",
    "formula": "tau = mu (sigma / sigma_median)^-n sigma",
    "parameters": {
        "stress_exponent": {
            "absent": 0.0,
            "min": 0.0,
            "max": 1.0,
            "physical": (0.0, 1 / 3),
            "unit": "1",
            "meaning": "exponent n, 1/3 for a smooth Hertz contact; sigma_median is that of the study's rows",
        },
    },
    "sides": 1,
    "rigs": {
        "layer_on_incline": "thin layers hold to steeper angles, by a power of the height",
        "shear_cell": "the yield line bends down",
    },
    "signature": "the apparent friction falls as a small power of the normal stress",
    "source": "Archard 1957, Proceedings of the Royal Society A 243, 190, doi:10.1098/rspa.1957.0214",
}


def yield_stress(shear_pa, normal_pa, conditions, values):
    """Shear stress carried, Pa: tau (sigma/sigma_median)^-n; acts on what friction carries."""
    return shear_pa * (normal_pa / conditions["median_normal_stress_pa"]) ** -values["stress_exponent"]


CLOSED_FORM = {"layer_on_incline": yield_stress, "shear_cell": yield_stress}
ORDER = 0  # before what adds to the frictional stress
