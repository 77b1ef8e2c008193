"""Rolling resistance: grains that are no spheres, or rough, do not roll freely on each other and on the wall."""

EFFECT = {
    "name": "rolling_resistance",
    "means": "grains of irregular shape or rough surface resist rolling on each other and on the steel",
    "formula": "M <= (mu_r0 + mu_r) R Fn at every contact, mu_r0 what the model has already",
    "parameters": {
        "rolling_friction": {
            "absent": 0.0, "min": 0.0, "max": 1.0, "physical": (0.0, 0.6), "unit": "1",
            "meaning": "mu_r, rolling moment over radius times normal force, added at powder-powder and powder-steel contacts",
        },
    },
    "owns": ("powder_rolling_friction", "powder_steel_rolling_friction"),
    "sides": 1,
    "rigs": {"repose": "the heap is steeper, whatever the size of its grains and the mass of the powder"},
    "signature": "the angle is higher in all heaps alike; amplification, size and mass make no difference",
    "source": "Zhou, Wright, Yang, Xu & Yu 1999, Physica A 269, 536, doi:10.1016/S0378-4371(99)00183-1; "
    "Wensrich & Katterfeld 2012, Powder Technology 217, 409, doi:10.1016/j.powtec.2011.10.057",
}  # fmt: skip


def rolling(pair, values):
    """The pair (contacts.Pair) with rolling friction added."""
    return pair._replace(rolling_friction=pair.rolling_friction + values["rolling_friction"])


TURN = 2
POWDER_SCENE = {"pair": rolling, "wall_pair": rolling}
