"""One seed and its plate: what the three bench rigs share."""

from math import isfinite, sqrt

import numpy as np

from yade_scripts import contacts, laws, particles, stepping
from yade_scripts.acting import Effects
from yade_scripts.case import Failed, quantity

GRAVITY = 9.81  # m/s2
REFERENCE_RESTITUTION = 0.25
LONGEST_FLIGHT_STEP = 10.0  # of the time step at contact
STEPS_BETWEEN_FORCES = 10  # the effects' force on the centre of mass changes little meanwhile

TABLE_1 = "source paper, Table 1"
CONTACT_LAWS = (laws.HERTZ_MINDLIN, laws.COHESIVE_FRICTIONAL, laws.LOCAL_DAMPING)
PARAMETERS = {
    "seed_powder_restitution": {
        **quantity(0.25, 0.05, 0.95, "1", "restitution seed-powder, the paper's a1"),
        "caution": "of this law, not to be carried to another code: the damper takes the seed's whole mass, so that e holds for "
        "central impacts only (restitution_at in study.toml)",
    },
    "seed_powder_static_friction": quantity(0.0, 0.0, 1.5, "1", "static friction seed-powder, the paper's a2"),
    "seed_powder_rolling_friction": quantity(0.0, 0.0, 1.0, "1", "rolling friction seed-powder, the paper's a3"),
    "seed_density_kg_m3": quantity(1250.0, 500.0, 3000.0, "kg/m3", TABLE_1),
    "seed_shear_modulus_pa": quantity(1.02e7, 1e5, 1e10, "Pa", TABLE_1),
    "seed_poisson_ratio": quantity(0.4, 0.0, 0.49, "1", TABLE_1),
    "powder_density_kg_m3": quantity(1833.0, 500.0, 8000.0, "kg/m3", TABLE_1),
    "powder_shear_modulus_pa": quantity(3e7, 1e5, 1e11, "Pa", TABLE_1),
    "powder_poisson_ratio": quantity(0.296, 0.0, 0.49, "1", TABLE_1),
    "cohesive_frictional_damping": quantity(
        0.3,
        0.0,
        0.9,
        "1",
        "local damping, in place of the restitution; of cohesive_frictional_local_damping",
    ),
}
SEED_LENGTH = quantity(particles.SEED_LENGTH_MM, 1.5, 3.0, "mm", "length of the seed; the clump scales with it")


def numerics(time_step_fraction: float, stiffness_scale: float) -> dict:
    """Declaration of the numerics of a seed rig with these defaults."""
    return {
        "time_step_fraction": quantity(
            time_step_fraction, 0.005, 0.25, "1", "of the Rayleigh step of the smallest member; less where e < 0.25"
        ),
        "stiffness_scale": quantity(stiffness_scale, 1e-3, 10.0, "1", "both shear moduli are multiplied by it"),
        "damping_at_contact": quantity(
            0.0,
            0.0,
            1.0,
            "1",
            "mass that the damper takes: 0 the seed's, 1 the mass effective at the contact, off centre less",
        ),
        "rolling_spring": quantity(0.3, 1e-4, 1.0, "1", "stiffness of the rolling moment below its limit, in I/dt^2"),
    }


