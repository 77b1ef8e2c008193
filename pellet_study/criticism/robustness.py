"""What would change a verdict: set-up scatter that is declared nowhere, and held-out rows fitted too.

Replicates of one set-up share its error, so their scatter tells nothing of it. With a variance of k^2 standard errors
squared added to that of every cell mean the whole question is asked again: k = 1, and where the verdict does not survive
that, the least k that undoes it, by bisection.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, fit_study, widened
from pellet_study.criticism.compare import compare
from pellet_study.criticism.diagnose import Diagnosis, diagnose
from pellet_study.criticism.entries import lone_row
from pellet_study.criticism.least_squares import fit, problem_of
from pellet_study.criticism.verdicts import FittedToo, Grade, Undone, Verdict
from pellet_study.model.model import Model, key
from pellet_study.study.study import Study

HALVINGS = 4  # of one standard error: the scatter that undoes a verdict is known to a sixteenth of it
MOST_ALONE = 6  # held-out conditions that are tried one by one
NAMING = (Verdict.MISSING, Verdict.TIED)


def examined(study: Study, state: CalibratedStudy, found: Diagnosis, gate: float) -> Diagnosis:
    """A diagnosis with what would change it."""
    compared = found.comparison
    if compared.lone_row is None and compared.judgement.grade != Grade.FITS:
        lone = lone_row(state, compared.rows, compared.far_off)
        found = replace(found, comparison=replace(compared, lone_row=lone))
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
    return Undone(high, answer.verdict, answer.named, by_rig(state, high))


def stands(found: Diagnosis, other: Diagnosis) -> bool:
    """Whether another diagnosis still names what one found."""
    return other.verdict == found.verdict and set(found.named) <= set(other.named)


def scattered(study: Study, state: CalibratedStudy, standard_errors: float, gate: float) -> Diagnosis:
    """The diagnosis with this much more scatter of every cell mean."""
    cells = widened(state.cells, (standard_errors * state.cells.sd) ** 2)
    fitted = fit(state.model, cells, problem_of(state.model, 1, state.fit.point))
    wider = CalibratedStudy(study, state.model, cells, fitted)
    return diagnose(study, wider, gate, compare(study, wider), propose=False, rank=False)


def by_rig(state: CalibratedStudy, standard_errors: float) -> dict[str, dict[str, float]]:
    """{rig: {observable: set-up scatter in its unit}} at the median standard error of its cells."""
    found: dict[str, dict[str, float]] = {}
    cases = [state.model.cases[c] for c in state.cells.case]
    for rig, observable in dict.fromkeys((case.rig, case.observable) for case in cases):
        sd = [
            s for case, s in zip(cases, state.cells.sd, strict=True) if (case.rig, case.observable) == (rig, observable)
        ]
        found.setdefault(rig, {})[observable] = float(standard_errors * np.median(sd))
    return found


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
        answer = FittedToo(tuple(conditions_of(study, one) for one in some), found.verdict, found.named)
        if found.verdict == Verdict.MISSING:
            return answer
        tied = tied or answer
    return tied


def conditions_of(study: Study, case: tuple) -> dict[str, str | float]:
    """The rig of a case and those of its conditions that vary over the rig's rows."""
    rig, _, conditions, _ = case
    rows = [row for row in study.rows if row.rig == rig]
    varying = {name: value for name, value in conditions if len({row.conditions[name] for row in rows}) > 1}
    return {"rig": rig, **varying}
