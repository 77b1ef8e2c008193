"""Surfaces of several readings of the same heaps, which scatter together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from pellet_study.doe.factors import Factor
from pellet_study.doe.terms import columns_of, quadratic_terms
from pellet_study.errors import SimulationError

NORMAL = 1.959964  # of the normal distribution, 97.5 %


@dataclass(frozen=True)
class Responses:
    r"""Quadratic surfaces :math:`y = b_0 + \sum b_i x_i + \sum b_{ij} x_i x_j` of m readings on the same n heaps, in coded units.

    Attributes
    ----------
    factors : the k factors, in the order of the coded columns
    names : the m readings
    coefficients : (terms, m)
    inverse : (terms, terms), (X'X)^-1
    scatter : (m, m) covariance of the readings of one heap about the surfaces, with `freedom` degrees of freedom
    misfit : (m, m) covariance of what the true means of a point lie off the quadratics, beyond what scatter explains, widened
        for the few points that tell it; 0 where points have no replicates
    heaps : n
    """

    factors: list[Factor]
    names: list[str]
    coefficients: np.ndarray
    inverse: np.ndarray
    scatter: np.ndarray
    freedom: int
    misfit: np.ndarray
    heaps: int

    @property
    def widening(self) -> float:
        """Factor on a variance for the scatter that is known from few heaps: squared quantile of t over that of the normal."""
        return widening(self.freedom)

    def columns(self, coded: np.ndarray) -> np.ndarray:
        """The terms (points, terms) at coded points (points, k)."""
        return columns_of(coded, quadratic_terms([f.name for f in self.factors]))

    def predict(self, coded: np.ndarray) -> np.ndarray:
        """The readings (points, m) at coded points (points, k)."""
        return self.columns(coded) @ self.coefficients

    def covariance(self, coded: np.ndarray) -> np.ndarray:
        """Covariance (points, m, m) of the errors of `predict`: of the coefficients, and of what the quadratic misses."""
        return self.leverage(coded)[:, None, None] * self.scatter * self.widening + self.misfit

    def leverage(self, coded: np.ndarray) -> np.ndarray:
        """x'(X'X)^-1 x (points,): variance of a predicted mean over that of a heap."""
        terms = self.columns(coded)
        return ((terms @ self.inverse) * terms).sum(axis=1)

    def moved(self, shift: np.ndarray) -> "Responses":
        """The surfaces with every reading raised by a constant (m,)."""
        raised = self.coefficients.copy()
        raised[0] += shift
        return replace(self, coefficients=raised)

    def of(self, names: Sequence[str]) -> "Responses":
        """The surfaces of some of the readings."""
        at = [self.names.index(name) for name in names]
        return replace(
            self,
            names=list(names),
            coefficients=self.coefficients[:, at],
            scatter=self.scatter[np.ix_(at, at)],
            misfit=self.misfit[np.ix_(at, at)],
        )


def widening(freedom: int) -> float:
    """How much larger a variance counts that `freedom` degrees of freedom tell; 1 where it is known (0)."""
    return float((stdtrit(freedom, 0.975) / NORMAL) ** 2) if freedom > 0 else 1.0


def fit(factors: list[Factor], names: Sequence[str], coded: np.ndarray, readings: np.ndarray) -> Responses:
    """Least squares of every reading on the same heaps.

    Parameters
    ----------
    coded : (n, k) coded levels of the heaps
    readings : (n, m), no number missing

    Raises
    ------
    SimulationError : no more heaps than terms, or heaps that do not separate them
    """
    terms = columns_of(coded, quadratic_terms([f.name for f in factors]))
    heaps, size = terms.shape
    if heaps <= size or np.linalg.matrix_rank(terms) < size:
        raise SimulationError(
            f"{heaps} heaps have all of {', '.join(names)}: too few for a surface of {size} terms with its scatter"
        )
    inverse = np.linalg.inv(terms.T @ terms)
    coefficients = inverse @ terms.T @ readings
    left = readings - terms @ coefficients
    freedom = heaps - size
    return Responses(
        factors,
        list(names),
        coefficients,
        inverse,
        left.T @ left / freedom,
        freedom,
        _misfit(coded, readings, left, size),
        heaps,
    )


def _misfit(coded: np.ndarray, readings: np.ndarray, left: np.ndarray, terms: int) -> np.ndarray:
    """Covariance of the lack of fit by mean squares, (lack of fit - pure error) / heaps a point, with no negative eigenvalue."""
    _, point, number = np.unique(coded.round(6), axis=0, return_inverse=True, return_counts=True)
    points, heaps = len(number), len(coded)
    if points <= terms or heaps <= points:
        return np.zeros((readings.shape[1], readings.shape[1]))
    means = np.array([readings[point.ravel() == k].mean(axis=0) for k in range(points)])
    within = readings - means[point.ravel()]
    pure = within.T @ within
    excess = (left.T @ left - pure) / (points - terms) - pure / (heaps - points)
    size = np.sqrt(np.maximum(np.diag(pure), 1e-300))
    value, axes = np.linalg.eigh(excess / np.outer(size, size))
    kept = (axes * np.maximum(value, 0)) @ axes.T * np.outer(size, size)
    return widening(points - terms) * kept * points / heaps
