r"""The parameters that agree with all readings together: their posterior distribution on the surfaces.

With readings :math:`y` of covariance :math:`V` and surfaces :math:`\hat y(x)` of covariance :math:`C(x)`, and every setting of the box as
likely before as another, the density at a setting is

.. math:: p(x | y) \propto |V + C(x)|^{-1/2} \exp(-\tfrac12 (y - \hat y)' (V + C(x))^{-1} (y - \hat y))

The box is filled with Sobol points, each weighted by this density: no chain has to converge, and the same call gives the same numbers.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigh

from pellet_study.doe import coded_box
from pellet_study.doe.factors import Factor
from pellet_study.powder.responses import Responses

LEVEL = 0.95
DENSEST = 0.1  # of the posterior, out of which one setting is recommended
ENOUGH = 2_000  # points that carry the posterior, below which its part of the box is filled anew
ZOOMS = 4
NEGLIGIBLE = 12.0  # of the logarithm of the density below its highest: 6e-6


@dataclass(frozen=True)
class Block:
    """Readings whose heaps were simulated together: surfaces, measured means (m,) and their covariance (m, m)."""

    responses: Responses
    measured: np.ndarray
    covariance: np.ndarray

    def whitened(self, coded: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """At coded points (points, k): measured less predicted in units of their joint scatter (points, m), and log |V + C|.

        The logarithm leaves out what is the same at all points. V + C(x) is a constant matrix and h(x) times another, so one
        pair of axes serves all points.
        """
        surfaces = self.responses
        constant = self.covariance + surfaces.misfit
        sizes, axes = eigh(surfaces.widening * surfaces.scatter, constant)
        widths = 1 + surfaces.leverage(coded)[:, None] * sizes
        return (self.measured - surfaces.predict(coded)) @ axes / np.sqrt(widths), np.log(widths).sum(axis=1)


@dataclass(frozen=True)
class Posterior:
    """Weighted settings of the box.

    Attributes
    ----------
    block : the readings and surfaces that it is of
    coded : (points, k), evenly spread over a part of the box
    weights : (points,), of sum 1
    part : share of the box that the points fill; outside of it the density is negligible
    distance : least squared distance of the readings from the surfaces over the box, in units of their joint scatter
    """

    block: Block
    coded: np.ndarray
    weights: np.ndarray
    part: float
    distance: float

    @property
    def factors(self) -> list[Factor]:
        """The factors, in the order of the coded columns."""
        return self.block.responses.factors

    @cached_property
    def order(self) -> np.ndarray:
        """The points, densest first."""
        return np.argsort(-self.weights, kind="stable")

    @property
    def best(self) -> np.ndarray:
        """The densest setting, coded."""
        return self.coded[self.order[0]]

    @property
    def recommended(self) -> np.ndarray:
        """The setting nearest to the middle of the box among those that agree best, a tenth of the posterior; coded."""
        among = self.coded[self.region(DENSEST)]
        return among[np.argmin((among**2).sum(axis=1))]

    def share(self, level: float = LEVEL) -> float:
        """Share of the box that the smallest region takes which holds so much of the posterior."""
        return region_share(self.weights[self.order], level) * self.part

    def region(self, level: float = LEVEL) -> np.ndarray:
        """Which points lie in that region."""
        inside = np.zeros(len(self.weights), dtype=bool)
        inside[self.order[: 1 + np.searchsorted(np.cumsum(self.weights[self.order]), level)]] = True
        return inside

    def holds(self, setting: np.ndarray, level: float = LEVEL) -> bool:
        """Whether a coded setting (k,) lies in that region."""
        logs = log_density(self.block, np.vstack([setting, self.best]))[0]
        least = self.weights[self.region(level)].min()
        return bool(logs[0] - logs[1] >= np.log(least / self.weights.max()))

    def interval(self, factor: int, level: float = LEVEL) -> tuple[float, float]:
        """Physical levels of a factor between the (1 - level)/2 and (1 + level)/2 quantiles."""
        order = np.argsort(self.coded[:, factor], kind="stable")
        below = np.cumsum(self.weights[order])
        ends = np.interp([(1 - level) / 2, (1 + level) / 2], below, self.coded[order, factor])
        low, high = (float(self.factors[factor].physical(x)) for x in ends)
        return low, high


def region_share(weights: np.ndarray, level: float = LEVEL) -> float:
    """Share of the points that hold `level` of the weight; the weights largest first, of sum 1."""
    return float((1 + np.searchsorted(np.cumsum(weights), level)) / len(weights))


def posterior(block: Block) -> Posterior:
    """The settings of the box by how well they agree with the readings."""
    spread = coded_box.sample(len(block.responses.factors))
    coded, part, least = spread, 1.0, np.inf
    for zoom in range(ZOOMS + 1):
        logs, distances = log_density(block, coded)
        weights = np.exp(logs - logs.max())
        least = min(least, float(distances.min()))
        between = 2 * np.ptp(coded, axis=0) / len(coded) ** (1 / coded.shape[1])
        low, high = _around(coded[logs > logs.max() - NEGLIGIBLE], between)
        smaller = float(np.prod((high - low) / 2))
        if zoom == ZOOMS or weights.sum() ** 2 / (weights**2).sum() >= ENOUGH or smaller > 0.9 * part:
            break
        coded, part = low + (spread + 1) / 2 * (high - low), smaller
    return Posterior(block, coded, weights / weights.sum(), part, least)


def _around(coded: np.ndarray, room: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the part of the box that holds settings, with some room: at least what lies between points."""
    room = 0.1 * np.ptp(coded, axis=0) + room
    return np.maximum(coded.min(axis=0) - room, -1), np.minimum(coded.max(axis=0) + room, 1)


def log_density(block: Block, coded: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Logarithm of the density (points,), but for a constant, and the squared distance of the readings (points,)."""
    white, size = block.whitened(coded)
    squared = (white**2).sum(axis=1)
    return -(squared + size) / 2, squared
