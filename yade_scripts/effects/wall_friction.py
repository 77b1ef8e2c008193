"""Wall friction: the plate and the funnel are rougher or smoother than the model's."""

EFFECT = {
    "name": "wall_friction",
    "means": "plate and funnel are rougher (or smoother) than the model's",
    "formula": "mu_w = mu_w0 + d",
    "parameters": {
        "added_friction": {
            "absent": 0.0, "min": -0.5, "max": 0.5, "physical": (-0.4, 0.4), "unit": "1",
            "meaning": "d, static friction powder-steel beyond the model's",
        },
    },
    "sides": 2,
    "rigs": {"repose": "the foot of the heap is held (or slips): small heaps show more"},
    "signature": "the angle changes where the heap's foot would slip on the plate, not on a rough plate",
    "source": "Zhou, Xu, Yu & Zulli 2001, Phys. Rev. E 64, 021301, doi:10.1103/PhysRevE.64.021301",
}  # fmt: skip


def rougher(pair, values):
    """The powder-steel pair (contacts.Pair) with static friction added, not below 0."""
    return pair._replace(static_friction=max(0.0, pair.static_friction + values["added_friction"]))


TURN = 5
POWDER_SCENE = {"wall_pair": rougher}
