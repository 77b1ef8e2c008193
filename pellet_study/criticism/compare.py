"""How well the present model fits, and where it fails, without asking why.

Lack of fit: chi2 of the cell means over its degrees of freedom against F(n - p, nu), nu the degrees of freedom of the
scatter of readings; over all cells, and rig by rig, as a misfit of one rig drowns in the scatter of the others.
Constancy (Box & Hunter 1962, doi:10.1080/00401706.1962.10490015, as score tests): does a calibrated constant drift with
a condition? The direction J_k s(log c), s standardised over the rig's cells (and its square, and for a constant that
several rigs share the rig itself), freed of what the calibration absorbs, against the residual; significance of the
largest over all directions by Monte Carlo.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy import special

from pellet_study.criticism.calibration import CalibratedStudy, fit_study
from pellet_study.criticism.residuals import RowResidual, holdout_p, level_out_errors, row_residuals
from pellet_study.criticism.score_tests import (
    DRIFT,
    LACK_IN_A_RIG,
    Drift,
    absorbed_basis,
    constancy_tests,
    lack_by_rig,
    lack_of_fit,
)
from pellet_study.study.study import Study

LACK_OF_FIT = 0.001  # p over all rigs together below which a model fails
HELD_OUT_FAILS = 0.001  # p of the rows held out
IDENTIFIED = 0.5  # a constant is identified where its 95 % interval is narrower than this share of its range


@dataclass(frozen=True)
class Comparison:
    """A calibrated model beside the measurements; what cannot be known is None.

    `chi2`, `dof` count rows; `lack_of_fit_p` compares cell means with the scatter of readings; `needed_setup_percent`
    maps a rig to the set-up scatter, in percent of the reading, that would excuse its misfit; `rig_lack_of_fit_p` maps
    it to the p of its own cells alone. `holdout_p`: are the rows held out as far off as readings and constants scatter?
    """

    effects: tuple[str, ...]
    parameters: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    not_identified: tuple[str, ...]
    at_bound: tuple[str, ...]
    chi2: float | None
    dof: int
    lack_of_fit_p: float | None
    drifts: tuple[Drift, ...]
    needed_setup_percent: dict[str, float]
    rows: tuple[RowResidual, ...]
    rms_error: float | None
    holdout_rms_error: float | None
    rms_error_unit: str
    warnings: tuple[str, ...]
    level_out_rms_error: dict[str, float] | None = None
    rig_lack_of_fit_p: dict[str, float] = field(default_factory=dict)
    holdout_p: float | None = None

    @property
    def fits(self) -> bool:
        """Neither lack of fit, over all or in one rig, nor a drifting constant."""
        by_rig = self.rig_lack_of_fit_p.values()
        return (
            (self.lack_of_fit_p is None or self.lack_of_fit_p >= LACK_OF_FIT)
            and all(p >= LACK_IN_A_RIG / len(by_rig) for p in by_rig)
            and not (self.drifts and self.drifts[0].p < DRIFT)
        )

    @property
    def judged(self) -> bool | None:
        """`fits`, or None where the data cannot say."""
        return None if self.fits and self.lack_of_fit_p is None else self.fits


def compare(study: Study, state: CalibratedStudy | None = None, level_out: bool = False) -> Comparison:
    """Calibrate a study's present model and look at what is left; `level_out` also refits without each level."""
    state = state or fit_study(study)
    model, cells, fitted = state.model, state.cells, state.fit
    names = [model.names[c] for c in fitted.problem.free]
    rank = absorbed_basis(fitted.jacobian).shape[1]
    count, fit_rows = len(cells.case), [row for row in study.rows if row.split == "fit"]
    p_fit = lack_of_fit(fitted, cells)
    intervals, loose = intervals_of(state)
    warnings = [*cells.warnings, *model.warnings]
    dof = len(fit_rows) - len(names)
    if count <= rank:
        warnings.append(
            "there are as many free parameters as different cases: any model fits, "
            "these data can show no missing effect; measure under more conditions"
        )
    stuck = tuple(n for n, s in zip(names, fitted.at_bound, strict=True) if s)
    if stuck:
        warnings.append(
            f"{', '.join(stuck)} at the bound of its range: the range, or the model, does not hold the data; where the data "
            "may be right, widen the range first"
        )
    loose = tuple(name for name in loose if name not in stuck)
    if loose:
        warnings.append(f"not identified by these data: {', '.join(loose)}")
    for name, setting in study.parameters.items():
        if setting.free and name not in model.column:
            warnings.append(f"{name} is free, but acts in none of the rigs used")
    sd = {}
    for c, u in zip(cells.case, cells.sd, strict=True):
        sd[c] = u
    rows = row_residuals(state, sd)
    observables = {(r.row.rig, r.row.observable) for r in rows}
    single = len({o for _, o in observables}) == 1
    unit = next(iter(observables))[1].rsplit("_", 1)[-1] if single else "standard uncertainties"

    def rms(split: str) -> float | None:
        errors = [r.residual if single else r.z for r in rows if r.row.split == split]
        if not errors or any(e is None for e in errors):
            return None
        return float(np.sqrt(np.mean(np.square(errors))))

    whole = fitted.chi2 + cells.replicate_chi2 if cells.scale_known else None
    found = Comparison(
        effects=tuple(study.effects),
        parameters={
            **{n: float(s.value) for n, s in model.settings.items()},
            **dict(zip(names, map(float, fitted.values), strict=True)),
        },
        intervals=intervals,
        not_identified=loose,
        at_bound=stuck,
        chi2=whole,
        dof=dof,
        lack_of_fit_p=p_fit,
        drifts=constancy_tests(state),
        needed_setup_percent=needed_setup(state),
        rows=rows,
        rms_error=rms("fit"),
        holdout_rms_error=rms("holdout"),
        rms_error_unit=unit,
        warnings=tuple(warnings),
        level_out_rms_error=level_out_errors(state) if level_out else None,
        rig_lack_of_fit_p=lack_by_rig(state),
        holdout_p=holdout_p(state, rows),
    )
    if found.judged and found.holdout_p is not None and found.holdout_p < HELD_OUT_FAILS:
        worst = max(abs(r.z) for r in rows if r.row.split == "holdout" and r.z is not None)
        note = f"the rows held out contradict the model (p < {HELD_OUT_FAILS:g}, the worst is {worst:.1f} standard errors off)"
        found = replace(found, warnings=(*found.warnings, note))
    return found