class SeedScene:
    """A YADE scene with one clump seed, ready for walls and engines.

    Parameters
    ----------
    case : a rig's complete case
    rotation : (3, 3) array, orientation of the seed
    added_mass : kg, a point mass at the seed's centre
    effects : the effects present; none by default
    fastest : m/s, speed of the fastest impact to come; asked for where restitution depends on speed
    """

    def __init__(
        self,
        case: dict,
        rotation: np.ndarray,
        added_mass: float = 0.0,
        effects: Effects | None = None,
        fastest: float = 0.0,
    ):
        from yade import O

        parameters, numerics = case["parameters"], case["numerics"]
        self.effects = effects = effects or Effects((), case)
        softer = numerics["stiffness_scale"]
        seed, powder = (
            contacts.Material(
                parameters[f"{name}_density_kg_m3"],
                softer * parameters[f"{name}_shear_modulus_pa"],
                parameters[f"{name}_poisson_ratio"],
            )
            for name in ("seed", "powder")
        )
        pair = contacts.Pair(
            *(parameters[f"seed_powder_{k}"] for k in ("restitution", "static_friction", "rolling_friction"))
        )
        self.pair = pair = effects.at("contact", pair)
        length, aspect = case["conditions"]["seed_length_mm"], effects.at("aspect", 1.0)
        centres, self.radii = particles.alfalfa_seed(length, aspect)
        mass, inertia = particles.seed_mass_properties(length, seed.density, aspect)
        self.volume = mass / seed.density
        self.mass = mass + added_mass
        self.inertia = np.array(inertia)
        self.rest_height = float(self.radii.max())  # of the centre above the plate, lying flat
        self.reach = float(
            (np.linalg.norm(centres, axis=1) + self.radii).max()
        )  # no part of the seed is farther from its centre
        self._at_contact = numerics["damping_at_contact"] > 0.5
        if "restitution" in effects or self._at_contact:
            arms = [np.sum(c**2) * np.eye(3) - np.outer(c, c) for c in centres]  # |w x c|^2 = w arm w
            share = max(np.linalg.eigvalsh(self.mass * arm / np.sqrt(np.outer(inertia, inertia)))[-1] for arm in arms)
            self._fastest_member = sqrt(1 + share)  # times sqrt(2 energy/mass): no member's centre is faster
        self.points = centres @ rotation.T
        self.rotation = rotation
        self.time_step = numerics["time_step_fraction"] * contacts.rayleigh_step(float(self.radii.min()), seed)
        self._adhesive = case["contact_law"] != laws.LOCAL_DAMPING  # its contacts know their adhesion
        if self._adhesive:  # a strong damper asks for shorter steps
            self.time_step *= min(
                1.0,
                contacts.damping_ratio(REFERENCE_RESTITUTION) / contacts.damping_ratio(self.restitution(fastest)),
            )
        elif self._at_contact:
            raise Failed(f"the {case['contact_law']} law has no damper: damping_at_contact means nothing")
        elif "restitution" in effects:
            raise Failed(f"the {case['contact_law']} law has no restitution that could depend on speed")
        spring = numerics["rolling_spring"] * min(inertia) / self.time_step**2
        options = {"rolling_stiffness": spring}
        if case["contact_law"] == laws.LOCAL_DAMPING:
            options |= {"radius": self.rest_height, "damping": parameters["cohesive_frictional_damping"]}
        self.contacts = laws.LAWS[case["contact_law"]](seed, powder, pair, **options)
        O.reset()
        self.contacts.enter()

    def place(self, position) -> None:
        """Put the seed's centre at a position (m), at rest."""
        from yade import O, utils

        spheres = [
            utils.sphere(tuple(point + position), radius, material=self.contacts.particle, color=(1, 1, 1))
            for point, radius in zip(self.points, self.radii, strict=True)
        ]
        self.clump, self.members = O.bodies.appendClumped(spheres, discretization=0)
        self.state = O.bodies[self.clump].state
        self.local = self.points @ np.array(self.state.ori.toRotationMatrix())  # members in YADE's body axes
        self.plates = []
        axes = np.array(self.state.ori.toRotationMatrix()).T @ self.rotation
        self.state.inertia = tuple(axes**2 @ self.inertia)  # along YADE's axes, a permutation of the seed's
        self.state.mass = self.mass
        for member in self.members:
            O.bodies[member].state.mass = self.mass  # contact damping reads the member's mass

    def plate(self, centre, half_size, orientation=None) -> None:
        """A fixed box of the powder's material; its upper face (local z) is the one the seed can meet."""
        from yade import O, Quaternion, Vector3, utils

        turn = orientation or Quaternion((1, 0, 0), 0)
        normal = turn * Vector3(0, 0, 1)
        plate = O.bodies.append(
            utils.box(
                tuple(centre),
                tuple(half_size),
                orientation=turn,
                fixed=True,
                material=self.contacts.wall,
                color=(1, 1, 1),
            )
        )
        self.plates.append((plate, normal, normal.dot(Vector3(*centre)) + half_size[2]))

    def start(self, gravity, damp_gravity: bool = True) -> None:
        """Set up the engines; the next O.step() moves the seed."""
        from yade import (
            Bo1_Box_Aabb,
            Bo1_Sphere_Aabb,
            ForceResetter,
            InsertionSortCollider,
            InteractionLoop,
            NewtonIntegrator,
            O,
            Vector3,
        )

        self.newton = NewtonIntegrator(
            damping=self.contacts.damping,
            dampGravity=damp_gravity,
            gravity=tuple(gravity),
            exactAsphericalRot=True,
        )
        O.engines = [
            ForceResetter(),
            InsertionSortCollider(
                [Bo1_Sphere_Aabb(), Bo1_Box_Aabb()], verletDist=0.2 * self.radii.min(), targetInterv=-1
            ),
            InteractionLoop(self.contacts.geometry, self.contacts.physics, self.contacts.law),
            self.newton,
        ]
        O.dt = self.time_step
        self.omega, self.interactions, self.vector = O, O.interactions, Vector3
        self._touching: list[Touch] = []
        self._known_interactions = 0
        self._out_of_reach = 0  # steps in which no member can come to a plate it does not touch
        self.step = self._stepper(stepping.single(self.contacts))
        self._inertia = tuple(self.state.inertia)
        self._momentum, self._flown_from, self._twice_energy = None, None, None

    def spin(self, momentum) -> None:
        """Give the seed an angular momentum (N m s, world axes).

        YADE 2023.02a takes the momentum and overwrites the velocity with what follows from it; 2025.2 the other way round
        in a body that has not moved yet.
        """
        momentum = self.vector(*momentum)
        self.state.angMom = momentum
        self.state.angVel = self.state.ori * self._of_rotation(self.state.ori, momentum)[1]

    def restitution(self, speed: float) -> float:
        """Coefficient of restitution at a normal approach speed (m/s), kept inside the range of the contact law."""
        base = self.pair.restitution
        if "restitution" not in self.effects:
            return base
        return min(0.95, max(0.05, self.effects.at("restitution", base, speed)))

    def force(self, velocity) -> tuple[float, float, float]:
        """Force of the effects on the centre of mass (N) at a velocity (m/s)."""
        return self.effects.at("force", (0.0, 0.0, 0.0), velocity, self.volume)

    def _stepper(self, step):
        """One step; then what the effects make of the contacts and of the motion, in force from the next step on.

        A step of YADE's own takes some microseconds, no more than Python's: what it needs is looked up once, here.
        """
        effects, state, omega, forces = self.effects, self.state, self.omega, self.omega.forces
        forced, rolls = "force" in effects, "rolling" in effects
        new = "restitution" in effects or self._at_contact
        adhesive, friction = "contact" in effects and self._adhesive, "friction" in effects
        if new or rolls or friction or "contact" in effects or "tangential_stiffness" in effects:
            at_contacts = self._look_for_contacts
        elif forced:
            at_contacts = None
        else:
            return step

        def step_with_effects() -> None:
            if forced and omega.iter % STEPS_BETWEEN_FORCES == 0:
                velocity = state.vel
                forces.setPermF(self.clump, self.force((velocity[0], velocity[1], velocity[2])))
            if at_contacts is None:
                step()
                return
            before = None
            if new:  # for the first step of a contact, in which only its functor can be told
                if self._out_of_reach > 0:
                    self._out_of_reach -= 1
                else:
                    self.contacts.physics[0].betan.val = self._damping_ratio(*self._approach())
                before = state.pos
            step()
            at_contacts(before)
            touching = self._touching
            if touching and adhesive:
                self._limit_adhesive(touching)
            elif touching and friction:
                mu = self._friction(touching)
                for touch in touching:
                    touch.slides_at(mu)
            if rolls:
                forces.setPermT(self.clump, self._rolling_moment(touching))

        return step_with_effects

    def _look_for_contacts(self, before) -> None:
        """Note the contacts where they have changed; `before` is where the centre was before the step."""
        known, touching = self.interactions, self._touching
        if known.countReal() == len(touching) and len(known) == self._known_interactions:
            for touch in touching:
                if not touch.contact.isReal:
                    break
            else:
                return
        self._touching = [Touch(contact) for contact in known]
        self._known_interactions, self._out_of_reach = len(known), 0
        now = self.omega.iter - 1
        for touch in self._touching:
            if touch.contact.iterMadeReal == now:
                self._new_contact(touch.phys, touch.geom, before)

    def _damping_ratio(self, speed: float, lever) -> float:
        """Damping ratio of a contact by its approach speed (m/s) and its arm's vector product with the normal (m).

        YADE's damper takes the seed's whole mass M, so that e holds for central impacts. A damper that takes the mass that is
        effective at the contact, 1/m = 1/M + l I^-1 l with l that product, keeps e at every single contact.
        """
        ratio = contacts.damping_ratio(self.restitution(speed))
        if not self._at_contact:
            return ratio
        _, _, turned = self._of_rotation(self.state.ori, lever)
        return ratio / sqrt(1 + self.mass * turned)

    def _approach(self):
        """Normal approach speed (m/s) of the point of the seed nearest to a plate, and its arm times the normal (m).

        Notes for how many steps no member can come to a plate it does not touch, whatever the contacts do meanwhile:
        none is faster than all the energy could make it.
        """
        state = self.state
        touched = {(touch.contact.id1, touch.contact.id2) for touch in self._touching}
        orientation, position = state.ori, state.pos
        toward, nearest, speed, away = orientation.conjugate(), np.inf, 0.0, self.reach
        lever = self.vector(0, 0, 0)
        for plate, normal, level in self.plates:
            across = toward * normal
            across = np.array((across[0], across[1], across[2]))
            heights = (self.local @ across - self.radii).tolist()
            gap = min(heights)
            lowest = heights.index(gap)
            above = position.dot(normal) - level
            gap += above
            if gap < nearest:
                arm = orientation * self.vector(*(self.local[lowest] - self.radii[lowest] * across).tolist())
                nearest, speed = gap, abs((state.vel + state.angVel.cross(arm)).dot(normal))
                lever = arm.cross(normal)
            for member, height in zip(self.members, heights, strict=True):
                if (plate, member) not in touched and (member, plate) not in touched:
                    away = min(away, above + height)
        energy = self.kinetic_energy() + 3 * max(0.0, self.elastic_energy()) + GRAVITY * self.reach
        self._out_of_reach = max(0, int(away / (self._fastest_member * sqrt(2 * energy) * self.omega.dt)) - 1)
        return speed, lever

    def _friction(self, touching) -> float:
        """Static friction, by the seed's whole normal load where it depends on it."""
        mu = self.pair.static_friction
        if "friction" not in self.effects:
            return mu
        return self.effects.at("friction", mu, sum([touch.force.norm() for touch in touching]))

    def _limit_adhesive(self, touching) -> None:
        """Limits mu (Fn + Fa) of sliding and mu_r R (Fn + Fa) of rolling at each contact, Fa the adhesion.

        YADE's Mindlin law takes mu (|Fn| + Fa), which is too much at a contact in tension, Fn < 0, and a rolling moment
        maxBendPl |Fn|. Where |Fn| is small against Fa it changes much within a step, so that the limit of the step before
        does not serve: there it is held.
        """
        mu, rolling = self._friction(touching), self.pair.rolling_friction * self.rest_height
        for touch in touching:
            normal, adhesion = touch.force.dot(touch.normal), touch.adhesion
            limit = normal + adhesion if normal > -adhesion else 0.0
            touch.slides_at(mu if normal >= 0 else mu * (limit / (adhesion - normal)))
            if rolling > 0:
                size, least = abs(normal), 0.05 * adhesion
                touch.phys.maxBendPl = rolling * (limit / (size if size > least else least))

    def _new_contact(self, phys, geom, before) -> None:
        """Damping by the approach speed after its first step, and tangential stiffness; both stay for the contact's life."""
        if "restitution" in self.effects or self._at_contact:
            arm = geom.contactPoint - before
            velocity = self.state.vel + self.state.angVel.cross(arm)
            phys.betan = self._damping_ratio(abs(velocity.dot(geom.normal)), arm.cross(geom.normal))
        if "tangential_stiffness" in self.effects:
            stiffness = "kso" if self._adhesive else "ks"
            share = self.effects.at("tangential_stiffness", 1.0)
            setattr(phys, stiffness, share * getattr(phys, stiffness))

    def _rolling_moment(self, touching):
        """Moment on the seed (N m) of the rolling friction beyond the constant one, against the rolling."""
        moment, spin, radius = self.vector(0, 0, 0), self.state.angVel, self.rest_height
        for touch in touching:
            normal = touch.normal
            rolling = spin - normal * spin.dot(normal)
            rate = rolling.norm()
            if rate > 0:
                coefficient = self.effects.at("rolling", 0.0, rate * radius)
                moment -= rolling * (coefficient * radius * touch.force.norm() / rate)
        return moment

    def forget_contacts(self) -> None:
        """Let the contacts begin anew: the seed has been put elsewhere."""
        self.interactions.clear()
        self._touching = []

    def clearance(self) -> float:
        """Distance of the seed from the nearest plate, m."""
        toward = self.state.ori.conjugate()
        nearest = np.inf
        for _, normal, level in self.plates:
            across = toward * normal
            across = np.array((across[0], across[1], across[2]))
            height = self.state.pos.dot(normal) - level
            nearest = min(nearest, height + float((self.local @ across - self.radii).min()))
        return nearest

    def run(self, steps: int) -> None:
        """Step on, with longer steps where no plate can be reached meanwhile; undo the drift of free rotation.

        YADE's rotation of aspherical bodies gains energy in free flight, in proportion to the time step (2 % in 50 ms at
        1000 rad/s and a step of 6 us). Angular momentum stays exact, so a flight is known by its unchanged angular
        momentum, and the seed is turned, by the least angle, to the energy it had.
        """
        state, omega = self.state, self.omega
        if self.interactions.countReal():
            longer = 1.0
        else:
            fastest = state.vel.norm() + state.angVel.norm() * self.reach
            fastest += max(1e-2, GRAVITY * steps * LONGEST_FLIGHT_STEP * self.time_step)  # more than gravity adds
            free_steps = (self.clearance() - 1e-6) / (fastest * self.time_step)
            longer = min(max(1.0, free_steps / steps), LONGEST_FLIGHT_STEP)
        omega.dt = self.time_step * longer
        self._out_of_reach = 0  # counted in steps of another length
        step = self.step
        for _ in range(steps):
            step()
        momentum, orientation = self.vector(state.angMom), state.ori
        if not isfinite(momentum.dot(momentum) + state.vel.dot(state.vel)):
            raise Failed("blew up: the seed's motion is no longer a number; a smaller time_step_fraction is needed")
        if momentum != self._momentum:
            self._momentum, self._flown_from, self._twice_energy = momentum, orientation, None
            return
        if self._twice_energy is None:
            self._twice_energy = self._of_rotation(self._flown_from, momentum)[2]
        in_body, spin, twice_energy = self._of_rotation(orientation, momentum)
        square = in_body.dot(in_body)
        if square == 0:
            return
        across = spin - in_body * (twice_energy / square)
        slope = across.dot(across)
        if slope * square < 1e-6 * twice_energy**2:  # spinning about a principal axis: nothing drifts
            return
        turn = in_body.cross(across) * ((self._twice_energy - twice_energy) / (2 * slope * square))
        angle = turn.norm()
        if angle > 0:
            from yade import Quaternion

            state.ori = state.ori * Quaternion(turn / angle, -angle)

    def _of_rotation(self, orientation, momentum):
        """Angular momentum (N m s) and velocity (1/s) in the seed's axes, and twice the energy of the rotation (J)."""
        in_body = orientation.conjugate() * momentum
        x, y, z = self._inertia
        spin = self.vector(in_body[0] / x, in_body[1] / y, in_body[2] / z)
        return in_body, spin, in_body.dot(spin)

    def elastic_energy(self) -> float:
        """Energy the contacts can give back per mass, m2/s2: elastic less the work against adhesion, sideways parts left
        out.
        """
        stored = 0.0
        for contact in self.interactions:
            phys, overlap = contact.phys, max(0.0, contact.geom.penetrationDepth)
            if self._adhesive:
                stored += 0.4 * phys.kno * overlap**2.5 - phys.adhesionForce * overlap
            else:
                stored += 0.5 * phys.kn * overlap**2
        return stored / self.mass

    def kinetic_energy(self) -> float:
        """Kinetic energy per mass, m2/s2, rotation included."""
        state = self.state
        velocity = state.vel
        return 0.5 * velocity.dot(velocity) + 0.5 * state.angVel.dot(state.angMom) / self.mass


class Touch:
    """A contact while it lasts; `force` and `normal` are YADE's own vectors, which it changes in place."""

    __slots__ = ("contact", "phys", "geom", "force", "normal", "adhesion", "friction")

    def __init__(self, contact):
        self.contact, self.phys, self.geom = contact, contact.phys, contact.geom
        self.force, self.normal = self.phys.normalForce, self.geom.normal
        self.adhesion = getattr(self.phys, "adhesionForce", 0.0)
        self.friction = None

    def slides_at(self, friction: float) -> None:
        """Set the friction coefficient, where it is another one than was set last."""
        if friction != self.friction:
            self.phys.tangensOfFrictionAngle = self.friction = friction


def lowest(points: np.ndarray, radii: np.ndarray, normal) -> float:
    """Lowest extent of spheres along a unit normal, m (negative below the seed's centre)."""
    return float((points @ np.asarray(normal) - radii).min())
