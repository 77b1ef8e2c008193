"""Least squares on coded factors: a linear model fitted by statsmodels, and what is read off the fit.

Reference
---------
Myers, Montgomery, Anderson-Cook, Response Surface Methodology, 4th ed., Wiley 2016, ch. 2: PRESS.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pellet_study.doe.blocks import Block, columns_of_blocks
from pellet_study.doe.terms import INTERCEPT, columns_of, quadratic_terms
from pellet_study.errors import InputError

CURVATURE = "curvature"


@dataclass(frozen=True)
class LinearFit:
    """A fitted linear model in coded units.

    Attributes
    ----------
    names : list of str
        Factor names.
    terms : dict
        {term: indices of the factors multiplied}.
    coded : ndarray (n_runs, n_factors)
    response : ndarray (n_runs,)
    extra : dict
        {name: column (n_runs,)} of further columns fitted that are no part of the model (curvature).
    blocks : list of Block
        Groups of runs that may differ in level, fitted beside the rest.
    rounding : float
        Variance of a reading by its rounding alone, response unit squared: no scatter of single runs is below it.
    """

    names: list[str]
    terms: dict[str, tuple[int, ...]]
    coded: np.ndarray
    response: np.ndarray
    extra: dict[str, np.ndarray]
    blocks: Sequence[Block] = ()
    rounding: float = 0.0

    @cached_property
    def beside(self) -> dict[str, np.ndarray]:
        """The columns fitted beside the terms: the extra ones, then the contrasts of the blocks."""
        return {**self.extra, **columns_of_blocks(self.blocks)}

    @cached_property
    def matrix(self) -> np.ndarray:
        columns = columns_of(self.coded, self.terms)
        return np.column_stack([columns, *self.beside.values()])

    @cached_property
    def results(self):
        """The statsmodels OLS results."""
        from statsmodels.regression.linear_model import OLS

        return OLS(self.response, self.matrix).fit()

    @property
    def columns(self) -> list[str]:
        """Names of the fitted columns: the terms, then those beside them."""
        return [*self.terms, *self.beside]

    @cached_property
    def inverse(self) -> np.ndarray:
        """(X'X)^-1 over all columns."""
        return np.linalg.inv(self.matrix.T @ self.matrix)

    @cached_property
    def df_residual(self) -> int:
        return len(self.response) - self.matrix.shape[1]

    @cached_property
    def ss_residual(self) -> float:
        return float(np.sum(self.residuals**2)) if self.df_residual else 0.0

    @property
    def mean_square_error(self) -> float | None:
        """Residual variance; None where the model takes up every degree of freedom."""
        return self.ss_residual / self.df_residual if self.df_residual else None

    @cached_property
    def fitted(self) -> np.ndarray:
        return np.asarray(self.results.fittedvalues)

    @cached_property
    def residuals(self) -> np.ndarray:
        return self.response - self.fitted

    @property
    def coefficients(self) -> dict[str, float]:
        """{term: coefficient} in coded units."""
        return dict(zip(self.terms, map(float, self.results.params), strict=False))

    @property
    def standard_errors(self) -> dict[str, float | None]:
        variance = self.mean_square_error
        if variance is None:
            return dict.fromkeys(self.terms)
        return dict(zip(self.terms, np.sqrt(variance * np.diag(self.inverse)).tolist(), strict=False))

    def predict(self, coded) -> np.ndarray:
        """Predicted response at coded points (n_points, n_factors)."""
        return columns_of(coded, self.terms) @ np.asarray(self.results.params)[: len(self.terms)]

    def leverage(self, coded) -> np.ndarray:
        """x'(X'X)^-1 x at coded points: variance of the predicted mean over the residual variance."""
        points, size = columns_of(coded, self.terms), len(self.terms)
        return np.einsum("ij,jk,ik->i", points, self.inverse[:size, :size], points)

    @property
    def run_leverage(self) -> np.ndarray:
        """Leverages (n_runs,) of the runs fitted, all columns counted."""
        return np.einsum("ij,jk,ik->i", self.matrix, self.inverse, self.matrix)

    @cached_property
    def studentized(self) -> np.ndarray | None:
        r"""R-student :math:`e/(s_{(i)}\sqrt{1-h})` (n_runs,), NaN at leverage 1.

        :math:`s_{(i)}`, from the other runs, has one degree of freedom less than the residual: None where that leaves none. It
        is no smaller than the rounding of the readings, which few runs may hide by chance.
        """
        if not self.mean_square_error or self.df_residual < 2:
            return None
        leverage = self.run_leverage
        left = np.where(leverage > 1 - 1e-9, np.nan, 1 - leverage)
        deleted = (self.ss_residual - self.residuals**2 / left) / (self.df_residual - 1)
        deleted = np.maximum(deleted, self.rounding)
        return self.residuals / np.sqrt(np.where(deleted > 0, deleted, np.nan) * left)

    def suspects(self, alpha: float = 0.05) -> list[tuple[int, float]]:
        r"""(place, R-student) of the runs beyond Bonferroni's bound :math:`t_{1-\alpha/2n}`, the farthest first.

        Of runs that the model cannot tell apart (R-student alike in size) the one that reads farthest from the median first.

        R-student has Student's distribution with one degree of freedom less than the residual where nothing is wrong
        (Cook, Weisberg, Residuals and Influence in Regression, Chapman and Hall 1982, sec. 2.2).
        """
        if self.studentized is None:
            return []
        from scipy.special import stdtrit

        bound = stdtrit(self.df_residual - 1, 1 - alpha / (2 * len(self.response)))
        real = np.abs(self.residuals) > 1e-9 * np.abs(self.response).max()  # more than rounding
        places = np.flatnonzero((np.abs(self.studentized) > bound) & real)
        off = np.abs(self.response - np.median(self.response))
        order = sorted(places, key=lambda i: (-float(f"{abs(self.studentized[i]):.3g}"), -off[i]))
        return [(int(i), float(self.studentized[i])) for i in order]

    def gradient(self, coded) -> np.ndarray:
        """Slopes of the predicted response (n_points, n_factors), per coded unit."""
        coded = np.atleast_2d(np.asarray(coded, dtype=float))
        slopes = np.zeros_like(coded)
        for indices, value in zip(self.terms.values(), self.coefficients.values(), strict=True):
            for place, i in enumerate(indices):
                others = [j for k, j in enumerate(indices) if k != place]
                slopes[:, i] += value * coded[:, others].prod(axis=1)
        return slopes


def fit(names, terms, coded, response, extra=None, blocks=(), rounding: float = 0.0) -> LinearFit:
    """Fit a linear model by least squares.

    Parameters
    ----------
    names : list of str
    terms : dict
        See `linear_terms`, `quadratic_terms`.
    coded : array (n_runs, n_factors)
    response : array (n_runs,)
    extra : dict, optional
        {name: column} fitted beside the model's terms.
    blocks : sequence of Block
    rounding : float
        See `LinearFit`.

    Raises
    ------
    InputError
        If there are fewer runs than terms, or the runs do not separate the terms.
    """
    coded, response = np.asarray(coded, float), np.asarray(response, float)
    model = LinearFit(list(names), dict(terms), coded, response, extra or {}, blocks, rounding)
    runs, size = model.matrix.shape
    if runs < size:
        raise InputError(
            f"the table has {runs} runs with a response and the model has {size} terms "
            f"({', '.join(model.columns)}): expected at least {size} runs; run what is missing, or leave "
            "factors out with --ignore"
        )
    if np.linalg.matrix_rank(model.matrix) < size:
        raise InputError(
            f"the {runs} runs do not separate the terms {_confounded(model)}: expected a design in which "
            "each varies by itself; check these columns for copies of one another, or run the points that "
            "are missing"
        )
    return model


def _confounded(model: LinearFit) -> str:
    """The columns that take part in an exact linear dependence."""
    _, singular, vectors = np.linalg.svd(model.matrix)
    null = vectors[np.sum(singular > 1e-9 * singular[0]) :]
    involved = np.abs(null).max(axis=0) > 1e-6
    return ", ".join(repr(name) for name, is_in in zip(model.columns, involved, strict=True) if is_in)


def press(model: LinearFit) -> float | None:
    r"""PRESS :math:`\sum (e_i/(1-h_i))^2` over the runs; None where a run of the model itself has leverage 1.

    A single centre point is fitted exactly by its own curvature column and is left out of the sum.
    """
    leverage = model.run_leverage
    exact = leverage > 1 - 1e-9
    absorbed = np.zeros(len(leverage), bool)
    single = model.extra.get(CURVATURE)
    if single is not None and single.sum() == 1:
        absorbed |= single.astype(bool)
    if (exact & ~absorbed).any():
        return None
    return float(np.sum((model.residuals[~absorbed] / (1 - leverage[~absorbed])) ** 2))


def variance_inflation(model: LinearFit) -> dict[str, float]:
    """{column: VIF}, 1 where a column is orthogonal to all others (intercept included by centring)."""
    centred = model.matrix - model.matrix.mean(axis=0)
    vif = np.diag(model.inverse) * np.sum(centred**2, axis=0)
    return {name: float(value) for name, value in zip(model.columns, vif, strict=True) if name != INTERCEPT}


def physical_coefficients(model: LinearFit, factors) -> dict[str, float]:
    """{term: coefficient} of the same equation in physical units (any polynomial up to second order)."""
    slopes = np.array([1 / factor.half_range for factor in factors])
    shifts = np.array([-factor.centre / factor.half_range for factor in factors])
    by_indices = {tuple(sorted(indices)): 0.0 for indices in model.terms.values()}
    for indices, value in zip(model.terms.values(), model.coefficients.values(), strict=True):
        for chosen in range(2 ** len(indices)):
            kept = [i for place, i in enumerate(indices) if chosen >> place & 1]
            dropped = [i for place, i in enumerate(indices) if not chosen >> place & 1]
            key = tuple(sorted(kept))
            by_indices[key] = by_indices.get(key, 0.0) + value * slopes[kept].prod() * shifts[dropped].prod()
    named = {tuple(sorted(indices)): name for name, indices in quadratic_terms(model.names).items()}
    return {named[key]: float(value) for key, value in by_indices.items()}
