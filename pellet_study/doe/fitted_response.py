"""A response as fitted, in its own unit whatever scale it was fitted on: predictions, slopes, intervals."""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe import coded_box
from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.box_search import lowest_and_highest
from pellet_study.doe.factors import Factor
from pellet_study.doe.intervals import Interval, interval
from pellet_study.doe.terms import quadratic_terms
from pellet_study.doe.transformation import Transformation


@dataclass(frozen=True)
class FittedResponse:
    """One response: its name as in the table, the surface fitted, and the transformation it was fitted through.

    Predictions of a transformed response are medians: the back-transformed mean of a symmetric distribution.
    """

    name: str
    surface: Surface
    transformation: Transformation | None = None

    @property
    def factors(self) -> list[Factor]:
        return self.surface.table.factors

    @property
    def reduced(self) -> bool:
        """Whether terms of the full quadratic were left out."""
        return len(self.surface.model.terms) < len(quadratic_terms(self.surface.table.names))

    def _back(self, values):
        return values if self.transformation is None else self.transformation.back(values)

    def predict(self, coded) -> np.ndarray:
        """Predicted response (n_points,) at coded points (n_points, n_factors), in its own unit."""
        return self._back(self.surface.model.predict(coded))

    def beyond_scale(self, coded) -> np.ndarray:
        """Where (n_points,) the fitted scale has left the range of its power, so that `predict` is 0 or infinity."""
        if self.transformation is None:
            return np.zeros(len(np.atleast_2d(coded)), dtype=bool)
        return ~self.transformation.holds(self.surface.model.predict(coded))

    def spread(self, points) -> float:
        """Range of the predictions over points that fill the box; of a transformed response, whose scale may run out there,
        over the runs."""
        where = points if self.transformation is None else self.surface.table.coded.to_numpy()
        return max(1e-300, float(np.ptp(self.predict(where))))

    def gradient(self, coded) -> np.ndarray:
        """Slopes of `predict` (n_points, n_factors), per coded unit."""
        slopes = self.surface.model.gradient(coded)
        if self.transformation is None:
            return slopes
        return slopes * self.transformation.slope_back(self.surface.model.predict(coded))[:, None]

    def bounds(self, coded, leverage=None) -> tuple[np.ndarray, np.ndarray] | None:
        """Confidence bounds of the mean (median) at level 1 - alpha; None where the fit leaves no residual.

        `leverage` (n_points,) stands in for the design's own, as after further runs.
        """
        model = self.surface.model
        if model.mean_square_error is None:
            return None
        from scipy.special import stdtrit

        leverage = model.leverage(coded) if leverage is None else leverage
        width = stdtrit(model.df_residual, 1 - self.surface.alpha / 2) * np.sqrt(model.mean_square_error * leverage)
        predicted = model.predict(coded)
        ends = self._back(predicted - width), self._back(predicted + width)
        return np.minimum(*ends), np.maximum(*ends)

    def mean_of(self, readings) -> float:
        """The mean of readings on the fitted scale, taken back."""
        forward = readings if self.transformation is None else self.transformation.forward(readings)
        return float(self._back(float(np.mean(forward))))

    def interval(self, coded, runs: int = 1) -> Interval:
        """Prediction at one coded point with its two intervals at level 1 - alpha, in the response's own unit.

        The prediction interval is that of the mean of `runs` runs, see `intervals.interval`.

        The standard error is that on the fitted scale; None where a transformation stands between.
        """
        found = interval(self.surface.model, coded, self.surface.alpha, runs)
        if self.transformation is None:
            return found
        predicted = float(self._back(found.predicted))
        confidence, prediction = self._back_ends(found.confidence), self._back_ends(found.prediction)
        within = self._back_ends(found.within_block)
        return Interval(
            predicted, None, confidence, prediction, found.extrapolation, found.level, within, found.block_scatter
        )

    def _back_ends(self, ends: tuple[float, float] | None) -> tuple[float, float] | None:
        if ends is None:
            return None
        low, high = sorted(map(float, self._back(np.array(ends))))
        return low, high

    def predicted_range(self) -> tuple[float, float]:
        """Lowest and highest predicted response in the box [-1, 1]^k."""
        return lowest_and_highest(self, coded_box.sample(len(self.factors)))
