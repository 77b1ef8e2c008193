"""Spheres and a level plate: what the checks share, and how each reads one property of a contact.

A reading looks at motion or at the forces on a body, never at what a contact law stores.
"""

from math import cos, hypot, inf, pi, sin, sqrt, tan

from yade_scripts import contacts, laws, stepping
from yade_scripts.case import Failed, quantity
from yade_scripts.contacts import Material, Pair

GRAVITY = 9.81  # m/s2
CONTACT_LAWS = (laws.HERTZ_MINDLIN, laws.LOCAL_DAMPING)
SEED = Material(1250.0, 1.02e7, 0.4)  # source paper, Table 1
POWDER = Material(1833.0, 3e7, 0.296)  # source paper, Table 1
STEEL = Material(7850.0, 7.9e10, 0.3)  # handbook values

RESTITUTION = {"restitution": quantity(0.5, 0.05, 0.95, "1", "asked of the pair")}
STATIC_FRICTION = {"static_friction": quantity(0.5, 0.0, 1.5, "1", "asked of the pair")}
ROLLING_FRICTION = {"rolling_friction": quantity(0.05, 0.0, 1.0, "1", "asked of the pair")}
SURFACE_ENERGY = {"surface_energy_j_m2": quantity(0.0, 0.0, 1.0, "J/m2", "JKR surface energy asked of the pair")}
DAMPING = {
    "cohesive_frictional_damping": quantity(0.3, 0.0, 0.9, "1", "local damping; not used by hertz_mindlin"),
}
RADIUS = {"radius_mm": quantity(0.5, 0.05, 5.0, "mm", "radius of the sphere")}
SPEED = {"speed_m_s": quantity(1.0, 0.01, 10.0, "m/s", "speed of the impact")}
ROLLING_SPRING = {
    "rolling_spring": quantity(0.02, 1e-5, 0.5, "1", "stiffness of the rolling moment below its limit, in I/dt^2"),
}


def time_step_fraction(default: float) -> dict:
    """Declaration of the time step."""
    return {"time_step_fraction": quantity(default, 0.002, 0.25, "1", "of the Rayleigh step of the sphere")}


def sphere_mass(radius: float, material: Material) -> float:
    """Mass of a sphere 4/3 pi R^3 rho, kg."""
    return 4 / 3 * pi * radius**3 * material.density


def sphere_inertia(radius: float, material: Material) -> float:
    """Moment of inertia of a sphere 2/5 m R^2, kg m2."""
    return 0.4 * sphere_mass(radius, material) * radius**2


def effective_modulus(first: Material, second: Material) -> float:
    """E* with 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2, Pa (Hertz 1882)."""
    return 1 / sum((1 - m.poisson_ratio**2) / m.young for m in (first, second))


def hertz_force(overlap: float, effective_radius: float, modulus: float) -> float:
    """Hertz force 4/3 E* R*^(1/2) overlap^(3/2), N (m, m, Pa)."""
    return 4 / 3 * modulus * effective_radius**0.5 * overlap**1.5


def linear_stiffness(radius: float, first: Material, second: Material) -> float:
    """Stiffness 2 E1 R E2 R / (E1 R + E2 R) of the cohesive-frictional law, N/m (YADE manual, Ip2_CohFrictMat)."""
    return 2 * first.young * second.young * radius / (first.young + second.young)


def weight_overlap(case: dict, radius: float, particle: Material, plate: Material) -> float:
    """Overlap at which a sphere on the plate carries its own weight, m."""
    weight = sphere_mass(radius, particle) * GRAVITY
    if case["contact_law"] == laws.LOCAL_DAMPING:
        return weight / linear_stiffness(radius, particle, plate)
    return (weight / hertz_force(1.0, radius, effective_modulus(particle, plate))) ** (2 / 3)


