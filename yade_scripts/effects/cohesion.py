"""Cohesion: grains stick to each other, so that a shear stress is carried without any normal stress."""

from yade_scripts.contacts import NOT_COHESIVE

EFFECT = {
    "name": "cohesion",
    "means": "grains stick to each other: some shear stress is carried without normal stress",
    "formula": "tau = mu sigma + c",
    "parameters": {
        "cohesive_stress_pa": {
            "absent": 0.0,
            "min": 0.0,
            "max": 20000.0,
            "physical": (0.0, 5000.0),
            "unit": "Pa",
            "meaning": "shear stress carried at zero normal stress, c",
        },
    },
    "owns": ("powder_surface_energy",),
    "parameters_in": {  # where the amount is another quantity
        "repose": {
            "surface_energy_j_m2": {
                "absent": 0.0,
                "min": 0.0,
                "max": 1.0,
                "physical": (0.0, 0.4),
                "unit": "J/m2",
                "meaning": "surface energy of the grains (JKR) at amplification 6, Gamma; pull-off 3/2 pi Gamma R*",
            },
        },
    },
    "sides": 1,
    "rigs": {
        "repose": "small grains make steeper heaps: pull-off over weight goes with 1/d^2",
        "layer_on_incline": "thin layers hold to steeper angles, by c/(rho g h cos a)",
        "shear_cell": "the yield line does not pass through the origin",
    },
    "not_with": {"repose": {"hertz_mindlin": NOT_COHESIVE}},
    "signature": "the apparent friction rises as the normal stress falls, like 1/stress, whatever the grain size",
    "source": "Nedderman 1992, Statics and Kinematics of Granular Materials, doi:10.1017/CBO9780511600043",
}


def yield_stress(shear_pa, normal_pa, conditions, values):
    """Shear stress carried, Pa: tau + c."""
    return shear_pa + values["cohesive_stress_pa"]


CLOSED_FORM = {"layer_on_incline": yield_stress, "shear_cell": yield_stress}


def sticky(pair, values):
    """The pair (contacts.Pair) of two grains with surface energy added."""
    return pair._replace(surface_energy=pair.surface_energy + values["surface_energy_j_m2"])


TURN = 1
POWDER_SCENE = {"pair": sticky}
