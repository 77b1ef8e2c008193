"""Two grains of a law that dissipates between grains, as soft as in a heap: what its checks share."""

from math import cos, sin, sqrt

from yade_scripts import contacts, laws, layered
from yade_scripts.case import Failed, quantity
from yade_scripts.checks import sphere_scene
from yade_scripts.checks.sphere_scene import POWDER, STEEL
from yade_scripts.contacts import Pair

CONTACT_LAWS = (laws.COHESIVE_FRICTIONAL,)
PARAMETERS = (
    sphere_scene.RESTITUTION
    | {"surface_energy_j_m2": quantity(0.0, 0.0, 1.0, "J/m2", "JKR surface energy asked of the pair")}
    | {
        "adhesion_load": quantity(
            layered.ADHESION_LOAD, 1.1, 5.0, "1", "load of adhesion in both limits, pull-off forces"
        )
    }
)
RADIUS = {"radius_mm": quantity(1.294, 0.05, 5.0, "mm", "radius of the grains")}
NUMERICS = {
    "time_step_fraction": quantity(0.09, 0.002, 0.25, "1", "of the Rayleigh step, cut further where e < 0.3"),
    "stiffness_scale": quantity(1e-3, 1e-5, 1.0, "1", "of both moduli"),
}
PHASES = [(k + 0.5) / 8 for k in range(8)]  # of the first step in a contact, over which a reading is a mean
MOST_STEPS = 40_000
WALLS = Pair(0.5, 0.3, 0.1)


class Grains:
    """The law of a case, and what its closed forms need (SI)."""

    def __init__(self, case: dict, friction: float = 0.8, rolling: float = 0.35, walls: Pair = WALLS):
        given, numerics = case["parameters"], case["numerics"]
        self.radius = 1e-3 * case["conditions"]["radius_mm"]
        self.softness = softer = numerics["stiffness_scale"]
        powder, steel = (m._replace(shear_modulus=softer * m.shear_modulus) for m in (POWDER, STEEL))
        self.restitution, self.load = given["restitution"], given["adhesion_load"]
        self.pull = contacts.pull_off_force(given["surface_energy_j_m2"], self.radius / 2)
        self.stiffness = layered.stiffness(self.radius, powder)
        self.reduced_mass = 0.5 * sphere_scene.sphere_mass(self.radius, powder)
        self.rayleigh = contacts.rayleigh_step(self.radius, powder)
        self.time_step = numerics["time_step_fraction"] * self.rayleigh
        self.time_step *= layered.step_share(self.restitution, self.load)
        self._materials, self._pair = (
            (powder, steel),
            Pair(self.restitution, friction, rolling, given["surface_energy_j_m2"]),
        )
        self._walls = walls

    def law(self) -> contacts.Contacts:
        """Asked for inside YADE."""
        spring = 0.1 * sphere_scene.sphere_inertia(self.radius, self._materials[0]) / self.time_step**2
        return laws.LAWS[laws.COHESIVE_FRICTIONAL](
            *self._materials, self._walls, self._pair, rolling_stiffness=spring, radius=self.radius,
            time_step=self.time_step, adhesion_load=self.load, softness=self.softness,
        )  # fmt: skip

    @property
    def reach(self) -> float:
        """Distance at which grains that are attached part, m."""
        return -self.at_load(-self.pull)

    @property
    def lost(self) -> float:
        """w = a F^2/(k m*) of stiff grains, twice the energy of adhesion over the reduced mass, m2/s2."""
        return self.softness * self.load * self.pull**2 / (self.stiffness * self.reduced_mass)

    def expected_restitution(self, speed: float) -> float:
        """sqrt(e^2 (v^2 + w) - w)/v, or 0 where that is none."""
        return sqrt(max(0.0, self.restitution**2 * (speed**2 + self.lost) - self.lost)) / speed

    @property
    def sticking_speed(self) -> float:
        """Below it two grains stick, m/s."""
        return layered.sticking_speed(self.restitution, self.lost)

    def limit(self, coefficient: float, force: float) -> float:
        """mu (N + a F) of either limit under a load, and a mu (N + F) in tension, where it ends with the contact, N."""
        carried = force + self.load * self.pull if force >= 0 else self.load * (force + self.pull)
        return coefficient * carried

    def at_load(self, force: float) -> float:
        """Overlap at which the contact carries a normal force (compression positive), m."""
        return force / (self.stiffness if force >= 0 else self.stiffness / self.load)


