"""What `calibrate` takes from a study: the seven factors of the source paper, what stays, and the angle to meet."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, stdtrit

from pellet_study.doe import validation
from pellet_study.doe.answers import plain
from pellet_study.doe.factors import Factor
from pellet_study.errors import InputError
from pellet_study.paper.designs import screening_factors
from pellet_study.rigs import on_yade
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import BELONGS_TO, SCALINGS, Study
from yade_scripts import powder_scene

RIG, OBSERVABLE = "repose", "repose_angle_deg"
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
DEFAULT_LAW = "cohesive_frictional"
IDLE = {
    "cohesive_frictional": {"A": "the law has no restitution; A is an idle column, its effect an estimate of noise"}
}
CONTRADICTED = 1e-3  # p of the rows' scatter below which their stated sd is not believed


@dataclass(frozen=True)
class Plan:
    """What a study asks of the chain.

    `factors` are the seven of the screening with the ranges of the study (those of `own`) or the paper's Table 6; `fixed`
    the parameters that stay; `target`, `sd`, `n` the measured angle, the standard deviation of a reading and the number of
    readings; `freedom` the degrees of freedom of `sd`; `margin` that of the equivalence test, the measurement's own
    standard deviation; `remarks` what the reader must know.
    """

    contact_law: str
    factors: list[Factor]
    fixed: dict
    conditions: dict
    numerics: dict
    target: float
    sd: float
    n: int
    freedom: int
    remarks: tuple[str, ...] = ()
    own: frozenset[str] = frozenset()

    @property
    def margin(self) -> float:
        return self.sd

    @property
    def measured(self) -> validation.Sample:
        """The measured angle for the test; of a single reading, a known number.

        Of readings whose scatter is known from few rows, as many readings as that scatter has degrees of freedom and one
        more, with the same standard error.
        """
        if self.n == 1:
            return validation.Sample(self.target)
        return validation.Sample(self.target, self.sd * ((self.freedom + 1) / self.n) ** 0.5, self.freedom + 1)

    def attainable(self, level: float) -> bool:
        """Whether enough heaps could show equivalence at a level: the measured mean itself is known well enough."""
        return self.n == 1 or stdtrit(self.freedom, 1 - level) * self.sd / self.n**0.5 < self.margin

    @property
    def record(self) -> dict:
        """What a decision keeps of the plan it was made for."""
        return plain(
            {
                "contact_law": self.contact_law,
                "plan": {
                    "factors": {f.name: [f.low, f.high] for f in self.factors},
                    "fixed": self.fixed,
                    "conditions": self.conditions,
                    "numerics": self.numerics,
                    "target_deg": self.target,
                    "sd_deg": self.sd,
                    "n": self.n,
                },
            }
        )

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


def plan_of(study: Study, contact_law: str | None = None) -> Plan:
    """The chain a study asks for.

    Raises
    ------
    InputError : no measured repose angle, or several under different conditions, or none with a standard deviation;
        an angle that no heap has; anything the chain cannot hold or vary as the study says
    """
    rows = [r for r in study.rows if r.rig == RIG and r.observable == OBSERVABLE and r.split == "fit"]
    if not rows:
        raise InputError(f"the measurements have no row of the rig {RIG}; calibrate needs the measured repose angle")
    if any(dict(row.conditions) != dict(rows[0].conditions) for row in rows):
        raise InputError("calibrate meets one repose angle, but the rows differ in their conditions; use compare")
    if any(dict(row.parameters) != dict(rows[0].parameters) for row in rows):
        raise InputError("calibrate meets one repose angle, but the rows differ in what is known of them; use compare")
    known = rows[0].parameters
    refuse_effects(study)
    factors = []
    for printed in screening_factors():
        name = SYMBOLS[printed.name]
        setting = study.parameters.get(name)
        if name in known:
            raise InputError(
                f"the measurements give {name}, which calibrate varies ({printed.name} of the source paper); leave the "
                "column out, or use compare"
            )
        if setting is not None and setting.free:
            factors.append(Factor(printed.name, setting.low, setting.high, printed.unit))
        elif setting is not None:
            raise InputError(
                f"study.toml fixes {name}, which calibrate varies ({printed.name} of the source paper); "
                "give its min and max, or leave it out for the paper's range"
            )
        else:
            factors.append(printed)
    others = {
        name: setting
        for name, setting in study.parameters.items()
        if name in on_yade.rig(RIG).parameters and name not in (*known, *SYMBOLS.values())
    }
    for name, setting in others.items():
        if setting.free:
            raise InputError(
                f"study.toml gives {name} a min and max, but calibrate varies only A to G ({', '.join(SYMBOLS.values())}); "
                f"give its value alone, {name} = {setting.value:g}, or use compare"
            )
    value, sd, n, freedom, remarks = measured_angle(rows)
    if not 0 < value < 90:
        raise InputError(f"the measured repose angle is {value:g} deg; expected one above 0 and below 90")
    return Plan(
        contact_law or study.contact_law or DEFAULT_LAW,
        factors,
        {name: setting.value for name, setting in others.items()} | dict(known),
        dict(rows[0].conditions),
        {"surface_energy_exponent": SCALINGS[study.surface_energy_scaling]},
        value,
        sd,
        n,
        freedom,
        remarks,
        own=frozenset(f.name for f in factors if SYMBOLS[f.name] in study.parameters),
    )


def refuse_effects(study: Study) -> None:
    """Effects of the rig may be listed in a study only as absent: calibrate varies parameters.

    Raises
    ------
    InputError : one is present, or its amount is free
    """
    for name in study.catalogue.acting(RIG):
        effect = study.catalogue.effects[name]
        amount = study.effects[name][effect.amount] if name in study.effects else None
        absent = effect.neutral()[effect.amount]
        if amount is not None and (amount.free or amount.value != absent):
            instead = [f"{symbol} ({p})" for symbol, p in SYMBOLS.items() if BELONGS_TO.get(p) == name]
            raise InputError(
                f"study.toml has the effect {name}, but calibrate varies only the parameters A to G: write "
                f"{name} = {{ {effect.amount} = {absent:g} }}"
                + (f" and give min and max of {' and '.join(instead)}" if instead else ", or use compare")
            )


def measured_angle(rows: Sequence[Measurement]) -> tuple[float, float, int, int, tuple[str, ...]]:
    """Mean of the rows (deg), standard deviation of a reading (deg), readings, its degrees of freedom, remarks.

    A row is a mean of n readings, so the scatter of k rows about their mean gives that of a reading as
    sum n (value - mean)^2 / (k - 1). It is taken where no row has an sd, and where it contradicts those stated
    (chi-squared); else the stated ones, pooled, stand for the rows without one too.

    Raises
    ------
    InputError : neither an sd nor rows that differ
    """
    n = sum(row.n for row in rows)
    mean = sum(row.n * row.value for row in rows) / n
    squares = sum(row.n * (row.value - mean) ** 2 for row in rows)
    stated = [row for row in rows if row.sd is not None]
    if not stated:
        if squares == 0:
            few = "the repose angle has no sd" if len(rows) == 1 else "the repose angles have no sd and are all equal"
            raise InputError(f"{few}: calibrate takes it as the margin of the validation; give it")
        return mean, float(np.sqrt(squares / (len(rows) - 1))), n, len(rows) - 1, ()
    sd = float(np.sqrt(sum(row.n * row.sd**2 for row in stated) / sum(row.n for row in stated)))
    if len(rows) > 1 and chdtrc(len(rows) - 1, squares / sd**2) < CONTRADICTED:
        wider = float(np.sqrt(squares / (len(rows) - 1)))
        remark = (
            f"the measured angles contradict their sd of {sd:g} deg: they scatter as readings with an sd of {wider:.2g} deg, "
            "which is taken, as the margin too"
        )
        return mean, wider, n, len(rows) - 1, (remark,)
    return mean, sd, n, sum(row.n - 1 for row in stated), ()


def differences(there: Mapping, here: Mapping) -> list[str]:
    """What two plans do not share, in words."""

    def shown(value) -> str:
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
