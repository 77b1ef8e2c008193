"""What three methods answer to a sealed set, each on the same response surfaces.

`best_aicc` takes the base model or the base model with one candidate, whichever has the smallest AICc. `discrepancy`
adds a Gaussian process over the conditions (Kennedy & O'Hagan 2001, doi:10.1111/1467-9868.00294) where that has the smaller
AICc; it names nothing. `pellet_study` is the answer of `refine`, as the trial has it, with the constants and failing rows
that belong to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pellet_study.challenge.predictions import Stored
from pellet_study.criticism.calibration import CalibratedStudy, fit_study
from pellet_study.criticism.least_squares import Fit, fit, fit_many
from pellet_study.criticism.rivals import rival_problem
from pellet_study.criticism.ways import ways_of
from pellet_study.model.model import Model
from pellet_study.study.study import Study

FAILS = 2.0  # standard errors from which on a row fails
SHARES = (0.02, 0.1, 0.3, 0.7)  # of the way to the physical limit, at which the fit of an amount begins
HEIGHTS = (0.0, *np.geomspace(0.3, 30, 21))  # standard deviations of the discrepancy, in standard errors of a row
LENGTHS = (0.3, 0.5, 0.8, 1.3, 2.0, 3.0, 5.0)  # over which it changes, in standard deviations of a condition


class Answer(NamedTuple):
    """A method's answer to a set; `constants` has those of the base model and those with what the answer adds."""

    verdict: str
    effects: tuple[str, ...]
    failing: tuple[int, ...]
    before: np.ndarray
    after: np.ndarray


@dataclass(frozen=True)
class Set:
    """A set's readings, the base model fitted to them, and the fit with each candidate."""

    state: CalibratedStudy
    fits: dict[str, Fit]

    @classmethod
    def of(cls, study: Study, stored: Stored) -> "Set":
        """Fit the base model and all candidates, one at a time, within their physical ranges."""
        study = replace(study, catalogue=stored.study.catalogue)
        state = fit_study(study, Model(study, engines=stored.engines))
        problems = []
        for name in state.model.effects:
            starts = [
                {way.columns[0]: way.absent + share * way.reach}
                for way in ways_of(state.model, name)
                for share in SHARES
            ]
            problems.append(rival_problem(state, [name], starts))
        fits = fit_many(state.model, state.cells, problems)
        return cls(state, dict(zip(state.model.effects, fits, strict=True)))

    def constants(self, fitted: Fit) -> np.ndarray:
        """The free constants of a fit."""
        return fitted.values[: len(self.state.fit.problem.free)]

    def failing(self, fitted: Fit) -> tuple[int, ...]:
        """Rows, 1 the first, where a model is more than two standard errors from the calibrated base model."""
        both = self.state.model.predict(np.array([self.state.fit.point, fitted.point])).mean[:, self.state.cells.case]
        return rows(np.diff(both, axis=0)[0] / self.state.cells.sd)

    def answer(self, verdict: str, effects: Sequence[str], fitted: Fit | None) -> Answer:
        """An answer that adds what is fitted; None: nothing, and the rows that fail are those of the residuals."""
        before = self.constants(self.state.fit)
        if fitted is not None:
            return Answer(verdict, tuple(effects), self.failing(fitted), before, self.constants(fitted))
        failing = rows(self.state.fit.residual) if verdict == "unexplained" else ()
        return Answer(verdict, tuple(effects), failing, before, before)


def rows(z: np.ndarray) -> tuple[int, ...]:
    """Rows, 1 the first, that are more than two standard errors off."""
    return tuple(int(k) + 1 for k in np.flatnonzero(np.abs(z) > FAILS))


def aicc(minus_two_log_likelihood: float, n: int, free: int) -> float:
    """Akaike's criterion for small samples (Hurvich & Tsai 1989, doi:10.1093/biomet/76.2.297)."""
    return minus_two_log_likelihood + 2 * free + 2 * free * (free + 1) / (n - free - 1)


