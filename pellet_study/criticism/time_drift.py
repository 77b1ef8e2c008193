"""Does an instrument drift with time? The order in which readings were taken, against their residuals.

A drift that the readings of a rig's observable have in common shifts each by b s, s the standardised order of the
readings (a score test, as in `constancy`). The cell means tell it as far as no calibrated constant imitates it, and the
readings of one cell, taken one after the other, whatever the model is:

    t = (d'r + a'e)/(s sqrt(|d|^2 + |a|^2))

d the shift of the cell means and r their residuals, whitened, d freed of what the calibration absorbs; a and e the order
and the readings about their cell means, in standard errors; s what the drift leaves of these.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import stats

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.criticism.cell_means import cells_of
from pellet_study.criticism.lack_of_fit import absorbed_basis
from pellet_study.criticism.score_tests import visible
from pellet_study.criticism.used_sd import reading_sd
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Study

LEAST = 4  # readings with an order, from which on a drift is looked for
ALONG = 0.8  # rank correlation of the order with a condition, from which a drift looks like the condition's effect


@dataclass(frozen=True)
class TimeDrift:
    """How the readings of a rig's observable go with their order.

    `change` is from the first reading to the last, in the observable's unit, with its standard error; `z` is t, p over all rigs
    together; `along` are the conditions that were changed in the order of the readings, so that nothing tells the two apart.
    """

    rig: str
    observable: str
    change: float
    error: float
    z: float
    p: float
    along: tuple[str, ...]


def time_drifts(state: CalibratedStudy) -> tuple[TimeDrift, ...]:
    """The drift of every observable whose readings have an order, the worst first; empty where none has."""
    cells = cells_of([row for row in state.study.rows if row.split == "fit"])
    found = []
    for rig, observable in observables_with_order(cells):
        shift, span = shifts(cells, rig, observable)
        one = _drift(state, cells, shift)
        if one is not None:
            z, dof, per_spread, error = one
            p = 2 * float(stats.t.sf(abs(z), dof))
            rows = [row for cell in cells for row in cell if id(row) in shift]
            found.append(TimeDrift(rig, observable, per_spread * span, error * span, z, p, along(rows)))
    told = [replace(one, p=min(1.0, len(found) * one.p)) for one in found]
    return tuple(sorted(told, key=lambda one: one.p))


def observables_with_order(cells: Sequence[Sequence[Measurement]]) -> list[tuple[str, str]]:
    """Rigs and observables with enough readings of different orders to see a drift."""
    names = dict.fromkeys((cell[0].rig, cell[0].observable) for cell in cells)
    return [name for name in names if len(set(orders(cells, *name).values())) >= LEAST]


def orders(cells: Sequence[Sequence[Measurement]], rig: str, observable: str) -> dict[int, float]:
    """{id of a row: its order} of the rows of an observable that have one."""
    rows = (row for cell in cells for row in cell if (row.rig, row.observable) == (rig, observable))
    return {id(row): row.order for row in rows if row.order is not None}


def shifts(cells: Sequence[Sequence[Measurement]], rig: str, observable: str) -> tuple[dict[int, float], float]:
    """{id of a row: its standardised order}, and the span of these."""
    order = orders(cells, rig, observable)
    steps = np.array(list(order.values()))
    mean, spread = float(steps.mean()), float(steps.std())
    return {row: (value - mean) / spread for row, value in order.items()}, float(np.ptp(steps)) / spread


def direction_of(state: CalibratedStudy, drift: TimeDrift) -> np.ndarray:
    """The whitened shift of the cell means by a drift."""
    cells = cells_of([row for row in state.study.rows if row.split == "fit"])
    return state.cells.whitened(_of_cells(cells, shifts(cells, drift.rig, drift.observable)[0]))


def _of_cells(cells: Sequence[Sequence[Measurement]], shift: Mapping[int, float]) -> np.ndarray:
    """Mean shift of each cell; rows without an order are not shifted."""
    return np.array([sum(r.n * shift.get(id(r), 0.0) for r in cell) / sum(r.n for r in cell) for cell in cells])


def _drift(
    state: CalibratedStudy, cells: Sequence[Sequence[Measurement]], shift: Mapping[int, float]
) -> tuple[float, float, float, float] | None:
    """t of a drift, its degrees of freedom, its size per unit of shift, the standard error of that; None where nothing tells.

    The scatter that the drift itself leaves is the measure: replicates that drift scatter too much. Where the sd is stated it
    is no less than that.
    """
    basis, residual = absorbed_basis(state.fit.jacobian), state.fit.residual
    seen = visible(state.cells.whitened(_of_cells(cells, shift))[None], basis)[0]
    mine = np.array([any(id(row) in shift for row in cell) for cell in cells])
    along_it, square = float(seen @ residual), float(seen @ seen)
    squares = float(np.square(residual[mine]).sum())
    spare = float((1 - np.square(basis).sum(axis=1))[mine].sum()) - 1
    within = _within(cells, shift, dict(zip(map(id, state.study.rows), reading_sd(state.study.rows), strict=True)))
    scale = _scale(state, within, shift)
    along_it += within.along / scale**2
    square += within.square / scale**2
    squares += within.squares / scale**2
    spare += within.spare
    if square < 1e-12:
        return None
    stated = all(row.sd is not None for cell in cells for row in cell if id(row) in shift)
    left = (max(squares - along_it**2 / square, 1e-12) / spare) ** 0.5 if spare > 0.5 else None
    if left is not None and (left > 1 or not stated):
        unit, dof = left, spare
    elif stated:
        unit, dof = 1.0, float("inf")
    else:
        return None
    return along_it / square**0.5 / unit, dof, along_it / square, unit / square**0.5


class _Within(NamedTuple):
    """Sums over the readings about their cell means, in their own sd: order by reading, order and reading squared, freedom."""

    along: float
    square: float
    squares: float
    spare: int


def _within(
    cells: Sequence[Sequence[Measurement]], shift: Mapping[int, float], spreads: Mapping[int, float | None]
) -> _Within:
    """What the readings of one cell, taken one after the other, tell of a drift."""
    found = _Within(0.0, 0.0, 0.0, 0)
    for cell in cells:
        own = [row for row in cell if id(row) in shift]
        if len(own) < 2:
            continue
        weight = np.array([row.n / (spreads[id(row)] or 1.0) ** 2 for row in own])
        value, place = np.array([row.value for row in own]), np.array([shift[id(row)] for row in own])
        value, place = value - weight @ value / weight.sum(), place - weight @ place / weight.sum()
        sums = (weight @ (place * value), weight @ place**2, weight @ value**2, len(own) - 1)
        found = _Within(*(a + b for a, b in zip(found, sums, strict=True)))
    return found


def _scale(state: CalibratedStudy, within: _Within, shift: Mapping[int, float]) -> float:
    """How many times its sd a reading scatters about its cell mean, where replicates contradict the stated one; else 1.

    As the drift leaves them scattered; where they are so few that any drift takes all of their scatter, all of it.
    """
    rows = [row for row in state.study.rows if id(row) in shift and row.sd is not None]
    times = max((state.cells.contradicted.get((row.rig, row.observable), 1.0) for row in rows), default=1.0)
    if times <= 1 or within.square <= 0:
        return 1.0
    if within.spare < 2:
        return float(times)
    left = max(within.squares - within.along**2 / within.square, 0.0) / (within.spare - 1)
    return float(max(1.0, left**0.5))


def along(rows: Sequence[Measurement]) -> tuple[str, ...]:
    """Conditions that were changed in the order of the readings: those whose rank correlation with it is large."""
    ordered = [row for row in rows if row.order is not None]
    return tuple(name for name, rho in correlations(ordered).items() if abs(rho) >= ALONG)


def correlations(ordered: Sequence[Measurement]) -> dict[str, float]:
    """Rank correlation of the order of readings with each condition that varies and is no word."""
    found = {}
    for condition in ordered[0].conditions if len(ordered) >= LEAST else ():
        values = [row.conditions[condition] for row in ordered]
        if len(set(values)) > 1 and not any(isinstance(value, str) for value in values):
            found[condition] = float(stats.spearmanr([row.order for row in ordered], values).statistic)
    return found


def unordered(study: Study) -> bool:
    """Whether no row says when it was taken."""
    return all(row.order is None for row in study.rows)
