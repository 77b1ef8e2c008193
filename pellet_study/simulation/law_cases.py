"""Which cases the contact laws are checked in: a table of sweeps, each over every combination of its values."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

from pellet_study.rigs.on_yade import case, rig
from yade_scripts import laws

MINDLIN, DISSIPATING, LOCAL_DAMPING = laws.HERTZ_MINDLIN, laws.COHESIVE_FRICTIONAL, laws.LOCAL_DAMPING
BOTH = (MINDLIN, LOCAL_DAMPING)
CHECKS = (
    "restitution",
    "hertz",
    "sliding",
    "rolling",
    "pull_off",
    "adhesion_jump",
    "two_pairs",
    "clump_inertia",
    "free_spin",
    "clump_restitution",
    "clump_sliding",
    "grain_impact",
    "grain_sticking",
    "grain_pull_off",
    "grain_limits",
    "grain_energy",
    "grain_and_wall",
)
Values = Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class Sweep:
    """Cases of a check (`yade_scripts/checks/CHECK.py`): each law with every combination of values, the last fastest.

    `quick` has the values that take the place of some in the short list; None where the sweep is not in it.
    """

    check: str
    laws: tuple[str, ...]
    values: Values
    quick: Values | None

    def cases(self, quick: bool) -> Iterator[dict]:
        """Its cases, in the whole list or in the short one."""
        if quick and self.quick is None:
            return
        values = {**self.values, **(self.quick or {})} if quick else self.values
        for law, combination in product(self.laws, product(*values.values())):
            yield _case(self.check, law, dict(zip(values, combination, strict=True)))


E, MU, MU_R, V = "restitution", "static_friction", "rolling_friction", "speed_m_s"
SEED_E, SEED_MU = "seed_powder_restitution", "seed_powder_static_friction"
DAMPING, GAMMA, STEP = "cohesive_frictional_damping", "surface_energy_j_m2", "time_step_fraction"
SPRING, OTHER, TOUCHING = "rolling_spring", "other_radius_mm", "members_touching"
NO_DAMPING = {DAMPING: (0.0,)}
STICKY = {"powder_powder_surface_energy_j_m2": (0.05,), "powder_steel_surface_energy_j_m2": (0.01,)}
SWAPPED = {"powder_powder_restitution": (0.6,), "powder_steel_restitution": (0.3,)}
SPRINGS, MU_RS, SHORT = (0.2, 0.02, 0.002), (0.005, 0.05, 0.25), (0.2, 0.002)
STIFF, APART, LOAD, ADHESION_LOAD = "stiffness_scale", "apart_mm_s", "load_n", "adhesion_load"
SOFTER = (0.01, 0.1, 1.0)

SWEEPS = (
    Sweep(
        "restitution",
        (MINDLIN,),
        {E: (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.5, 0.7, 0.9), V: (0.1, 0.3, 1.0, 2.0, 4.0)},
        {E: (0.05, 0.5, 0.9), V: (0.1, 4.0)},
    ),
    Sweep(
        "restitution",
        (LOCAL_DAMPING,),
        {E: (0.25, 0.9), V: (0.1, 4.0), DAMPING: (0.0, 0.1, 0.3, 0.6, 0.9)},
        {DAMPING: (0.0, 0.3)},
    ),
    Sweep(
        "restitution",
        (MINDLIN,),
        {E: (0.05, 0.1, 0.25, 0.5), STEP: (0.025, 0.05)},
        {E: (0.05,), STEP: (0.05,)},
    ),
    Sweep(
        "restitution",
        (MINDLIN,),
        {E: (0.5,), V: (0.1, 1.0, 4.0), GAMMA: (0.005, 0.05, 0.5)},
        {V: (0.1,), GAMMA: (0.05,)},
    ),
    Sweep("hertz", BOTH, {"radius_mm": (0.26, 0.5), V: (0.1, 1.0, 4.0)}, {"radius_mm": (0.5,), V: (1.0,)}),
    Sweep("sliding", (MINDLIN,), {E: (0.05, 0.25, 0.9), MU: (0.1, 0.3, 0.6, 0.85)}, {E: (0.05,), MU: (0.3,)}),
    Sweep("sliding", (LOCAL_DAMPING,), {MU: (0.1, 0.3, 0.6, 0.85), DAMPING: (0.0, 0.3)}, {MU: (0.6,)}),
    Sweep(
        "rolling",
        (MINDLIN,),
        {E: (0.05, 0.25, 0.9), SPRING: SPRINGS, MU_R: (0.0, *MU_RS)},
        {E: (0.25,), SPRING: SHORT},
    ),
    Sweep(
        "rolling",
        (MINDLIN,),
        {E: (0.05, 0.25, 0.9), SPRING: SPRINGS, MU_R: MU_RS, "impact_m_s": (0.05,)},
        {E: (0.25,), SPRING: SHORT},
    ),
    Sweep(
        "rolling",
        (LOCAL_DAMPING,),
        {MU_R: (0.0, 0.05, 0.25), DAMPING: (0.0, 0.3), "impact_m_s": (0.0, 0.05)},
        {MU_R: (0.05,), "impact_m_s": (0.0,)},
    ),
    Sweep("pull_off", BOTH, {GAMMA: (0.001, 0.05, 0.5), OTHER: (0.0, 0.26, 0.13)}, {GAMMA: (0.05,)}),
    Sweep("pull_off", (MINDLIN,), {E: (0.05, 0.25)}, None),
    Sweep("adhesion_jump", BOTH, {E: (0.05, 0.25, 0.5, 0.9), **NO_DAMPING}, {E: (0.25,)}),
    Sweep("two_pairs", (MINDLIN,), NO_DAMPING, {}),
    Sweep("two_pairs", (MINDLIN,), {**NO_DAMPING, **STICKY}, {}),
    Sweep("two_pairs", (LOCAL_DAMPING,), NO_DAMPING, {}),
    Sweep("two_pairs", (LOCAL_DAMPING,), {**NO_DAMPING, **STICKY}, {}),
    Sweep("two_pairs", (LOCAL_DAMPING,), {}, {}),
    Sweep("two_pairs", BOTH, {**NO_DAMPING, **SWAPPED}, None),
    Sweep(
        "clump_restitution",
        (MINDLIN,),
        {SEED_E: (0.05, 0.1, 0.25, 0.35, 0.5, 0.9), TOUCHING: (1.0, 2.0, 6.0), V: (0.3, 1.0, 2.0)},
        {SEED_E: (0.25,), V: (1.0,)},
    ),
    Sweep("clump_inertia", (MINDLIN,), {"seed_length_mm": (1.5, 2.2, 3.0)}, {"seed_length_mm": (2.2,)}),
    Sweep("free_spin", (MINDLIN,), {"spin_rad_s": (300.0, 1000.0, 2000.0)}, {"spin_rad_s": (1000.0,)}),
    Sweep("clump_sliding", (MINDLIN,), {SEED_E: (0.05, 0.25), SEED_MU: (0.3, 0.6, 0.85)}, {SEED_E: (0.05,), SEED_MU: (0.3,)}),
    Sweep("clump_sliding", (LOCAL_DAMPING,), {SEED_MU: (0.3, 0.6, 0.85)}, {SEED_MU: (0.6,)}),
    Sweep("clump_restitution", (LOCAL_DAMPING,), {TOUCHING: (1.0, 6.0)}, {}),
    Sweep(
        "clump_restitution",
        (MINDLIN,),
        {SEED_E: (0.05, 0.1, 0.25, 0.5), TOUCHING: (1.0, 2.0, 6.0), STEP: (0.05,)},
        None,
    ),
    Sweep(
        "grain_impact",
        (DISSIPATING,),
        {E: (0.05, 0.15, 0.3, 0.5, 0.7, 0.9), V: (0.05, 0.2, 1.0), GAMMA: (0.0, 0.2)},
        {E: (0.15, 0.5), V: (0.2,)},
    ),
    Sweep("grain_impact", (DISSIPATING,), {E: (0.05, 0.15), V: (0.002,), GAMMA: (0.2,)}, {E: (0.15,)}),  # they stick
    Sweep("grain_sticking", (DISSIPATING,), {E: (0.3,), STIFF: SOFTER}, None),
    Sweep("grain_sticking", (DISSIPATING,), {E: (0.05, 0.15, 0.3, 0.5, 0.9)}, {E: (0.15,)}),
    Sweep("grain_pull_off", (DISSIPATING,), {E: (0.3,), APART: (1.0,), STIFF: SOFTER}, None),
    Sweep("grain_pull_off", (DISSIPATING,), {E: (0.05, 0.15, 0.5, 0.9), APART: (1.0, 50.0)}, {E: (0.15,)}),
    Sweep("grain_pull_off", (DISSIPATING,), {E: (0.3,), ADHESION_LOAD: (1.25, 4.0)}, None),
    Sweep("grain_limits", (DISSIPATING,), {E: (0.3,), GAMMA: (0.2,), STIFF: SOFTER}, None),
    Sweep("grain_limits", (DISSIPATING,), {E: (0.15,), GAMMA: (0.0,), LOAD: (1e-3, 5e-3)}, {LOAD: (1e-3,)}),
    Sweep(
        "grain_limits",
        (DISSIPATING,),
        {E: (0.15,), GAMMA: (0.1, 0.3), LOAD: (-1e-4, 0.0, 1e-3, 5e-3)},
        {GAMMA: (0.1,), LOAD: (1e-3,)},
    ),
    Sweep("grain_limits", (DISSIPATING,), {E: (0.3,), GAMMA: (0.2,), ADHESION_LOAD: (1.25, 4.0)}, None),
    Sweep(
        "grain_energy",
        (DISSIPATING,),
        {E: (0.05, 0.15, 0.9), "aslant_deg": (0.0, 35.0, 70.0), GAMMA: (0.0, 0.2)},
        {E: (0.15,)},
    ),
    Sweep(
        "grain_and_wall",
        (DISSIPATING,),
        {"steel_restitution": (0.15, 0.6), E: (0.15, 0.6), GAMMA: (0.0, 0.2)},
        {"steel_restitution": (0.15,), E: (0.15,)},
    ),
)  # fmt: skip


def cases(quick: bool = False) -> list[dict]:
    """The cases of all checks, each once; `quick` keeps a part that meets every check, law and known limit once."""
    wanted = [case for sweep in SWEEPS for case in sweep.cases(quick)]
    return [case for place, case in enumerate(wanted) if case not in wanted[:place]]


def _case(check: str, contact_law: str, values: Mapping[str, float]) -> dict:
    """A case of a check; each value goes to the group that declares it."""
    groups: dict[str, Any] = {
        group: {name: value for name, value in values.items() if name in getattr(rig(check), group)}
        for group in ("parameters", "conditions", "numerics")
    }
    unknown = set(values) - {name for group in groups.values() for name in group}
    if unknown:
        raise ValueError(f"check {check} has no {', '.join(sorted(unknown))}")
    return case(check, contact_law=contact_law, **groups)
