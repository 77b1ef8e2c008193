"""Cohesive-frictional grains that dissipate at the contact: every grain is a stack of concentric spheres.

No law of YADE has a damper that cannot pull, friction, rolling resistance and cohesion at once. Here each has a law of its
own, between spheres that meet only those of their layer; a clump sums the forces up. At an overlap x of two grains, with
k = E R the stiffness of the contact, F the JKR pull-off force and a the `adhesion_load`:

| layer | force | carries |
|---|---|---|
| elastic | (k/a) x; (k/a) x + F where the grains are attached | friction a mu and rolling friction a mu_r on its own force |
| attraction | -F where they are attached | cohesion |
| damper | max(0, (1 - 1/a) k x + c dx/dt), x > 0 | restitution |
| particle | Hertz-Mindlin with the walls only | the particle-wall pair |

Grains that are attached are held down to x = -a F/k, where the elastic layer is spent and F is the pull-off force. Under a load N
the elastic layer carries F + N/a, so that the limits are mu (N + a F) and mu_r R (N + a F); a = 2 is what Thornton & Yin 1991
(doi:10.1016/0032-5910(91)80178-L) derive for JKR contacts. The damper only pushes: it neither adds to the pull-off force nor
takes energy while the adhesion is overcome. To attach or not to attach makes no difference to the force while they touch.

To part takes the energy a F^2/(2 k), so that an impact at the speed v ends at sqrt(e^2 (v^2 + w) - w), w = a F^2/(k m*), and
grains stick up to sqrt(w (1 - e^2))/e. In grains as soft as simulated ones k is a thousandth of the powder's, and they
would stick at thirty times the speed. Softening must not do that (arXiv:1805.03025): grains that meet faster than the stiff
ones stick are attached only once their contact has lasted longer than any impact (ENDURING).

Nothing is damped outside contacts.
"""

from collections import deque
from functools import cache
from math import atan, hypot, pi, sqrt

import numpy as np

from yade_scripts.contacts import (
    Contacts,
    Layer,
    Material,
    Pair,
    hertz_mindlin,
    pull_off_force,
    stiffness_ratio,
)

ELASTIC, DAMPER, ATTRACTION = 2, 4, 8  # groups of bodies
BEFORE = 2  # places that a grain's elastic sphere stands before that of its attraction
ADHESION_LOAD = 2.0
THIN = 1e-6  # density of the layers beside the particle's, as a share of it
SOFT = 1e-3  # stiffness of the attraction, as a share of the contact's
MARK = 1e-14  # Pa, cohesion by which a contact of the attraction is known before it has its own; none to speak of
REFERENCE_STEP = 0.34  # times the contact's angular frequency: 0.09 of the Rayleigh step
MARGIN = 0.8  # share of a restitution that the strongest damper of a step must reach
PHASES = 16  # of the first step in a contact
ENDURING = 2 * pi  # time after which a contact is no impact, times its angular frequency
LOOKS_EVERY = 6  # steps between looks for new contacts, of which the shortest lasts ten


def rebound(ratio: float, share: float, step: float) -> np.ndarray:
    """Restitution of x'' = -(1 - share) x - max(0, share x + 2 beta x') in leapfrog steps, one for each phase of the first.

    The steps are YADE's: the damper reads the velocity half a step before the overlap. nan where it is not stable.

    Parameters
    ----------
    ratio : beta, damper over its critical value
    share : of the stiffness that the damper's spring has
    step : time step times the contact's angular frequency
    """
    overlap = (np.arange(PHASES) + 0.5) / PHASES * step
    speed, left = np.ones(PHASES), np.full(PHASES, np.nan)
    for _ in range(int(40 * (1 + ratio) / step)):
        speed = speed - step * ((1 - share) * overlap + np.maximum(0.0, share * overlap + 2 * ratio * speed))
        overlap = overlap + step * speed
        parted = (overlap <= 0) & np.isnan(left)
        left[parted] = -speed[parted]
        if not np.isnan(left).any():
            break
        speed[overlap <= 0] = overlap[overlap <= 0] = 0.0
    return left


@cache
def damping_ratio(restitution: float, share: float, step: float) -> float:
    """Damping ratio with which a contact has a restitution, in the mean over the phases, at a time step (as in `rebound`).

    Raises
    ------
    ValueError : the step is longer than half the stable one, where a stronger damper does not dissipate more
    """
    low, high = 1e-4, 0.5 * (1 / step - step)
    if rebound(high, share, step).mean() > restitution:
        raise ValueError(
            f"restitution {restitution:g}: the time step is too long for its damper; a smaller time_step_fraction is needed"
        )
    for _ in range(40):
        middle = sqrt(low * high)
        low, high = (middle, high) if rebound(middle, share, step).mean() > restitution else (low, middle)
    return sqrt(low * high)


