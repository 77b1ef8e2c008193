"""The validation: does the setting give the measured angle? New heaps, and a test of equivalence."""

from collections.abc import Mapping, Sequence
from dataclasses import fields

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from pellet_study.doe import validation
from pellet_study.errors import SimulationError
from pellet_study.powder.decisions import ALPHA, Attempt, Checked, Optimum, Validation
from pellet_study.powder.heaps import SEEDS_A_TRY, SEEDS_OF_READ, Heaps, lost_of, point_at
from pellet_study.powder.identified import corrected_setting
from pellet_study.powder.plan import OBSERVABLE, Plan, Reading, bond
from pellet_study.powder.results import Results
from pellet_study.powder.surface import refitted

LEAST_GAIN = 0.1  # share of what the heaps miss below which a correction inside the box is not worth new heaps


def validate(heaps: Heaps, results: Results) -> Validation:
    """Heaps at the optimum with seeds nobody has used: is their mean the measured angle?

    Where that is not shown, the setting is corrected along the surface's gradient by what is missing (where more than the
    angle was measured, to the setting that agrees best once the surfaces pass through these heaps), and validated anew with
    other seeds. Both attempts stay in the table and in the decision; the last one counts. There is no
    second one where the box has nothing nearer to the target along that gradient, nor where the measured angle is known so
    badly that no heaps can show equivalence and the heaps do not differ from it.
    """
    point, nothing_nearer = chosen(results), False
    tables: list[pd.DataFrame] = []
    attempts: list[Attempt] = []
    results.declare_margin("validation")
    first = SEEDS_OF_READ if results.read_setting else 0
    while True:
        runs = enough_heaps(heaps, point, first + SEEDS_A_TRY * len(attempts))
        tables.append(runs.assign(attempt=len(attempts)))
        results.write_table("validation", "runs", pd.concat(tables, ignore_index=True))
        attempts.append(judged(heaps, results, runs, point))
        if attempts[-1].passed or len(attempts) == heaps.sizes.attempts:
            break
        if attempts[-1].beyond_showing:
            break
        better = corrected(heaps, results, point, attempts[-1])
        if nothing_nearer := better is None:
            break
        point = better
    whole = (runs["verdict"] == "ok").idxmax()  # the first that gave an angle
    heaps.keep_grains(point, int(runs.loc[whole, "seed"]), results.grains)
    last = {f.name: getattr(attempts[-1], f.name) for f in fields(Attempt)}
    decision = Validation(**last, attempts=attempts, nothing_nearer=nothing_nearer)
    results.write_decision("validation", decision)
    return decision


def chosen(results: Results) -> dict[str, float]:
    """The setting to validate: the optimum; where it is read from another chain, what that chain's validation left."""
    other = results.read_setting
    if other is not None and (other / "validation" / "decision.json").exists():
        validated: Validation = results.checked(other, "validation")
        return validated.point
    best: Optimum = results.decision("optimum")
    return best.point


def enough_heaps(heaps: Heaps, point: Mapping[str, float], first: int) -> pd.DataFrame:
    """As many heaps at a setting as the wanted standard error of their mean needs, and a quarter of the margin of other readings.

    It stops once their scatter so far is small enough, sooner where that happens to come out small: the standard error
    is then a little too small, and so is the chance stated of passing a setting just outside the margin. It also stops
    where the mean's 95 % interval lies outside the margin: more heaps of that setting could not pass.
    """
    sizes, number = heaps.sizes, heaps.sizes.fewest
    while True:
        runs = heaps.at("validation", [point] * number, first=first)
        good = runs[runs["verdict"] == "ok"]
        error = error_of(good[OBSERVABLE])
        if any(good[o.observable].notna().sum() < 2 for o in heaps.plan.others):
            return runs  # none of more heaps would have it
        wanted = max(
            [error / sizes.wanted_error, *(error_of(good[o.observable]) / (o.sd / 4) for o in heaps.plan.others)]
        )
        if wanted <= 1 or number >= sizes.most:
            return runs
        if any(hopeless(one, good[column_of(one, heaps.plan)]) for one in heaps.plan.readings):
            return runs
        more = number * wanted**2
        number = int(min(sizes.most, max(number + 1, np.ceil(more)))) if np.isfinite(more) else sizes.most


def column_of(reading: Reading, plan: Plan) -> str:
    """The column of the heaps that has a reading: the angle that steers has one of its own."""
    return OBSERVABLE if reading.observable == plan.observable else reading.observable


def error_of(readings: pd.Series) -> float:
    """Standard error of the mean of the heaps that have a reading; infinite where fewer than two have."""
    number = readings.notna().sum()
    return float(readings.std(ddof=1) / np.sqrt(number)) if number > 1 else np.inf