def impact(grains: Grains, speed: float, phase: float = 0.5, plate: bool = False) -> float:
    """Relative speed after over before of two grains head on (or a grain and the plate), 0 where they stick."""
    scene = sphere_scene.Scene(grains.law(), grains.time_step)
    radius, gap = grains.radius, phase * speed * grains.time_step
    if plate:
        scene.plate()
        one, two = scene.sphere(radius, (0, 0, radius + gap), (0, 0, -speed)).state, None
    else:
        one = scene.sphere(radius, (0, 0, radius + gap), (0, 0, -speed / 2)).state
        two = scene.sphere(radius, (0, 0, -radius), (0, 0, speed / 2)).state
    for _ in range(MOST_STEPS):
        scene.step()
        distance = one.pos[2] - radius if plate else one.pos[2] - two.pos[2] - 2 * radius
        approach = one.vel[2] - (0 if plate else two.vel[2])
        if distance > grains.reach and approach > 0:
            return approach / speed
    return 0.0


def energy_gained(grains: Grains, speed: float, angle: float, spin: float) -> float:
    """Kinetic energy after over before, less 1, of two spinning grains that meet at an angle (rad); 0 where none is gained."""
    scene = sphere_scene.Scene(grains.law(), grains.time_step)
    radius = grains.radius
    one = scene.sphere(radius, (0, 0, 2 * radius), (speed * sin(angle), 0, -speed * cos(angle)), (0, spin, 0)).state
    two = scene.sphere(radius, (0, 0, 0), spin=(0, spin, 0)).state
    mass, inertia = 2 * grains.reduced_mass, 0.8 * grains.reduced_mass * radius**2

    def energy() -> float:
        return sum(0.5 * mass * s.vel.squaredNorm() + 0.5 * inertia * s.angVel.squaredNorm() for s in (one, two))

    start, most = energy(), 0.0
    for _ in range(MOST_STEPS):
        scene.step()
        most = max(most, energy())
        if (one.pos - two.pos).norm() > 2 * radius + grains.reach and (one.vel - two.vel).dot(one.pos - two.pos) > 0:
            break
    attraction = grains.load * grains.pull**2 / (2 * grains.stiffness)  # that the contact may give and takes back
    return max(0.0, (most - attraction) / start - 1)


def attached(grains: Grains):
    """A scene with two grains whose places and turns are given, after their contact has endured: (scene, upper, lower)."""
    from yade import O

    scene = sphere_scene.Scene(grains.law(), grains.time_step)
    place = 2 * grains.radius - grains.at_load(grains.pull or 1e-4)
    bodies = [scene.sphere(grains.radius, (0, 0, z), blocked="xyzXYZ") for z in (place, 0)]
    while O.time < 2 * layered.ENDURING * sqrt(grains.reduced_mass / grains.stiffness):
        scene.step()
    return scene, *bodies


def pull_off(grains: Grains, speed: float) -> float:
    """Largest tension (N) while two grains at rest on each other are drawn apart at a constant speed."""
    from yade import O

    scene, body, _ = attached(grains)
    tension, apart = 0.0, 2 * (2 * grains.radius - grains.at_load(-grains.pull)) - 2 * grains.radius
    fastest = (
        -0.05 * grains.at_load(-grains.pull) / grains.time_step
    )  # the force falls by that share between two readings
    if speed > fastest:
        raise Failed(f"too fast for the time step: {speed:g} m/s, expected less than {fastest:.2g}")
    body.state.vel = (0, 0, speed)
    while body.state.pos[2] < apart:
        scene.step()
        tension = max(tension, -O.forces.f(body.id, True)[2])
    return tension


def limits(grains: Grains, load: float) -> tuple[float, float]:
    """Tangential force (N) of two grains that slide on each other, and moment over radius (N) of two that roll, under a load.

    Both turn in their places: in the same sense they slide, in opposite ones they roll.
    """
    from yade import O

    read, radius, steps = [], grains.radius, 3000
    overlap = grains.at_load(load)
    lever = radius - 0.5 * overlap
    speed = (
        20 * max(abs(overlap), grains.pull / grains.stiffness, 1e-3 * radius) / (steps * grains.time_step)
    )  # far beyond what the springs give
    for sense in (1, -1):
        scene, body, other = attached(grains)
        body.state.pos = (0, 0, 2 * radius - overlap)
        body.state.angVel, other.state.angVel = (0, speed / lever, 0), (0, sense * speed / lever, 0)
        for _ in range(steps):
            scene.step()
        force, moment = O.forces.f(body.id, True), O.forces.t(body.id, True)
        read.append(abs(force[0]) if sense == 1 else abs(moment[1] + lever * force[0]) / radius)
    return read[0], read[1]