def remainders(ratio: float, share: float, step: float, steps: int) -> np.ndarray:
    """sqrt(v^2 + (omega x)^2) over the speed of approach, 0, 1, ... steps after an impact's first, in leapfrog steps.

    The mean over the phases of the first step.

    Parameters
    ----------
    ratio, share, step : of the contact, as in `rebound`
    steps : up to which
    """
    overlap, speed, found = (np.arange(PHASES) + 0.5) / PHASES * step, np.ones(PHASES), []
    for _ in range(steps + 1):
        touching = overlap
        speed = speed - step * ((1 - share) * overlap + np.maximum(0.0, share * overlap + 2 * ratio * speed))
        overlap = overlap + step * speed
        found.append(np.mean(np.hypot(speed, touching)))
    return np.array(found)


@cache
def longest_step(restitution: float, share: float) -> float:
    """Longest step, times the contact's angular frequency, at which a damper can do with a margin what is asked of it.

    At half the stable step of the damped contact, 2 (sqrt(1 + beta^2) - beta) (Belytschko, Liu & Moran 2000,
    ISBN 978-0-471-98774-1), the strongest damper has a restitution that grows with the step; it must stay below MARGIN e.
    """
    low, high = 1e-3, 1.0
    for _ in range(30):
        middle = sqrt(low * high)
        strongest = rebound(0.5 * (1 / middle - middle), share, middle) if middle < 0.99 else np.ones(1)
        low, high = (low, middle) if not strongest.mean() <= MARGIN * restitution else (middle, high)
    return low


def step_share(restitution: float, adhesion_load: float = ADHESION_LOAD) -> float:
    """Share of the step of REFERENCE_STEP that a restitution leaves: at a = 2 it is 1 from 0.17 on, 0.88 at 0.15, 0.33 at 0.05."""
    return min(1.0, longest_step(restitution, 1 - 1 / adhesion_load) / REFERENCE_STEP)


def stiffness(radius: float, material: Material) -> float:
    """k = E R of two equal spheres, N/m."""
    return material.young * radius


def cohesive_frictional(
    particle: Material,
    wall: Material,
    particle_wall: Pair,
    particle_particle: Pair | None = None,
    rolling_stiffness: float = 0.0,
    radius: float = 0.0,
    time_step: float = 0.0,
    adhesion_load: float = ADHESION_LOAD,
    softness: float = 1.0,
) -> Contacts:
    """The layers of a grain, and the functors of all pairs; see the table above.

    Parameters
    ----------
    particle_particle : None where a single particle or clump meets the walls only: then the law is Hertz-Mindlin
    rolling_stiffness : of the walls' contacts below the limit, N m/rad
    radius : of the particles, m (the mean, where sizes are spread)
    time_step : s, for which the damper is made
    adhesion_load : a > 1, load that adhesion adds to both limits, in pull-off forces
    softness : modulus of the particle here over that of the powder, whose sticking speed is kept
    """
    if particle_particle is None:
        return hertz_mindlin(particle, wall, particle_wall, rolling_stiffness=rolling_stiffness)
    from yade import (
        CohFrictMat,
        Ig2_Box_Sphere_ScGeom6D,
        Ig2_Facet_Sphere_ScGeom6D,
        Ig2_Sphere_Sphere_ScGeom6D,
        Ip2_CohFrictMat_CohFrictMat_CohFrictPhys,
        Ip2_ViscElMat_ViscElMat_ViscElPhys,
        Law2_ScGeom6D_CohFrictPhys_CohesionMoment,
        Law2_ScGeom_ViscElPhys_Basic,
        ViscElMat,
    )

    pair, share = particle_particle, 1 - 1 / adhesion_load
    whole, half_mass = stiffness(radius, particle), 0.5 * particle.density * 4 / 3 * pi * radius**3
    frequency = sqrt(whole / half_mass)
    ratio = damping_ratio(pair.restitution, share, time_step * frequency)
    damper = 2 * ratio * sqrt(half_mass * whole)
    adhesive = pair.surface_energy > 0
    elastic = 1 / adhesion_load - (SOFT if adhesive else 0.0)  # share of the stiffness
    walls = hertz_mindlin(particle, wall, particle_wall, rolling_stiffness=rolling_stiffness)
    none = {"fragile": False, "isCohesive": False, "normalCohesion": 0.0, "shearCohesion": 0.0, "alphaKtw": 0.0}
    friction = CohFrictMat(
        density=THIN * particle.density,
        young=elastic * particle.young,
        poisson=stiffness_ratio(particle) / elastic,
        frictionAngle=atan(pair.static_friction / elastic),
        momentRotationLaw=True,
        alphaKr=0.5,
        etaRoll=pair.rolling_friction / elastic,
        etaTwist=0.0,
        **none,
    )
    viscous = ViscElMat(
        density=THIN * particle.density, kn=2 * share * whole, cn=2 * damper, ks=0.0, cs=0.0, frictionAngle=0.0
    )
    layers = [Layer(friction, ELASTIC), Layer(viscous, DAMPER)]
    if adhesive:
        sticky = none | {"fragile": True, "isCohesive": True, "normalCohesion": MARK, "shearCohesion": MARK}
        attraction = CohFrictMat(
            density=THIN * particle.density,
            young=SOFT * particle.young,
            poisson=0.0,
            frictionAngle=0.0,
            alphaKr=0.0,
            etaRoll=0.0,
            etaTwist=0.0,
            **sticky,
        )
        layers.append(Layer(attraction, ATTRACTION))

    attraction_of = None
    if adhesive:
        pull = pull_off_force(pair.surface_energy, radius / 2)
        well = adhesion_load * pull**2 * softness / (whole * half_mass)
        left = remainders(ratio, share, time_step * frequency, LOOKS_EVERY)
        attraction_of = Attraction(pair.surface_energy, sticking_speed(pair.restitution, well), frequency, left)

    return Contacts(
        walls.particle,
        walls.wall,
        [Ig2_Sphere_Sphere_ScGeom6D(), Ig2_Box_Sphere_ScGeom6D(), Ig2_Facet_Sphere_ScGeom6D()],
        [
            *walls.physics,
            Ip2_CohFrictMat_CohFrictMat_CohFrictPhys(setCohesionOnNewContacts=True),
            Ip2_ViscElMat_ViscElMat_ViscElPhys(),
        ],
        [
            *walls.law,
            Law2_ScGeom6D_CohFrictPhys_CohesionMoment(useIncrementalForm=True, always_use_moment_law=True),
            Law2_ScGeom_ViscElPhys_Basic(),
        ],
        damping=0.0,
        born=attraction_of and attraction_of.born,
        tended=attraction_of and attraction_of.tend,
        layers=tuple(layers),
        looks_every=LOOKS_EVERY,
    )