def damped_restitution(ratio: float, steps: int = 4000) -> float:
    """Restitution of x'' = -x^(3/2) - 2 beta (3/2)^(1/2) x^(1/4) x', the damper off while the sum would pull.

    The Hertz contact of Tsuji, Tanaka & Ishida 1992 (doi:10.1016/0032-5910(92)88030-L) in units of the impact, by
    the classical Runge-Kutta method; `ratio` is beta. n contacts at once act as one with the ratio n^(1/2) beta.
    """
    strength = 2 * ratio * sqrt(1.5)

    def force(x: float, v: float) -> float:
        x = max(x, 0.0)
        elastic, damper = x**1.5, strength * x**0.25 * v
        return -elastic if elastic + damper < 0 else -elastic - damper

    x, v = 0.0, 1.0
    h = 4.0 / steps / (1 + strength)
    while x > 0 or v > 0:
        k1, l1 = v, force(x, v)
        k2, l2 = v + h / 2 * l1, force(x + h / 2 * k1, v + h / 2 * l1)
        k3, l3 = v + h / 2 * l2, force(x + h / 2 * k2, v + h / 2 * l2)
        k4, l4 = v + h * l3, force(x + h * k3, v + h * l3)
        x, v = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), v + h / 6 * (l1 + 2 * l2 + 2 * l3 + l4)
    return -v


def local_damping_restitution(damping: float) -> float:
    """Restitution sqrt((1 - d)/(1 + d)) that YADE's local damping d gives a linear contact."""
    return sqrt((1 - damping) / (1 + damping))


def pair_of(case: dict, prefix: str = "") -> Pair:
    """The contact parameters a case asks for; without friction and adhesion where its rig declares none."""
    given = case["parameters"]
    absent = {"restitution": 0.5, "static_friction": 0.0, "rolling_friction": 0.0, "surface_energy_j_m2": 0.0}
    return Pair(*(given.get(prefix + name, value) for name, value in absent.items()))


def one_pair(case: dict, radius: float, particle: Material = SEED, plate: Material = POWDER):
    """Time step (s) and contact law of a sphere that meets nothing but the plate."""
    numerics = case["numerics"]
    step = numerics["time_step_fraction"] * contacts.rayleigh_step(radius, particle)
    spring = numerics.get("rolling_spring", 0.02) * sphere_inertia(radius, particle) / step**2
    options = {"rolling_stiffness": spring}
    if case["contact_law"] == laws.LOCAL_DAMPING:
        options |= {"radius": radius, "damping": case["parameters"]["cohesive_frictional_damping"]}
    return step, laws.LAWS[case["contact_law"]](particle, plate, pair_of(case), **options)


class Scene:
    """A YADE scene for spheres and a plate with its surface at z = 0."""

    def __init__(self, law: contacts.Contacts, time_step: float, gravity=(0.0, 0.0, 0.0)):
        from yade import (
            Bo1_Box_Aabb,
            Bo1_Sphere_Aabb,
            ForceResetter,
            InsertionSortCollider,
            InteractionLoop,
            NewtonIntegrator,
            O,
        )

        O.reset()
        law.enter()
        self.law = law
        self.step = stepping.single(law)
        self.newton = NewtonIntegrator(damping=law.damping, gravity=gravity, exactAsphericalRot=True)
        collider = InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()], verletDist=1e-5, targetInterv=-1)
        law.collide(collider)
        O.engines = [
            ForceResetter(),
            collider,
            InteractionLoop(law.geometry, law.physics, law.law),
            self.newton,
        ]
        O.dt = time_step

    def sphere(self, radius: float, position, velocity=(0, 0, 0), spin=(0, 0, 0), blocked: str = ""):
        """Add a sphere; blocked directions move at the given velocity and spin whatever pushes."""
        body, _ = self.law.grain(position, radius)
        body.state.blockedDOFs = blocked
        body.state.vel, body.state.angVel = velocity, spin
        return body

    def plate(self) -> None:
        """Add the plate, 20 x 20 m."""
        from yade import O, utils

        O.bodies.append(
            utils.box(
                (0, 0, -0.005),
                (10, 10, 0.005),
                fixed=True,
                material=self.law.wall,
                color=(1, 1, 1),
                mask=self.law.wall_mask,
            )
        )


