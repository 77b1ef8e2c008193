"""Box-Behnken and face-centred central composite designs, and the quadratic fit of the table that was run.

References
----------
Box, Behnken, Some new three level designs for the study of quantitative variables, Technometrics 2 (1960)
455, doi:10.1080/00401706.1960.10489912.
Box, Cox, An analysis of transformations, J. Roy. Statist. Soc. B 26 (1964) 211,
doi:10.1111/j.2517-6161.1964.tb00553.x. Cook, Detection of influential observation in linear regression,
Technometrics 19 (1977) 15, doi:10.1080/00401706.1977.10489493.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from pellet_study.doe.blocks import columns_of_blocks
from pellet_study.doe.composite import composite_matrix
from pellet_study.doe.design_table import DesignTable
from pellet_study.doe.factors import Factor, physical_design
from pellet_study.doe.lenth import Lenth, lenth
from pellet_study.doe.linear_model import (
    INTERCEPT,
    LinearFit,
    anova_row,
    block_rows,
    fit,
    near_zero,
    physical_coefficients,
    press,
    pure_error,
    quadratic_terms,
    type_three,
    variance_inflation,
)
from pellet_study.doe.published_designs import box_behnken_matrix
from pellet_study.errors import InputError

BOX_COX_RANGE = (-5.0, 5.0)
PREDICTED_R2_GAP = 0.2
"""The rule of thumb of Design-Expert: predicted R2 should lie within 0.2 of the adjusted one."""


# ----------------------------------------------------------------------------------------------------- design
def coded_matrix(n_factors: int, centre_points: int = 5, face_centred: bool = False) -> np.ndarray:
    """Coded design (n_runs, n_factors): Box-Behnken as published, or face-centred central composite.

    Parameters
    ----------
    n_factors : int
        See `box_behnken_matrix`, which has no corners, and `composite_matrix`, for those who need them.
    centre_points : int
        Runs at the middle, 1 or more; without replicates of it there is no pure error.
    face_centred : bool

    Raises
    ------
    InputError
        If the number of factors or of centre points is out of range.
    """
    if face_centred:
        return composite_matrix(n_factors, "face", centre_points)[0]
    return box_behnken_matrix(n_factors, centre_points)


def design(factors: list[Factor], centre_points: int = 5, face_centred: bool = False) -> pd.DataFrame:
    """The design in the physical units of its factors; see `coded_matrix`."""
    return physical_design(coded_matrix(len(factors), centre_points, face_centred), factors)


# --------------------------------------------------------------------------------------------------- analysis
@dataclass(frozen=True)
class BoxCox:
    """Maximum likelihood power of the response and its confidence interval at `level` (None: beyond -5 or 5).

    `beyond` is 5 or -5 where the likelihood still rises there: there is no power then, and no transformation helps.
    """

    power: float | None
    low: float | None
    high: float | None
    beyond: float | None = None
    level: float = 0.95

    @property
    def transformation_needed(self) -> bool:
        """Whether 1 (no transformation) lies outside the interval."""
        return (self.low is not None and self.low > 1) or (self.high is not None and self.high < 1)


@dataclass(frozen=True)
class Runs:
    """Diagnostics of each run, arrays of shape (n_runs,); studentized residuals are external (R-student)."""

    fitted: np.ndarray
    residuals: np.ndarray
    studentized: np.ndarray | None
    leverage: np.ndarray
    cooks_distance: np.ndarray | None


@dataclass(frozen=True)
class Stationary:
    """Stationary point of the surface: coded, predicted response, eigenvalues of the second-order part."""

    coded: np.ndarray
    predicted: float
    eigenvalues: np.ndarray

    @property
    def kind(self) -> str:
        if np.all(self.eigenvalues < 0):
            return "maximum"
        return "minimum" if np.all(self.eigenvalues > 0) else "saddle"


@dataclass(frozen=True)
class Surface:
    """A fitted response surface and how far to trust it; None where undefined."""

    table: DesignTable
    model: LinearFit
    alpha: float
    anova: list[dict]
    coefficients: dict[str, float]
    standard_errors: dict[str, float | None]
    physical_coefficients: dict[str, float]
    r2: float
    r2_adjusted: float | None
    r2_predicted: float | None
    press: float | None
    cv_percent: float | None
    adequate_precision: float | None
    lack_of_fit_p: float | None
    pure_error_df: int
    vif: dict[str, float]
    runs: Runs
    normality: tuple[float, float] | None
    box_cox: BoxCox | None
    stationary: Stationary | None
    lenth: Lenth | None

    @property
    def saturated(self) -> bool:
        return self.model.df_residual == 0

    @property
    def effects(self) -> dict[str, float]:
        """{term: twice its coefficient}: for a main effect the change of the response from -1 to +1."""
        return {name: 2 * value for name, value in self.coefficients.items() if name != INTERCEPT}

    @property
    def scaled_effects(self) -> dict[str, float]:
        """{term: coefficient over its standard error per unit sigma}: of equal variance."""
        return _scaled(self.model)

    @property
    def standard_error_inflation(self) -> dict[str, float]:
        """{main effect or interaction: standard error relative to one orthogonal to the other terms}.

        1 in a complete design; the squares are never orthogonal and have their VIF only.
        """
        products = {name for name, indices in self.model.terms.items() if len(indices) == len(set(indices))}
        return {name: float(np.sqrt(value)) for name, value in self.vif.items() if name in products}

    @property
    def orthogonal(self) -> bool:
        return max(self.standard_error_inflation.values(), default=1.0) < 1 + 1e-6

    @property
    def p(self) -> dict[str, float | None]:
        """{term: p value of its partial F test}."""
        return {row["source"]: row["p"] for row in self.anova if row["source"] in self.model.terms}


def analyse(table: DesignTable, alpha: float = 0.05) -> Surface:
    r"""Full quadratic fit in coded units.

    :math:`y = b_0 + \sum b_i x_i + \sum b_{ij} x_i x_j + \sum b_{ii} x_i^2`

    Parameters
    ----------
    table : DesignTable
        Every factor at three levels or more, in whatever row order, with runs missing or replicated.
    alpha : float
        Level of the intervals, 0 to 1.

    Raises
    ------
    InputError
        If a factor has only two levels, there are fewer runs than terms, or the runs do not separate them.
    """
    for name in table.names:
        if table.coded[name].round(1).nunique() < 3:
            raise InputError(
                f"column {name!r} has only two levels in rows {table.lines[0]} to {table.lines[-1]}: its "
                "square cannot be fitted; expected three levels or more. Analyse a two-level table with pb"
            )
    return fit_surface(table, quadratic_terms(table.names), alpha)


def fit_surface(table: DesignTable, terms: dict[str, tuple[int, ...]], alpha: float = 0.05) -> Surface:
    """Fit the given terms (see `linear_model.quadratic_terms`) and everything that is read off the fit."""
    model = fit(table.names, terms, table.coded, table.response, columns_of_blocks(table.blocks))
    rows, lack_of_fit_p, pure_df = _anova(table, model)
    total = float(np.sum((model.response - model.response.mean()) ** 2))
    variance, squares = model.mean_square_error, press(model)
    mean = float(model.response.mean())
    return Surface(
        table=table,
        model=model,
        alpha=alpha,
        anova=rows,
        coefficients=model.coefficients,
        standard_errors=model.standard_errors,
        physical_coefficients=physical_coefficients(model, table.factors),
        r2=1 - model.ss_residual / total,
        r2_adjusted=None if variance is None else 1 - variance / (total / (len(model.response) - 1)),
        r2_predicted=None if squares is None or variance is None else 1 - squares / total,
        press=None if variance is None else squares,
        cv_percent=100 * float(np.sqrt(variance)) / mean
        if variance is not None and not near_zero(mean, model.response)
        else None,
        adequate_precision=_adequate_precision(model),
        lack_of_fit_p=lack_of_fit_p,
        pure_error_df=pure_df,
        vif={name: value for name, value in variance_inflation(model).items() if name in terms},
        runs=diagnostics(model),
        normality=_normality(model),
        box_cox=box_cox(model, alpha) if variance else None,
        stationary=_stationary(model),
        lenth=lenth(list(_scaled(model).values()), alpha) if variance is None else None,
    )


def _anova(table: DesignTable, model: LinearFit) -> tuple[list[dict], float | None, int]:
    """ANOVA rows in the order of the paper's Table 13, p of the lack of fit, df of the pure error."""
    error = (model.mean_square_error, model.df_residual)
    sums = {name: value for name, value in type_three(model).items() if name in model.terms}
    total = float(np.sum((model.response - model.response.mean()) ** 2))
    rows, between = block_rows(table.blocks, model)
    rows.append(anova_row("model", total - between - model.ss_residual, len(sums), *error))
    rows += [anova_row(name, value, 1, *error) for name, value in sums.items()]
    rows.append(anova_row("residual", model.ss_residual, model.df_residual))
    pure_ss, pure_df = pure_error(table.coded, table.response, table.blocks)
    lack_of_fit_p = None
    if pure_df:
        lack_ss, lack_df = max(model.ss_residual - pure_ss, 0.0), model.df_residual - pure_df
        rows.append(anova_row("lack of fit", lack_ss, lack_df, pure_ss / pure_df, pure_df))
        rows.append(anova_row("pure error", pure_ss, pure_df))
        lack_of_fit_p = rows[-2]["p"]
    rows.append({**anova_row("total", total, len(model.response) - 1), "mean_square": None})
    return rows, lack_of_fit_p, pure_df


