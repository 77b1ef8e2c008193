"""The powder in LAMMPS (Debian's package lammps, of 2022): `pair_style granular` with `jkr` where there is surface energy, else `hertz/material`.

How its law differs from `cohesive_frictional` at equal grains:

- Spring: Hertz's or Johnson, Kendall and Roberts', where ours is linear; along the contact Mindlin's 8 G* a, where ours is 0.83 of the
  linear one.
- Cohesion: JKR's force, with our pull-off force (gamma = G/2). Its well is as deep as the soft contact makes it: at
  G = 0.2 J/m2, e = 0.15 and a softness of 0.001 grains stick up to 0.6 m/s, which is nearly every impact of a heap; at full stiffness
  up to 0.05 m/s. Ours stick up to 0.006 m/s at any softness: they keep the sticking speed of a stiff linear contact, k = E R, whose
  well is less deep than JKR's. Cells of full stiffness show what softness is worth. Switch `dmt`: the pull-off force at any overlap (gamma = 3/8 G).
- Limits: mu (N + 2 F) and mu_r R (N + 2 F), as ours, at all times; ours in tension end at N = -F.
- Damper: it only pushes, as ours, by a second pair style laid over the first, `gran/hertz/history` with `limit_damping` and SHARE of
  the stiffness. It goes with the root of the overlap, so that the restitution is the one asked for at AT_SPEED and depends on the speed
  (results/checks/engine_checks.csv); the limits do not see it, nor SHARE of the spring. Switch `damper pulls`: the damper of
  `granular` itself, which pulls at the end of an impact (its restitution does not depend on the speed), and which the
  limits see where there is no surface energy.
- Damper along the contact: none, as in ours. Switch `tangential damper` (with `damper pulls`): as strong as LIGGGHTS' own.
- Rolling: a spring as stiff as ours below the limit.
- A damper against a grain of the base knows that this grain does not move; ours is the same as between two grains.
- Walls have no cohesion and a damper that only pushes, as ours; Hertz's spring in both.

The damper `tsuji` falls short of the restitution that it is given (0.44 for 0.3): it gets the number at which its polynomial is right.
At walls it is of no use, as each `run` puts the number through the polynomial once more: walls have `viscoelastic`.
"""

from functools import cache
from math import pi, sqrt
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from yade_scripts.apparatus import Funnel
from yade_scripts.contacts import stiffness_ratio
from yade_scripts.layered import stiffness
from yade_scripts.powder_scene import grain_mass

from .powder import Powder, effective_shear, effective_young, pulling_ratio

LIBRARY = "liblammps.so.0"
ATOMS = "sphere"
DMT, DAMPER_PULLS, TANGENTIAL_DAMPER = "dmt", "damper pulls", "tangential damper"
SWITCHES = {DMT, DAMPER_PULLS, TANGENTIAL_DAMPER}
AT_SPEED = 0.3  # m/s, of the impact whose restitution is right; grains fall from the outlet at up to 0.9 m/s
SHARE = 0.01  # of the stiffness that the damper's style has: what it may take off the force of a contact that opens
PHASES = 16  # of the first step in a contact
STRONGEST = 60.0  # damper that is tried
TSUJI = (1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218)  # of the number given, from the manual


def impact(damper: float, share: float, step: float) -> float:
    """Restitution of x'' = -(1 - s) x^(3/2) - max(0, s x^(3/2) + b x^(1/2) x'), x' = 1 at the touch, in the engine's steps.

    The mean over the phases of the first step. The damper reads the velocity half a step before the overlap.

    Parameters
    ----------
    damper : b
    share : s, of the stiffness that the damper's spring has; 1: the whole force only pushes
    step : time step in the unit of time of the equation
    """
    overlap = (np.arange(PHASES) + 0.5) / PHASES * step
    speed, left = np.ones(PHASES), np.full(PHASES, np.nan)
    while np.isnan(left).any():
        spring = overlap**1.5
        speed = speed - step * (
            (1 - share) * spring + np.maximum(0.0, share * spring + damper * np.sqrt(overlap) * speed)
        )
        overlap = overlap + step * speed
        parted = (overlap <= 0) & np.isnan(left)
        left[parted] = -speed[parted]
        overlap = np.maximum(overlap, 0.0)
    return float(left.mean())


@cache
def viscosity(restitution: float, share: float, step: float) -> float:
    """Least damper with which an impact (as above) has a restitution."""
    high = 0.5
    while impact(high, share, step) > restitution:
        high *= 1.2
        if high > STRONGEST:
            raise ValueError(f"restitution {restitution:g}: the time step is too long for its damper")
    return float(
        brentq(lambda damper: impact(damper, share, step) - restitution, high / 1.2 if high > 0.5 else 1e-3, high)
    )


def gamma(restitution: float, share: float, young: float, radius: float, mass: float, step: float) -> float:
    """Damper of LAMMPS, 1/(m s): its force is this times the reduced mass, the root of R* x, and the speed.

    Parameters
    ----------
    restitution, share : as in `impact`
    young, radius, mass : E*, R* and reduced mass of the contact
    step : time step, s
    """
    spring = 4 / 3 * young * sqrt(radius) / mass
    length = (AT_SPEED**2 / spring) ** 0.4
    return viscosity(restitution, share, step * AT_SPEED / length) * AT_SPEED / (sqrt(radius) * length**1.5)


