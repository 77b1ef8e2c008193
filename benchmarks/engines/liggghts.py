"""The powder in LIGGGHTS 3.8 (Debian's package liggghts): `hertz`, `tangential history`, `rolling_friction epsd2`, no cohesion.

How its law differs from `cohesive_frictional` at equal grains:

- Spring: Hertz's, where ours is linear; along the contact Mindlin's 8 G* sqrt(R* x), where ours is 0.83 of the linear one.
- Damper: it may pull at the end of an impact, and goes with the fourth root of the overlap; ours pushes only. The restitution is
  the one asked for in both.
- Damper along the contact: as strong as the normal one; ours has none. Switch: `no tangential damper`.
- Limits: sliding friction mu |Fn| and rolling moment mu_r R |Fn|, with the damper's part in Fn; ours takes the elastic force alone.
- Rolling: the spring below the limit is the tangential one times R*^2, where ours is half of it times R^2.
- A damper against a grain of the base knows that this grain does not move; ours is the same as between two grains.

LIGGGHTS has no JKR: the pull of its `sjkr` grows with the overlap, so that there are no cohesive cells of it.
"""

from math import cos, pi, sin
from pathlib import Path

import numpy as np

from yade_scripts.apparatus import SEGMENTS, Funnel

from .powder import Powder

LIBRARY = "libliggghts.so.3"
ATOMS = "granular"
LEAST_MODULUS, MOST_MODULUS = 5e6, 1e9  # Pa, beyond which LIGGGHTS wants to be told that it is meant
NO_TANGENTIAL_DAMPER = "no tangential damper"
SWITCHES = {NO_TANGENTIAL_DAMPER}


class Law:
    """Commands that make the contacts of a powder.

    Parameters
    ----------
    switches : of SWITCHES
    """

    def __init__(self, powder: Powder, switches: frozenset[str]):
        self.powder = powder
        damper = "off" if NO_TANGENTIAL_DAMPER in switches else "on"
        self.model = "model hertz tangential history rolling_friction epsd2"
        self.option = f"tangential_damping {damper}"

    def before(self) -> list[str]:
        """Before the grains are there."""
        moduli = [material.young for material in (self.powder.grain, self.powder.steel)]
        soft = ["soft_particles yes"] if min(moduli) < LEAST_MODULUS else []
        return ["communicate single vel yes", *soft, *(["hard_particles yes"] if max(moduli) > MOST_MODULUS else [])]

    def between_grains(self) -> list[str]:
        """The law; type 1 is powder, 2 steel."""
        grain, steel, pair, wall = self.powder.grain, self.powder.steel, self.powder.pair, self.powder.wall_pair
        return [
            _of_each("youngsModulus", grain.young, steel.young),
            _of_each("poissonsRatio", grain.poisson_ratio, steel.poisson_ratio),
            _of_pairs("coefficientRestitution", pair.restitution, wall.restitution),
            _of_pairs("coefficientFriction", pair.static_friction, wall.static_friction),
            # the largest moment is coefficient x R* x force, R* = R/2 between grains and R at a wall
            _of_pairs("coefficientRollingFriction", 2 * pair.rolling_friction, wall.rolling_friction),
            f"pair_style gran {self.model} {self.option}",
            "pair_coeff * *",
        ]

    def plane(self, name: str, height: float) -> list[str]:
        """A steel plane that carries grains at a height, m."""
        return [f"fix {name} powder wall/gran {self.model} primitive type 2 zplane {height:.9g} {self.option}"]

    def funnel(self, funnel: Funnel, folder: Path) -> list[str]:
        """The funnel: as many facets as the rig's."""
        joint, top = funnel.bottom + funnel.cone, funnel.bottom + funnel.top
        rings = [(funnel.width, funnel.width, joint, top)]
        if funnel.cone > 0:
            rings.append((funnel.outlet, funnel.width, funnel.bottom, joint))
        write_facets(folder / "funnel.stl", rings)
        return [
            f"fix funnel all mesh/surface file {folder / 'funnel.stl'} type 2 curvature 1e-6",
            f"fix funnel_wall powder wall/gran {self.model} mesh n_meshes 1 meshes funnel {self.option}",
        ]

    def shake(self, amplitude: float, frequency: float) -> list[str]:
        """Vibrate the funnel along its axis (m, Hz)."""
        return [f"fix shake all move/mesh mesh funnel wiggle amplitude 0. 0. {amplitude:g} period {1 / frequency:g}"]

    def remove_funnel(self, shaken: bool) -> list[str]:
        """Take it away."""
        return [*(["unfix shake"] if shaken else []), "unfix funnel_wall", "unfix funnel"]


def _of_each(name: str, grain: float, steel: float) -> str:
    return f"fix {name} all property/global {name} peratomtype {grain:.9g} {steel:.9g}"


def _of_pairs(name: str, grains: float, wall: float) -> str:
    return f"fix {name} all property/global {name} peratomtypepair 2 {grains:.9g} {wall:.9g} {wall:.9g} {wall:.9g}"


def write_facets(file: Path, rings: list[tuple[float, float, float, float]]) -> None:
    """Rings of two triangles a facet between (radius, radius, height, height), as STL."""
    lines = ["solid steel"]
    around = 2 * pi * np.arange(SEGMENTS + 1) / SEGMENTS
    for low, high, bottom, top in rings:
        for a, b in zip(around, around[1:], strict=False):
            corners = [(r * cos(t), r * sin(t), z) for r, z in ((low, bottom), (high, top)) for t in (a, b)]
            for three in ((0, 1, 2), (1, 3, 2)):
                lines += ["facet normal 0 0 0", "outer loop"]
                lines += ["vertex " + " ".join(f"{v:.9e}" for v in corners[c]) for c in three]
                lines += ["endloop", "endfacet"]
    file.write_text("\n".join([*lines, "endsolid steel", ""]))
