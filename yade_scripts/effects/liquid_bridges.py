"""Liquid bridges: moisture between the grains pulls them together where they touch."""

from math import pi

from yade_scripts.contacts import NOT_COHESIVE

EFFECT = {
    "name": "liquid_bridges",
    "means": "moisture forms bridges that pull touching grains together",
    "formula": "F = 2 pi R* gamma_l at contact, R* = R/2 of two equal grains, contact angle 0",
    "parameters": {
        "surface_tension_n_m": {
            "absent": 0.0, "min": 0.0, "max": 0.2, "physical": (0.0, 0.073), "unit": "N/m",
            "meaning": "gamma_l, surface tension of the liquid times the cosine of its contact angle; water 0.073",
        },
    },
    "sides": 1,
    "rigs": {"repose": "fine powder makes steeper heaps, as cohesion does; dried powder does not"},
    "not_with": {"repose": {"hertz_mindlin": NOT_COHESIVE}},
    "signature": "like cohesion in every heap of one humidity (both pulls are proportional to R); changes with humidity",
    "source": "Fisher 1926, J. Agric. Sci. 16, 492, doi:10.1017/S0021859600007838; "
    "Willett, Adams, Johnson & Seville 2000, Langmuir 16, 9396, doi:10.1021/la000657y",
}  # fmt: skip


def pull(pair, values):
    """The pair (contacts.Pair) with the surface energy of equal pull-off added: 3/2 pi Gamma R* = 2 pi R* gamma_l."""
    return pair._replace(surface_energy=pair.surface_energy + 2 * pi * values["surface_tension_n_m"] / (1.5 * pi))


TURN = 3
POWDER_SCENE = {"pair": pull}
