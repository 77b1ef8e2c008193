"""Bounded weighted least squares, many fits in step: every round asks the model for one batch of points.

    minimise chi2(theta) = |W (y - f(theta))|^2,  low <= theta <= high

Levenberg-Marquardt with the parameters scaled to their ranges and the step projected on the bounds (Marquardt 1963,
doi:10.1137/0111030; Kanzow, Yamashita & Fukushima 2004, doi:10.1016/j.cam.2004.02.013). Several starts a fit; all
starts of all fits advance together, so that on a simulator the Jacobians of a set of rivals are one batch.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pellet_study.criticism.cell_means import CellMeans
from pellet_study.model.model import Model

ROUNDS = 40
SETTLED = 3e-4  # change of chi2, on a scale where 1 is one standard error squared


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
    stick at a bound that the data push against.
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
    owner = np.array([k for k, problem in enumerate(problems) for _ in range(max(1, len(problem.starts)))])
    width = max(1, max(len(problem.free) for problem in problems))
    tracks = len(owner)
    column = np.zeros((tracks, width), dtype=int)
    real = np.zeros((tracks, width), dtype=bool)
    low, span = np.zeros((tracks, width)), np.ones((tracks, width))
    unit = np.zeros((tracks, width))
    base = np.array([problems[k].base for k in owner])
    track = 0
    for problem in problems:
        p = len(problem.free)
        for start in problem.starts if len(problem.starts) else [np.empty(0)]:
            column[track, :p], real[track, :p] = problem.free, True
            low[track, :p], span[track, :p] = problem.low, problem.high - problem.low
            unit[track, :p] = np.clip((start - problem.low) / (problem.high - problem.low), 0, 1)
            track += 1

    target, step = cells.mean, model.step

    def evaluate(which: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Whitened residuals and their derivatives by the scaled parameters, for some tracks."""
        here = np.repeat(base[which][:, None, :], 1 + width, axis=1)
        forward = np.where(at + step <= 1, step, -step)
        rows = np.arange(len(which))
        for k in range(width):
            used = real[which, k]
            here[rows[used], :, column[which[used], k]] = (low[which[used], k] + span[which[used], k] * at[used, k])[
                :, None
            ]
        for k in range(width):
            used = real[which, k]
            here[rows[used], 1 + k, column[which[used], k]] += span[which[used], k] * forward[used, k]
        predicted = model.predict(here.reshape(-1, here.shape[-1])).mean[:, cells.case]
        predicted = cells.whitened(target - predicted).reshape(len(which), 1 + width, -1)
        slopes = (predicted[:, 0, None, :] - predicted[:, 1:, :]) / forward[:, :, None]
        return predicted[:, 0], np.where(real[which][:, :, None], slopes, 0.0)

    residual, jacobian = evaluate(np.arange(tracks), unit)  # jacobian: (tracks, width, n), of the prediction
    chi2 = (residual**2).sum(axis=1)
    damping = np.full(tracks, 1e-3)
    active = real.any(axis=1)
    for _ in range(ROUNDS):
        which = np.flatnonzero(active)
        if not len(which):
            break
        j, r, at = jacobian[which], residual[which], unit[which]
        gradient = np.einsum("tkn,tn->tk", j, r)  # downhill direction of chi2 / 2
        held = ((at <= 0) & (gradient <= 0)) | ((at >= 1) & (gradient >= 0)) | ~real[which]
        normal = np.einsum("tkn,tln->tkl", j, j)
        diagonal = np.einsum("tkk->tk", normal).copy()
        floor = 1e-10 * diagonal.max(axis=1, keepdims=True) + 1e-300
        normal = np.where(held[:, :, None] | held[:, None, :], 0.0, normal)
        extra = np.where(held, 1.0, damping[which, None] * np.maximum(diagonal, floor) + floor)
        normal = normal + extra[:, :, None] * np.eye(width)
        move = np.linalg.solve(normal, np.where(held, 0.0, gradient)[:, :, None])[:, :, 0]
        trial = np.clip(at + move, 0, 1)
        new_residual, new_jacobian = evaluate(which, trial)
        new_chi2 = (new_residual**2).sum(axis=1)
        better = new_chi2 <= chi2[which]
        gain = chi2[which] - new_chi2
        still = np.abs(trial - at).max(axis=1) < 1e-9
        done = (better & (gain < SETTLED * (1 + 1e-3 * new_chi2))) | still | (damping[which] > 1e8)
        taken = which[better]
        unit[taken], residual[taken], jacobian[taken], chi2[taken] = (
            a[better] for a in (trial, new_residual, new_jacobian, new_chi2)
        )
        damping[which] = np.where(better, np.maximum(damping[which] * 0.1, 1e-9), damping[which] * 8)
        active[which[done]] = False

    fits = []
    for k, problem in enumerate(problems):
        mine = np.flatnonzero(owner == k)
        best = mine[np.argmin(chi2[mine])]
        p = len(problem.free)
        point = problem.base.copy()
        point[list(problem.free)] = low[best, :p] + span[best, :p] * unit[best, :p]
        slope = jacobian[best, :p] / span[best, :p, None]
        push = jacobian[best, :p] @ residual[best]
        u = unit[best, :p]
        stuck = ((u <= 1e-9) & (push <= 0)) | ((u >= 1 - 1e-9) & (push >= 0))
        fits.append(Fit(problem, point, float(chi2[best]), residual[best], slope.T, stuck, not active[best]))
    return fits


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
