"""The surface of an effect beside that of the base: what it shifts, learnt from simulations with it and, in pairs, without.

Curvature and interactions have priors about 0, as wide as all simulations of the effect in a rig make likeliest.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pellet_study.model.response_surface import FLOOR, LogSurface
from pellet_study.model.terms import effect_terms

LINEAR = 10.0  # prior standard deviation of an effect's first coefficient: none to speak of
SCALES = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)  # from which those of its curvature and interactions are chosen
LIKENESS = (0.0, 0.5, 0.8, 0.9, 0.95, 0.98, 0.99)  # from which the correlation of runs with and without it is
LEAST = 0.05  # of the base surface; an effect leaves at least so much: the logarithm of nearly none tells nothing
BENDS = (0.0, 10.0, 100.0)  # from which a is
MUCH = 5.0  # gain in log likelihood from which a may differ from 0
QUIET = 0.0025  # relative variance of a point below which exp E - 1 may take the place of E
NO_INFORMATION = 1e6  # variance of a point whose simulations failed


@dataclass(frozen=True)
class EffectRuns:
    """What a site's simulations of an effect gave, beside those without it at the same places with the same seeds, if any.

    Parameters
    ----------
    u, shapes, x : (n,) amounts, (n, s) scaled shapes, (n, p) scaled parameters
    with_it, without : (n,) means; NaN where the simulations failed; None where there are none
    expected, known : (n,) logarithm of what the base surface gives there, and the (n, n) covariance of its error
    scatter : (n,) relative variance of one of the means
    """

    u: np.ndarray
    shapes: np.ndarray
    x: np.ndarray
    with_it: np.ndarray
    without: np.ndarray | None
    expected: np.ndarray
    known: np.ndarray
    scatter: np.ndarray


class _Form(NamedTuple):
    """What is fitted, (k, n) values and their (k, n, n) noise, to which terms, with which prior, and how likely it is."""

    likelihood: float
    terms: np.ndarray
    prior: np.ndarray
    value: np.ndarray
    noise: np.ndarray
    of_ratio: bool
    bend: float


class _Shifts:
    """What the runs of an effect at some sites measure, beside those without it where there are any."""

    def __init__(self, runs: Sequence[EffectRuns]):
        self.paired = all(run.without is not None for run in runs)
        with_it = np.stack([np.log(np.maximum(run.with_it, LEAST * np.exp(run.expected))) for run in runs])
        without = np.stack([_log(run.without) for run in runs if run.without is not None]) if self.paired else 0.0
        self.lost = ~np.isfinite(with_it + without)
        self.with_it, self.without = np.where(self.lost, 0.0, with_it), np.where(self.lost, 0.0, without)
        self.expected = np.where(self.lost, 0.0, [run.expected for run in runs])
        self.scatter = np.stack([run.scatter for run in runs])
        self.known, self.eye = np.stack([run.known for run in runs]), np.eye(len(runs[0].u))

    def measured(self, likeness: float) -> tuple[np.ndarray, np.ndarray]:
        """Shifts (k, n) and their covariance (k, n, n)."""
        # the logarithm of a mean that scatters lies half the variance below the logarithm of its expectation
        shift = self.with_it - likeness * self.without + (1 - likeness) * (self.scatter / 2 - self.expected)
        own = self.scatter * (1 - likeness**2) + NO_INFORMATION * self.lost
        return np.where(self.lost, 0.0, shift), (1 - likeness) ** 2 * self.known + own[:, :, None] * self.eye

    def fitted(self) -> Iterator[tuple[np.ndarray, np.ndarray, float, bool]]:
        """What may be fitted: values, their noise, the logarithm of the Jacobian, and whether it is exp E - 1."""
        for likeness in LIKENESS if self.paired else LIKENESS[:1]:
            value, noise = self.measured(likeness)
            yield value, noise, 0.0, False
            if self.scatter.max() * (1 - likeness**2) <= QUIET:  # else the weights would follow the scatter
                growth = np.exp(value)
                yield growth - 1, growth[:, :, None] * noise * growth[:, None, :], float(value.sum()), True


def fitted_effects(runs: Sequence[EffectRuns]) -> list[LogSurface]:
    """Surfaces of one effect at the sites of a rig, by Bayesian linear regression.

    What the effect shifts is measured from r ln(mean without it) + (1 - r) (base surface), r the correlation of the two
    means (a control variate: Hammersley & Handscomb 1964, doi:10.1007/978-94-009-5819-7, chapter 5), which leaves the
    variance scatter (1 - r^2) + (1 - r)^2 known. r and the prior standard deviations of curvature (c2, c3) and
    interactions (g) are those under which the runs of all sites together are likeliest (MacKay 1992,
    doi:10.1162/neco.1992.4.3.415).
    """
    shapes, shifts = runs[0].shapes.shape[1], _Shifts(runs)
    chosen: _Form | None = None
    for bend in BENDS:
        terms = np.stack([effect_terms(run.u, run.shapes, run.x, bend) for run in runs])
        form = _likeliest(terms, shapes, shifts, bend)
        if form is not None and (chosen is None or form.likelihood > chosen.likelihood + (MUCH if bend else 0.0)):
            chosen = form
    if chosen is None:
        raise ValueError("no form of the effect has a likelihood")
    weighted = np.linalg.solve(chosen.noise, chosen.terms)
    covariance = np.linalg.inv(chosen.terms.transpose(0, 2, 1) @ weighted + np.diag(chosen.prior**-2))
    coefficients = (covariance @ (weighted.transpose(0, 2, 1) @ chosen.value[:, :, None]))[:, :, 0]
    return [
        LogSurface(c, v, float(np.median(n.diagonal())), chosen.of_ratio, bend=chosen.bend)
        for c, v, n in zip(coefficients, covariance, chosen.noise, strict=True)
    ]


def _likeliest(terms: np.ndarray, shapes: int, shifts: _Shifts, bend: float) -> _Form | None:
    """Of all that may be fitted and all priors, what makes the runs likeliest."""
    found: _Form | None = None
    for value, noise, change, of_ratio in shifts.fitted():
        for curvature in SCALES:
            for interaction in SCALES:
                prior = _prior(terms.shape[2], shapes, curvature, interaction)
                spread_of = noise + (terms * prior**2) @ terms.transpose(0, 2, 1)
                _, determinants = np.linalg.slogdet(spread_of)
                solved = np.linalg.solve(spread_of, value[:, :, None])[:, :, 0]
                likelihood = change - 0.5 * float((determinants + (value * solved).sum(axis=1)).sum())
                if likelihood > (-np.inf if found is None else found.likelihood):
                    found = _Form(likelihood, terms, prior, value, noise, of_ratio, bend)
    return found


def _log(means: np.ndarray) -> np.ndarray:
    return np.log(np.maximum(means, max(FLOOR * np.nanmedian(np.abs(means)), 1e-12)))


def _prior(terms: int, shapes: int, curvature: float, interaction: float) -> np.ndarray:
    parameters = terms - 3 - shapes
    return np.array([LINEAR, curvature, curvature] + [LINEAR] * shapes + [interaction] * parameters)
