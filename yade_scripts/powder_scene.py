"""Amplified powder in a steel funnel over a base: what the repose rig is made of.

Places at which effects act (their `POWDER_SCENE`):

| place | asked with | answers |
|---|---|---|
| `pair`, `wall_pair` | contacts.Pair, powder-powder and powder-steel | contacts.Pair |
| `spread` | half-width of the radii over their mean | the same |
| `exponent` | of the amplification in the surface energy | the same |
| `drag` | 0; diameters (m) and speeds (m/s) of the grains | force against their motion over their speeds, N s/m |
"""

import time
from collections.abc import Callable
from math import cos, inf, pi, radians, sin, sqrt

import numpy as np

from yade_scripts import contacts, laws, layered, stepping
from yade_scripts.apparatus import SEGMENTS, Base, Funnel
from yade_scripts.contacts import Material, Pair
from yade_scripts.laws import COHESIVE_FRICTIONAL, HERTZ_MINDLIN, LOCAL_DAMPING

GRAVITY = 9.81  # m/s2
STEEL = Material(7850.0, 7.9e10, 0.3)  # handbook values
REFERENCE_AMPLIFICATION = 6.0  # of the source paper: surface energies are given there
STEPS_BETWEEN_DRAGS = 50  # the speed of a grain in flight changes by some mm/s meanwhile
FASTEST_START = 0.1  # m/s, of the random velocities they start with
LOOKS_EVERY = 5e-4  # s, whether the steps asked for are done


def grain_radius(diameter_um: float, amplification: float) -> float:
    """Radius of an amplified grain, m."""
    return 0.5e-6 * diameter_um * amplification


def grain_mass(radius: float, density: float) -> float:
    """Mass of a sphere 4/3 pi R^3 rho, kg."""
    return 4 / 3 * pi * radius**3 * density


def damper_share(restitution: float) -> float:
    """Share of the time step that a Mindlin contact's damper leaves: 1 from e = 0.15 on, 0.30 at e = 0.05.

    A spring and damper of damping ratio b are stable up to the step 2/omega (sqrt(1 + b^2) - b) (damped central
    differences, Belytschko, Liu & Moran 2000, ISBN 978-0-471-98774-1); b is 2.6 at e = 0.15 and 8.9 at 0.05, where heaps blew up at 0.18 of the Rayleigh step.
    """

    def bound(e: float) -> float:
        ratio = contacts.damping_ratio(e)
        return sqrt(1 + ratio**2) - ratio

    return min(1.0, bound(restitution) / bound(0.15))


def bond_number(surface_energy: float, radius: float, density: float) -> float:
    """Pull-off force of two equal grains, 3/2 pi Gamma R/2, over the weight of one."""
    return contacts.pull_off_force(surface_energy, radius / 2) / (grain_mass(radius, density) * GRAVITY)


def radii(number: int, mean: float, spread: float, draw: np.random.Generator) -> np.ndarray:
    """Radii spread evenly over mean (1 +- spread), scaled so that the mass is that of equal grains, m."""
    sizes = 1 + spread * draw.uniform(-1, 1, number)
    return mean * sizes / np.mean(sizes**3) ** (1 / 3)


