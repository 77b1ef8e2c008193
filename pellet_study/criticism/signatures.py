"""What each absent effect would do to the readings that no calibrated constant imitates."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.model.model import Model

# standard errors, the size at which signatures are taken; about what is seen in 80 of 100 data sets (2.6 + 0.84)
STEP = 3.0
SHARES = np.geomspace(1e-4, 1, 13)  # of an effect's physical reach, at which it is tried


@dataclass(frozen=True)
class Signature:
    """How an effect of a size shows in the whitened residuals: `unit` freed of what the calibration absorbs."""

    effect: str
    sign: int
    size: float
    shape: dict[str, float]
    unit: np.ndarray
    length: float
    visible_share: float


def columns_of(model: Model, effect: str) -> list[int]:
    """Columns of an effect's parameters, the amount first."""
    return [model.column[f"{effect}.{p}"] for p in model.study.catalogue.effects[effect].parameters]


def physical(model: Model, effect: str) -> list[tuple[float, float]]:
    """Physical range of each of an effect's parameters."""
    quantities = model.study.catalogue.effects[effect].parameters.values()
    return [q.get("physical", (q["min"], q["max"])) for q in quantities]


@dataclass(frozen=True)
class Way:
    """A way for an effect to act: the side its amount is on, and its shape parameters; `reach` is the farthest amount."""

    effect: str
    sign: int
    shape: dict[str, float]
    columns: list[int]
    absent: float
    reach: float

    def at(self, point: np.ndarray, amount: float) -> np.ndarray:
        """A point with this much of the effect."""
        moved = point.copy()
        moved[self.columns[0]] = amount
        for column, value in zip(self.columns[1:], self.shape.values(), strict=True):
            moved[column] = value
        return moved


def ways_of(model: Model, name: str) -> list[Way]:
    """One for each side an effect may take and each of three values of every shape parameter."""
    effect = model.study.catalogue.effects[name]
    columns, ranges = columns_of(model, name), physical(model, name)
    absent = effect.neutral()[effect.amount]
    parameters = list(effect.parameters)[1:]
    shapes = [dict(zip(parameters, values, strict=True)) for values in product(*[_three(*r) for r in ranges[1:]])]
    ways = []
    for sign in (1, -1) if effect.sides == 2 else (1,):
        limit = ranges[0][1] if sign > 0 else ranges[0][0]
        if limit != absent:
            ways += [Way(name, sign, shape, columns, absent, limit - absent) for shape in shapes]
    return ways


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
    lengths = np.linalg.norm(change - (change @ basis) @ basis.T, axis=2)
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
        taken.append(Signature(way.effect, way.sign, float(size), way.shape, unit, float(length), float(share)))
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


def _three(low: float, high: float) -> tuple[float, float, float]:
    return (low, float(np.sqrt(low * high)) if low > 0 else 0.5 * (low + high), high)
