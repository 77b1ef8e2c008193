"""The ways an effect may act, and the amounts at which it is tried: its sides, its shapes, from near nothing to its reach."""

from dataclasses import dataclass
from itertools import product

import numpy as np

from pellet_study.model.model import Model

SHARES = np.geomspace(1e-4, 1, 13)  # of an effect's physical reach, at which it is tried


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


def _three(low: float, high: float) -> tuple[float, float, float]:
    return (low, float(np.sqrt(low * high)) if low > 0 else 0.5 * (low + high), high)
