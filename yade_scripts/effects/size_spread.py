"""Size spread: the grains are less equal than the model's."""

EFFECT = {
    "name": "size_spread",
    "means": "the grains differ more in size",
    "formula": "R evenly between (1 - s0 - s) and (1 + s0 + s) times their mean, s0 the model's own spread",
    "parameters": {
        "added_spread": {
            "absent": 0.0, "min": 0.0, "max": 0.6, "physical": (0.0, 0.5), "unit": "1",
            "meaning": "s, half-width of the size distribution beyond the model's, as a share of the mean radius",
        },
    },
    "sides": 1,
    "rigs": {"repose": "the angle scatters more from heap to heap; its mean changes little"},
    "signature": "scatter of the angle rather than its mean; small heaps show more",
    "source": "Zhou, Xu, Yu & Zulli 2001, Phys. Rev. E 64, 021301, doi:10.1103/PhysRevE.64.021301",
}  # fmt: skip


def wider(spread: float, values) -> float:
    """Half-width of the size distribution, as a share of the mean."""
    return spread + values["added_spread"]


TURN = 4
POWDER_SCENE = {"spread": wider}