def _adequate_precision(model: LinearFit) -> float | None:
    r""":math:`(\max\hat y - \min\hat y) / \sqrt{p s^2 / n}`, signal to noise; above 4 is wanted."""
    if not model.mean_square_error:
        return None
    runs, size = model.matrix.shape
    return float(np.ptp(model.fitted) / np.sqrt(size * model.mean_square_error / runs))


def diagnostics(model: LinearFit) -> Runs:
    r"""Leverage h, R-student :math:`e/(s_{(i)}\sqrt{1-h})`, Cook's D :math:`e^2 h/(p s^2 (1-h)^2)`.

    A run with leverage 1 is fitted exactly whatever it reads, and has neither R-student nor Cook's D (NaN).
    """
    leverage, residuals = model.run_leverage, model.residuals
    variance, df = model.mean_square_error, model.df_residual
    if not variance or df < 2:
        return Runs(model.fitted, residuals, None, leverage, None)
    left = np.where(leverage > 1 - 1e-9, np.nan, 1 - leverage)
    cook = residuals**2 * leverage / (len(model.columns) * variance * left**2)
    return Runs(model.fitted, residuals, model.studentized, leverage, cook)


def _normality(model: LinearFit) -> tuple[float, float] | None:
    """Shapiro-Wilk W and p of the residuals."""
    if not model.mean_square_error:
        return None
    from scipy.stats import shapiro

    statistic, p = shapiro(model.residuals)
    return float(statistic), float(p)


