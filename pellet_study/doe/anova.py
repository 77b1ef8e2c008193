"""What an analysis of variance is made of: sums of squares, F tests, pure error, blocks.

Reference
---------
Myers, Montgomery, Anderson-Cook, Response Surface Methodology, 4th ed., Wiley 2016, ch. 2: lack of fit.
"""

import numpy as np
import pandas as pd

from pellet_study.doe.blocks import sum_of_squares
from pellet_study.doe.linear_model import LinearFit
from pellet_study.doe.terms import INTERCEPT


def type_three(model: LinearFit) -> dict[str, float]:
    r"""{column: partial (type III) sum of squares} :math:`b_j^2 / [(X'X)^{-1}]_{jj}`, intercept left out."""
    sums = np.asarray(model.results.params) ** 2 / np.diag(model.inverse)
    return {name: float(value) for name, value in zip(model.columns, sums, strict=True) if name != INTERCEPT}


def f_test(sum_of_squares: float, df: int, variance: float | None, df_error: int) -> tuple[float | None, float | None]:
    """F and p of a sum of squares against an error variance; (None, None) where there is none."""
    if not variance or df_error <= 0 or df <= 0:
        return None, None
    from scipy.special import fdtrc

    ratio = sum_of_squares / df / variance
    return float(ratio), float(fdtrc(df, df_error, ratio))


def anova_row(source, sum_of_squares, df, variance=None, df_error=0) -> dict:
    """One line of an ANOVA table; F and p are None where undefined."""
    ratio, p = f_test(sum_of_squares, df, variance, df_error)
    return {
        "source": source,
        "sum_of_squares": float(sum_of_squares),
        "df": int(df),
        "mean_square": float(sum_of_squares / df) if df else None,
        "f": ratio,
        "p": p,
    }


def pure_error(coded, response, blocks=()) -> tuple[float, int]:
    """Sum of squares and degrees of freedom within replicated runs; exactly 0 where they differ by rounding only.

    Runs of different blocks are no replicates of each other.
    """
    response = np.asarray(response, dtype=float)
    labels = [pd.Series(block.labels) for block in blocks]
    groups = pd.Series(response).groupby([pd.Series(c).round(6) for c in np.asarray(coded).T] + labels)
    within = response - groups.transform("mean").to_numpy()
    differ = np.abs(within).max() > 1e-12 * np.abs(response).max()
    squares = float(((groups.count() - 1) * groups.var(ddof=1).fillna(0)).sum()) if differ else 0.0
    return squares, int((groups.count() - 1).sum())


def predicted_ceiling(squares: float, df: int, response) -> float | None:
    r"""Predicted R2 of a model that gives the true mean of every run: what the scatter of the replicates leaves.

    :math:`1 - n s^2_\mathrm{pure} / SS_\mathrm{total}`, at least 0; None without replicates. Its PRESS is the scatter of new
    runs about their true means.
    """
    if not df:
        return None
    response = np.asarray(response, dtype=float)
    total = float(np.sum((response - response.mean()) ** 2))
    return max(0.0, 1 - len(response) * squares / df / total)


def block_rows(blocks, model: LinearFit) -> tuple[list[dict], float]:
    """The ANOVA's line of the blocks, fitted before the factors, and its sum of squares; none without blocks."""
    squares, df = sum_of_squares(blocks, model.response)
    if not df:
        return [], 0.0
    name = "blocks" if len(blocks) > 1 else f"block {blocks[0].name}"
    return [anova_row(name, squares, df, model.mean_square_error, model.df_residual)], squares


def near_zero(mean: float, response) -> bool:
    """Whether a mean is zero but for rounding, so that nothing can be given in percent of it."""
    return abs(mean) <= 1e-9 * float(np.abs(response).max())
