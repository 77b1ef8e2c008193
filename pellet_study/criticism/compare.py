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

from pellet_study.criticism.bounds import stuck_words
from pellet_study.criticism.calibration import CalibratedStudy, fit_study
from pellet_study.criticism.constancy import Drift, constancy_tests
from pellet_study.criticism.entries import LoneRow, doubted_constants, doubted_sd, doubted_units, far_off, lone_row
from pellet_study.criticism.grades import Judgement, judged, tests_of
from pellet_study.criticism.holdout import holdout_p, level_out_errors
from pellet_study.criticism.intervals import IDENTIFIED, intervals_of
from pellet_study.criticism.lack_of_fit import absorbed_basis, lack_by_rig, lack_of_fit, needed_setup
from pellet_study.criticism.least_squares import ROUNDS
from pellet_study.criticism.likely_unit import LikelyUnit, likely_unit
from pellet_study.criticism.reading_order import order_warnings
from pellet_study.criticism.residuals import RowResidual, noise_shares, row_residuals
from pellet_study.criticism.spread import Scatter
from pellet_study.criticism.time_drift import TimeDrift, time_drifts
from pellet_study.criticism.verdicts import Grade
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Study

HELD_OUT_FAILS = 0.001  # p of the rows held out below which they contradict a model, as strict as lack of fit


