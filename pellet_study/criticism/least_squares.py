"""Bounded weighted least squares, many fits in step: every round asks the model for one batch of points.

    minimise chi2(theta) = |W (y - f(theta))|^2,  low <= theta <= high

Levenberg-Marquardt with the parameters scaled to their ranges and the step projected on the bounds (Marquardt 1963,
doi:10.1137/0111030; Kanzow, Yamashita & Fukushima 2004, doi:10.1016/j.cam.2004.02.013). Several starts a fit; all
starts of all fits advance together, so that on a simulator the Jacobians of a set of rivals are one batch.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pellet_study.criticism.cell_means import CellMeans
from pellet_study.model.model import Model

ROUNDS = 40  # a bound on the time; a fit that needs more says so (`settled`)
SETTLED = 3e-4  # change of chi2, on a scale where 1 is one standard error squared
STILL = 1e-9  # of a range; a step this small changes no digit that is shown
DAMPING, LEAST_DAMPING, MOST_DAMPING = (
    1e-3,
    1e-9,
    1e8,
)  # of a track at first; where it stays Gauss-Newton; where it gives up
AT_BOUND = 1e-9  # of a range


@dataclass(frozen=True)
class Problem:
    """One fit: which columns are free, between which bounds, from which starts.

    `base` is the point that gives all other columns; `starts` is (starts, free).
    """

    base: np.ndarray
    free: tuple[int, ...]
    low: np.ndarray
    high: np.ndarray
    starts: np.ndarray


@dataclass(frozen=True)
class Fit:
    """The best of a problem's starts.

    `jacobian` is of the whitened predictions, (n, free); `residual` W (y - f); `at_bound` says which free columns
    stick at a bound that the data push against; `settled` whether it ended before the rounds did.
    """

    problem: Problem
    point: np.ndarray
    chi2: float
    residual: np.ndarray
    jacobian: np.ndarray
    at_bound: np.ndarray
    settled: bool

    @property
    def values(self) -> np.ndarray:
        """Values of the free columns."""
        return self.point[list(self.problem.free)]


def fit(model: Model, cells: CellMeans, problem: Problem) -> Fit:
    """One fit."""
    return fit_many(model, cells, [problem])[0]


def fit_many(model: Model, cells: CellMeans, problems: Sequence[Problem]) -> list[Fit]:
    """All fits in step, the best start of each."""
    if not problems:
        return []
    tracks = tracks_of(problems)
    now = begun(model, cells, tracks)
    for _ in range(ROUNDS):
        which = np.flatnonzero(now.active)
        if not len(which):
            break
        chi2, damping = now.chi2[which], now.damping[which]
        trial = step(now.jacobian[which], now.residual[which], now.unit[which], damping, tracks.real[which])
        residual, jacobian = evaluate(model, cells, tracks, which, trial)
        new_chi2 = (residual**2).sum(axis=1)
        better, gain = new_chi2 <= chi2, chi2 - new_chi2
        still = np.abs(trial - now.unit[which]).max(axis=1) < STILL
        done = (better & (gain < SETTLED * (1 + 1e-3 * new_chi2))) | still | (damping > MOST_DAMPING)
        taken = which[better]
        now.unit[taken], now.chi2[taken] = trial[better], new_chi2[better]
        now.residual[taken], now.jacobian[taken] = residual[better], jacobian[better]
        now.damping[which] = np.where(better, np.maximum(damping * 0.1, LEAST_DAMPING), damping * 8)
        now.active[which[done]] = False
    return [best_of(problem, tracks, np.flatnonzero(tracks.owner == k), now) for k, problem in enumerate(problems)]


@dataclass(frozen=True)
class Tracks:
    """Every start of every problem, padded to the widest.

    Parameters
    ----------
    owner : (tracks,) number of each track's problem
    base : (tracks, columns) points that give the fixed columns
    column, real : (tracks, width) which columns are free, and which of these are there
    low, span : (tracks, width) their ranges
    start : (tracks, width) where they begin, 0 to 1 over the ranges
    """

    owner: np.ndarray
    base: np.ndarray
    column: np.ndarray
    real: np.ndarray
    low: np.ndarray
    span: np.ndarray
    start: np.ndarray


def tracks_of(problems: Sequence[Problem]) -> Tracks:
    """The starts of some problems; one without starts, which has nothing free, has one track."""
    owner = np.array([k for k, problem in enumerate(problems) for _ in range(max(1, len(problem.starts)))])
    shape = len(owner), max(1, max(len(problem.free) for problem in problems))
    column, real = np.zeros(shape, dtype=int), np.zeros(shape, dtype=bool)
    low, span, start = np.zeros(shape), np.ones(shape), np.zeros(shape)
    track = 0
    for problem in problems:
        p = len(problem.free)
        for given in problem.starts if len(problem.starts) else [np.empty(0)]:
            column[track, :p], real[track, :p] = problem.free, True
            low[track, :p], span[track, :p] = problem.low, problem.high - problem.low
            start[track, :p] = np.clip((given - problem.low) / (problem.high - problem.low), 0, 1)
            track += 1
    return Tracks(owner, np.array([problems[k].base for k in owner]), column, real, low, span, start)


@dataclass
class Progress:
    """Where the tracks are, arrays over them; those that are no longer `active` have settled.

    `unit` are their free columns, 0 to 1 over the ranges; `jacobian` (tracks, width, n) is of the whitened predictions.
    """

    unit: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    chi2: np.ndarray
    damping: np.ndarray
    active: np.ndarray


def begun(model: Model, cells: CellMeans, tracks: Tracks) -> Progress:
    """The tracks at their starts."""
    residual, jacobian = evaluate(model, cells, tracks, np.arange(len(tracks.start)), tracks.start)
    damping = np.full(len(tracks.start), DAMPING)
    chi2, active = (residual**2).sum(axis=1), np.asarray(tracks.real.any(axis=1))
    return Progress(tracks.start.copy(), residual, jacobian, chi2, damping, active)


def evaluate(
    model: Model, cells: CellMeans, tracks: Tracks, which: np.ndarray, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Whitened residuals (k, n) of k tracks, and the (k, width, n) derivatives of their predictions.

    Parameters
    ----------
    which : (k,) the tracks asked for
    at : (k, width) their free columns, 0 to 1 over the ranges, by which the derivatives are taken
    """
    width, rows = at.shape[1], np.arange(len(which))
    column, real, low, span = tracks.column[which], tracks.real[which], tracks.low[which], tracks.span[which]
    points = np.repeat(tracks.base[which][:, None, :], 1 + width, axis=1)  # itself, then each column moved
    forward = np.where(at + model.step <= 1, model.step, -model.step)
    for k in range(width):
        used = real[:, k]
        points[rows[used], :, column[used, k]] = (low[used, k] + span[used, k] * at[used, k])[:, None]
    for k in range(width):
        used = real[:, k]
        points[rows[used], 1 + k, column[used, k]] += span[used, k] * forward[used, k]
    predicted = model.predict(points.reshape(-1, points.shape[-1])).mean[:, cells.case]
    left = cells.whitened(cells.mean - predicted).reshape(len(which), 1 + width, -1)
    slopes = (left[:, 0, None, :] - left[:, 1:, :]) / forward[:, :, None]
    return left[:, 0], np.where(real[:, :, None], slopes, 0.0)


