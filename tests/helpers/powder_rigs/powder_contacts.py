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
                found.setdefault("powder", (contact.phys, [shape.radius for shape in shapes]))
            elif any(isinstance(shape, Box) for shape in shapes):
                radius = next(shape.radius for shape in shapes if isinstance(shape, Sphere))
                found.setdefault("steel", (contact.phys, [radius, radius]))
    return {
        f"{pair}_{k}": v for pair, contact in found.items() for k, v in zip(CONSTANTS, constants(*contact), strict=True)
    }


def constants(phys, radii) -> tuple[float, float, float, float]:
    """Of one contact; a law without a damper has damping 0."""
    reduced = radii[0] * radii[1] / sum(radii)
    if hasattr(phys, "betan"):
        return phys.betan, phys.tangensOfFrictionAngle, phys.maxBendPl / np.mean(radii), phys.adhesionForce / reduced
    return 0.0, phys.tangensOfFrictionAngle, phys.maxRollPl / min(radii), phys.normalAdhesion / reduced
