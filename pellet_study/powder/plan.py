"""The plan of a powder calibration: the seven factors of the source paper, what stays, and the angle to meet."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from scipy.special import stdtrit

from pellet_study.doe import validation
from pellet_study.doe.answers import plain
from pellet_study.doe.factors import Factor
from pellet_study.rigs import on_yade
from yade_scripts import laws, powder_scene

RIG, OBSERVABLE = "repose", "repose_angle_deg"
OTHER_ANGLES = ("repose_flank_deg", "repose_triangle_deg", "repose_moment_deg", "repose_height_deg")
ANGLES = (OBSERVABLE, *OTHER_ANGLES)  # of a heap; one that was measured steers the chain
OTHER_READINGS = (*OTHER_ANGLES, "discharge_time_s", "fill_bulk_density_kg_m3")
READINGS = (OBSERVABLE, *OTHER_READINGS)  # of the same pouring
SYMBOLS = {
    "A": "powder_restitution",
    "B": "powder_static_friction",
    "C": "powder_rolling_friction",
    "D": "powder_steel_restitution",
    "E": "powder_steel_static_friction",
    "F": "powder_steel_rolling_friction",
    "G": "powder_surface_energy",
}
NAMES = {
    "A": "restitution powder-powder",
    "B": "static friction powder-powder",
    "C": "rolling friction powder-powder",
    "D": "restitution powder-steel",
    "E": "static friction powder-steel",
    "F": "rolling friction powder-steel",
    "G": "surface energy",
}
MEASURED = ("target_deg", "sd_deg", "n", "others")  # keys of a plan's record
KNOWN = 1000  # readings whose scatter counts as known
ONCE_FIXED = {"outlet_diameter_mm": 24.0, "lift_speed_mm_s": 30.0}  # conditions since 28 November 2026
DEFAULT_LAW = laws.COHESIVE_FRICTIONAL
IDLE = {laws.LOCAL_DAMPING: {"A": "the law has no restitution; A is an idle column, its effect an estimate of noise"}}


@dataclass(frozen=True)
class Reading:
    """What was read of the same powder under the same conditions: the mean of `n` readings and their standard deviation.

    `freedom` are the degrees of freedom of `sd`; 0 where it is stated of a single reading, and then counts as known.
    """

    observable: str
    value: float
    sd: float
    n: int
    freedom: int

    @property
    def sample(self) -> validation.Sample:
        """For the test of equivalence; of a single reading, a known number.

        Of readings whose scatter is known from few rows, as many readings as that scatter has degrees of freedom and one
        more, with the same standard error.
        """
        if self.n == 1:
            return validation.Sample(self.value)
        if self.freedom == 0:  # a stated sd, taken as known
            return validation.Sample(self.value, self.sd * (KNOWN / self.n) ** 0.5, KNOWN)
        return validation.Sample(self.value, self.sd * ((self.freedom + 1) / self.n) ** 0.5, self.freedom + 1)

    def attainable(self, level: float) -> bool:
        """Whether enough heaps could show equivalence at a level, within `sd`: the measured mean itself is known well enough."""
        return self.n == 1 or stdtrit(self.freedom or KNOWN, 1 - level) / self.n**0.5 < 1


@dataclass(frozen=True)
class Plan:
    """What a study asks of the chain.

    `factors` are the seven of the screening with the ranges of the study (those of `own`) or the paper's Table 6; `fixed`
    the parameters that stay; `target`, `sd`, `n` the measured angle, the standard deviation of a reading and the number of
    readings; `freedom` the degrees of freedom of `sd`; `margin` that of the equivalence test, the measurement's own
    standard deviation; `remarks` what the reader must know; `seeds_by` is "setting" where the seed of a heap belongs to
    its levels, "place" where it follows from where the heap stands in its design, as in release 0.1; `observable` is the
    angle that was measured and steers the chain, `others` what was measured beside it.
    """

    contact_law: str
    factors: list[Factor]
    fixed: dict[str, float]
    conditions: dict[str, Any]
    numerics: dict[str, float]
    target: float
    sd: float
    n: int
    freedom: int
    remarks: tuple[str, ...] = ()
    own: frozenset[str] = frozenset()
    seeds_by: str = "setting"
    observable: str = OBSERVABLE
    others: tuple[Reading, ...] = ()

    @property
    def angle(self) -> Reading:
        """The measured angle that steers the chain."""
        return Reading(self.observable, self.target, self.sd, self.n, self.freedom)

    @property
    def readings(self) -> list[Reading]:
        """All that was measured, that angle first."""
        return [self.angle, *self.others]

    @property
    def margin(self) -> float:
        """Of the equivalence test, deg."""
        return self.sd

    @property
    def record(self) -> dict[str, Any]:
        """What a decision keeps of the plan it was made for."""
        return plain(
            {
                "contact_law": self.contact_law,
                "plan": {
                    "factors": {f.name: [f.low, f.high] for f in self.factors},
                    "fixed": self.fixed,
                    "conditions": self.conditions,
                    "numerics": self.numerics,
                    "observable": self.observable,
                    "target_deg": self.target,
                    "sd_deg": self.sd,
                    "n": self.n,
                    "others": {one.observable: [one.value, one.sd, one.n] for one in self.others},
                },
            }
        )

    def energy(self, point: Mapping[str, float]) -> float:
        """Surface energy (J/m2) of a point: one of its levels, or known."""
        default = on_yade.rig(RIG).parameters[SYMBOLS["G"]]["default"]
        return float(point.get("G", self.fixed.get(SYMBOLS["G"], default)))

    @property
    def idle(self) -> dict[str, str]:
        """{factor: why the contact law cannot represent it}."""
        return IDLE.get(self.contact_law, {})

    def outside(self, point: Mapping[str, float]) -> dict[str, str]:
        """{factor: which range} of the levels that lie outside the screening's, as the boxes may move beyond them."""
        found = {}
        for f in self.factors:
            if abs(f.coded(point[f.name])) > 1 + 1e-6:
                whose = "study.toml" if f.name in self.own else "the source paper's Table 6"
                found[f.name] = f"outside the range {f.low:g} to {f.high:g} of {whose}"
        return found