def number_for_tsuji(restitution: float) -> float:
    """The number that `damping tsuji` must be given for a restitution, its damper pulling."""
    wanted = sqrt(5) * pulling_ratio(restitution)  # over sqrt(m k) x^(1/4), k = 4/3 E* sqrt(R*)
    return float(brentq(lambda given: sum(c * given**k for k, c in enumerate(TSUJI)) - wanted, -0.5, 1.0))


class Law:
    """Commands that make the contacts of a powder.

    Parameters
    ----------
    switches : of SWITCHES
    """

    def __init__(self, powder: Powder, switches: frozenset[str]):
        self.powder, self.switches = powder, switches
        self.mass = grain_mass(powder.radius, powder.grain.density)

    def before(self) -> list[str]:
        """Before the grains are there."""
        return ["comm_modify vel yes"]

    def between_grains(self) -> list[str]:
        """The law of all grains."""
        pulls = DAMPER_PULLS in self.switches
        whole, young = self._granular(pulls), effective_young(self.powder.grain, self.powder.grain)
        if pulls:
            return ["pair_style granular", f"pair_coeff * * {whole}"]
        spring = SHARE * 4 / 3 * young
        damper = gamma(
            self.powder.pair.restitution, SHARE, young, self.powder.radius / 2, self.mass / 2, self.powder.time_step
        )
        return [
            f"pair_style hybrid/overlay granular gran/hertz/history {spring:.9g} {spring:.9g} {damper:.9g} 0 0 1 limit_damping",
            f"pair_coeff * * granular {whole}",
            "pair_coeff * * gran/hertz/history",
        ]

    def _granular(self, pulls: bool) -> str:
        """Coefficients of `pair_style granular`, with its own damper or without."""
        grain, pair, radius = self.powder.grain, self.powder.pair, self.powder.radius
        share = 1.0 if pulls else 1 - SHARE
        damper = number_for_tsuji(pair.restitution) if pulls else 0.0
        if pair.surface_energy > 0 and DMT in self.switches:
            normal, energy = "dmt", f" {3 / 8 * pair.surface_energy:.9g}"
        elif pair.surface_energy > 0:
            normal, energy = "jkr", f" {pair.surface_energy / 2:.9g}"
        else:
            normal, energy = "hertz/material", ""
        shear = 8 * effective_shear(grain, grain)
        # of the damper over that of LIGGGHTS: this one is damped by the tangential stiffness, that one by the normal one
        along = sqrt(shear / (2 * effective_young(grain, grain))) if TANGENTIAL_DAMPER in self.switches else 0.0
        # the rolling force is at R* = R/2: spring and limit of a moment at R are 4 and 2 times as much
        rolling = 4 * 0.5 * stiffness_ratio(grain) * stiffness(radius, grain)
        return (
            f"{normal} {share * grain.young:.9g} {damper:.9g} {grain.poisson_ratio:g}{energy} "
            f"tangential mindlin {shear:.9g} {along:.9g} {pair.static_friction:g} "
            f"rolling sds {rolling:.9g} 0 {2 * pair.rolling_friction:g} damping {'tsuji' if pulls else 'velocity'}"
        )

    def _wall(self) -> str:
        """The law of grains at walls, by its constants: of a material the fix for walls takes 1 - nu for 1 - nu^2."""
        grain, steel, pair, radius = self.powder.grain, self.powder.steel, self.powder.wall_pair, self.powder.radius
        young, shear = effective_young(grain, steel), effective_shear(grain, steel)
        damper = gamma(pair.restitution, 1.0, young, radius, self.mass, self.powder.time_step)
        return (
            f"granular hertz {4 / 3 * young:.9g} {damper:.9g} tangential mindlin {8 * shear:.9g} 0 {pair.static_friction:g} "
            f"rolling sds {self.powder.wall_rolling / radius**2:.9g} 0 {pair.rolling_friction:g} damping viscoelastic "
            "limit_damping"
        )

    def plane(self, name: str, height: float) -> list[str]:
        """A steel plane that carries grains at a height, m."""
        return [f"fix {name} powder wall/gran {self._wall()} zplane {height:.9g} NULL"]

    def funnel(self, funnel: Funnel, folder: Path) -> list[str]:
        """The funnel: a cone and a cylinder, open at both ends, each as high as the whole, so that no grain passes at the joint."""
        low, high = funnel.bottom, funnel.bottom + funnel.top
        ends = f"{low:.9g} {high:.9g} side in open 1 open 2 move NULL NULL v_lift"
        widest = funnel.room(funnel.cone) if funnel.cone == 0 else _widened(funnel)
        return [
            "variable lift equal 0.0",
            f"region cone cone z 0 0 {funnel.outlet:.9g} {widest:.9g} {ends}",
            f"region cylinder cylinder z 0 0 {funnel.width:.9g} {ends}",
            f"fix cone_wall powder wall/gran/region {self._wall()} region cone",
            f"fix cylinder_wall powder wall/gran/region {self._wall()} region cylinder",
        ]

    def shake(self, amplitude: float, frequency: float) -> list[str]:
        """Vibrate the funnel along its axis (m, Hz)."""
        return [
            "variable start equal $(step)",
            "variable lift delete",
            f'variable lift equal "{amplitude:g}*sin({2 * pi * frequency:.9g}*(step-v_start)*dt)"',
        ]

    def remove_funnel(self, shaken: bool) -> list[str]:
        """Take it away."""
        return ["unfix cone_wall", "unfix cylinder_wall"]


def _widened(funnel: Funnel) -> float:
    """Radius that the funnel's cone would have at the top of its cylinder, m."""
    return funnel.outlet + (funnel.width - funnel.outlet) * funnel.top / funnel.cone
