"""Where the fit of a model with effects begins: at the amount of each with which the constants alone fit best.

An effect may be flat where it begins, at its absent value or beyond a threshold, and a fit that begins there stays.
"""

import numpy as np

from pellet_study.criticism.cell_means import CellMeans
from pellet_study.criticism.least_squares import Problem, fit_many
from pellet_study.criticism.ways import SHARES, Way, ways_of
from pellet_study.model.model import Model


def points_along(model: Model, cells: CellMeans, problem: Problem) -> list[np.ndarray]:
    """For every effect that is free, the best point along its reach; none where each would take simulations."""
    if model.scatters:
        return []
    ways = {name: [w for w in ways_of(model, name) if w.columns[0] in problem.free] for name in model.study.effects}
    return [best_along(model, cells, problem, of_effect) for of_effect in ways.values() if of_effect]


def best_along(model: Model, cells: CellMeans, problem: Problem, ways: list[Way]) -> np.ndarray:
    """The best of the fits of all other constants with an effect held at amounts along its reach."""
    free, held = np.array(problem.free), set(ways[0].columns)
    kept = np.array([column not in held for column in problem.free])
    problems = []
    for point in [problem.base, *(way.at(problem.base, way.absent + way.reach * s) for way in ways for s in SHARES)]:
        base = problem.base.copy()  # what is fixed in the study stays, and nothing leaves its range
        base[free] = np.clip(point[free], problem.low, problem.high)
        low, high = problem.low[kept], problem.high[kept]
        problems.append(Problem(base, tuple(map(int, free[kept])), low, high, base[free[kept]][None]))
    return min(fit_many(model, cells, problems), key=lambda found: found.chi2).point
