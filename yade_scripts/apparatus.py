"""What powder is poured from and onto: a funnel (or a cylinder) and a base, as numbers.

A funnel is a cone over a round outlet with a cylinder on top; where outlet and cylinder are equally wide it is a cylinder.
A base is an endless steel plate, or a disc over whose edge runs what is too much. A disc is smooth (the steel plate) or
rough: a closely packed layer of fixed grains of the powder itself, whose pockets a grain fills down to z = 0.
"""

from math import cos, pi, radians, sin, sqrt, tan
from typing import NamedTuple

import numpy as np

from yade_scripts.case import Failed

CONE_SLOPE_DEG = 60.0  # of the funnel's cone against the horizontal
SEGMENTS = 24  # facets around the funnel
LATTICE = 2.2  # spacing of the grains before they settle, in the largest radius
POCKET = (
    2 * sqrt(2 / 3) - 1
)  # depth of the centres of a close-packed layer under the bottom of a grain in a pocket, in R


class Funnel:
    """A cone over a round outlet, with a cylinder on top; on the axis z.

    Parameters
    ----------
    outlet : radius of the outlet, m
    width : radius of the cylinder, m
    bottom : height of the outlet, m

    Raises
    ------
    Failed : the outlet is wider than the cylinder
    """

    def __init__(self, outlet: float, width: float, bottom: float):
        if outlet > width:
            raise Failed(
                f"an outlet of {2e3 * outlet:g} mm in a funnel of {2e3 * width:g} mm; lower outlet_diameter_mm or raise "
                "funnel_diameter_mm"
            )
        self.outlet, self.width, self.bottom = outlet, width, bottom
        self.cone = (width - outlet) * tan(radians(CONE_SLOPE_DEG))

    def room(self, height: float) -> float:
        """Radius of the funnel at a height over its outlet, m."""
        return self.outlet + (self.width - self.outlet) * min(1.0, height / self.cone) if self.cone > 0 else self.width

    def lattice(self, number: int, largest: float) -> np.ndarray:
        """(number, 3) places for grains inside the funnel that do not touch, the lowest first, m.

        Raises
        ------
        Failed : the funnel is narrower than a grain
        """
        gap, found, layer = LATTICE * largest, [], 0
        wall = largest * 1.1 / sin(radians(CONE_SLOPE_DEG)) + gap * 0.02
        if self.width * cos(pi / SEGMENTS) <= wall:
            raise Failed(
                f"a funnel of {2e3 * self.width:g} mm holds no grains of {2e3 * largest:.3g} mm; raise its diameter, or take "
                "a smaller amplification"
            )
        while sum(map(len, found)) < number:
            height = 1.1 * largest + layer * gap * sqrt(2 / 3)
            reach = self.room(height - 0.5 * largest) * cos(pi / SEGMENTS) - wall
            n = int(self.width / gap) + 2
            i, j = np.meshgrid(np.arange(-n, n + 1), np.arange(-n, n + 1), indexing="ij")
            x = gap * (i + 0.5 * j + 0.5 * (layer % 2)).ravel()
            y = gap * (sqrt(3) / 2 * j + (layer % 2) / sqrt(12)).ravel()
            inside = np.hypot(x, y) < reach
            if height > self.cone and not inside.any():  # a cylinder with room for one grain, on the axis
                inside = np.hypot(x, y) <= np.hypot(x, y).min()
            found.append(np.column_stack([x[inside], y[inside], np.full(inside.sum(), self.bottom + height)]))
            layer += 1
        self.top = float(found[-1][0, 2]) - self.bottom + 2 * largest
        return np.vstack(found)[:number]


class Base(NamedTuple):
    """What the heap stands on: radius of the disc (m; None: an endless plate), and whether it is rough."""

    radius: float | None = None
    rough: bool = False

    def places(self, grain: float, turn: float) -> np.ndarray:
        """(n, 3) centres of the fixed grains of a rough disc, m; none where it is smooth.

        Parameters
        ----------
        grain : radius of the grains, m
        turn : of the layer about the axis, rad
        """
        if not self.rough or self.radius is None:
            return np.empty((0, 3))
        n = int(self.radius / grain) + 3
        i, j = np.meshgrid(np.arange(-n, n + 1), np.arange(-n, n + 1), indexing="ij")
        x, y = 2 * grain * (i + 0.5 * j).ravel(), sqrt(3) * grain * j.ravel()
        near = np.hypot(x, y) < self.radius + grain
        x, y = x[near], y[near]
        return np.column_stack(
            [cos(turn) * x - sin(turn) * y, sin(turn) * x + cos(turn) * y, np.full(len(x), -POCKET * grain)]
        )
