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
from functools import lru_cache

import numpy as np
from scipy import special

from pellet_study import evidence as readings
from pellet_study.calibrate import Fit, fit, problem_of
from pellet_study.errors import SimulationError
from pellet_study.evidence import Evidence
from pellet_study.model.model import Model, key, refuse_too_few
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Study

DRAWS = 5_000
SEED = 20260101
LACK_OF_FIT = 0.001  # p over all rigs together below which a model fails
LACK_IN_A_RIG = 0.002  # the same for single rigs, shared among them: a misfit in one rig drowns in the others
DRIFT = 0.001
HELD_OUT_FAILS = 0.001  # p of the rows held out
EXCESS = 1.1  # residual over replicate variance up to which chance is the likely cause
VISIBLE = 0.03  # share of a direction that must survive the calibration to be tested
IDENTIFIED = 0.5  # a constant is identified where its 95 % interval is narrower than this share of its range


@dataclass(frozen=True)
class Drift:
    """A calibrated constant that does not stay constant: z over one condition, p over all directions together."""

    parameter: str
    rig: str
    condition: str
    shape: str
    z: float
    p: float


@dataclass(frozen=True)
class RowResidual:
    """One row of the file beside its prediction; `z` in units of the row's standard uncertainty, None if unknown."""

    row: Measurement
    predicted: float
    residual: float
    z: float | None


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


@dataclass(frozen=True)
class Calibrated:
    """A model, its evidence and the fit: what the next questions start from."""

    study: Study
    model: Model
    evidence: Evidence
    fit: Fit


def calibrate(
    study: Study, model: Model | None = None, evidence: Evidence | None = None, extra_starts: int = 3
) -> Calibrated:
    """Fit a study's free constants to its rows of split `fit`.

    `evidence` may be that of another model of the same rows, which need not be gathered again.

    Raises
    ------
    InputError : everything held out, or fewer rows than free parameters
    """
    rows = [row for row in study.rows if row.split == "fit"]
    model = model or Model(study)
    problem = problem_of(model, extra_starts)
    refuse_too_few(len(rows), len(problem.free))
    if evidence is not None:
        return Calibrated(study, model, evidence, fit(model, evidence, problem))
    refuse_dead(model)
    evidence = readings.gather(model, rows)
    first = fit(model, evidence, problem)
    noisy = with_simulator_noise(evidence, model, first.point)
    return Calibrated(study, model, noisy, first if noisy is evidence else fit(model, noisy, problem))


def refuse_dead(model: Model) -> None:
    """No fit to rows that cannot be simulated.

    Raises
    ------
    SimulationError : most simulations of a row failed
    """
    if model.scatters and not np.isfinite(model.predict(model.base).mean).all():
        reasons = [text for engine in model.engines.values() for text in getattr(engine, "dead", {}).values()]
        raise SimulationError("; ".join(dict.fromkeys(reasons)) or "a row cannot be simulated")


def surface_error(state: Calibrated) -> tuple[float, str] | None:
    """How well the model's surfaces hold at the calibrated point: p of direct simulations there, and the worst row.

    None where predictions are not interpolated between simulations.
    """
    model, point = state.model, state.fit.point
    surface = model.predict(point)
    if not surface.variance.any():
        return None
    direct = model.directly(point)
    known = np.flatnonzero((surface.variance[0] > 0) & np.isfinite(direct.mean[0]))
    z = (direct.mean - surface.mean)[0, known] / np.sqrt((direct.variance + surface.variance)[0, known])
    worst = known[np.argmax(np.abs(z))]
    case = model.cases[worst]
    where = ", ".join(f"{name} {value:g}" for name, value in case.conditions.items())
    return float(special.chdtrc(len(z), (z**2).sum())), (
        f"{case.rig} ({where}): simulated {direct.mean[0, worst]:.4g}, surface {surface.mean[0, worst]:.4g}"
    )


def with_simulator_noise(evidence: Evidence, model: Model, point: np.ndarray) -> Evidence:
    """Evidence whose variances hold the variance of the model's own means at a point, where it has any."""
    if not model.scatters:
        return evidence
    return widened(evidence, model.predict(point).variance[0, evidence.case])


