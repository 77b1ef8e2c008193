"""Air drag with a constant coefficient: the law by which air drag was hidden in the sealed sets.

The package has had the law of a sphere since; a candidate of the benchmark must be the effect that was hidden.
"""

from math import pi, sqrt

AIR_DENSITY = 1.2  # kg/m3, 20 C

EFFECT = {
    "name": "air_drag",
    "means": "still air brakes the falling and rolling seed in proportion to the square of its speed",
    "formula": "F = -1/2 rho_air Cd A |v| v on the centre of mass, A = pi d^2/4, d the diameter of equal volume",
    "parameters": {
        "drag_coefficient": {
            "absent": 0.0, "min": 0.0, "max": 5.0, "physical": (0.0, 2.0), "unit": "1",
            "meaning": "Cd, of the sphere of equal volume; 0.4 to 1.5 at Reynolds numbers of 10 to 1000",
        },
    },
    "sides": 1,
    "rigs": {
        "rebound": "high drops of small seeds rebound lower",
        "inclined_roll": "long and steep runs of small seeds end earlier",
    },
    "signature": "the loss grows with the length of the path, like 1/(density x diameter): small seeds show more",
    "source": "Clift, Grace & Weber 1978, Bubbles, Drops, and Particles, ISBN 978-0-12-176950-5",
}  # fmt: skip


def force(newtons, velocity, volume: float, values):
    """Force on the centre of mass, N, with drag added (velocity in m/s, volume in m3)."""
    area = pi / 4 * (6 * volume / pi) ** (2 / 3)
    share = -0.5 * AIR_DENSITY * values["drag_coefficient"] * area * sqrt(sum(v * v for v in velocity))
    return tuple(f + share * v for f, v in zip(newtons, velocity, strict=True))


TURN = 9
SEED_SCENE = {"force": force}