def box_cox(model: LinearFit, alpha: float = 0.05) -> BoxCox | None:
    r"""Box-Cox power of the response, by profile likelihood.

    Maximises :math:`-\frac{n}{2}\ln(SSE_\lambda/n)`, :math:`SSE_\lambda` that of the model fitted to
    :math:`y^{(\lambda)} = (y^\lambda - 1)/(\lambda \dot y^{\lambda-1})`, :math:`\dot y` the geometric mean.

    Returns
    -------
    BoxCox or None
        None where a response is not positive or there is no residual.
    """
    if np.any(model.response <= 0) or not model.df_residual:
        return None
    from scipy.optimize import brentq, minimize_scalar
    from scipy.special import chdtri

    logs = np.log(model.response)
    projector = np.eye(len(logs)) - model.matrix @ model.inverse @ model.matrix.T

    def log_likelihood(power: float) -> float:
        relative = logs - logs.mean()  # constants drop out: the model has an intercept
        scaled = relative if abs(power) < 1e-8 else np.expm1(power * relative) / power
        return -len(logs) / 2 * np.log(np.sum((projector @ scaled) ** 2) / len(logs))

    low, high = BOX_COX_RANGE
    best = minimize_scalar(lambda power: -log_likelihood(power), bounds=(low, high), method="bounded").x
    beyond = next((end for end in (low, high) if log_likelihood(end) >= log_likelihood(best)), None)
    if beyond is not None:
        return BoxCox(None, None, None, beyond, 1 - alpha)
    limit = log_likelihood(best) - chdtri(1, alpha) / 2
    below, above = (
        float(brentq(lambda power: log_likelihood(power) - limit, best, end)) if log_likelihood(end) < limit else None
        for end in (low, high)
    )
    return BoxCox(float(best), below, above, level=1 - alpha)