def bounce(law, time_step: float, radius: float, speed: float, plate: bool = True) -> dict:
    """A sphere hits the plate, or two spheres each other, head on without gravity.

    Returns
    -------
    restitution : relative speed after over before
    contact_time_s, largest_overlap_m
    """

    scene = Scene(law, time_step)
    gap = 0.5 * speed * time_step
    if plate:
        scene.plate()
        one, two = scene.sphere(radius, (0, 0, radius + gap), (0, 0, -speed)).state, None
    else:
        one = scene.sphere(radius, (0, 0, radius + gap), (0, 0, -speed / 2)).state
        two = scene.sphere(radius, (0, 0, -radius), (0, 0, speed / 2)).state
    overlap, steps = 0.0, 0
    while True:
        scene.step()
        steps += 1
        distance = one.pos[2] - radius if plate else one.pos[2] - two.pos[2] - 2 * radius
        approach = one.vel[2] if plate else one.vel[2] - two.vel[2]
        overlap = max(overlap, -distance)
        if distance > 0 and approach > 0:
            free = distance / approach  # time since the surfaces parted
            return {
                "restitution": approach / speed,
                "contact_time_s": steps * time_step - gap / speed - free,
                "largest_overlap_m": overlap,
            }
        if steps > 50_000:
            if abs(approach) > 1e-3 * speed:
                raise Failed("the contact does not end")
            return {"restitution": 0.0, "contact_time_s": inf, "largest_overlap_m": overlap}  # it sticks


def normal_force(law, time_step: float, radius: float, overlap: float) -> float:
    """Force (N) on a sphere held at rest at an overlap (m) with the plate."""
    from yade import O

    scene = Scene(law, time_step)
    scene.plate()
    body = scene.sphere(radius, (0, 0, radius - overlap), blocked="xyzXYZ")
    scene.step()
    return O.forces.f(body.id)[2]


def slope_friction(law, time_step: float, radius: float, overlap: float, slope: float) -> float:
    """Friction coefficient tan(slope) - a/(g cos(slope)) of a sphere that slides down a slope without rolling."""

    scene = Scene(law, time_step, (GRAVITY * sin(slope), 0, -GRAVITY * cos(slope)))
    scene.plate()
    state = scene.sphere(radius, (0, 0, radius - overlap), blocked="XYZ").state
    for _ in range(4000):  # until the start has died down
        scene.step()
    speed, steps = state.vel[0], 20_000
    for _ in range(steps):
        scene.step()
    return tan(slope) - (state.vel[0] - speed) / (steps * time_step) / (GRAVITY * cos(slope))


def slip_angle(law, time_step: float, radius: float, overlap: float, bracket: float = 0.0015) -> float:
    """Tilt (rad) at which a sphere that cannot roll starts to slide, bisected between holding and sliding."""

    ramp, hold = 4000, 12_000  # steps

    def slides(angle: float) -> bool:
        scene = Scene(law, time_step, (0, 0, -GRAVITY))
        scene.plate()
        state = scene.sphere(radius, (0, 0, radius - overlap), blocked="XYZ").state
        for k in range(1, ramp + hold + 1):
            if k <= ramp and k % 10 == 0:
                tilt = angle * (0.5 - 0.5 * cos(pi * k / ramp))
                scene.newton.gravity = (GRAVITY * sin(tilt), 0, -GRAVITY * cos(tilt))
            scene.step()
            if k == ramp + hold // 2:
                half = state.pos[0]
        moved = state.pos[0] - half
        return moved > 0.001 * GRAVITY * (0.5 * hold * time_step) ** 2

    holds, slips = 0.0, 1.2
    while slips - holds > bracket:
        angle = 0.5 * (holds + slips)
        holds, slips = (holds, angle) if slides(angle) else (angle, slips)
    return 0.5 * (holds + slips)


