"""The contact constants of the repose rig's scene, read off its contacts while the funnel fills."""

import numpy as np

from yade_scripts import repose
from yade_scripts.case import Failed

CONSTANTS = ("damping", "friction", "rolling", "adhesion")
RIG = {
    **repose.RIG,
    "name": "powder_contacts",
    "observables": {f"{pair}_{name}": "" for pair in ("powder", "steel") for name in CONSTANTS},
    "random": False,
}


def simulate(case: dict) -> dict:
    """Damping ratio, tan of the friction angle, rolling limit over R Fn, pull-off over R* of both pairs."""
    from yade import Box, O, Sphere

    scene, _ = repose.build(case)
    found = {}
    while len(found) < 2:
        scene.run(100)
        if O.iter > 5000:
            raise Failed("no contacts")
        for contact in O.interactions:
            shapes = [O.bodies[k].shape for k in (contact.id1, contact.id2)]
            if all(isinstance(shape, Sphere) for shape in shapes):
                radii = [shape.radius for shape in shapes]
                if not scene.contacts.layers:
                    found.setdefault("powder", (contact.phys, radii))
                elif "powder" not in found and whole(layers := layers_between(contact), scene.contacts):
                    found["powder"] = (layers, radii)
            elif any(isinstance(shape, Box) for shape in shapes):
                radius = next(shape.radius for shape in shapes if isinstance(shape, Sphere))
                found.setdefault("steel", (contact.phys, [radius, radius]))
    return {
        f"{pair}_{k}": v for pair, contact in found.items() for k, v in zip(CONSTANTS, constants(*contact), strict=True)
    }


def whole(layers, law) -> bool:
    """Whether two grains touch in every layer, and are attached where there is cohesion."""
    attached = any(getattr(phys, "unp", 0.0) > 0 for phys, *_ in layers)
    return len(layers) == len(law.layers) and (attached or law.born is None)


def layers_between(contact) -> list:
    """What all layers of two grains do to each other, with the grains' reduced mass."""
    from yade import O

    pair = {O.bodies[k].clumpId for k in (contact.id1, contact.id2)}
    one, other = (max(O.bodies[m].state.mass for m in O.bodies[k].shape.members) for k in pair)
    same = [c for c in O.interactions if {O.bodies[c.id1].clumpId, O.bodies[c.id2].clumpId} == pair]
    return [(c.phys, c.geom, one * other / (one + other)) for c in same]


def of_layers(layers) -> tuple[float, float, float, float]:
    """Each layer carries its share of the contact's stiffness, and of what is asked of the contact."""
    phys = [one[0] for one in layers]
    whole, mass = sum(one.kn for one in phys), layers[0][2]
    damper = next(one for one in phys if hasattr(one, "cn"))
    elastic = next(one for one in phys if getattr(one, "kr", 0.0) > 0)
    pull = sum(one.unp * one.kn for one in phys if getattr(one, "unp", 0.0) > 0)  # the elastic layer pushes as much
    share = elastic.kn / whole
    return (
        damper.cn / (2 * (mass * whole) ** 0.5),
        share * elastic.tangensOfFrictionAngle,
        share * elastic.maxRollPl / max(one[1].refR1 for one in layers),
        pull / (0.5 * max(one[1].refR1 for one in layers)),
    )


def constants(phys, radii) -> tuple[float, float, float, float]:
    """Of one contact; a law without a damper has damping 0."""
    if isinstance(phys, list):
        return of_layers(phys)
    reduced = radii[0] * radii[1] / sum(radii)
    if hasattr(phys, "betan"):
        return phys.betan, phys.tangensOfFrictionAngle, phys.maxBendPl / np.mean(radii), phys.adhesionForce / reduced
    return 0.0, phys.tangensOfFrictionAngle, phys.maxRollPl / min(radii), phys.normalAdhesion / reduced
