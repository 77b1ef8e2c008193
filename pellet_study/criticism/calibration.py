"""A study's free constants fitted to its rows, with the noise of the simulations in every uncertainty."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from pellet_study.criticism.cell_means import CellMeans, cell_means
from pellet_study.criticism.least_squares import Fit, fit, problem_of, with_starts
from pellet_study.criticism.starts import points_along
from pellet_study.errors import SimulationError
from pellet_study.model.model import Model, refuse_too_few
from pellet_study.output.words import number
from pellet_study.study.study import Study

EXCESS = 1.1  # residual over replicate variance up to which chance is the likely cause


@dataclass(frozen=True, eq=False)
class CalibratedStudy:
    """A study's model fitted to its cell means: what the next questions start from; equal to itself alone."""

    study: Study
    model: Model
    cells: CellMeans
    fit: Fit


def fit_study(
    study: Study,
    model: Model | None = None,
    cells: CellMeans | None = None,
    extra_starts: int = 3,
    start: np.ndarray | None = None,
) -> CalibratedStudy:
    """Fit a study's free constants to its rows of split `fit`.

    `cells` may be those of another model of the same rows, `start` a point at which an effect present was found: without it
    formulas are tried along the whole reach of each.

    Raises
    ------
    InputError : everything held out, or fewer rows than free parameters
    """
    rows = [row for row in study.rows if row.split == "fit"]
    model = model or Model(study)
    problem = problem_of(model, extra_starts)
    refuse_too_few(len(rows), len(problem.free))
    given = cells is not None
    if cells is None:
        refuse_failed(model)
        cells = cell_means(model, rows)
    problem = with_starts(problem, [start] if start is not None else points_along(model, cells, problem))
    first = fit(model, cells, problem)
    if given:
        return CalibratedStudy(study, model, cells, first)
    noisy = with_simulator_noise(cells, model, first.point)
    return CalibratedStudy(study, model, noisy, first if noisy is cells else fit(model, noisy, problem))


def refuse_failed(model: Model) -> None:
    """No fit to rows that cannot be simulated.

    Raises
    ------
    SimulationError : most simulations of a row failed
    """
    if model.scatters and not np.isfinite(model.predict(model.base).mean).all():
        reasons = [text for engine in model.engines.values() for text in engine.failed.values()]
        raise SimulationError("; ".join(dict.fromkeys(reasons)) or "a row cannot be simulated")


def surface_error(state: CalibratedStudy) -> tuple[float, str] | None:
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
    where = ", ".join(f"{name} {number(value, 6)}" for name, value in case.conditions.items())
    return float(special.chdtrc(len(z), (z**2).sum())), (
        f"{case.rig} ({where}): simulated {direct.mean[0, worst]:.4g}, surface {surface.mean[0, worst]:.4g}"
    )


def with_simulator_noise(cells: CellMeans, model: Model, point: np.ndarray) -> CellMeans:
    """Cell means whose variances hold the variance of the model's own means at a point, where it has any."""
    if not model.scatters:
        return cells
    return widened(cells, model.predict(point).variance[0, cells.case])


def widened(cells: CellMeans, variance: np.ndarray) -> CellMeans:
    """Cell means with more variance."""
    sd = np.sqrt(cells.sd**2 + variance)
    if cells.whiten.ndim == 1:
        return replace(cells, sd=sd, whiten=cells.whiten * cells.sd / sd)
    more = np.diag(variance) if cells.alike is None else cells.alike * np.sqrt(np.outer(variance, variance))
    together = np.linalg.inv(cells.whiten.T @ cells.whiten) + more
    return replace(cells, sd=sd, whiten=np.linalg.inv(np.linalg.cholesky(together)))


def with_own_noise(state: CalibratedStudy, fitted: Fit) -> tuple[CalibratedStudy, Fit]:
    """A state and a rival's fit with the variance that the rival's predictions have beyond the present model's."""
    if not state.model.scatters:
        return state, fitted
    both = state.model.predict(np.array([state.fit.point, fitted.point])).variance[:, state.cells.case]
    cells = widened(state.cells, np.maximum(both[1] - both[0], 0.0))
    if cells.whiten.ndim == 1:
        ratio = state.cells.sd / cells.sd
        residual, jacobian = fitted.residual * ratio, fitted.jacobian * ratio[:, None]
    else:
        again = cells.whiten @ np.linalg.inv(state.cells.whiten)
        residual, jacobian = again @ fitted.residual, again @ fitted.jacobian
    noisy = replace(fitted, residual=residual, jacobian=jacobian, chi2=float((residual**2).sum()))
    return replace(state, cells=cells), noisy


def covariance(fitted: Fit) -> np.ndarray:
    """(J' J)^-1 over the free columns, each scaled by its range, generalised where singular."""
    span = fitted.problem.high - fitted.problem.low
    scaled = fitted.jacobian * span
    return np.linalg.pinv(scaled.T @ scaled, rcond=1e-12, hermitian=True) * np.outer(span, span)


def reduced_chi2(state: CalibratedStudy, fitted: Fit) -> float:
    """The chi2 that counts as one: a fit's residual scatter where it exceeds the stated one or none is stated."""
    dof = max(len(state.cells.case) - len(fitted.problem.free), 1)
    ratio = fitted.chi2 / dof
    return max(1.0, ratio / EXCESS) if state.cells.scale_known else max(ratio, 1e-12)


def part_of(cells: CellMeans, kept: np.ndarray) -> CellMeans:
    """Some of the cells."""
    whiten = cells.whiten
    if whiten.ndim == 1:
        whiten = whiten[kept]
    else:
        covariance_of_cells = np.linalg.inv(whiten.T @ whiten)[np.ix_(kept, kept)]
        whiten = np.linalg.inv(np.linalg.cholesky(covariance_of_cells))
    group = tuple(np.array(cells.group)[kept].tolist()) if cells.group else ()
    return replace(
        cells,
        group=group,
        setups=tuple(one for one, stays in zip(cells.setups, kept, strict=False) if stays),
        case=cells.case[kept],
        mean=cells.mean[kept],
        sd=cells.sd[kept],
        whiten=whiten,
        alike=None if cells.alike is None else cells.alike[np.ix_(kept, kept)],
    )
