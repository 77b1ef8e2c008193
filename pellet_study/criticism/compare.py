"""How well the present model fits, and where it fails, without asking why.

Lack of fit: chi2 of the cell means over its degrees of freedom against F(n - p, nu), nu the degrees of freedom of the
scatter of readings; over all cells, and rig by rig, as a misfit of one rig drowns in the scatter of the others.
Constancy (Box & Hunter 1962, doi:10.1080/00401706.1962.10490015, as score tests): does a calibrated constant drift with
a condition? The direction J_k s(log c), s standardised over the rig's cells (and its square, and for a constant that
several rigs share the rig itself), freed of what the calibration absorbs, against the residual; significance of the
largest over all directions by Monte Carlo.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, fit_study
from pellet_study.criticism.constancy import DRIFT, Drift, constancy_tests
from pellet_study.criticism.holdout import holdout_p, level_out_errors
from pellet_study.criticism.intervals import intervals_of
from pellet_study.criticism.lack_of_fit import LACK_IN_A_RIG, absorbed_basis, lack_by_rig, lack_of_fit, needed_setup
from pellet_study.criticism.least_squares import ROUNDS
from pellet_study.criticism.residuals import RowResidual, row_residuals
from pellet_study.study.study import Study

# p over all rigs together below which a model fails; the gate of `diagnose` has most of the 5 % of alarms that nothing
# hidden may raise, so that little is left for lack of fit and drift
LACK_OF_FIT = 0.001
HELD_OUT_FAILS = 0.001  # p of the rows held out, as strict as lack of fit


@dataclass(frozen=True)
class Comparison:
    """A calibrated model beside the measurements; what cannot be known is None.

    `chi2`, `dof` count rows; `lack_of_fit_p` compares cell means with the scatter of readings; `needed_setup_percent`
    maps a rig to the set-up scatter, in percent of the reading, that would excuse its misfit; `rig_lack_of_fit_p` maps
    it to the p of its own cells alone. `holdout_p`: are the rows held out as far off as readings and constants scatter?
    `converged`: did the fit settle within its rounds?
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
    converged: bool = True

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
        """`fits`, or None where the data, or a fit that did not end, cannot say."""
        unsaid = self.lack_of_fit_p is None if self.fits else not self.converged
        return None if unsaid else self.fits


def compare(study: Study, state: CalibratedStudy | None = None, level_out: bool = False) -> Comparison:
    """Calibrate a study's present model and look at what is left; `level_out` also refits without each level."""
    state = state or fit_study(study)
    model, cells, fitted = state.model, state.cells, state.fit
    names = [model.names[c] for c in fitted.problem.free]
    intervals, loose = intervals_of(state)
    stuck = tuple(name for name, at_bound in zip(names, fitted.at_bound, strict=True) if at_bound)
    loose = tuple(name for name in loose if name not in stuck)
    rows = row_residuals(state)
    comparison = Comparison(
        effects=tuple(study.effects),
        parameters={
            **{n: float(s.value) for n, s in model.settings.items()},
            **dict(zip(names, map(float, fitted.values), strict=True)),
        },
        intervals=intervals,
        not_identified=loose,
        at_bound=stuck,
        chi2=fitted.chi2 + cells.replicate_chi2 if cells.scale_known else None,
        dof=sum(row.split == "fit" for row in study.rows) - len(names),
        lack_of_fit_p=lack_of_fit(fitted, cells),
        drifts=constancy_tests(state),
        needed_setup_percent=needed_setup(state),
        rows=rows,
        rms_error=rms_error(rows, "fit"),
        holdout_rms_error=rms_error(rows, "holdout"),
        rms_error_unit=unit_of_rms(rows),
        warnings=(*cells.warnings, *model.warnings, *warnings_of(state, stuck, loose)),
        level_out_rms_error=level_out_errors(state) if level_out else None,
        rig_lack_of_fit_p=lack_by_rig(state),
        holdout_p=holdout_p(state, rows),
        converged=fitted.settled,
    )
    if comparison.judged and comparison.holdout_p is not None and comparison.holdout_p < HELD_OUT_FAILS:
        worst = max(abs(r.z) for r in rows if r.row.split == "holdout" and r.z is not None)
        note = f"the rows held out contradict the model (p < {HELD_OUT_FAILS:g}, the worst is {worst:.1f} standard errors off)"
        comparison = replace(comparison, warnings=(*comparison.warnings, note))
    return comparison


def warnings_of(state: CalibratedStudy, stuck: Sequence[str], loose: Sequence[str]) -> list[str]:
    """What to know of a fit: too few cases for it, constants at their bounds or not identified, or that act nowhere."""
    warnings = list(state.study.remarks)
    if not state.fit.settled:
        warnings.append(
            f"the calibration did not end within {ROUNDS} rounds: its values are not the best, chi2 is too large; in study.toml "
            "narrow min and max of the free parameters, or begin nearer to the answer with `value`"
        )
    if len(state.cells.case) <= absorbed_basis(state.fit.jacobian).shape[1]:
        warnings.append(
            "there are as many free parameters as different cases: any model fits, "
            "these data can show no missing effect; measure under more conditions"
        )
    if stuck:
        warnings.append(
            f"{', '.join(stuck)} at the bound of its range: the range, or the model, does not hold the data; where the data "
            "may be right, widen the range first"
        )
    if loose:
        warnings.append(f"not identified by these data: {', '.join(loose)}")
    for name, setting in state.study.parameters.items():
        if setting.free and name not in state.model.column:
            warnings.append(f"{name} is free, but acts in none of the rigs used")
    return warnings


def _one_observable(rows: Sequence[RowResidual]) -> bool:
    return len({r.row.observable for r in rows}) == 1


def unit_of_rms(rows: Sequence[RowResidual]) -> str:
    """The unit of `rms_error`: the observable's where there is but one, else standard uncertainties."""
    return rows[0].row.observable.rsplit("_", 1)[-1] if _one_observable(rows) else "standard uncertainties"


def rms_error(rows: Sequence[RowResidual], split: str) -> float | None:
    """Root of the mean squared residual of the rows of a split, in `unit_of_rms`; None without rows, or where unknown."""
    one = _one_observable(rows)
    errors = [r.residual if one else r.z for r in rows if r.row.split == split]
    known = [e for e in errors if e is not None]
    return float(np.sqrt(np.mean(np.square(known)))) if known and len(known) == len(errors) else None