def _stationary(model: LinearFit) -> Stationary | None:
    """Where the gradient of the quadratic vanishes; None where it does so nowhere or on a line."""
    size = len(model.names)
    slopes, second = np.zeros(size), np.zeros((size, size))
    for indices, value in zip(model.terms.values(), model.coefficients.values(), strict=True):
        if len(indices) == 1:
            slopes[indices[0]] = value
        elif len(indices) == 2:
            second[indices] += value / 2
            second[indices[::-1]] += value / 2
    if np.linalg.matrix_rank(second, tol=1e-9 * max(1e-300, np.abs(second).max())) < size:
        return None
    point = -0.5 * np.linalg.solve(second, slopes)
    return Stationary(point, float(model.predict(point)[0]), np.linalg.eigvalsh(second))


def _scaled(model: LinearFit) -> dict[str, float]:
    """Coefficients of equal variance, the intercept left out."""
    scaled = (np.asarray(model.results.params) / np.sqrt(np.diag(model.inverse)))[: len(model.terms)]
    return dict(zip(list(model.terms)[1:], map(float, scaled[1:]), strict=True))


# --------------------------------------------------------------------------------------------- reduced models
def without(surface: Surface, dropped: list[str]) -> Surface:
    """The same table fitted without the named terms.

    Raises
    ------
    InputError
        If a term is not in the model, or a main effect would go while a product with it stays.
    """
    terms = {name: indices for name, indices in surface.model.terms.items() if name not in dropped}
    for name in dropped:
        if name not in surface.model.terms or name == INTERCEPT:
            raise InputError(f"{name!r} is no term of the model: its terms are {', '.join(surface.p)}")
        needed = _dependents(surface.model.terms[name], terms)
        if needed:
            raise InputError(f"{name!r} cannot be left out while {needed[0]!r} stays: leave that out first")
    return fit_surface(surface.table, terms, surface.alpha)


def _dependents(indices: tuple[int, ...], terms: dict) -> list[str]:
    """Terms of second order that contain a main effect."""
    if len(indices) != 1:
        return []
    return [name for name, other in terms.items() if len(other) == 2 and indices[0] in other]


def reduce_backward(surface: Surface, alpha: float = 0.1) -> tuple[Surface, list[str]]:
    """Backward elimination: leave out the least significant term while its p exceeds `alpha`, hierarchy kept.

    Returns
    -------
    surface, dropped : Surface, list of str
        The reduced fit and the terms left out, in order. Their p values are no longer honest: they were
        chosen.

    Raises
    ------
    InputError
        If the model is saturated: without p values there is nothing to choose by.
    """
    if surface.saturated:
        raise InputError("the model is saturated and has no p values: name the terms to leave out with --drop")
    dropped: list[str] = []
    while True:
        terms = surface.model.terms
        candidates = {
            name: p
            for name, p in surface.p.items()
            if p is not None and p > alpha and not _dependents(terms[name], terms)
        }
        if not candidates or len(terms) <= 2:
            return surface, dropped
        worst = max(candidates, key=candidates.get)
        dropped.append(worst)
        surface = without(surface, [worst])
