"""A study's free constants fitted to its rows, with the noise of the simulations in every uncertainty."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from pellet_study.criticism import cell_means as readings
from pellet_study.criticism.cell_means import Evidence
from pellet_study.criticism.least_squares import Fit, fit, problem_of
from pellet_study.errors import SimulationError
from pellet_study.model.model import Model, refuse_too_few
from pellet_study.study.study import Study

EXCESS = 1.1  # residual over replicate variance up to which chance is the likely cause


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


def covariance(fitted: Fit) -> np.ndarray:
    """(J' J)^-1 over the free columns, generalised where singular."""
    return np.linalg.pinv(fitted.jacobian.T @ fitted.jacobian, rcond=1e-12, hermitian=True)


def unit_of_chi2(state: Calibrated, fitted: Fit) -> float:
    """The chi2 that counts as one: a fit's residual scatter where it exceeds the stated one or none is stated."""
    dof = max(len(state.evidence.case) - len(fitted.problem.free), 1)
    ratio = fitted.chi2 / dof
    return max(1.0, ratio / EXCESS) if state.evidence.scale_known else max(ratio, 1e-12)


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
