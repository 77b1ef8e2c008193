"""What would change a verdict: set-up scatter that is declared nowhere, and held-out rows fitted too.

Replicates of one set-up share its error, so their scatter tells nothing of it. With k standard errors of its cell mean
entered as `setup_sd` of every row the whole question is asked again: k = 1, and where the verdict does not survive
that, the least k that undoes it, by bisection.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, fit_study
from pellet_study.criticism.compare import compare
from pellet_study.criticism.diagnose import Diagnosis, diagnose
from pellet_study.criticism.suspicious import suspicious_row
from pellet_study.criticism.verdicts import FittedToo, Grade, Undone, Verdict
from pellet_study.model.model import Model, key
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Study

HALVINGS = 4  # of one standard error: the scatter that undoes a verdict is known to a sixteenth of it
MOST_ALONE = 6  # held-out conditions that are tried one by one
NAMING = (Verdict.MISSING, Verdict.TIED)


def examined(study: Study, state: CalibratedStudy, found: Diagnosis, gate: float) -> Diagnosis:
    """A diagnosis with what would change it."""
    if found.comparison.judgement.grade != Grade.FITS:
        lone = suspicious_row(study, state, found, gate)
        found = replace(found, comparison=replace(found.comparison, lone_row=lone))
    if found.verdict in (*NAMING, Verdict.UNEXPLAINED):
        tested = bool(
            state.cells.scale_known
        )  # else the scatter about the fit is the measure, and holds that of the set-ups
        found = replace(found, undone=undone(study, state, found, gate) if tested else None, undone_tested=tested)
    if found.verdict in (Verdict.ADEQUATE, Verdict.TIED) and found.comparison.holdout_contradicts:
        too = fitted_too(study, state, gate)
        known = too is not None and (found.verdict == Verdict.ADEQUATE or too.verdict == Verdict.MISSING)
        found = replace(found, fitted_too=too if known else None)
    return found


def undone(study: Study, state: CalibratedStudy, found: Diagnosis, gate: float) -> Undone | None:
    """The least set-up scatter, up to one standard error of a cell mean, that undoes a verdict; None where none does."""
    answer = scattered(study, state, 1.0, gate)
    if stands(found, answer):
        return None
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        there = scattered(study, state, middle, gate)
        if stands(found, there):
            low = middle
        else:
            high, answer = middle, there
    rows = entered(study, state, high)
    return Undone(high, answer.verdict, answer.named, by_rig(rows), by_line(rows))


def stands(found: Diagnosis, other: Diagnosis) -> bool:
    """Whether another diagnosis still names what one found."""
    return other.verdict == found.verdict and set(found.named) <= set(other.named)


def scattered(study: Study, state: CalibratedStudy, standard_errors: float, gate: float) -> Diagnosis:
    """The diagnosis with this much more scatter of every cell mean, entered as `setup_sd` of its rows."""
    larger = replace(study, rows=entered(study, state, standard_errors))
    wider = fit_study(larger, Model(larger, engines=state.model.engines), extra_starts=1, start=state.fit.point)
    return diagnose(larger, wider, gate, compare(larger, wider), propose=False, rank=False)


def entered(study: Study, state: CalibratedStudy, standard_errors: float) -> tuple[Measurement, ...]:
    """The rows with this many standard errors of their cell mean more in `setup_sd`, as it is printed: rounded up."""
    error = {
        (key(state.model.cases[c]), *cell): sd
        for c, cell, sd in zip(state.cells.case, state.cells.setups, state.cells.sd, strict=True)
    }
    rows = []
    for row in study.rows:
        sd = error.get((key(row), row.setup, row.setup_sd))
        rows.append(
            row if sd is None else replace(row, setup_sd=rounded_up(np.hypot(row.setup_sd, standard_errors * sd)))
        )
    return tuple(rows)


def rounded_up(value: float) -> float:
    """A positive number of three digits, not below another."""
    digit = 10.0 ** (np.floor(np.log10(value)) - 2)
    return float(f"{np.ceil(value / digit) * digit:.6g}")


def by_rig(rows: Sequence[Measurement]) -> dict[str, dict[str, float]]:
    """{rig: {observable: median set-up scatter of its fitted rows, in its unit}}."""
    found: dict[str, dict[str, list[float]]] = {}
    for row in rows:
        if row.split == "fit":
            found.setdefault(row.rig, {}).setdefault(row.observable, []).append(row.setup_sd)
    return {rig: {name: float(np.median(sd)) for name, sd in of_rig.items()} for rig, of_rig in found.items()}


def by_line(rows: Sequence[Measurement]) -> tuple[dict[str, Any], ...]:
    """What to enter, row by row."""
    names = ("line", "rig", "observable", "setup_sd")
    return tuple({name: getattr(row, name) for name in names} for row in rows if row.split == "fit")


def fitted_too(study: Study, state: CalibratedStudy, gate: float) -> FittedToo | None:
    """The held-out conditions whose rows, fitted too, would let an effect be named; one of them where it is enough.

    Of single ones that let exactly one effect be named before those that leave a tie.
    """
    held = list(dict.fromkeys(key(row) for row in study.rows if row.split == "holdout"))
    sets: list[Sequence[tuple]] = [[one] for one in held[:MOST_ALONE]] if len(held) > 1 else []
    tied = None
    for some in [*sets, held]:
        rows = tuple(replace(row, split="fit") if key(row) in some else row for row in study.rows)
        larger = replace(study, rows=rows)
        refitted = fit_study(larger, Model(larger, engines=state.model.engines))
        found = diagnose(larger, refitted, gate, propose=False, rank=False)
        if found.verdict not in NAMING:
            continue
        conditions = tuple(conditions_of(study, one) for one in some)
        answer = FittedToo(conditions, found.verdict, found.named, bool(found.drifting))
        if found.verdict == Verdict.MISSING and not found.drifting:
            return answer
        tied = answer if tied is None or (tied.drifting and not answer.drifting) else tied
    return tied


def conditions_of(study: Study, case: tuple) -> dict[str, str | float]:
    """The rig of a case and those of its conditions that vary over the rig's rows."""
    rig, _, conditions, _ = case
    rows = [row for row in study.rows if row.rig == rig]
    varying = {name: value for name, value in conditions if len({row.conditions[name] for row in rows}) > 1}
    return {"rig": rig, **varying}
