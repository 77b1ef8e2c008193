"""What each absent effect would do to the readings that no calibrated constant imitates."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.criticism.ways import SHARES, ways_of

# standard errors, the size at which signatures are taken; about what is seen in 80 of 100 data sets (2.6 + 0.84)
STEP = 3.0


@dataclass(frozen=True)
class Signature:
    """How an effect of a size shows in the whitened residuals: `unit` freed of what the calibration absorbs.

    `fitting` is the amount, of those tried, that with the constants, to first order, leaves the least misfit: where the fit
    may begin when the effect is flat elsewhere.
    """

    effect: str
    sign: int
    size: float
    shape: dict[str, float]
    unit: np.ndarray
    length: float
    visible_share: float
    fitting: float


def signatures(state: CalibratedStudy, names: Sequence[str], basis: np.ndarray) -> list[Signature]:
    """Signatures of effects at the size that shows with three standard errors, or at the physical limit.

    One for each side an effect may take and each of three shapes where it has shape parameters.
    """
    model, cells, point = state.model, state.cells, state.fit.point
    ways = [way for name in names for way in ways_of(model, name)]
    if not ways:
        return []
    trials = [way.at(point, way.absent + way.reach * share) for way in ways for share in SHARES]
    means = model.predict(np.array([point, *trials])).mean[:, cells.case]
    change = cells.whitened(means[1:] - means[0]).reshape(len(ways), len(SHARES), -1)
    change = np.nan_to_num(change, nan=0.0, posinf=0.0, neginf=0.0)
    free_change = change - (change @ basis) @ basis.T
    lengths = np.linalg.norm(free_change, axis=2)
    left = np.linalg.norm(state.fit.residual - free_change, axis=2)
    fitting = [way.absent + way.reach * SHARES[k] for way, k in zip(ways, left.argmin(axis=1), strict=True)]
    sizes = [
        way.absent + way.reach * min(_share_that_shows(length), 1.0) for way, length in zip(ways, lengths, strict=True)
    ]
    trials = [way.at(point, size) for way, size in zip(ways, sizes, strict=True)]
    means = model.predict(np.array([point, *trials])).mean[:, cells.case]
    change = np.nan_to_num(cells.whitened(means[1:] - means[0]))
    seen = change - (change @ basis) @ basis.T
    taken = []
    for k, (way, size) in enumerate(zip(ways, sizes, strict=True)):
        length, whole = np.linalg.norm(seen[k]), np.linalg.norm(change[k])
        share = length / whole if whole > 1e-12 else 0.0
        unit = seen[k] / length if length > 1e-9 else np.zeros_like(seen[k])
        told = Signature(
            way.effect, way.sign, float(size), way.shape, unit, float(length), float(share), float(fitting[k])
        )
        taken.append(told)
    return taken


def _share_that_shows(length: np.ndarray) -> float:
    """The share of its reach at which an effect is `STEP` long, by a power law between the shares tried; else the largest."""
    above = np.flatnonzero(length >= STEP)
    if not len(above):
        return SHARES[-1]
    i = above[0]
    if i > 0 and length[i - 1] > 0:
        slope = np.log(length[i] / length[i - 1]) / np.log(SHARES[i] / SHARES[i - 1])
        if slope > 0.05:
            return SHARES[i - 1] * (STEP / length[i - 1]) ** (1 / slope)
    return SHARES[i]