def steering(observables: Iterable[str]) -> str | None:
    """Which angle of those measured steers the chain: `repose_angle_deg`, else the first; None where there is none."""
    angles = [name for name in observables if name in ANGLES]
    return OBSERVABLE if OBSERVABLE in angles else next(iter(angles), None)


def with_conditions(record: Mapping[str, Any]) -> dict[str, Any]:
    """A record of a plan with what records did not have before: which angle, other readings, the conditions of `ONCE_FIXED`.

    A record of release 0.1 names no protocol, and keeps its conditions: its heaps were made by another one than the default.
    """
    if not (plan := record.get("plan")):
        return dict(record)
    conditions = plan.get("conditions", {})
    if "protocol" in conditions:
        conditions = ONCE_FIXED | conditions
    return {**record, "plan": {"others": {}, "observable": OBSERVABLE} | plan | {"conditions": conditions}}


def without_target(record: Mapping[str, Any]) -> dict[str, Any]:
    """A record of a plan without what was measured: its ranges, conditions, law, and which angle steers."""
    return {**record, "plan": {key: value for key, value in record["plan"].items() if key not in MEASURED}}


def differences(there: Mapping[str, Any], here: Mapping[str, Any]) -> list[str]:
    """What two plans do not share, in words."""

    def shown(value: object) -> str:
        return "not given" if value is None else " to ".join(map(str, value)) if isinstance(value, list) else str(value)

    found = []
    for key in {**here, **there}:
        one, other = there.get(key), here.get(key)
        if isinstance(one, Mapping) and isinstance(other, Mapping):
            found += differences(one, other)
        elif one != other:
            found.append(f"{key} {shown(one)} there, {shown(other)} here")
    return found


def bond(plan: Plan, energy: float) -> float:
    """Bond number of a surface energy (J/m2, at amplification 6) in the heaps of a plan, as the rig computes it."""
    case = on_yade.case(RIG, parameters=plan.fixed, conditions=plan.conditions, numerics=plan.numerics)
    amplification = case["conditions"]["amplification"]
    scale = (amplification / powder_scene.REFERENCE_AMPLIFICATION) ** case["numerics"]["surface_energy_exponent"]
    radius = powder_scene.grain_radius(case["conditions"]["particle_diameter_um"], amplification)
    return float(powder_scene.bond_number(energy * scale, radius, case["parameters"]["powder_density_kg_m3"]))