def step(
    jacobian: np.ndarray, residual: np.ndarray, at: np.ndarray, damping: np.ndarray, real: np.ndarray
) -> np.ndarray:
    """Where each track goes next: a damped Gauss-Newton step in the columns that no bound holds, cut at the bounds."""
    gradient = np.einsum("tkn,tn->tk", jacobian, residual)  # downhill direction of chi2 / 2
    held = ((at <= 0) & (gradient <= 0)) | ((at >= 1) & (gradient >= 0)) | ~real
    normal = np.einsum("tkn,tln->tkl", jacobian, jacobian)
    diagonal = np.einsum("tkk->tk", normal).copy()
    floor = 1e-10 * diagonal.max(axis=1, keepdims=True) + 1e-300
    normal = np.where(held[:, :, None] | held[:, None, :], 0.0, normal)
    extra = np.where(held, 1.0, damping[:, None] * np.maximum(diagonal, floor) + floor)
    normal = normal + extra[:, :, None] * np.eye(at.shape[1])
    move = np.linalg.solve(normal, np.where(held, 0.0, gradient)[:, :, None])[:, :, 0]
    return np.clip(at + move, 0, 1)


def best_of(problem: Problem, tracks: Tracks, own: np.ndarray, ended: Progress) -> Fit:
    """The fit of a problem: where the best of its own tracks ended, in the units of the parameters."""
    best, p = own[np.argmin(ended.chi2[own])], len(problem.free)
    unit, span, jacobian = ended.unit[best, :p], tracks.span[best, :p], ended.jacobian[best, :p]
    point = problem.base.copy()
    point[list(problem.free)] = tracks.low[best, :p] + span * unit
    push = jacobian @ ended.residual[best]
    return Fit(
        problem,
        point,
        chi2=float(ended.chi2[best]),
        residual=ended.residual[best],
        jacobian=(jacobian / span[:, None]).T,
        at_bound=((unit <= AT_BOUND) & (push <= 0)) | ((unit >= 1 - AT_BOUND) & (push >= 0)),
        settled=bool(not ended.active[best]),
    )


def problem_of(model: Model, extra_starts: int = 3, point: np.ndarray | None = None) -> Problem:
    """The fit a study asks for: its free settings, from the values given and from points spread over the ranges."""
    free = [(model.column[name], s) for name, s in model.settings.items() if s.free]
    low = np.array([s.low for _, s in free])
    high = np.array([s.high for _, s in free])
    first = np.array([(model.base if point is None else point)[c] for c, _ in free])
    golden = (np.arange(1, extra_starts + 1)[:, None] * (0.6180339887 + 0.3 * np.arange(len(free)))) % 1.0
    for k, (column, _) in enumerate(free):  # an effect's amount can be of any order of magnitude below its limit
        if column in model.amounts:
            golden[:, k] = 10.0 ** -np.arange(1, extra_starts + 1)
            golden[:, k] += -low[k] / (high[k] - low[k]) if low[k] < 0 else 0.0
    starts = np.vstack([first[None, :], low + golden * (high - low)]) if free else np.empty((0, 0))
    return Problem(model.base if point is None else point, tuple(c for c, _ in free), low, high, starts)


def with_starts(problem: Problem, points: Sequence[np.ndarray]) -> Problem:
    """A fit that begins at some points too."""
    more = [point[list(problem.free)] for point in points]
    return replace(problem, starts=np.vstack([problem.starts, *more])) if more and len(problem.free) else problem