def widened(evidence: Evidence, variance: np.ndarray) -> Evidence:
    """Evidence with more variance in its cells."""
    sd = np.sqrt(evidence.sd**2 + variance)
    if evidence.whiten.ndim == 1:
        return replace(evidence, sd=sd, whiten=evidence.whiten * evidence.sd / sd)
    together = np.linalg.inv(evidence.whiten.T @ evidence.whiten) + np.diag(variance)
    return replace(evidence, sd=sd, whiten=np.linalg.inv(np.linalg.cholesky(together)))


def with_own_noise(state: Calibrated, fitted: Fit) -> tuple[Calibrated, Fit]:
    """A state and a rival's fit with the variance that the rival's predictions have beyond the present model's."""
    if not state.model.scatters or state.evidence.whiten.ndim > 1:
        return state, fitted
    both = state.model.predict(np.array([state.fit.point, fitted.point])).variance[:, state.evidence.case]
    evidence = widened(state.evidence, np.maximum(both[1] - both[0], 0.0))
    ratio = state.evidence.sd / evidence.sd
    residual = fitted.residual * ratio
    mine = replace(
        fitted, residual=residual, jacobian=fitted.jacobian * ratio[:, None], chi2=float((residual**2).sum())
    )
    return replace(state, evidence=evidence), mine


def lack_of_fit(fitted: Fit, evidence: Evidence, mine: np.ndarray | None = None) -> float | None:
    """p of the chi2 of some cells (default all) over their degrees of freedom; None where there is nothing to compare.

    A rig's cells have as many degrees of freedom as cells, less their leverages, and are compared with the scatter of
    its own readings. For one rig that is F(n - p, nu); several are summed, and the sum matched in mean and variance by
    a scaled F (Satterthwaite 1946, doi:10.2307/3002019).
    """
    if not evidence.scale_known:
        return None
    basis = absorbed(fitted.jacobian)
    own = 1 - (basis**2).sum(axis=1)
    mine = np.ones(len(own), dtype=bool) if mine is None else mine
    dof, chi2 = float(own[mine].sum()), float((fitted.residual[mine] ** 2).sum())
    if dof < 0.5:
        return None
    group = np.array(evidence.group if evidence.group else np.zeros(len(own), dtype=int))
    d = np.array([own[mine & (group == g)].sum() for g in np.unique(group[mine])])
    known = evidence.group_dof if evidence.group else (evidence.dof,)
    nu = np.array([known[g] for g in np.unique(group[mine])], dtype=float)
    if len(nu) == 1 or (nu <= 5).any():
        return float(special.fdtrc(dof, nu.sum(), chi2 / dof))
    mean = d * nu / (nu - 2)
    variance = 2 * mean**2 * (d + nu - 2) / (np.maximum(d, 1e-9) * (nu - 4))
    relative = dof * variance.sum() / mean.sum() ** 2
    matched = (4 * relative + 2 * dof - 4) / (relative - 2) if relative > 2 else 1e9
    return float(special.fdtrc(dof, matched, chi2 / mean.sum() * matched / (matched - 2)))


def lack_by_rig(state: Calibrated) -> dict[str, float]:
    """p of each rig's own cells; rigs whose cells leave nothing to compare are left out."""
    rigs = np.array([state.model.cases[c].rig for c in state.evidence.case], dtype=object)
    found = {rig: lack_of_fit(state.fit, state.evidence, rigs == rig) for rig in dict.fromkeys(rigs)}
    return {rig: p for rig, p in found.items() if p is not None}


def absorbed(jacobian: np.ndarray) -> np.ndarray:
    """Orthonormal basis of what the free constants absorb, (n, rank)."""
    if jacobian.size == 0:
        return np.zeros((jacobian.shape[0], 0))
    size = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian / np.where(size > 0, size, 1)
    u, s, _ = np.linalg.svd(scaled, full_matrices=False)
    return u[:, s > 1e-7 * max(s.max(), 1e-300)]


