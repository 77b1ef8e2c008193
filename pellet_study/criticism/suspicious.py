"""A row that no explanation of the others agrees with: typed wrong, as far as the other rows tell, even beside a hidden effect.

The worst rows, by each rival's fit, are held out one by one, and the whole question is asked of the others. A row is named
where they are explained, by the present model or by candidates, and each of these explanations puts it so far off that
chance does so once in a thousand data sets, over all rows. Where candidates explain all rows, leaving one out must do
better by more than a tie allows and by what the best of so many rows gains by chance: else the effect is the reason.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, fit_study, reduced_chi2
from pellet_study.criticism.compare import Comparison, compare
from pellet_study.criticism.diagnose import Diagnosis, diagnose
from pellet_study.criticism.entries import TRIED, LoneRow, as_predicted
from pellet_study.criticism.explanations import TIE
from pellet_study.criticism.grades import judged, tests_of
from pellet_study.criticism.holdout import holdout_p
from pellet_study.criticism.lack_of_fit import lack_of_fit
from pellet_study.criticism.least_squares import Fit
from pellet_study.criticism.residuals import row_residuals
from pellet_study.criticism.verdicts import Grade, Verdict
from pellet_study.model.model import Model, key
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Study

WRONG = 0.001  # p over all rows that the row named is as far off by chance, as of readings beside their replicates
EXPLAINED = (Verdict.MISSING, Verdict.TIED)


def suspicious_row(study: Study, state: CalibratedStudy, found: Diagnosis, gate: float) -> LoneRow | None:
    """The row that no explanation of the others agrees with; None where there is none, or several are."""
    cells = state.cells
    if not cells.scale_known or state.model.scatters or len(cells.case) - 1 <= len(state.fit.problem.free):
        return None
    named = []
    for row in worst_rows(state, [state.fit, *(rival.fit for rival in found.rivals)]):
        lone = without(study, state, found, row, gate)
        named += [lone] if lone is not None else []
    return min(named, key=lambda item: item[0])[1] if named else None


def worst_rows(state: CalibratedStudy, fits: Sequence[Fit]) -> list[Measurement]:
    """The rows without replicates that some fit leaves farthest off, in errors that a row of its leverage has; `TRIED` of them."""
    places = [key(row) for row in state.study.rows if row.split == "fit"]
    size: dict[tuple, float] = {}
    for fitted in fits:
        free = fitted.jacobian[:, ~fitted.at_bound]
        leverage = (
            np.einsum("ij,ji->i", free, np.linalg.pinv(free)) if free.shape[1] else np.zeros(len(fitted.residual))
        )
        off = np.abs(fitted.residual) / np.sqrt(np.maximum(1 - leverage, 1e-6)) / np.linalg.norm(fitted.residual)
        for case, z in zip(state.cells.case, off, strict=True):
            where = key(state.model.cases[case])
            size[where] = max(size.get(where, 0.0), float(z))
    alone = [row for row in state.study.rows if row.split == "fit" and places.count(key(row)) == 1]
    return sorted(alone, key=lambda row: -size[key(row)])[:TRIED]


def without(
    study: Study, state: CalibratedStudy, found: Diagnosis, row: Measurement, gate: float
) -> tuple[float, LoneRow] | None:
    """What is left without a row, and the row, where all explanations of the others contradict it."""
    fitted = [r for r in study.rows if r.split == "fit"]
    rows = tuple(replace(r, split="holdout") if r is row else r for r in fitted)
    smaller = replace(study, rows=rows)
    left = fit_study(smaller, Model(smaller, engines=state.model.engines), extra_starts=1, start=state.fit.point)
    compared = compare(smaller, left)
    answer = diagnose(smaller, left, gate, compared, propose=False, rank=False)
    explained = [r for r in answer.rivals if r.effects in answer.named] if answer.verdict in EXPLAINED else []
    fits = [r.fit for r in explained] or [left.fit]
    if answer.verdict not in (*EXPLAINED, Verdict.ADEQUATE) or (
        not explained and compared.judgement.grade == Grade.FAILS
    ):
        return None
    best = fits[0]
    if found.verdict in EXPLAINED:
        least = min(r.fit.chi2 for r in found.rivals if r.effects in found.named)
        more = len(best.problem.free) - len(found.rivals[0].fit.problem.free)
        cost = 2.0 * (more + 1) + 2.0 * np.log(len(fitted)) + TIE
        if best.chi2 + cost * reduced_chi2(left, best) > least:
            return None
    for one in fits:
        there = replace(left, fit=one)
        p = holdout_p(there, row_residuals(there))
        if p is None or p * len(fitted) > WRONG:
            return None
    return float(best.chi2), named_row(left, best, row, compared, explained[0].effects if explained else ())


def named_row(
    left: CalibratedStudy, best: Fit, row: Measurement, compared: Comparison, effects: tuple[str, ...]
) -> LoneRow:
    """The row with what the others predict for it, by their best explanation."""
    case = [key(one) for one in left.model.cases].index(key(row))
    predicted = float(left.model.predict(best.point).mean[0, case])
    unit = left.study.catalogue.rigs[row.rig].units.get(row.observable, "")
    lack = lack_of_fit(best, left.cells)
    grade = compared.judgement.grade if not effects else judged(tests_of(lack, {}, ())).grade
    return LoneRow(row, predicted, grade or Grade.FITS, lack, as_predicted(row.value, predicted, unit), effects)
