"""Contact laws: materials and functors, and the surface energy translated into each law's parameter.

Surface energy Gamma is the JKR surface energy of the source paper (as EDEM uses it, the work of adhesion): each law
gets the parameter that gives the same pull-off force F = 3/2 pi Gamma R*, with 1/R* = 1/R1 + 1/R2 and R* = R on a
plane (Johnson, Kendall & Roberts 1971, doi:10.1098/rspa.1971.0141).

Planes are YADE boxes. Ig2_Box_Sphere_* gives the box the sphere's radius, so YADE's Mindlin law takes R* = R/2 there;
the laws below make up for it, in the moduli where the particles meet nothing but planes, in the adhesion always.
"""

from collections.abc import Callable
from functools import cache
from math import atan, exp, log, pi, sqrt
from typing import NamedTuple

import numpy as np

from yade_scripts.case import Failed

NOT_COHESIVE = (
    "hertz_mindlin is not offered for cohesive powder: its damper doubles the pull-off force at 5 cm/s and makes grains stick "
    "at 1 m/s; use cohesive_frictional"
)
SWITCH = 1e-12  # J/m2, far below any weight: keeps YADE's adhesive branch on, see hertz_mindlin
ALONE, WALLS = 1, 16  # groups of bodies: of particles and walls; of walls alone, where particles do not meet each other
FIXED_BITS = 5  # by which a group's number is shifted to that of its grains that never move
FIXED = 0b1111 << FIXED_BITS  # all of those
PARTICLE, WALL = 0, 1  # numbers of the materials in YADE, see Contacts.enter


class Material(NamedTuple):
    """An elastic solid: density (kg/m3), shear modulus (Pa), Poisson ratio."""

    density: float
    shear_modulus: float
    poisson_ratio: float

    @property
    def young(self) -> float:
        """E = 2 G (1 + nu), Pa."""
        return 2 * self.shear_modulus * (1 + self.poisson_ratio)


class Pair(NamedTuple):
    """What two materials do to each other at a contact."""

    restitution: float  # e, 0.05 to 0.95
    static_friction: float  # mu = tan(friction angle)
    rolling_friction: float  # mu_r = rolling moment / (radius x normal force)
    surface_energy: float = 0.0  # Gamma, J/m2


class Layer(NamedTuple):
    """A sphere inside a grain, concentric with it, that meets those of its own group only."""

    material: object
    group: int  # a power of 2
    inset: float = 0.0  # its radius is the grain's less this, m


class Contacts(NamedTuple):
    """Materials for the bodies, functors for the interaction loop, damping for the integrator.

    `born` is what must be set on each new contact before its second step, where a functor cannot say it; a scene steps
    with `yade_scripts/stepping.py`, which does. None where the functors say all. Where a grain has `layers`, the particle's
    sphere meets the walls only, and the layers make the contacts between grains.
    """

    particle: object
    wall: object
    geometry: list
    physics: list
    law: list
    damping: float
    born: Callable | None = None
    layers: tuple[Layer, ...] = ()
    looks_every: int = 1  # steps between looks for what is born
    tended: Callable | None = None  # called after each of these looks

    def enter(self) -> None:
        """Give the materials to YADE, after O.reset(): the particle's number is PARTICLE, the wall's WALL."""
        from yade import O

        O.materials.append(self.particle)
        O.materials.append(self.wall)

    def collide(self, collider) -> None:
        """Tell a collider which spheres do not meet their like: fixed ones, and where there are layers the particles'."""
        collider.avoidSelfInteractionMask = (ALONE if self.layers else 0) | FIXED

    @property
    def wall_mask(self) -> int:
        """Groups of a wall: it meets the particles, whose group is ALONE."""
        return ALONE | WALLS if self.layers else ALONE

    def grain(self, place, radius: float):
        """Add a grain at rest (m, m): the body that moves, a clump where it has layers, and the number of its own sphere."""
        from yade import O

        whole = _sphere(place, radius, self.particle, ALONE)
        if not self.layers:
            number = O.bodies.append(whole)
            return O.bodies[number], number
        inner = [_sphere(place, radius - layer.inset, layer.material, layer.group) for layer in self.layers]
        clump, members = O.bodies.appendClumped([whole, *inner], discretization=0)
        return O.bodies[clump], members[0]

    def fixed_grain(self, place, radius: float) -> None:
        """Add a grain that never moves and meets the moving ones alone (m, m)."""
        from yade import O

        for layer in self.layers or (Layer(self.particle, ALONE),):
            group = layer.group | layer.group << FIXED_BITS
            O.bodies.append(_sphere(place, radius - layer.inset, layer.material, group, fixed=True))


def _sphere(place, radius: float, material, group: int, fixed: bool = False):
    from yade import utils

    return utils.sphere(tuple(map(float, place)), radius, material=material, color=(1, 1, 1), mask=group, fixed=fixed)


