"""Side-wall friction: the walls of a channel carry part of the layer's weight along the slope."""

EFFECT = {
    "name": "side_wall_friction",
    "means": "the side walls of the channel hold back the layer",
    "formula": "tan a = mu + mu_w h / W",
    "parameters": {
        "wall_friction": {
            "absent": 0.0,
            "min": 0.0,
            "max": 5.0,
            "physical": (0.0, 1.0),
            "unit": "1",
            "meaning": "friction at the side walls times the ratio of sideways to normal stress, mu_w",
        },
    },
    "sides": 1,
    "rigs": {"layer_on_incline": "high layers in a narrow channel hold to steeper angles"},
    "signature": "the angle rises with the layer's height over the channel's width",
    "source": "Taberlet et al. 2003, Physical Review Letters 91, 264301, doi:10.1103/PhysRevLett.91.264301",
}


def yield_stress(shear_pa, normal_pa, conditions, values):
    """Shear stress carried, Pa: tau + sigma mu_w h/W (two walls, sideways stress half the basal one on average)."""
    slenderness = conditions["layer_height_mm"] / conditions["channel_width_mm"]
    return shear_pa + normal_pa * values["wall_friction"] * slenderness


CLOSED_FORM = {"layer_on_incline": yield_stress}
