"""Predictions of a fitted model with their intervals: of the mean, and of one further run."""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe.block_scatter import BlockScatter, block_scatter, variance_of_new
from pellet_study.doe.linear_model import LinearFit


@dataclass(frozen=True)
class Interval:
    """A predicted response, its confidence interval (mean) and prediction interval (one run), both at `level`.

    Of runs made in blocks the mean is that of the blocks, and the prediction interval is for a run in a new one, with the
    scatter between blocks in it; `within_block` is that of a run in an average one of those run, without it. `block_scatter`
    says what was found of that scatter.
    """

    predicted: float
    standard_error: float | None
    confidence: tuple[float, float] | None
    prediction: tuple[float, float] | None
    extrapolation: bool
    level: float = 0.95
    within_block: tuple[float, float] | None = None
    block_scatter: tuple[BlockScatter, ...] = ()


def interval(model: LinearFit, coded, alpha: float = 0.05, runs: int = 1) -> Interval:
    """Predicted response at one coded point with its two intervals at level 1 - alpha.

    `extrapolation` is true where the leverage of the point exceeds that of every run fitted (as at the corners of a
    Box-Behnken box). The prediction interval is that of the mean of `runs` runs, all of them in one new block.
    """
    from scipy.special import stdtrit

    predicted, leverage = float(model.predict(coded)[0]), float(model.leverage(coded)[0])
    extrapolation = leverage > float(model.leverage(model.coded).max()) + 1e-9
    if model.mean_square_error is None:
        return Interval(predicted, None, None, None, extrapolation, 1 - alpha)

    def around(variance: float, df: float) -> tuple[float, float]:
        width = float(stdtrit(df, 1 - alpha / 2) * np.sqrt(variance))
        return predicted - width, predicted + width

    scatter = block_scatter(model)
    of_mean = around(model.mean_square_error * leverage, model.df_residual)
    within = around(model.mean_square_error * (leverage + 1 / runs), model.df_residual)
    of_run = within
    if scatter:  # of several runs no wider than of one: the fewer degrees of freedom would make it so
        each = [around(*variance_of_new(model, leverage + 1 / n, scatter)) for n in {1, runs}]
        of_run = min(each, key=lambda ends: ends[1] - ends[0])
    error = float(np.sqrt(model.mean_square_error * leverage))
    return Interval(
        predicted, error, of_mean, of_run, extrapolation, 1 - alpha, within if scatter else None, tuple(scatter)
    )