class PowderScene:
    """A YADE scene with powder, funnel, gate and base, at the start of the fill.

    Parameters
    ----------
    grains : radii, m
    funnel : Funnel; where it starts lower than a grain's diameter there is no gate: the powder stands on the base
    base : Base
    powder, steel : Material, both as soft as they are simulated
    pair, wall_pair : Pair, powder-powder and powder-steel
    law : name of the contact law
    time_step_fraction : of the Rayleigh step of the smallest grain; less where a Mindlin contact has e < 0.15
    rolling_spring : stiffness of the rolling moment of Mindlin contacts below its limit, in I/dt^2
    damping : local damping of the law that has one
    adhesion_load : that adhesion adds to the limits of friction and rolling, in pull-off forces (yade_scripts/layered.py)
    softness : modulus of `powder` over the real one's
    drag : (diameters, speeds) to the force against the motion of the grains over their speeds; None where there is none
    draw : random numbers of this case
    """

    def __init__(
        self,
        grains,
        funnel: Funnel,
        base: Base,
        powder: Material,
        steel: Material,
        pair: Pair,
        wall_pair: Pair,
        law: str,
        time_step_fraction: float,
        rolling_spring: float,
        damping: float,
        adhesion_load: float,
        softness: float,
        drag: Callable | None,
        draw: np.random.Generator,
    ):
        from yade import O

        O.reset()
        self.grains, self.funnel, self.base, self.powder = np.asarray(grains), funnel, base, powder
        self.mean_radius = float(self.grains.mean())
        self.mass = grain_mass(1.0, powder.density) * self.grains**3
        smallest = float(self.grains.min())
        viscous = (wall_pair, pair) if law == HERTZ_MINDLIN else (wall_pair,)
        self.time_step = time_step_fraction * contacts.rayleigh_step(smallest, powder)
        if law == COHESIVE_FRICTIONAL:  # its steps are half as long as those that the walls' share is made for
            walls = min(1.0, 2 * damper_share(wall_pair.restitution))
            self.time_step *= min(walls, layered.step_share(pair.restitution, adhesion_load))
        else:
            self.time_step *= damper_share(min(each.restitution for each in viscous))
        inertia = 0.4 * grain_mass(smallest, powder.density) * smallest**2
        options = {"rolling_stiffness": rolling_spring * inertia / self.time_step**2}
        if law == LOCAL_DAMPING:
            options |= {"radius": self.mean_radius, "damping": damping}
        if law == COHESIVE_FRICTIONAL:
            options |= {
                "radius": self.mean_radius,
                "time_step": self.time_step,
                "adhesion_load": adhesion_load,
                "softness": softness,
            }
        self.contacts = laws.LAWS[law](powder, steel, wall_pair, pair, **options)
        self.contacts.enter()
        self._fill(draw)
        self._walls(draw)
        self.drag = drag
        self._engines()
        self.step = stepping.single(self.contacts)

    def _fill(self, draw: np.random.Generator) -> None:
        """Grains of random order on a lattice turned at random, with random velocities."""
        places = self.funnel.lattice(len(self.grains), float(self.grains.max()))
        turn = draw.uniform(0, 2 * pi)
        x = cos(turn) * places[:, 0] - sin(turn) * places[:, 1]
        y = sin(turn) * places[:, 0] + cos(turn) * places[:, 1]
        speeds = FASTEST_START * draw.uniform(-1, 1, (len(places), 3))
        self.bodies = []
        for place, radius, speed in zip(zip(x, y, places[:, 2], strict=True), self.grains, speeds, strict=True):
            body, _ = self.contacts.grain(place, float(radius))
            body.state.vel = tuple(map(float, speed))
            self.bodies.append(body)

    def _walls(self, draw: np.random.Generator) -> None:
        from yade import O, utils

        funnel, steel = self.funnel, self.contacts.wall
        look = {"material": steel, "color": (1, 1, 1), "mask": self.contacts.wall_mask}
        ring = radians(360 / SEGMENTS)
        self.walls = []

        def ring_of_facets(low: float, high: float, bottom: float, top: float) -> None:
            for k in range(SEGMENTS):
                a, b = k * ring, (k + 1) * ring
                corners = [(r * cos(t), r * sin(t), z) for r, z in ((low, bottom), (high, top)) for t in (a, b)]
                for three in ((0, 1, 2), (1, 3, 2)):
                    facet = utils.facet([corners[c] for c in three], fixed=True, **look)
                    self.walls.append(O.bodies.append(facet))

        if funnel.cone > 0:
            ring_of_facets(funnel.outlet, funnel.width, funnel.bottom, funnel.bottom + funnel.cone)
        if funnel.top > funnel.cone:
            ring_of_facets(funnel.width, funnel.width, funnel.bottom + funnel.cone, funnel.bottom + funnel.top)
        thick = 2 * self.mean_radius
        half = 1.2 * funnel.outlet
        self.gate = None
        if funnel.bottom >= thick:
            self.gate = O.bodies.append(
                utils.box((0, 0, funnel.bottom - thick), (half, half, thick), fixed=True, **look)
            )
        if not self.base.rough:
            O.bodies.append(utils.box((0, 0, -0.005), (10, 10, 0.005), fixed=True, **look))
        else:
            for place in self.base.places(self.mean_radius, draw.uniform(0, 2 * pi)):
                self.contacts.fixed_grain(place, self.mean_radius)

    def _engines(self) -> None:
        from yade import (
            Bo1_Box_Aabb,
            Bo1_Facet_Aabb,
            Bo1_Sphere_Aabb,
            ForceResetter,
            HarmonicMotionEngine,
            InsertionSortCollider,
            InteractionLoop,
            NewtonIntegrator,
            O,
        )

        self.shaker = HarmonicMotionEngine(A=(0, 0, 0), f=(1, 1, 1), fi=(0, 0, 0), ids=self.walls, dead=True)
        collider = InsertionSortCollider(
            [Bo1_Sphere_Aabb(), Bo1_Box_Aabb(), Bo1_Facet_Aabb()],
            verletDist=(0.1 if self.contacts.layers else 0.2) * self.mean_radius,
            targetInterv=-1,
        )
        self.contacts.collide(collider)
        O.engines = [
            ForceResetter(),
            collider,
            InteractionLoop(self.contacts.geometry, self.contacts.physics, self.contacts.law),
            self.shaker,
            NewtonIntegrator(damping=self.contacts.damping, gravity=(0, 0, -GRAVITY), exactAsphericalRot=False),
        ]
        O.dt = self.time_step

    def open(self) -> None:
        """Take the gate away."""
        from yade import O

        if self.gate is not None:
            O.bodies.erase(self.gate)

    def shake(self, amplitude: float, frequency: float) -> None:
        """Vibrate the funnel along its axis (m, Hz); an amplitude of 0 stops it where it is."""
        from yade import O

        self.shaker.dead = amplitude == 0
        if amplitude:
            self.shaker.A, self.shaker.f = (0, 0, amplitude), (1, 1, frequency)
        else:
            for k in self.walls:
                O.bodies[k].state.vel = (0, 0, 0)

    def lift(self, speed: float) -> None:
        """Raise the funnel from now on (m/s)."""
        from yade import O

        for k in self.walls:
            O.bodies[k].state.vel = (0, 0, speed)

    def bottom(self) -> float:
        """Height of the outlet now, m; infinite once the funnel is taken away."""
        from yade import O

        if not self.walls:
            return inf
        return self.funnel.bottom + O.bodies[self.walls[0]].state.displ()[2]

    def take_away(self, gone: np.ndarray) -> None:
        """Take grains out of the scene ((n,) booleans)."""
        from yade import O

        if gone.any():
            for k in np.flatnonzero(gone):
                O.bodies.erase(self.bodies[k].id, True)
            self.bodies = [body for body, lost in zip(self.bodies, gone, strict=True) if not lost]
            self.grains, self.mass = self.grains[~gone], self.mass[~gone]

    def remove_funnel(self) -> None:
        """Take the funnel away: nothing touches it any more."""
        from yade import O

        self.shaker.dead = True
        for k in self.walls:
            O.bodies.erase(k)
        self.walls = []

    def run(self, steps: int) -> None:
        """Step on; where there is drag, it follows the speeds from some steps to the next."""
        if self.drag is None:
            self._steps(steps)
            return
        for done in range(0, steps, STEPS_BETWEEN_DRAGS):
            self._brake()
            self._steps(min(STEPS_BETWEEN_DRAGS, steps - done))

    def _brake(self) -> None:
        """Put on every grain the force of the air at its present speed (YADE's DragEngine has one coefficient for all)."""
        from yade import O

        velocities = np.array([tuple(body.state.vel) for body in self.bodies]).reshape(-1, 3)
        per_speed = self.drag(2 * self.grains, np.linalg.norm(velocities, axis=1))
        for body, force in zip(self.bodies, (-per_speed[:, None] * velocities).tolist(), strict=True):
            O.forces.setPermF(body.id, force)

    def _steps(self, steps: int) -> None:
        """Steps of YADE."""
        from yade import O

        if self.contacts.born is None:
            O.run(steps)
            while O.running:  # O.run(steps, True) looks every 40 ms only
                time.sleep(LOOKS_EVERY)
            return
        for _ in range(steps):
            self.step()

    def centres(self) -> np.ndarray:
        """(n, 3) array, m."""
        return np.array([tuple(body.state.pos) for body in self.bodies])

    def kinetic_energy(self) -> float:
        """Of translation, J. A grain may spin on its place for ever: no law here resists twist."""
        return float(0.5 * self.mass @ [body.state.vel.squaredNorm() for body in self.bodies])

    def largest_speed(self) -> float:
        """m/s."""
        return float(np.sqrt(np.max([body.state.vel.squaredNorm() for body in self.bodies])))

    def largest_overlap(self) -> float:
        """In the mean radius."""
        from yade import O

        return max((contact.geom.penetrationDepth for contact in O.interactions), default=0.0) / self.mean_radius
