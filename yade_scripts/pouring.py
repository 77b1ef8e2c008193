"""How a heap is made, from look to look: the powder settles, flows out, and comes to rest.

A look steps the scene on, tells a blow-up, and takes away what has run over the edge of the base: grains whose centre
lies beyond it, outside the funnel.
"""

from math import atan2, pi, sqrt

import numpy as np

from yade_scripts.case import Failed
from yade_scripts.powder_scene import GRAVITY, PowderScene

LOOK = 2.0  # time between looks, in the fall time sqrt(R/g) of a grain
SETTLED = 1e-2  # mean kinetic energy of a settled fill, in a grain's weight times radius
FASTEST = 3.0  # times the speed of a free fall from the top of the funnel: more is a blow-up
LARGEST_OVERLAP = 0.6  # radius
LEFT_BEHIND = 0.01  # share of the grains that may stay in the funnel
PATIENCE = 30.0  # time without a grain leaving, in sqrt(R/g): an arch
MOST_FILL, MOST_FLOW, MOST_REST = 100.0, 500.0, 150.0  # in sqrt(R/g)
LIFTED = 1.2  # heights of the fill, by which a cylinder is lifted until what is still in it is a plug
SECTORS = 8  # of the edge, each of which the powder must run over


class Pouring:
    """A scene, from the fill to the heap at rest."""

    def __init__(self, scene: PowderScene):
        from yade import O

        self.scene = scene
        self.number = len(scene.grains)
        self.fall = sqrt(scene.mean_radius / GRAVITY)
        self.overlap = 0.0  # the largest at any look, in the mean radius
        self.over_edge = np.zeros(SECTORS, dtype=int)
        self._unit = scene.mass.mean() * GRAVITY * scene.mean_radius
        self._fastest = FASTEST * sqrt(2 * GRAVITY * (scene.funnel.bottom + scene.funnel.top))
        self._steps = max(1, round(LOOK * self.fall / O.dt))
        self.between_looks = self._steps * O.dt

    def look(self, phase: str) -> float:
        """Step on; mean kinetic energy of a grain, in its weight times radius.

        Raises
        ------
        Failed : a blow-up, or grains too soft
        """
        scene = self.scene
        scene.run(self._steps)
        self.overlap = max(self.overlap, scene.largest_overlap())
        speed = scene.largest_speed()
        if not speed < self._fastest:
            raise Failed(
                f"blew up in the {phase}: speed {speed:.3g} m/s, overlap {self.overlap:.2f} of the radius; "
                "a smaller time_step_fraction is needed"
            )
        if not self.overlap < LARGEST_OVERLAP:
            raise Failed(
                f"two bodies overlap by {self.overlap:.2f} of the radius in the {phase}, {LARGEST_OVERLAP:g} at most: too soft for "
                "this fill and fall; a larger stiffness_scale is needed, or a smaller time_step_fraction"
            )
        if scene.base.radius is not None:
            self._take_away()
        return scene.kinetic_energy() / (self._unit * max(1, len(scene.grains)))

    def _take_away(self) -> None:
        centres = self.scene.centres()
        gone = (np.hypot(centres[:, 0], centres[:, 1]) > self.scene.base.radius) & ~self._in_funnel(centres)
        for x, y, _ in centres[gone]:
            self.over_edge[int((atan2(y, x) + pi) / (2 * pi) * SECTORS) % SECTORS] += 1
        self.scene.take_away(gone)

    def _in_funnel(self, centres: np.ndarray) -> np.ndarray:
        within = np.hypot(centres[:, 0], centres[:, 1]) < self.scene.funnel.width
        return within & (centres[:, 2] > self.scene.bottom())

    def fill(self) -> None:
        """Let the powder settle in the closed funnel.

        Raises
        ------
        Failed : it does not
        """
        from yade import O

        while self.look("fill") > SETTLED:
            if O.time > MOST_FILL * self.fall:
                raise Failed(f"the fill does not settle in {O.time:.2g} s")

    def pour(self, vibration: float, frequency: float) -> float:
        """Open the funnel, vibrating along its axis (m, Hz), until it is empty; the time of the last grain to leave, s.

        Raises
        ------
        Failed : an arch holds, or the heap reaches the outlet
        """
        from yade import O

        scene, bottom = self.scene, self.scene.funnel.bottom
        inside, opened = len(scene.grains), O.time
        left_last = opened
        scene.open()
        scene.shake(vibration, frequency)
        while inside:
            self.look("flow")
            now = int((scene.centres()[:, 2] > bottom).sum())
            if now < inside:
                inside, left_last = now, O.time
            if O.time - left_last > PATIENCE * self.fall or O.time - opened > MOST_FLOW * self.fall:
                break
        if inside > LEFT_BEHIND * self.number:
            below = (bottom - scene.centres()[:, 2]) / scene.mean_radius
            if ((below > 2) & (below < 6)).any():  # under an arch there is nothing
                raise Failed(_REACHED)
            raise Failed(f"jammed: {self.number - inside} of {self.number} grains came out")
        return left_last

    def lift(self, speed: float) -> float:
        """Lift the cylinder off the powder (m/s); the time at which the last grain left it, s.

        Raises
        ------
        Failed : a plug stays in it
        """
        from yade import O

        scene = self.scene
        highest = LIFTED * scene.centres()[:, 2].max()
        scene.lift(speed)
        while (inside := int(self._in_funnel(scene.centres()).sum())) > LEFT_BEHIND * self.number:
            if scene.bottom() > highest:
                raise Failed(f"jammed: {self.number - inside} of {self.number} grains came out of the lifted cylinder")
            self.look("flow")
        return O.time

    def rest(self, energy: float, since: float) -> None:
        """Take the funnel away and wait until two looks in turn find a mean kinetic energy below one (weight times radius).

        Raises
        ------
        Failed : the heap does not come to rest, grains were lost, or a part of the base is not covered
        """
        from yade import O

        self.scene.remove_funnel()
        while self.look("rest") > energy or self.look("rest") > energy:
            if O.time - since > MOST_REST * self.fall:
                raise Failed(f"the heap is not at rest {O.time - since:.2g} s after the last grain came out")
        if self.scene.base.radius is None:
            lost = int((self.scene.centres()[:, 2] < 0).sum())
            if lost:
                raise Failed(f"{lost} grains were lost through the plate")
        elif (self.over_edge == 0).any():
            raise Failed(
                f"the powder ran over {int((self.over_edge > 0).sum())} of {SECTORS} parts of the base's edge; take more "
                "powder_mass_g or a smaller base_diameter_mm"
            )

    def below_outlet(self) -> None:
        """Refuse a heap that reached the outlet it was poured from."""
        if (self.scene.centres()[:, 2] + self.scene.grains).max() > self.scene.funnel.bottom:
            raise Failed(_REACHED)


_REACHED = "the heap reaches the outlet; raise outlet_height_mm or take less powder"