def visible(directions: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """(k, n) directions less what the free constants absorb."""
    return directions - (directions @ basis) @ basis.T


@lru_cache(maxsize=8)
def _noise(group: tuple[int, ...], group_dof: tuple[int, ...]) -> np.ndarray:
    """Whitened readings that hide nothing, (DRAWS, n): Gaussian over a scale as uncertain as each group's.

    The same draws for every test, so that an answer does not depend on what ran before.
    """
    rng = np.random.default_rng(SEED)
    noise = rng.standard_normal((DRAWS, len(group)))
    for number, dof in enumerate(group_dof):
        if dof > 0:
            mine = np.array(group) == number
            noise[:, mine] /= np.sqrt(rng.chisquare(dof, (DRAWS, 1)) / dof)
    return noise.astype(np.float32)


def standardised(
    left: np.ndarray, unit: np.ndarray, basis: np.ndarray, evidence: Evidence, two_sided: bool, birge: bool = True
) -> np.ndarray:
    """Scores along unit directions, in standard errors, (sets, k).

        score = z / s,  z = u'r,  s^2 = max(sum_g w_g (nu_g + R_g) / (nu_g + d_g - w_g), b^2 / EXCESS),  w_g = |u_g|^2

    How large an error is, each rig's readings g say with nu_g degrees of freedom, and so do the residuals that the
    direction leaves there: R_g their sum of squares, d_g their number less what the calibration absorbs. Where the
    residuals of all rigs together exceed the replicates' scatter by more than chance makes likely, their Birge ratio
    b^2 = (|r|^2 - z^2)/(d - 1), z the largest, takes its place (Birge 1932, doi:10.1103/PhysRev.40.207). Without
    `birge` the replicates alone are the measure; where no scatter is stated, the residuals alone.

    Parameters
    ----------
    left : (sets, n) whitened residuals, free of what the calibration absorbs
    unit : (k, n) unit vectors, free of it too
    basis : (n, rank), what it absorbs
    """
    z = left @ unit.T
    largest = np.abs(z).max(axis=1) if two_sided else np.maximum(z.max(axis=1), 0)
    dof = unit.shape[1] - basis.shape[1]
    squares = left**2
    excess = (squares.sum(axis=1) - largest**2).clip(0) / max(dof - 1, 1)
    if not evidence.scale_known:
        return z / np.sqrt(np.maximum(excess, 1e-24))[:, None]
    if not birge:
        return z
    group, known = groups_of(evidence)
    inside = (group[:, None] == np.arange(len(known))).astype(unit.dtype)
    nu, share = np.array(known, dtype=unit.dtype), unit**2 @ inside  # share: (k, groups)
    part = share / (nu + (1 - (basis**2).sum(axis=1)) @ inside - share)
    variance = part @ nu + squares @ inside @ part.T - 2 * z * (left @ (unit * (part @ inside.T)).T)
    variance += z**2 * (part * share).sum(axis=1)
    if dof > 1:
        variance = np.maximum(variance, excess[:, None] / EXCESS)
    return z / np.sqrt(variance)


def groups_of(evidence: Evidence) -> tuple[np.ndarray, tuple[int, ...]]:
    """Number of each cell's group, and each group's degrees of freedom."""
    return np.array(evidence.group or (0,) * len(evidence.case)), evidence.group_dof or (int(evidence.dof),)


def largest_null(
    unit: np.ndarray, basis: np.ndarray, evidence: Evidence, two_sided: bool, birge: bool = True
) -> np.ndarray:
    """Sorted draws of the largest standardised score over readings that hide nothing."""
    group, known = groups_of(evidence)
    noise, unit = _noise(tuple(group.tolist()), known), unit.astype(np.float32)
    if birge or not evidence.scale_known:
        basis = basis.astype(np.float32)
        noise = noise - (noise @ basis) @ basis.T
    z = standardised(noise, unit, basis, evidence, two_sided, birge)
    return np.sort((np.abs(z) if two_sided else z).max(axis=1))


def exceedance(null: np.ndarray, value: float) -> float:
    """Share of sorted null draws at or above a value, never quite zero."""
    return float((len(null) - np.searchsorted(null, value, side="left") + 1) / (len(null) + 1))


def drifts(state: Calibrated, rigs: frozenset[str] | None = None, birge: bool = True) -> tuple[Drift, ...]:
    """Constancy of every calibrated constant over every condition, the worst first; p is over all of them together.

    Parameters
    ----------
    rigs : only in these
    birge : in units of the residual scatter where it exceeds the replicates' (`standardised`); without, in units of the
        replicates' scatter where that is known, as lack of fit is, so that misfit elsewhere excuses nothing
    """
    names = [state.model.names[c] for c in state.fit.problem.free]
    labels, directions = drift_directions(state.model, state.evidence, state.fit, names)
    inside = [k for k, (_, rig, *_) in enumerate(labels) if rigs is None or rig in rigs]
    labels = [labels[k] for k in inside]
    if not labels:
        return ()
    directions, basis = directions[inside], absorbed(state.fit.jacobian)
    seen = visible(directions, basis)
    size = np.linalg.norm(seen, axis=1)
    keep = size > VISIBLE * np.maximum(np.linalg.norm(directions, axis=1), 1e-300)
    if not keep.any():
        return ()
    unit = seen[keep] / size[keep, None]
    if not state.evidence.scale_known and len(state.evidence.case) - basis.shape[1] < 2:
        return ()
    z = standardised(state.fit.residual[None], unit, basis, state.evidence, True, birge)[0]
    null = largest_null(unit, basis, state.evidence, True, birge)
    kept = [label for label, k in zip(labels, keep, strict=True) if k]
    found = [Drift(*label, z=float(v), p=exceedance(null, abs(v))) for label, v in zip(kept, z, strict=True)]
    return tuple(sorted(found, key=lambda d: -abs(d.z)))


def drift_directions(model: Model, evidence: Evidence, fitted: Fit, names: Sequence[str]):
    """Labels (parameter, rig, condition, shape) and (k, n) whitened directions of drift."""
    rigs = np.array([model.cases[c].rig for c in evidence.case], dtype=object)
    labels, directions = [], []
    diagonal = evidence.whiten.ndim == 1
    raw = fitted.jacobian if diagonal else np.linalg.solve(evidence.whiten, fitted.jacobian)

    def add(label, weights, column):
        direction = weights * raw[:, column]
        labels.append(label)
        directions.append(direction if diagonal else evidence.whiten @ direction)

    for rig in dict.fromkeys(rigs):
        mine = rigs == rig
        cases = [model.cases[c] for c in evidence.case[mine]]
        shapes = []
        for condition in cases[0].conditions:
            values = np.array([case.conditions[condition] for case in cases])
            levels = len(np.unique(values))
            if levels < 2:
                continue
            s = np.log(values) if (values > 0).all() else values
            s = (s - s.mean()) / s.std()
            shapes.append((condition, "rises", s))
            if levels > 2:
                shapes.append((condition, "bends", s**2 - 1))
        for column, name in enumerate(names):
            if not np.linalg.norm(fitted.jacobian[mine, column]) > 0:
                continue
            for condition, shape, s in shapes:
                weights = np.zeros(len(rigs))
                weights[mine] = s
                add((name, rig, condition, shape), weights, column)
            if np.linalg.norm(fitted.jacobian[~mine, column]) > 0:
                add((name, rig, "rig", "differs"), mine.astype(float), column)
    return labels, np.array(directions)


def compare(study: Study, state: Calibrated | None = None, level_out: bool = False) -> Comparison:
    """Calibrate a study's present model and look at what is left; `level_out` also refits without each level."""
    state = state or calibrate(study)
    model, evidence, fitted = state.model, state.evidence, state.fit
    names = [model.names[c] for c in fitted.problem.free]
    rank = absorbed(fitted.jacobian).shape[1]
    cells, fit_rows = len(evidence.case), [row for row in study.rows if row.split == "fit"]
    p_fit = lack_of_fit(fitted, evidence)
    intervals, loose = intervals_of(state)
    warnings = [*evidence.warnings, *model.warnings]
    dof = len(fit_rows) - len(names)
    if cells <= rank:
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
    for c, u in zip(evidence.case, evidence.sd, strict=True):
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

    whole = fitted.chi2 + evidence.replicate_chi2 if evidence.scale_known else None
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
        drifts=drifts(state),
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


def covariance(fitted: Fit) -> np.ndarray:
    """(J' J)^-1 over the free columns, generalised where singular."""
    return np.linalg.pinv(fitted.jacobian.T @ fitted.jacobian, rcond=1e-12, hermitian=True)


def unit_of_chi2(state: Calibrated, fitted: Fit) -> float:
    """The chi2 that counts as one: a fit's residual scatter where it exceeds the stated one or none is stated."""
    dof = max(len(state.evidence.case) - len(fitted.problem.free), 1)
    ratio = fitted.chi2 / dof
    return max(1.0, ratio / EXCESS) if state.evidence.scale_known else max(ratio, 1e-12)


def intervals_of(state: Calibrated) -> tuple[dict[str, tuple[float, float]], tuple[str, ...]]:
    """95 % intervals theta +- t b se, cut at the bounds, and the names of the constants the data do not pin down."""
    fitted, evidence = state.fit, state.evidence
    names = [state.model.names[c] for c in fitted.problem.free]
    if not names:
        return {}, ()
    dof = len(evidence.case) - len(names)
    if evidence.scale_known:
        t = special.stdtrit(evidence.dof, 0.975)
        ratio = np.sqrt(fitted.chi2 / dof) if dof > 0 else 1.0
        p = lack_of_fit(fitted, evidence)
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


def needed_setup(state: Calibrated) -> dict[str, float]:
    """Set-up scatter, percent of the reading, that each rig's cells would need for chi2 = cells - their share of p."""
    evidence, fitted = state.evidence, state.fit
    if not evidence.scale_known:
        return {}
    rigs = np.array([state.model.cases[c].rig for c in evidence.case], dtype=object)
    n, p = len(evidence.case), len(fitted.problem.free)
    plain = state.evidence.mean - state.model.predict(fitted.point).mean[0, evidence.case]
    found = {}
    for rig in dict.fromkeys(rigs):
        mine = rigs == rig
        share = mine.sum() * max(n - p, 1) / n
        r, v, y = plain[mine], evidence.sd[mine] ** 2, np.abs(evidence.mean[mine])

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


def row_residuals(state: Calibrated, sd: dict[int, float]) -> tuple[RowResidual, ...]:
    """Every row beside its prediction; z by the uncertainty of the row itself (not of its cell)."""
    model, study = state.model, state.study
    place = {key(case): k for k, case in enumerate(model.cases)}
    predicted = model.predict(state.fit.point)
    reading = reading_sd(study, model)
    found = []
    for k, row in enumerate(study.rows):
        c = place[key(row)]
        value = float(predicted.mean[0, c])
        spread = reading[k]
        z = None
        if spread is not None:
            if row.sd is not None:
                spread *= state.evidence.contradicted.get((row.rig, row.observable), 1.0)
            total = np.sqrt(spread**2 / row.n + row.setup_sd**2 + predicted.variance[0, c])
            z = float((row.value - value) / total)
        found.append(RowResidual(row, value, row.value - value, z))
    return tuple(found)


def holdout_p(state: Calibrated, rows: Sequence[RowResidual]) -> float | None:
    """p of e' C^-1 e over the rows held out, C of their readings, their predictions and the calibrated constants.

    The constants' covariance is widened by the misfit of the rows fitted; rows of one set-up share its error. F with the
    degrees of freedom of the readings' scatter. None without such rows, without their scatter, or where they depend on a
    constant that the rows fitted do not tell.
    """
    held = [r for r in rows if r.row.split == "holdout" and r.z]
    if not held or not state.evidence.scale_known:
        return None
    model, fitted = state.model, state.fit
    place = {key(case): k for k, case in enumerate(model.cases)}
    cases = [place[key(r.row)] for r in held]
    problem, span = fitted.problem, fitted.problem.high - fitted.problem.low
    points = np.repeat(fitted.point[None], 1 + len(problem.free), axis=0)
    step = np.where(fitted.values + model.step * span <= problem.high, model.step, -model.step) * span
    points[1 + np.arange(len(problem.free)), list(problem.free)] += step
    mean = model.predict(points).mean[:, cases]
    slopes = (mean[1:] - mean[0]) / step[:, None]
    unit = max(1.0, fitted.chi2 / max(len(state.evidence.case) - len(problem.free), 1))
    jacobian = fitted.jacobian * span
    _, size, rows_of = np.linalg.svd(jacobian, full_matrices=False)
    told = rows_of[size > 1e-6 * max(size.max(initial=0.0), 1e-300)]
    steps = slopes.T * span
    if np.abs(steps - steps @ told.T @ told).max(initial=0.0) > 1e-6 * np.abs(steps).max(initial=0.0):
        return None
    own = np.diag([(r.residual / r.z) ** 2 for r in held])
    for a, first in enumerate(held):
        for b, second in enumerate(held):
            if a != b and first.row.setup and first.row.setup == second.row.setup and first.row.rig == second.row.rig:
                own[a, b] = first.row.setup_sd * second.row.setup_sd
    error = np.array([r.residual for r in held])
    together, n = own + unit * slopes.T @ covariance(fitted) @ slopes, len(held)
    return float(special.fdtrc(n, state.evidence.dof, error @ np.linalg.solve(together, error) / n))


def reading_sd(study: Study, model: Model) -> list[float | None]:
    """Standard deviation of one reading for each row: as stated, else pooled from replicates, else None."""
    pooled: dict[tuple[str, str], tuple] = {}
    for group in {(row.rig, row.observable) for row in study.rows}:
        cells: dict[tuple, list[Measurement]] = {}
        for row in study.rows:
            if (row.rig, row.observable) == group and row.sd is None and row.split == "fit":
                cells.setdefault((key(row), row.setup), []).append(row)
        means = np.array([np.average([r.value for r in c], weights=[r.n for r in c]) for c in cells.values()])
        dof = np.array([len(c) - 1.0 for c in cells.values()])
        if not len(means) or dof.sum() == 0:
            continue
        within = np.array(
            [sum(r.n * (r.value - m) ** 2 for r in c) for c, m in zip(cells.values(), means, strict=True)]
        )
        sd = np.sqrt(within / np.maximum(dof, 1))
        pooled[group] = (means, readings.pooled_sd(means, sd, dof))
    found: list[float | None] = []
    for row in study.rows:
        spread = row.sd
        if spread is None and (row.rig, row.observable) in pooled:
            means, sd = pooled[row.rig, row.observable]
            spread = float(sd[np.argmin(np.abs(means - row.value))])
            spread = spread if spread > 0 else None
        if spread is None:
            others = [
                r.sd for r in study.rows if (r.rig, r.observable) == (row.rig, row.observable) and r.sd is not None
            ]
            spread = float(np.sqrt(np.mean(np.square(others)))) if others else None
        found.append(spread)
    return found


def level_out_errors(state: Calibrated) -> dict[str, float]:
    """Error on rows that a fit has not seen: each level of a condition kept back in turn, `rig.condition` -> rms.

    Unweighted, in the observable's unit; for conditions with at least three levels, where enough cells stay to fit.
    """
    model, evidence = state.model, state.evidence
    rows = [row for row in state.study.rows if row.split == "fit"]
    place = {key(case): k for k, case in enumerate(model.cases)}
    cells = [model.cases[c] for c in evidence.case]
    found = {}
    for rig in dict.fromkeys(cell.rig for cell in cells):
        for condition in next(cell for cell in cells if cell.rig == rig).conditions:
            level = np.array([cell.conditions[condition] if cell.rig == rig else np.nan for cell in cells])
            levels = np.unique(level[~np.isnan(level)])
            if len(levels) < 3 or len({row.observable for row in rows if row.rig == rig}) > 1:
                continue
            errors = []
            for left_out in levels:
                kept = level != left_out
                if kept.sum() < max(1, len(state.fit.problem.free)):
                    break
                fitted = fit(model, part_of(evidence, kept), problem_of(model, 2, state.fit.point))
                mean = model.predict(fitted.point).mean[0]
                errors += [
                    row.value - mean[place[key(row)]]
                    for row in rows
                    if row.rig == rig and row.conditions[condition] == left_out
                ]
            else:
                found[f"{rig}.{condition}"] = float(np.sqrt(np.mean(np.square(errors))))
    return found


def part_of(evidence: Evidence, kept: np.ndarray) -> Evidence:
    """Evidence from some of the cells."""
    whiten = evidence.whiten
    if whiten.ndim == 1:
        whiten = whiten[kept]
    else:
        covariance_of_cells = np.linalg.inv(whiten.T @ whiten)[np.ix_(kept, kept)]
        whiten = np.linalg.inv(np.linalg.cholesky(covariance_of_cells))
    group = tuple(np.array(evidence.group)[kept].tolist()) if evidence.group else ()
    return replace(
        evidence,
        group=group,
        case=evidence.case[kept],
        mean=evidence.mean[kept],
        sd=evidence.sd[kept],
        whiten=whiten,
    )