def intervals_of(state: CalibratedStudy) -> tuple[dict[str, tuple[float, float]], tuple[str, ...]]:
    """95 % intervals theta +- t b se, cut at the bounds, and the names of the constants the data do not pin down."""
    fitted, cells = state.fit, state.cells
    names = [state.model.names[c] for c in fitted.problem.free]
    if not names:
        return {}, ()
    dof = len(cells.case) - len(names)
    if cells.scale_known:
        t = special.stdtrit(cells.dof, 0.975)
        ratio = np.sqrt(fitted.chi2 / dof) if dof > 0 else 1.0
        p = lack_of_fit(fitted, cells)
        if p is not None and p < 0.05 and ratio > 1:
            t = special.stdtrit(dof, 0.975) * ratio
    elif dof > 0:
        t = special.stdtrit(dof, 0.975) * np.sqrt(fitted.chi2 / dof)
    else:
        t = np.inf
    span = fitted.problem.high - fitted.problem.low
    scaled = fitted.jacobian * span
    normal = scaled.T @ scaled
    tiny = np.linalg.eigvalsh(normal).max() * 1e-13 + 1e-300
    se = np.sqrt(np.diag(np.linalg.inv(normal + tiny * np.eye(len(names))))) * span
    found, loose = {}, []
    for k, name in enumerate(names):
        half = t * se[k]
        value, low, high = fitted.values[k], fitted.problem.low[k], fitted.problem.high[k]
        if not 2 * half < IDENTIFIED * span[k]:
            loose.append(name)
        found[name] = (float(max(low, value - half)), float(min(high, value + half)))
    return found, tuple(loose)


def needed_setup(state: CalibratedStudy) -> dict[str, float]:
    """Set-up scatter, percent of the reading, that each rig's cells would need for chi2 = cells - their share of p."""
    cells, fitted = state.cells, state.fit
    if not cells.scale_known:
        return {}
    rigs = np.array([state.model.cases[c].rig for c in cells.case], dtype=object)
    n, p = len(cells.case), len(fitted.problem.free)
    plain = state.cells.mean - state.model.predict(fitted.point).mean[0, cells.case]
    found = {}
    for rig in dict.fromkeys(rigs):
        mine = rigs == rig
        share = mine.sum() * max(n - p, 1) / n
        r, v, y = plain[mine], cells.sd[mine] ** 2, np.abs(cells.mean[mine])

        def chi2(tau, r=r, v=v, y=y):
            return (r**2 / (v + (tau * y) ** 2)).sum()

        low, high = 0.0, 10.0
        if chi2(0.0) > share:
            for _ in range(50):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if chi2(middle) > share else (low, middle)
        else:
            high = 0.0
        found[rig] = 100 * high
    return found