def rayleigh_step(radius: float, material: Material) -> float:
    """Rayleigh time step pi R sqrt(rho/G) / (0.1631 nu + 0.8766) of a sphere, s.

    Radius in m. Source: Thornton & Randall 1988, as printed in the EDEM and YADE manuals.
    """
    return pi * radius * sqrt(material.density / material.shear_modulus) / (0.1631 * material.poisson_ratio + 0.8766)


def pull_off_force(surface_energy: float, effective_radius: float) -> float:
    """JKR pull-off force 3/2 pi Gamma R*, N (Gamma in J/m2, R* in m)."""
    return 1.5 * pi * surface_energy * effective_radius


def damping_of(restitution: float) -> float:
    """Local damping d = (1 - e^2)/(1 + e^2) that gives an elastic linear contact the restitution e."""
    return (1 - restitution**2) / (1 + restitution**2)


@cache
def _restitution_table() -> tuple[np.ndarray, np.ndarray]:
    """Restitution against damping ratio of x'' = -x^(3/2) - 2 beta sqrt(3/2) x^(1/4) x', damper off where it would pull."""
    ratio = np.geomspace(1e-3, 30, 160)
    strength = 2 * ratio * sqrt(1.5)
    step = 4e-4
    overlap, speed = np.full(ratio.shape, 1e-9), np.ones(ratio.shape)
    restitution = np.full(ratio.shape, np.nan)
    while np.isnan(restitution).any():
        elastic = overlap**1.5
        damper = strength * overlap**0.25
        pulls = elastic + damper * speed < 0
        speed = speed - step * elastic
        speed = np.where(pulls, speed, speed / (1 + step * damper))
        overlap = overlap + step * speed
        left = (overlap <= 0) & np.isnan(restitution)
        restitution[left] = -speed[left]
        overlap = np.maximum(overlap, 0)
    return restitution[::-1], np.log(ratio[::-1])


def damping_ratio(restitution: float) -> float:
    """Damping ratio beta (YADE's betan) of a Hertz contact with the given coefficient of restitution.

    The contact force is kno x^(3/2) + 2 beta sqrt(m kn) x', kn = 3/2 kno x^(1/2), its damper off while it would pull:
    restitution depends on beta alone, not on size, stiffness or speed. Inverted numerically; 0.05 <= e <= 0.95.

    Raises
    ------
    ValueError : outside 0.05 to 0.95
    """
    if not 0.05 <= restitution <= 0.95:
        raise ValueError(f"restitution {restitution:g}: the law covers 0.05 to 0.95")
    return exp(np.interp(restitution, *_restitution_table()))


def tangential_damping_ratio(restitution: float) -> float:
    """Damping ratio along the contact (YADE's betas): -ln e / sqrt(pi^2 + ln^2 e) of a linear spring, at most 0.1.

    YADE adds the tangential damper to the elastic part without holding their sum to Coulomb's limit. Under a strong
    normal damper (e = 0.05) a ratio of 0.2 already brakes for good a contact that should slide: a seed with mu = 0.3
    then creeps at 17.2 deg instead of sliding off. 0.1 leaves Coulomb's threshold exact down to e = 0.05.
    """
    return min(0.1, -log(restitution) / sqrt(pi**2 + log(restitution) ** 2))


