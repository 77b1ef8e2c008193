"""Box-Behnken and face-centred central composite designs, and the quadratic fit of the table that was run.

References
----------
Box, Behnken, Some new three level designs for the study of quantitative variables, Technometrics 2 (1960)
455, doi:10.1080/00401706.1960.10489912.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from pellet_study.doe.anova import anova_row, block_rows, near_zero, predicted_ceiling, pure_error, type_three
from pellet_study.doe.box_cox import BoxCox, box_cox
from pellet_study.doe.composite import composite_matrix
from pellet_study.doe.design_table import DesignTable
from pellet_study.doe.factors import Factor, physical_design
from pellet_study.doe.lenth import Lenth, lenth
from pellet_study.doe.linear_model import LinearFit, fit, physical_coefficients, press, variance_inflation
from pellet_study.doe.published_designs import box_behnken_matrix
from pellet_study.doe.run_diagnostics import Runs, adequate_precision_of, diagnostics, normality_of
from pellet_study.doe.terms import INTERCEPT, quadratic_terms
from pellet_study.errors import InputError

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
    r2_predicted_ceiling: float | None
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
    """Fit the given terms (see `terms.quadratic_terms`) and everything that is read off the fit."""
    model = fit(table.names, terms, table.coded, table.response, blocks=table.blocks, rounding=table.rounding_variance)
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
        r2_predicted_ceiling=predicted_ceiling(*pure_error(table.coded, table.response, table.blocks), model.response),
        press=None if variance is None else squares,
        cv_percent=100 * float(np.sqrt(variance)) / mean
        if variance is not None and not near_zero(mean, model.response)
        else None,
        adequate_precision=adequate_precision_of(model),
        lack_of_fit_p=lack_of_fit_p,
        pure_error_df=pure_df,
        vif={name: value for name, value in variance_inflation(model).items() if name in terms},
        runs=diagnostics(model),
        normality=normality_of(model),
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