@dataclass(frozen=True)
class Comparison:
    """A calibrated model beside the measurements; what cannot be known is None.

    `chi2`, `dof` count rows; `lack_of_fit_p` compares cell means with the scatter of readings; `needed_setup_percent`
    maps a rig to the set-up scatter, in percent of the reading, that would excuse its misfit; `rig_lack_of_fit_p` maps
    it to the p of its own cells alone. `holdout_p`: are the rows held out as far off as readings and constants scatter?
    `converged`: did the fit settle within its rounds? `ranges` holds the free constants' ranges in the study, `range_shares`
    how much of them the 95 % intervals take before they are cut at the bounds; `units` are those declared, `left_out` rows
    that nothing is made of; `time_drifts` how readings go with the order in which they were taken, where that is known;
    `noise_share` is the variance of the simulations over that of the readings, rig by rig. Beyond `far_off` standard errors
    a row is farther off than the worst of so many; `lone_row` is that which alone keeps the model from fitting;
    `contradicted` says how many times its stated sd the replicates of a rig scatter; `cautions` are what the rigs declare
    that a constant may not be taken for; `scatters` hold the scatter of readings against that of simulations at the
    calibrated point, where that was looked for.
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
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    range_shares: dict[str, float] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    left_out: tuple[Measurement, ...] = ()
    time_drifts: tuple[TimeDrift, ...] = ()
    noise_share: dict[str, float] = field(default_factory=dict)
    far_off: float | None = None
    lone_row: LoneRow | None = None
    contradicted: dict[tuple[str, str], float] = field(default_factory=dict)
    cautions: dict[str, str] = field(default_factory=dict)
    scatters: tuple[Scatter, ...] = ()

    @property
    def judgement(self) -> Judgement:
        """How well it fits in a graded word, with the test that decides."""
        return judged(tests_of(self.lack_of_fit_p, self.rig_lack_of_fit_p, self.drifts, self.time_drifts))

    @property
    def fits(self) -> bool:
        """Neither lack of fit, over all or in one rig, nor a drifting constant; a doubtful fit is one."""
        return self.judgement.grade != Grade.FAILS

    @property
    def judged(self) -> bool | None:
        """`fits`, or None where the data, or a fit that did not end, cannot say."""
        unsaid = self.lack_of_fit_p is None if self.fits else not self.converged
        return None if unsaid or self.chi2 is None else self.fits

    @property
    def holdout_contradicts(self) -> bool:
        """Whether the rows held out refute the model; not where nothing tells."""
        return self.holdout_p is not None and self.holdout_p < HELD_OUT_FAILS


def compare(
    study: Study, state: CalibratedStudy | None = None, level_out: bool = False, other_units: bool = False
) -> Comparison:
    """Calibrate a study's present model and look at what is left.

    `level_out` also refits without each level, and it, or `other_units`, with a column in each other unit.
    """
    state = state or fit_study(study)
    model, cells, fitted = state.model, state.cells, state.fit
    names = [model.names[c] for c in fitted.problem.free]
    intervals, shares = intervals_of(state)
    loose: tuple[str, ...] = tuple(name for name, share in shares.items() if not share < IDENTIFIED)
    stuck = tuple(name for name, at_bound in zip(names, fitted.at_bound, strict=True) if at_bound)
    loose = tuple(name for name in loose if name not in stuck)
    rows = row_residuals(state)
    limit, drifts = far_off(state), constancy_tests(state)
    unit = likely_unit(state) if level_out or other_units else None
    values = dict(zip(names, map(float, fitted.values), strict=True))
    comparison = Comparison(
        effects=tuple(study.effects),
        parameters={
            **{n: float(s.value) for n, s in model.settings.items()},
            **values,
        },
        intervals=intervals,
        not_identified=loose,
        at_bound=stuck,
        chi2=fitted.chi2 + cells.replicate_chi2 if cells.scale_known else None,
        dof=sum(row.split == "fit" for row in study.rows) - len(names),
        lack_of_fit_p=lack_of_fit(fitted, cells),
        drifts=drifts,
        needed_setup_percent=needed_setup(state),
        rows=rows,
        rms_error=rms_error(rows, "fit"),
        holdout_rms_error=rms_error(rows, "holdout"),
        rms_error_unit=unit_of_rms(rows),
        warnings=(
            *cells.warnings,
            *model.warnings,
            *warnings_of(state, stuck, loose, unit),
            *(_doubts(state, drifts, values) if unit is None else [unit.words]),
            *order_warnings(state, drifts),
        ),
        level_out_rms_error=level_out_errors(state) if level_out else None,
        rig_lack_of_fit_p=lack_by_rig(state),
        holdout_p=holdout_p(state, rows),
        converged=fitted.settled,
        ranges=ranges_of(state),
        range_shares=shares,
        units=study.units,
        left_out=study.left_out,
        time_drifts=time_drifts(state),
        noise_share=noise_shares(rows),
        far_off=limit,
        contradicted=dict(cells.contradicted),
        cautions=cautions_of(state),
    )
    if level_out and comparison.judgement.grade != Grade.FITS:
        comparison = replace(comparison, lone_row=lone_row(state, rows, limit))
    if comparison.judged and comparison.holdout_contradicts:
        worst = max(abs(r.z) for r in rows if r.row.split == "holdout" and r.z is not None)
        note = f"the rows held out contradict the model (p < {HELD_OUT_FAILS:g}, the worst is {worst:.1f} standard errors off)"
        comparison = replace(comparison, warnings=(*comparison.warnings, note))
    return comparison


def _doubts(state: CalibratedStudy, drifts: Sequence[Drift], values: dict[str, float]) -> list[str]:
    """What looks wrong in the entries, where no unit of a whole column is the likely cause."""
    return [*doubted_units(state), *doubted_sd(state, drifts), *doubted_constants(state, values)]


def warnings_of(
    state: CalibratedStudy, stuck: Sequence[str], loose: Sequence[str], unit: LikelyUnit | None = None
) -> list[str]:
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
    warnings += [stuck_words(state, name, ranges_of(state)[name], unit) for name in stuck]
    if loose:
        warnings.append(f"not identified by these data: {', '.join(loose)}")
    for name, setting in state.study.parameters.items():
        if setting.free and name not in state.model.column:
            warnings.append(f"{name} is free, but acts in none of the rigs used")
    return warnings


def cautions_of(state: CalibratedStudy) -> dict[str, str]:
    """What must be known of a constant before it is used elsewhere, as the rigs used declare it."""
    if state.study.restitution_at != "centre":
        return {}
    declared = {n: q for rig in state.study.rigs for n, q in state.study.catalogue.rigs[rig].parameters.items()}
    return {n: declared[n]["caution"] for n in state.model.settings if "caution" in declared.get(n, {})}


def ranges_of(state: CalibratedStudy) -> dict[str, tuple[float, float]]:
    """The range in which each free constant may lie."""
    problem = state.fit.problem
    names = [state.model.names[c] for c in problem.free]
    return {name: (float(low), float(high)) for name, low, high in zip(names, problem.low, problem.high, strict=True)}


def _one_observable(rows: Sequence[RowResidual]) -> bool:
    return len({(r.row.observable, r.units.get(r.row.observable)) for r in rows}) == 1


def unit_of_rms(rows: Sequence[RowResidual]) -> str:
    """The unit of `rms_error`: the observable's, as declared, where there is but one, else standard uncertainties."""
    if not _one_observable(rows):
        return "standard uncertainties"
    observable = rows[0].row.observable
    return rows[0].units.get(observable, f"unit of {observable}")


def rms_error(rows: Sequence[RowResidual], split: str) -> float | None:
    """Root of the mean squared residual of the rows of a split, in `unit_of_rms`; None without rows, or where unknown."""
    one = _one_observable(rows)
    of_split = [r for r in rows if r.row.split == split]
    errors = [r.residual if one else r.residual / r.uncertainty if r.uncertainty else None for r in of_split]
    known = [e for e in errors if e is not None]
    return float(np.sqrt(np.mean(np.square(known)))) if known and len(known) == len(errors) else None