def hopeless(reading: Reading, found: pd.Series) -> bool:
    """Whether the 95 % interval of the mean of heaps lies outside the margin around what was measured."""
    error, number = error_of(found), found.notna().sum()
    if not np.isfinite(error):
        return False
    return bool(abs(float(found.mean()) - reading.value) - stdtrit(number - 1, 0.975) * error > reading.sd)


def judged(heaps: Heaps, results: Results, runs: pd.DataFrame, point: Mapping[str, float]) -> Attempt:
    """The mean of heaps at a setting against the measured angle, and against what else was measured."""
    plan, level = heaps.plan, ALPHA / heaps.sizes.attempts
    whole = heaps.good(runs, "validation", 2)
    for one in plan.others:
        if whole[one.observable].notna().sum() < 2:
            raise SimulationError(
                f"{one.observable} was measured, but fewer than two of the {len(whole)} heaps at the setting have it; take its row "
                "out of the measurements"
            )
    best: Optimum = results.decision("optimum")
    sample = validation.sample_of(whole[OBSERVABLE])
    others = [checked(one, whole[one.observable], level) for one in plan.others]
    return attempt_at(plan, sample, point, level, best.factors, heaps=len(runs), lost=lost_of(runs), others=others)


def attempt_at(
    plan: Plan,
    sample: validation.Sample,
    point: Mapping[str, float],
    level: float,
    factors: list[str],
    *,
    heaps: int,
    lost: int,
    others: Sequence[Checked] = (),
) -> Attempt:
    """Heaps at a setting, by their mean and scatter (deg), against the measured angle; each one-sided test at `level`."""
    assert sample.sd is not None
    mean, target, error = sample.mean, plan.target, sample.sd / sample.n**0.5
    tested = validation.equivalence(sample, plan.angle.sample, plan.margin, alpha=level)
    half = float(stdtrit(sample.n - 1, 0.975) * error)
    return Attempt(
        mean_deg=mean,
        sd_deg=sample.sd,
        standard_error_deg=error,
        interval_deg=[mean - half, mean + half],
        heaps=heaps,
        lost=lost,
        measured_deg=target,
        error_percent=100 * abs(mean - target) / target,
        error_interval_percent=[100 * (mean - half - target) / target, 100 * (mean + half - target) / target],
        margin_deg=plan.margin,
        p_tost=tested.p,
        equivalent=tested.equivalent,
        p_difference=tested.p_difference,
        attainable=plan.angle.attainable(level),
        point=dict(point),
        factors=factors,
        outside=plan.outside(point),
        bond_number=bond(plan, plan.energy(point)),
        others=list(others),
    )


def checked(reading: Reading, found: pd.Series, level: float) -> Checked:
    """The mean of heaps against another reading that was measured, within its own standard deviation."""
    tested = validation.equivalence(validation.sample_of(found.dropna()), reading.sample, reading.sd, alpha=level)
    return Checked(
        observable=reading.observable,
        mean=float(found.mean()),
        standard_error=error_of(found),
        measured=reading.value,
        margin=reading.sd,
        p_tost=tested.p,
        equivalent=tested.equivalent,
        p_difference=tested.p_difference,
        attainable=reading.attainable(level),
    )


def corrected(heaps: Heaps, results: Results, point: Mapping[str, float], attempt: Attempt) -> dict[str, float] | None:
    """The setting moved by what its heaps miss; None where the box leaves no way."""
    if heaps.plan.others:
        means = [attempt.mean_deg, *(one.mean for one in attempt.others)]
        nearer = corrected_setting(heaps.plan, results, point, means)
        then = (
            "the box has nothing that agrees better"
            if nearer is None
            else "the setting is corrected and validated anew"
        )
        heaps.say(f"  validation: not all readings are shown to be met; {then}")
        return None if nearer is None else {**point, **nearer}
    mean = attempt.mean_deg
    fitted = refitted(results)
    factors = fitted.table.factors
    coded = np.array([f.coded(point[f.name]) for f in factors])
    gradient = np.ravel(fitted.model.gradient(coded))
    miss = heaps.plan.target - mean
    better = np.clip(coded + miss * gradient / (gradient @ gradient), -1, 1)
    if np.sign(miss) * gradient @ (better - coded) < LEAST_GAIN * abs(miss):
        heaps.say(
            f"  validation: {mean:.2f} deg is not shown to be the measured angle, but along the gradient the box has nothing nearer: it is not corrected"
        )
        return None
    heaps.say(
        f"  validation: {mean:.2f} deg is not shown to be the measured angle; the setting is corrected and validated anew"
    )
    return {**point, **point_at(factors, better)}
