"""Jumps and steps of a curve: a change that stays as it is between ever nearer points, once or again and again.

A jump is looked for by halving: of a grid's intervals those where a curve changes most, or more than beside them, are halved,
always keeping the half with the larger change, down to neighbouring numbers. A change that goes on shrinking (as |a|^h does by
2^-h each time) is continuous, however steep; one that stays is a jump. Steps show as a curve that stands still between most
of many neighbouring points and jumps between several others, over a range or over a small part of it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

POINTS = 33  # of the grid over a range
NEAR = (1e-8, 1e-6, 1e-4, 1e-3, 1e-2)  # further points of it beside `absent`, as shares of the range
HALVINGS, LAST = 64, 20  # of an interval; a change that the last ones leave as it is does not shrink
STAYS = 0.9
FINE = 501  # points at which steps are looked for
WINDOWS = (
    1.0,
    0.02,
    4e-4,
)  # of the range: finer steps than a window's points can show are finer than finite differences
STILL, FEWEST = 1e-15, 3  # of the prediction; so few jumps are no steps


@dataclass(frozen=True)
class Jump:
    """A change at once between two neighbouring values of what was varied, in one row."""

    low: float
    high: float
    before: float
    after: float
    row: int

    @property
    def size(self) -> float:
        """How much the prediction changes."""
        return abs(self.after - self.before)


Curve = Callable[[np.ndarray, np.ndarray], np.ndarray]  # (p,) values of what is varied, (r,) rows: (p, r) predictions


def one_row(curve: Curve, row: int) -> Curve:
    """The curve of one row, whatever rows are asked for."""
    return lambda points, rows: np.repeat(curve(points, np.array([row])), len(rows), axis=1)


def grid_of(low: float, high: float, absent: float | None) -> np.ndarray:
    """Points over a range, closer about `absent`."""
    points = [np.linspace(low, high, POINTS)]
    if absent is not None:
        near = np.array(NEAR) * (high - low)
        points += [np.array([absent]), absent + near, absent - near]
    found = np.unique(np.concatenate(points))
    return found[((found >= low) & (found <= high)) | (found == absent)]


def jumps_of(
    curve: Curve, grid: np.ndarray, values: np.ndarray, absent: float | None, share: float = 0.0
) -> list[Jump]:
    """Jumps in the intervals where one may be: with the largest change, or a larger one than beside them, or at `absent`.

    Those below a share of the whole change are not looked for.
    """
    whole = np.maximum(np.ptp(values, axis=0), 1e-300)
    change = np.abs(np.diff(values, axis=0)) / whole
    beside = np.pad(change, ((1, 1), (0, 0)), constant_values=np.inf)
    excess = change - np.minimum(beside[:-2], beside[2:])
    places = {divmod(int(k), change.shape[1]) for by in (change, excess) for k in np.argsort(-by, axis=None)[:2]}
    if absent is not None:
        k = int(np.searchsorted(grid, absent))
        places |= {(m, int(np.argmax(change[m]))) for m in (k - 1, k) if 0 <= m < len(change)}
    intervals = sorted(places)
    rows = np.array([row for _, row in intervals])
    low, high = (np.array([grid[k + m] for k, _ in intervals]) for m in (0, 1))
    before, after = (np.array([values[k + m, row] for k, row in intervals]) for m in (0, 1))
    sizes = [np.abs(after - before)]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        open_ = (middle > low) & (middle < high) & (sizes[-1] > share * whole[rows])
        if not open_.any():
            break
        there = np.diag(curve(middle[open_], rows[open_]))
        left = np.abs(there - before[open_]) >= np.abs(after[open_] - there)
        for ends, values_there, moved in ((high, after, left), (low, before, ~left)):
            k = np.flatnonzero(open_)[moved]
            ends[k], values_there[k] = middle[k], there[moved]
        sizes.append(np.abs(after - before))
    stays = sizes[-1] >= STAYS * sizes[max(0, len(sizes) - 1 - LAST)]
    return [
        Jump(float(low[k]), float(high[k]), float(before[k]), float(after[k]), int(rows[k]))
        for k in np.flatnonzero(stays & (sizes[-1] > share * whole[rows]))
    ]


def where_it_moves(grid: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """The part of a grid in which nearly all of a curve's change lies."""
    walked = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(values)))])
    first, last = np.searchsorted(walked, np.array([0.05, 0.95]) * walked[-1])
    return float(grid[max(first - 1, 0)]), float(grid[last])


def step_of(curve: Curve, low: float, high: float, windows: Sequence[float] = WINDOWS) -> float | None:
    """The size of the steps in which a curve of one row moves, over its range or a part of it; None where it does not."""
    for share in windows:
        begin = low + 0.37 * (1 - share) * (high - low)
        points = np.linspace(begin, begin + share * (high - low), FINE)
        values = curve(points, np.arange(1))[:, 0]
        change = np.abs(np.diff(values))
        moved = np.flatnonzero(change > STILL * np.abs(values).max())
        if not FEWEST <= len(moved) < 0.5 * len(change):
            continue
        some = moved[np.unique(np.linspace(0, len(moved) - 1, POINTS).astype(int))]
        jumps = sum(_stays(curve, points[k], points[k + 1], change[k]) for k in some)
        if jumps > 0.5 * len(some) and jumps >= FEWEST:
            return float(np.median(change[moved]))
    return None


def _stays(curve: Curve, low: float, high: float, change: float) -> bool:
    """Whether a change stays as it is between ever nearer points."""
    before, after = curve(np.array([low, high]), np.arange(1))[:, 0]
    for _ in range(LAST):
        middle = 0.5 * (low + high)
        there = curve(np.array([middle]), np.arange(1))[0, 0]
        if abs(there - before) >= abs(after - there):
            high, after = middle, there
        else:
            low, before = middle, there
    return bool(abs(after - before) >= STAYS * change)