def rolling_friction(
    law, time_step: float, radius: float, overlap: float, speed: float = 0.1, impact: float = 0.0
) -> float:
    """Rolling friction of a sphere that rolls on the plate, from the speed it loses.

    mu_r = (1 + I/(m R^2)) (v0 - v) / J with the normal impulse per mass J = g t + w0 + w (w0 the downward speed at the
    start, w the upward one at the end); while the sphere stays on the plate this is a = g mu_r / (1 + I/(m R^2)).

    Parameters
    ----------
    speed : m/s along the plate at the start, rolling
    impact : m/s downward at the start; 0 lays the sphere down at the overlap that carries its weight
    """

    scene = Scene(law, time_step, (0, 0, -GRAVITY))
    scene.plate()
    height = radius - overlap if impact == 0 else radius
    state = scene.sphere(radius, (0, 0, height), (speed, 0, -impact), (0, speed / radius, 0)).state
    skip = 2000 if impact == 0 else 0
    for _ in range(skip):
        scene.step()
    along, down = state.vel[0], -state.vel[2]
    steps = 20_000
    for _ in range(steps):
        scene.step()
    impulse = GRAVITY * steps * time_step + down + state.vel[2]
    rolling = (state.vel[0] + 0.4 * state.angVel[1] * radius) / 1.4  # speed once the spin has caught up
    return 1.4 * (along - rolling) / impulse


def pull_off(law, time_step: float, radius: float, other: float | None = None) -> float:
    """Largest tension (N) while a sphere is drawn slowly off the plate, or off a sphere of radius `other`."""
    from yade import O

    scene = Scene(law, time_step)
    overlap, end = 2e-6 * radius, 2e-4 * radius
    base = 0.0
    if other is None:
        scene.plate()
    else:
        scene.sphere(other, (0, 0, 0), blocked="xyzXYZ")
        base = other
    touch = base + radius
    body = scene.sphere(radius, (0, 0, touch - overlap), blocked="xyzXYZ")
    state, tension = body.state, 0.0
    while state.pos[2] < touch + end:
        distance = state.pos[2] - touch
        # slow where the force changes within very little; slower before the touch, where the damper pulls too
        steps = 3000 if distance < 0 else 300
        state.vel = (0, 0, max(abs(distance), 1e-9 * radius) / (steps * time_step))
        scene.step()
        tension = max(tension, -O.forces.f(body.id)[2])
    return tension


def pressed(law, time_step: float, radius: float, overlap: float, plate: bool = True, adhesion: float = 0.0) -> dict:
    """A sphere pressed on the plate (or on a second sphere) is dragged along, then rolled, at a constant overlap.

    Parameters
    ----------
    adhesion : N, added to the normal force that friction is proportional to (Derjaguin, Muller & Toporov 1975)

    Returns
    -------
    static_friction : tangential over normal force while it slides
    rolling_friction : moment over radius times normal force while it rolls
    """
    from yade import O

    lever = radius - 0.5 * overlap
    speed = 4 * overlap / (3000 * time_step)
    read = {}
    for motion in ("static_friction", "rolling_friction"):
        scene = Scene(law, time_step)
        spin = speed / lever if motion == "rolling_friction" else 0.0
        along = speed
        base = 0.0
        if plate:
            scene.plate()
        else:  # two spheres roll on each other by turning in opposite ways
            base = radius
            along = 0.0 if spin else speed
            scene.sphere(radius, (0, 0, 0), spin=(0, -spin, 0), blocked="xyzXYZ")
        centre = (0, 0, base + radius - overlap)
        body = scene.sphere(radius, centre, (along, 0, 0), (0, spin, 0), blocked="xyzXYZ")
        for _ in range(3000):
            scene.step()
        force, moment = O.forces.f(body.id), O.forces.t(body.id)
        if spin:  # less what the tangential force adds to the moment
            read[motion] = abs(moment[1] + lever * force[0]) / (radius * force[2])
        else:
            read[motion] = hypot(force[0], force[1]) / (force[2] + adhesion)
    return read
