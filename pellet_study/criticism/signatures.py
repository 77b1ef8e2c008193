"""What each absent effect would do to the readings that no calibrated constant imitates."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.model.model import Model

STEP = 3.0  # standard errors, the size at which signatures are taken


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


def signatures(state: CalibratedStudy, names: Sequence[str], basis: np.ndarray) -> list[Signature]:
    """Signatures of effects at the size that shows with three standard errors, or at the physical limit.

    One for each side an effect may take and each of three shapes where it has shape parameters.
    """
    model, cells, point = state.model, state.cells, state.fit.point
    shares = np.geomspace(1e-4, 1, 13)
    trials, labels = [point], []
    for name in names:
        effect = model.study.catalogue.effects[name]
        columns, ranges = columns_of(model, name), physical(model, name)
        absent = effect.neutral()[effect.amount]
        shapes = [{}]
        if len(columns) > 1:
            keys = list(effect.parameters)[1:]
            shapes = [dict(zip(keys, values, strict=True)) for values in product(*[_three(*r) for r in ranges[1:]])]
        for sign in (1, -1) if effect.sides == 2 else (1,):
            reach = (ranges[0][1] if sign > 0 else ranges[0][0]) - absent
            if reach == 0:
                continue
            for shape in shapes:
                sizes = absent + reach * shares
                for size in sizes:
                    trial = point.copy()
                    trial[columns[0]] = size
                    for k, value in zip(columns[1:], shape.values(), strict=True):
                        trial[k] = value
                    trials.append(trial)
                labels.append((name, sign, shape, sizes, absent, reach))
    if not labels:
        return []
    means = model.predict(np.array(trials)).mean[:, cells.case]
    change = cells.whitened(means[1:] - means[0]).reshape(len(labels), len(shares), -1)
    change = np.nan_to_num(change, nan=0.0, posinf=0.0, neginf=0.0)
    seen = change - (change @ basis) @ basis.T
    length = np.linalg.norm(seen, axis=2)
    finer, sizes_at = [], []
    for k, (name, _, shape, _, absent, reach) in enumerate(labels):
        above = np.flatnonzero(length[k] >= STEP)
        share = shares[-1]
        if len(above):
            i = above[0]
            share = shares[i]
            if i > 0 and length[k, i - 1] > 0:
                slope = np.log(length[k, i] / length[k, i - 1]) / np.log(shares[i] / shares[i - 1])
                if slope > 0.05:
                    share = shares[i - 1] * (STEP / length[k, i - 1]) ** (1 / slope)
        sizes_at.append(absent + reach * min(share, 1.0))
        trial = point.copy()
        columns = columns_of(model, name)
        trial[columns[0]] = sizes_at[-1]
        for c, value in zip(columns[1:], shape.values(), strict=True):
            trial[c] = value
        finer.append(trial)
    means = model.predict(np.array([point, *finer])).mean[:, cells.case]
    change = np.nan_to_num(cells.whitened(means[1:] - means[0]))
    seen = change - (change @ basis) @ basis.T
    found = []
    for k, (name, sign, shape, *_) in enumerate(labels):
        size, whole = np.linalg.norm(seen[k]), np.linalg.norm(change[k])
        share = size / whole if whole > 1e-12 else 0.0
        unit = seen[k] / size if size > 1e-9 else np.zeros_like(seen[k])
        found.append(Signature(name, sign, float(sizes_at[k]), shape, unit, float(size), float(share)))
    return found


def _three(low: float, high: float) -> tuple[float, float, float]:
    return (low, float(np.sqrt(low * high)) if low > 0 else 0.5 * (low + high), high)