def hertz_mindlin(
    particle: Material,
    wall: Material,
    particle_wall: Pair,
    particle_particle: Pair | None = None,
    rolling_stiffness: float = 0.0,
    cohesive: bool = False,
) -> Contacts:
    """Hertz-Mindlin with a viscous damper, rolling moment mu_r R |Fn| and DMT adhesion.

    DMT pull-off in YADE is 4 pi gamma R*; equal to the JKR one for gamma = 3/8 Gamma (3/4 Gamma on a box).

    YADE's law has two rules for a damper that would pull. Without adhesion it sets the normal force to zero and then
    forgets to limit the rolling moment, so that a stiff rolling spring brakes every bounce; with adhesion it caps the
    damper at the pull-off force. A vanishing surface energy (`SWITCH`) selects the second rule always: the rolling
    limit holds at every step, and nothing jumps where the surface energy becomes positive.

    Parameters
    ----------
    particle_particle : None where a single particle or clump meets the walls only
    rolling_stiffness : stiffness of the rolling moment below its limit, N m/rad
    cohesive : whether particles may stick to each other all the same, as where the law itself is checked

    Raises
    ------
    Failed : they would, `NOT_COHESIVE`
    """
    if particle_particle and particle_particle.surface_energy > 0 and not cohesive:
        raise Failed(NOT_COHESIVE)
    import yade
    from yade import (
        FrictMat,
        Ig2_Box_Sphere_ScGeom,
        Ig2_Facet_Sphere_ScGeom,
        Ig2_Sphere_Sphere_ScGeom,
        Ip2_FrictMat_FrictMat_MindlinPhys,
        Law2_ScGeom_MindlinPhys_Mindlin,
    )

    alone = particle_particle is None
    rolls = any(pair.rolling_friction > 0 for pair in (particle_wall, particle_particle) if pair)
    stiffer = sqrt(2) if alone else 1.0  # R* = R/2 enters the stiffness as its root
    kind, born = FrictMat, None
    if alone or hasattr(yade, "PartialSatMat"):
        physics = [_mindlin(Ip2_FrictMat_FrictMat_MindlinPhys, particle_wall, 0.75, rolling_stiffness)]
    if not alone and hasattr(yade, "PartialSatMat"):
        kind = yade.PartialSatMat  # a class of its own, so that each pair of materials finds its own functor
        functor = yade.Ip2_PartialSatMat_PartialSatMat_MindlinPhys
        physics.append(_mindlin(functor, particle_particle, 0.375, rolling_stiffness))
    elif not alone:
        physics, born = _both_pairs(particle_particle, particle_wall, rolling_stiffness)
    return Contacts(
        kind(density=particle.density, young=stiffer * particle.young, poisson=particle.poisson_ratio),
        FrictMat(density=wall.density, young=stiffer * wall.young, poisson=wall.poisson_ratio),
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom()],
        physics,
        [Law2_ScGeom_MindlinPhys_Mindlin(includeMoment=rolls, includeAdhesion=True)],
        damping=0.0,
        born=born,
    )


def _both_pairs(particles: Pair, walls: Pair, rolling_stiffness: float) -> tuple[list, Callable]:
    """Both pairs in one Mindlin functor, for a YADE without a second class of material that has one.

    Damping and friction go by the materials' numbers. Rolling stiffness and limit and the pull-off force are plain
    numbers of the functor: each contact gets its own after its first step, in which it has no moment yet, and the adhesion
    of the less sticky pair.
    """
    from yade import Ip2_FrictMat_FrictMat_MindlinPhys, MatchMaker, O

    def of_pair(constant: Callable[[Pair], float]):
        one, other = constant(particles), constant(walls)
        return MatchMaker(matches=[(PARTICLE, PARTICLE, one), (PARTICLE, WALL, other)], algo="val", val=other)

    functor = _mindlin(Ip2_FrictMat_FrictMat_MindlinPhys, walls, 0.75, rolling_stiffness)
    functor.betan = of_pair(lambda pair: damping_ratio(pair.restitution))
    functor.betas = of_pair(lambda pair: tangential_damping_ratio(pair.restitution))
    functor.frictAngle = of_pair(lambda pair: atan(pair.static_friction))
    gamma = [max(share * pair.surface_energy, SWITCH) for share, pair in ((0.375, particles), (0.75, walls))]
    functor.gamma = min(gamma)

    def born(contact) -> None:
        numbers = (O.bodies[contact.id1].material.id, O.bodies[contact.id2].material.id)
        pair = walls if WALL in numbers else particles
        phys, one, other = contact.phys, contact.geom.refR1, contact.geom.refR2
        phys.kr = rolling_stiffness if pair.rolling_friction > 0 else 0.0
        phys.maxBendPl = pair.rolling_friction * (one + other) / 2
        phys.adhesionForce = 4 * pi * gamma[WALL in numbers] * one * other / (one + other)

    return [functor], born


def _mindlin(functor, pair: Pair, gamma_share: float, rolling_stiffness: float):
    """One Mindlin functor: per-pair constants; no rolling spring at all where mu_r = 0 (eta = 0 would mean elastic)."""
    from yade import MatchMaker

    return functor(
        betan=MatchMaker(algo="val", val=damping_ratio(pair.restitution)),
        betas=MatchMaker(algo="val", val=tangential_damping_ratio(pair.restitution)),
        frictAngle=MatchMaker(algo="val", val=atan(pair.static_friction)),
        eta=pair.rolling_friction,
        krot=rolling_stiffness if pair.rolling_friction > 0 else 0.0,
        gamma=max(gamma_share * pair.surface_energy, SWITCH),
    )


