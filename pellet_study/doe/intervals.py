"""Predictions of a fitted model with their intervals: of the mean, and of one further run."""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe.linear_model import LinearFit


@dataclass(frozen=True)
class Interval:
    """A predicted response, its confidence interval (mean) and prediction interval (one run), both at `level`."""

    predicted: float
    standard_error: float | None
    confidence: tuple[float, float] | None
    prediction: tuple[float, float] | None
    extrapolation: bool
    level: float = 0.95


def interval(model: LinearFit, coded, alpha: float = 0.05) -> Interval:
    """Predicted response at one coded point with its two intervals at level 1 - alpha.

    `extrapolation` is true where the leverage of the point exceeds that of every run fitted (as at the
    corners of a Box-Behnken box).
    """
    from scipy.special import stdtrit

    predicted, leverage = float(model.predict(coded)[0]), float(model.leverage(coded)[0])
    extrapolation = leverage > float(model.leverage(model.coded).max()) + 1e-9
    if model.mean_square_error is None:
        return Interval(predicted, None, None, None, extrapolation, 1 - alpha)
    t = stdtrit(model.df_residual, 1 - alpha / 2)
    mean, single = (np.sqrt(model.mean_square_error * (leverage + extra)) for extra in (0, 1))
    of_mean, of_run = ((float(predicted - t * width), float(predicted + t * width)) for width in (mean, single))
    return Interval(predicted, float(mean), of_mean, of_run, extrapolation, 1 - alpha)
