"""What `calibrate` takes from a study: its measured angle, the ranges of the seven factors, the parameters that stay."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import chdtrc

from pellet_study.doe.factors import Factor
from pellet_study.errors import InputError
from pellet_study.paper.designs import screening_factors
from pellet_study.powder.plan import ANGLES, DEFAULT_LAW, READINGS, RIG, SYMBOLS, Plan, Reading, steering
from pellet_study.rigs import on_yade
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import SCALINGS, Study

LEAST_FACTORS = 3  # of a Box-Behnken design
CONTRADICTED = 1e-3  # p of the rows' scatter below which their stated sd is not believed


def plan_of(study: Study, contact_law: str | None = None) -> Plan:
    """The chain a study asks for.

    Raises
    ------
    InputError : no measured repose angle, or several under different conditions, or none with a standard deviation;
        an angle that no heap has; anything the chain cannot hold or vary as the study says
    """
    law = contact_law or study.contact_law or DEFAULT_LAW
    refuse_law(study, law)
    readings = measured_rows(study)
    rows = next(iter(readings.values()))
    known = rows[0].parameters
    refuse_effects(study)
    factors = factors_of(study, known)
    fixed = fixed_of(study, known)
    (value, sd, n, freedom), remarks = measured_reading(rows)
    if not 0 < value < 90:
        raise InputError(f"the measured repose angle is {value:g} deg; expected one above 0 and below 90")
    others = []
    for observable, more in list(readings.items())[1:]:
        of_it, said = measured_reading(more)
        others.append(Reading(observable, *of_it))
        remarks += said
    return Plan(
        law,
        factors,
        fixed,
        dict(rows[0].conditions),
        {"surface_energy_exponent": SCALINGS[study.surface_energy_scaling]},
        value,
        sd,
        n,
        freedom,
        remarks,
        own=frozenset(f.name for f in factors if SYMBOLS[f.name] in study.parameters),
        seeds_by=study.seeds_by,
        observable=rows[0].observable,
        others=tuple(others),
    )


def refuse_law(study: Study, law: str) -> None:
    """A law that cannot have an effect to which one of the factors A to G belongs cannot be calibrated with.

    Raises
    ------
    InputError : says why
    """
    for effect in study.catalogue.effects.values():
        if (why := effect.not_with.get(RIG, {}).get(law)) and set(effect.owns) & set(SYMBOLS.values()):
            raise InputError(f"calibrate varies {', '.join(effect.owns)}, but {why}")


def measured_rows(study: Study) -> dict[str, list[Measurement]]:
    """{observable: its rows}, all under one condition; the angle that steers the chain comes first.

    That is `repose_angle_deg` where it was measured, else the first angle of the file.

    Raises
    ------
    InputError : no angle was measured, or the rows differ in their conditions or in what is known of them
    """
    rows = [r for r in study.rows if r.rig == RIG and r.observable in READINGS and r.split == "fit"]
    angle = steering(row.observable for row in rows)
    if angle is None:
        raise InputError(
            f"the measurements have no repose angle of the rig {RIG} ({', '.join(ANGLES)}); calibrate is steered by one"
        )
    if any(dict(row.conditions) != dict(rows[0].conditions) for row in rows):
        raise InputError(
            "calibrate meets readings of one pouring, but the rows differ in their conditions; keep one of them, or use compare"
        )
    if any(dict(row.parameters) != dict(rows[0].parameters) for row in rows):
        raise InputError(
            "calibrate meets readings of one pouring, but the rows differ in what is known of them; use compare"
        )
    names = dict.fromkeys([angle, *(row.observable for row in rows)])
    return {name: [row for row in rows if row.observable == name] for name in names}


def factors_of(study: Study, known: Mapping[str, float]) -> list[Factor]:
    """The factors A to G with the ranges of the study, else of the paper's Table 6; without those that are known.

    Raises
    ------
    InputError : fewer than the surface needs are left
    """
    factors = []
    for printed in screening_factors():
        name = SYMBOLS[printed.name]
        setting = study.parameters.get(name)
        if name in known or (setting is not None and not setting.free):
            continue
        if setting is None or setting.low is None or setting.high is None:
            factors.append(printed)
        else:
            factors.append(Factor(printed.name, setting.low, setting.high, printed.unit))
    if len(factors) < LEAST_FACTORS:
        raise InputError(
            f"only {', '.join(f.name for f in factors) or 'none'} of A to G is left to vary, the others are known; expected "
            f"{LEAST_FACTORS} or more: give min and max of another, or use compare"
        )
    return factors


def fixed_of(study: Study, known: Mapping[str, float]) -> dict[str, float]:
    """{parameter: value} that stays: of the rig in the study, A to G among them, and those known for the measured angle.

    Raises
    ------
    InputError : the study leaves one of them free that calibrate does not vary
    """
    of_rig = {
        name: setting
        for name, setting in study.parameters.items()
        if name in on_yade.rig(RIG).parameters and name not in known
    }
    for name, setting in of_rig.items():
        if setting.free and name not in SYMBOLS.values():
            raise InputError(
                f"study.toml gives {name} a min and max, but calibrate varies only A to G ({', '.join(SYMBOLS.values())}); "
                f"give its value alone, {name} = {setting.value:g}, or use compare"
            )
    return {name: setting.value for name, setting in of_rig.items() if not setting.free} | dict(known)


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
            instead = [f"{symbol} ({p})" for symbol, p in SYMBOLS.items() if p in effect.owns]
            raise InputError(
                f"study.toml has the effect {name}, but calibrate varies only the parameters A to G: write "
                f"{name} = {{ {effect.amount} = {absent:g} }}"
                + (f" and give min and max of {' and '.join(instead)}" if instead else ", or use compare")
            )


def measured_reading(rows: Sequence[Measurement]) -> tuple[tuple[float, float, int, int], tuple[str, ...]]:
    """Mean of the rows, standard deviation of a reading, number of readings, degrees of freedom of that sd; and remarks.

    A row is a mean of n readings, so the scatter of k rows about their mean gives that of a reading as
    sum n (value - mean)^2 / (k - 1). It is taken where no row has an sd, and where it contradicts those stated
    (chi-squared); else the stated ones, pooled, stand for the rows without one too.

    Raises
    ------
    InputError : neither an sd nor rows that differ
    """
    what = "repose angle" if rows[0].observable in ANGLES else rows[0].observable
    n = sum(row.n for row in rows)
    mean = sum(row.n * row.value for row in rows) / n
    squares = sum(row.n * (row.value - mean) ** 2 for row in rows)
    stated = [(row.n, row.sd) for row in rows if row.sd is not None]
    if not stated:
        if squares == 0:
            few = f"the {what} has no sd" if len(rows) == 1 else f"the rows of the {what} have no sd and are all equal"
            why = (
                "takes it as the margin of the validation" if rows[0].observable in ANGLES else "weighs readings by it"
            )
            raise InputError(f"{few}: calibrate {why}; give it")
        return (mean, float(np.sqrt(squares / (len(rows) - 1))), n, len(rows) - 1), ()
    sd = float(np.sqrt(sum(k * sd_k**2 for k, sd_k in stated) / sum(k for k, _ in stated)))
    if len(rows) > 1 and chdtrc(len(rows) - 1, squares / sd**2) < CONTRADICTED:
        wider = float(np.sqrt(squares / (len(rows) - 1)))
        unit = on_yade.rig(RIG).units[rows[0].observable]
        angle = rows[0].observable in ANGLES
        remark = (
            f"the measured {'angles' if angle else f'rows of {what}'} contradict their sd of {sd:g} {unit}: they scatter as "
            f"readings with an sd of {wider:.2g} {unit}, which is taken{', as the margin too' if angle else ''}"
        )
        return (mean, wider, n, len(rows) - 1), (remark,)
    return (mean, sd, n, sum(k - 1 for k, _ in stated)), ()