def pellet_study(of: Set, answered: dict) -> Answer:
    """The answer of `refine` as the trial has it: verdict, added, tied, and the constants of the model that it ended with."""
    told = np.array([value for name, value in answered["parameters"].items() if "." not in name])
    if answered["added"]:
        (name,) = answered["added"]
        return of.answer("missing", [name], of.fits[name])._replace(after=told)
    if answered["tied"]:
        names = [name for (name,) in answered["tied"]]
        return of.answer("tied", names, of.fits[names[0]])._replace(before=told)
    return of.answer(answered["verdict"], [], None)._replace(before=told, after=told)


def best_aicc(of: Set) -> Answer:
    """The smallest AICc among the base model and the base model with one candidate."""
    n = len(of.state.cells.mean)
    known = {name: aicc(f.chi2, n, len(f.problem.free)) for name, f in of.fits.items()}
    best = min(known, key=known.__getitem__)
    base = aicc(of.state.fit.chi2, n, len(of.state.fit.problem.free))
    return of.answer("adequate", [], None) if base <= known[best] else of.answer("missing", [best], of.fits[best])


def discrepancy(of: Set) -> Answer:
    """A Gaussian process over the conditions of each rig, in standard errors of a row, beside the constants.

    Its height and length are those of the largest likelihood, the constants eliminated to first order; then they are fitted.
    """
    state = of.state
    n, free, eye = len(state.cells.mean), len(state.fit.problem.free), np.eye(len(state.cells.mean))
    squares = distances(state.model)[np.ix_(state.cells.case, state.cells.case)]
    found = {}
    for height in HEIGHTS:
        for length in LENGTHS if height else LENGTHS[:1]:
            covariance = eye + height**2 * np.exp(-squares / (2 * length**2))
            root = np.linalg.cholesky(covariance)
            residual = np.linalg.solve(root, state.fit.residual)
            slopes = np.linalg.solve(root, state.fit.jacobian)
            left = residual - slopes @ np.linalg.lstsq(slopes, residual, rcond=None)[0]
            found[height, length] = left @ left + 2 * np.log(np.diag(root)).sum(), covariance, root
    none = found.pop((0.0, LENGTHS[0]))
    best = min(found.values(), key=lambda entry: entry[0])
    if aicc(none[0], n, free) <= aicc(best[0], n, free + 2):
        return of.answer("adequate", [], None)
    _, covariance, root = best
    whiten = np.linalg.inv(root) / state.cells.sd
    with_it = fit(state.model, replace(state.cells, whiten=whiten), state.fit.problem)
    predicted = state.model.predict(with_it.point).mean[0, state.cells.case]
    off = (state.cells.mean - predicted) / state.cells.sd
    added = (covariance - eye) @ np.linalg.solve(covariance, off)  # the mean of the process, given the readings
    base = state.model.predict(state.fit.point).mean[0, state.cells.case]
    failing = rows((predicted - base) / state.cells.sd + added)
    return Answer("unexplained", (), failing, of.constants(state.fit), of.constants(with_it))


def distances(model: Model) -> np.ndarray:
    """(n, n) squared distances of the cases over their conditions; infinite between rigs.

    A condition c counts as ln(1 + c/mean), freed of its mean and scaled to a standard deviation of 1 within its rig.
    """
    squares = np.full((len(model.cases), len(model.cases)), np.inf)
    for rig in dict.fromkeys(case.rig for case in model.cases):
        mine = [k for k, case in enumerate(model.cases) if case.rig == rig]
        numbers = np.array([[v for v in model.cases[k].conditions.values() if not isinstance(v, str)] for k in mine])
        varied = numbers[:, np.ptp(numbers, axis=0) > 0]
        x = np.log1p(varied / varied.mean(axis=0))
        x = (x - x.mean(axis=0)) / x.std(axis=0)
        squares[np.ix_(mine, mine)] = np.square(x[:, None] - x[None]).sum(axis=2)
    return squares