def cohesive_frictional_local_damping(
    particle: Material,
    wall: Material,
    particle_wall: Pair,
    particle_particle: Pair | None = None,
    rolling_stiffness: float = 0.0,
    radius: float = 0.0,
    damping: float = 0.0,
) -> Contacts:
    """Linear contact with friction, normal and shear cohesion and a rolling limit (CohFrictMat).

    Normal cohesion C = F / Rmin^2 with the JKR pull-off F, shear cohesion mu C, reformed at every new contact.
    The law has no damper: `particle_particle.restitution` has no meaning in it, and energy leaves through friction and
    the integrator's local `damping` alone, which acts on everything that moves.

    With `particle_particle` given, the walls keep their own restitution, friction and rolling friction: the particle
    pair is cohesive-frictional, the particle-wall pair Hertz-Mindlin, both in one loop. Without it (one clump on a
    plate) the particle-wall pair itself is cohesive-frictional.

    Parameters
    ----------
    rolling_stiffness : of the Mindlin walls, N m/rad
    radius : of the particles, m (the mean, where sizes are spread: the pull-off of a pair then scales with Rmin^2)
    damping : local damping, 0 to 1
    """
    from yade import (
        CohFrictMat,
        CohFrictPhys,
        FrictMat,
        Ig2_Box_Sphere_ScGeom6D,
        Ig2_Facet_Sphere_ScGeom6D,
        Ig2_Sphere_Sphere_ScGeom6D,
        Ip2_CohFrictMat_CohFrictMat_CohFrictPhys,
        Ip2_FrictMat_FrictMat_MindlinPhys,
        Law2_ScGeom6D_CohFrictPhys_CohesionMoment,
        Law2_ScGeom_MindlinPhys_Mindlin,
        MatchMaker,
    )

    alone = particle_particle is None
    pair = particle_wall if alone else particle_particle
    cohesion = pull_off_force(pair.surface_energy, radius if alone else radius / 2) / radius**2
    bonds_for_ever = CohFrictPhys().unpMax < 0  # of what is not fragile: from YADE 2025 on

    def cohesive(material: Material):
        return CohFrictMat(
            density=material.density,
            young=material.young,
            poisson=stiffness_ratio(material),
            frictionAngle=atan(pair.static_friction),
            isCohesive=cohesion > 0 or not bonds_for_ever,
            fragile=False,
            momentRotationLaw=True,
            alphaKr=0.5,
            alphaKtw=0.0,
            etaRoll=pair.rolling_friction,
            etaTwist=0.0,
            normalCohesion=0.0,
            shearCohesion=0.0,
        )

    def value(number: float):
        return MatchMaker(algo="val", val=number)

    functor = Ip2_CohFrictMat_CohFrictMat_CohFrictPhys(
        setCohesionOnNewContacts=True,
        normalCohesion=value(cohesion),
        shearCohesion=value(pair.static_friction * cohesion),
        frictAngle=value(atan(pair.static_friction)),
    )
    if hasattr(functor, "rollingCohesion"):  # from YADE 2025 on; by default they follow the shear cohesion
        functor.rollingCohesion = functor.twistingCohesion = value(0.0)
    physics = [functor]
    law = [Law2_ScGeom6D_CohFrictPhys_CohesionMoment(useIncrementalForm=True, always_use_moment_law=True)]
    wall_material = cohesive(wall)
    if not alone:
        wall_material = FrictMat(density=wall.density, young=_wall_modulus(particle, wall), poisson=wall.poisson_ratio)
        physics.append(_mindlin(Ip2_FrictMat_FrictMat_MindlinPhys, particle_wall, 0.75, rolling_stiffness))
        law.append(Law2_ScGeom_MindlinPhys_Mindlin(includeMoment=True, includeAdhesion=True))
    return Contacts(
        cohesive(particle),
        wall_material,
        [Ig2_Sphere_Sphere_ScGeom6D(), Ig2_Box_Sphere_ScGeom6D(), Ig2_Facet_Sphere_ScGeom6D()],
        physics,
        law,
        damping=damping,
        born=_break_at_pull_off if cohesion > 0 and bonds_for_ever else None,
    )


def _break_at_pull_off(contact) -> None:
    """Let a cohesive contact end at its pull-off force, as in YADE 2023.02a, where later ones would stretch for ever."""
    if hasattr(contact.phys, "unpMax"):
        contact.phys.unpMax = 0.0


def _wall_modulus(particle: Material, wall: Material) -> float:
    """Young's modulus of the wall that gives particle and wall the stiffness of Hertz's sphere on a plane, Pa.

    YADE's Mindlin functor reads the CohFrictMat's ks/kn as its Poisson ratio and takes R* = R/2; both are made up for.

    Raises
    ------
    ValueError : the particle alone is already softer than wanted
    """
    compliance = sum((1 - m.poisson_ratio**2) / m.young for m in (particle, wall)) / sqrt(2)
    left = compliance - (1 - stiffness_ratio(particle) ** 2) / particle.young
    if left <= 0:
        raise ValueError("the wall is too stiff against the particle for the cohesive-frictional law with steel walls")
    return (1 - wall.poisson_ratio**2) / left


def stiffness_ratio(material: Material) -> float:
    """ks/kn = 2 (1 - nu)/(2 - nu) of Mindlin's no-slip contact."""
    return 2 * (1 - material.poisson_ratio) / (2 - material.poisson_ratio)