def sticking_speed(restitution: float, well: float) -> float:
    """Approach speed up to which two grains stick, sqrt(w (1 - e^2))/e, m/s.

    Parameters
    ----------
    restitution : e
    well : w = a F^2/(k m*), twice the energy of adhesion over the reduced mass, m2/s2
    """
    return sqrt(well * (1 - restitution**2)) / restitution


class Attraction:
    """Attaches grains that touch: at once where they meet slowly, else once their contact endures.

    Parameters
    ----------
    surface_energy : J/m2
    slow : speed up to which grains stick, m/s
    frequency : angular frequency of a contact, 1/s
    left : what is left of the speed of approach so many steps after the first, as in `remainders`
    """

    def __init__(self, surface_energy: float, slow: float, frequency: float, left: np.ndarray):
        self.surface_energy, self.slow, self.frequency, self.left = surface_energy, slow, frequency, left
        self._waiting: deque = deque()  # (when it is due, the step it was born in, contact), the first due first

    def born(self, contact) -> None:
        """Look at a contact that came into being since the last look."""
        if not getattr(contact.phys, "normalAdhesion", 0.0) > 0:  # of another layer
            return
        from yade import O

        if self._approach(contact) <= self.slow:
            self._attach(contact)
        else:
            self._waiting.append((O.time + ENDURING / self.frequency, contact.iterMadeReal, contact))

    def _approach(self, contact) -> float:
        """Speed at which two grains came to touch, m/s, from what is left of it and their overlap."""
        from yade import O

        states = [_moving(number) for number in (contact.id1, contact.id2)]
        now = sum(
            sign * state.vel.dot(contact.geom.normal) for sign, state in zip((1, -1), states, strict=True) if state
        )
        since = min(O.iter - contact.iterMadeReal - 1, len(self.left) - 1)
        return hypot(now, self.frequency * contact.geom.penetrationDepth) / self.left[since]

    def tend(self) -> None:
        """Look at the contacts that wait."""
        from yade import O

        while self._waiting and self._waiting[0][0] <= O.time:
            _, step, contact = self._waiting.popleft()
            here = all(O.bodies[number] for number in (contact.id1, contact.id2))  # not taken away meanwhile
            if here and contact.isReal and contact.iterMadeReal == step:
                self._attach(contact)

    def _attach(self, contact) -> None:
        """Move the origins of the attraction's soft spring and of the elastic one by opposite forces."""
        from yade import O

        geom, soft = contact.geom, contact.phys
        elastic = O.interactions[contact.id1 - BEFORE, contact.id2 - BEFORE].phys
        if elastic is None:  # parted at this very step
            return
        force = pull_off_force(self.surface_energy, geom.refR1 * geom.refR2 / (geom.refR1 + geom.refR2))
        soft.unp = force / soft.kn
        soft.normalAdhesion = force * (1 + soft.kn / elastic.kn)  # ends where the elastic layer does
        elastic.unp = -force / elastic.kn


def _moving(number: int):
    """State of the grain that a sphere belongs to; None for one of a base."""
    from yade import O

    body = O.bodies[number]
    return O.bodies[body.clumpId].state if body.isClumpMember else None
