"""One calibrated constant refitted level by level of a condition, and what each rival makes of it."""

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.criticism.diagnose import Diagnosis

MOST_RIVALS = 4  # curves in one figure
BETTER = 4.0  # chi2, two standard errors, by which a rival must fit better to be drawn


def by_level(state: CalibratedStudy, diagnosis: Diagnosis) -> dict | None:
    """The most drifting constant at each level of the condition it drifts with; None where none drifts.

    At each level one Gauss-Newton step from the fitted value, c + sum(J r)/sum(J^2) with standard error 1/sqrt(sum J^2)
    over the cells of that level (J, r whitened). A rival's curve is the same step for what it predicts there.

    Returns
    -------
    {"parameter", "rig", "condition", "levels", "values", "standard_errors", "present", "rivals": {effects: values}, "units"}
    """
    worst = next((d for d in diagnosis.comparison.drifts if d.condition != "rig"), None)
    if worst is None:
        return None
    model, cells, fitted = state.model, state.cells, state.fit
    column = [model.names[c] for c in fitted.problem.free].index(worst.parameter)
    cases = [model.cases[c] for c in cells.case]
    in_rig = np.array([c.rig == worst.rig for c in cases])
    level = np.array([c.conditions.get(worst.condition, np.nan) for c in cases], dtype=object)
    slope = fitted.jacobian[:, column]
    levels = [x for x in sorted(set(level[in_rig])) if (slope[in_rig & (level == x)] != 0).any()]
    weights = [(slope[in_rig & (level == x)] ** 2).sum() for x in levels]

    def refitted(residual: np.ndarray) -> list[float]:
        steps = [
            (slope[at] * residual[at]).sum() / weight
            for at, weight in zip((in_rig & (level == x) for x in levels), weights, strict=True)
        ]
        return [float(fitted.values[column] + step) for step in steps]

    base = model.predict(fitted.point).mean[0, cells.case]
    rivals = {}
    for rival in [r for r in diagnosis.rivals if r.fit.chi2 < fitted.chi2 - BETTER][:MOST_RIVALS]:
        there = model.predict(rival.fit.point).mean[0, cells.case]
        rivals[" + ".join(rival.effects)] = refitted(cells.whitened(there - base))
    return {
        "parameter": worst.parameter,
        "rig": worst.rig,
        "condition": worst.condition,
        "levels": levels,
        "values": refitted(fitted.residual),
        "standard_errors": [float(1 / np.sqrt(w)) for w in weights],
        "present": float(fitted.values[column]),
        "rivals": rivals,
        "units": {n: u for n, u in state.study.units.items() if n in (worst.parameter, worst.condition)},
    }
