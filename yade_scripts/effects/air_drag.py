"""Air drag: still air brakes seeds and grains by the law of a sphere, times a factor."""

from math import pi

import numpy as np

AIR_DENSITY = 1.2  # kg/m3, 20 C
AIR_VISCOSITY = 1.81e-5  # Pa s, 20 C
NEWTON_FROM = 1000.0  # Reynolds number from which on the coefficient of a sphere is level
NEWTON = 24 / NEWTON_FROM * (1 + 0.15 * NEWTON_FROM**0.687)  # 0.438 there: 0.44 in the books, without their step

EFFECT = {
    "name": "air_drag",
    "means": "still air brakes what falls and rolls",
    "formula": "F = -f 1/2 rho_air Cd A |v| v on the centre of mass, Cd = 24/Re (1 + 0.15 Re^0.687), level from Re = 1000 on, "
    "Re = rho_air d |v|/eta, A = pi d^2/4, d the diameter of equal volume",
    "parameters": {
        "drag_factor": {
            "absent": 0.0, "min": 0.0, "max": 10.0, "physical": (0.0, 4.0), "unit": "1",
            "meaning": "f, drag over that of the sphere of equal volume: 1 for a sphere, 1.2 to 3 for seeds and splinters",
        },
    },
    "sides": 1,
    "rigs": {
        "rebound": "high drops of small seeds rebound lower",
        "inclined_roll": "long and steep runs of small seeds end earlier",
        "repose": "grains arrive more slowly: hardly seen in amplified grains",
    },
    "signature": "the loss grows with the length of the path, like Cd/(density x diameter): small and slow seeds show more",
    "source": "Schiller & Naumann 1933, Zeitschrift des VDI 77, 318; "
    "Clift, Grace & Weber 1978, Bubbles, Drops, and Particles, ISBN 978-0-12-176950-5; "
    "Haider & Levenspiel 1989, Powder Technology 58, 63, doi:10.1016/0032-5910(89)80008-7 (factors of other shapes)",
}  # fmt: skip


def sphere_drag(diameter, speed):
    """Drag of a sphere in still air over its speed, N s/m (m, m/s; numbers or arrays): 3 pi eta d Re Cd/24."""
    reynolds = AIR_DENSITY * diameter * speed / AIR_VISCOSITY
    slow = 1 + 0.15 * np.minimum(reynolds, NEWTON_FROM) ** 0.687
    return 3 * pi * AIR_VISCOSITY * diameter * np.where(reynolds < NEWTON_FROM, slow, NEWTON * reynolds / 24)


def force(newtons, velocity, volume: float, values):
    """Force on the centre of mass, N, with drag added (velocity in m/s, volume in m3)."""
    speed = sum(v * v for v in velocity) ** 0.5
    share = -values["drag_factor"] * float(sphere_drag((6 * volume / pi) ** (1 / 3), speed))
    return tuple(f + share * v for f, v in zip(newtons, velocity, strict=True))


def drag(per_speed, diameter, speed, values):
    """Drag of grains over their speeds, N s/m, (n,) arrays of diameters (m) and speeds (m/s)."""
    return per_speed + values["drag_factor"] * sphere_drag(diameter, speed)


TURN = 9
SEED_SCENE = {"force": force}
POWDER_SCENE = {"drag": drag}
