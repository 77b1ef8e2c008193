"""The runs of a table beside the design that their column `standard_order` says they belong to.

A run sheet made here numbers the runs of its design. With the number of factors and of runs that tells every level again,
so that a level typed wrong, runs exchanged, and columns that stand under another's header are found.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pellet_study.doe.composite import axial_points, composite_matrix
from pellet_study.doe.design_table import DesignTable
from pellet_study.doe.published_designs import TOGETHER, box_behnken_matrix
from pellet_study.doe.screening_designs import GENERATORS, coded_matrix
from pellet_study.errors import InputError

SAME_LEVEL = 0.1
"""How far, in coded units, a level may lie from the planned one and still be it."""
MOST_CELLS = 0.2
"""Share of the cells that may differ where the table is still taken for a run of the design."""
STRAY_CELLS = 2
"""Cells that may differ besides where whole columns are exchanged."""


@dataclass(frozen=True)
class Departures:
    """Where a table differs from its design.

    Attributes
    ----------
    cells : list of (int, int, float)
        Place of the run, place of the factor, coded level planned.
    columns : list of (int, int)
        (place of a factor, place of the factor whose levels stand under its name); empty where each has its own.
    """

    cells: list[tuple[int, int, float]]
    columns: list[tuple[int, int]]


def departures(table: DesignTable) -> Departures | None:
    """Where the runs differ from the design that they are numbered by; None where no design is that near, or none is numbered."""
    if table.standard_order is None:
        return None
    places = table.standard_order.to_numpy(dtype=int) - 1
    coded = table.coded.to_numpy(dtype=float)
    words = np.array([bool(factor.levels) for factor in table.factors])
    found = [_compared(coded, plan[places], words) for plan in _plans(coded, places)]
    known = [each for each in found if each is not None]
    return min(known, key=lambda each: (len(each.columns), len(each.cells)), default=None)


def _plans(coded: np.ndarray, places: np.ndarray) -> Iterator[np.ndarray]:
    """Every design of so many factors that can be made here with so many runs, those beyond the others at the centre.

    A screening may have had more factors, of which the table has some: its columns that the runs follow best.
    """
    n_factors, n_runs, distance = coded.shape[1], int(places.max()) + 1, float(np.abs(coded).max())
    for size in GENERATORS:
        for corners in _screenings(coded, places, size):
            yield np.vstack([corners, np.zeros((max(0, n_runs - size), n_factors))])
            yield from _with_axial_points(corners, n_runs, distance)
    if n_factors in TOGETHER:
        edges = len(box_behnken_matrix(n_factors, 1)) - 1
        yield box_behnken_matrix(n_factors, max(1, n_runs - edges))
    for n_blocks in (1, 2, 3, 5):
        for fraction in (False, True):
            try:
                smallest = composite_matrix(n_factors, "face", n_blocks, fraction, n_blocks)[0]
                centre = n_blocks + max(0, n_runs - len(smallest))
                yield composite_matrix(n_factors, distance, centre, fraction, n_blocks)[0]
            except InputError:  # there is none of so many factors in so many blocks
                continue


def _screenings(coded: np.ndarray, places: np.ndarray, size: int) -> Iterator[np.ndarray]:
    """The corners of the screening of so many runs in the table's factors, and in those of its columns that these follow."""
    from scipy.optimize import linear_sum_assignment

    n_factors = coded.shape[1]
    if n_factors >= size:
        return
    yield coded_matrix(n_factors, size)
    every, corner = coded_matrix(size - 1, size), places < size
    there = every[places[corner]]
    off = np.abs(coded[corner][None, :, :, None] - np.stack([there, -there])[:, :, None, :]) > SAME_LEVEL
    columns = linear_sum_assignment(off.sum(axis=1).min(axis=0))[1]
    if np.all(np.diff(columns) > 0):
        yield every[:, columns]


def _with_axial_points(corners: np.ndarray, n_runs: int, distance: float) -> Iterator[np.ndarray]:
    """A screening to which axial points were added, whatever the number of its centre points and of those beside them."""
    axial = axial_points(corners.shape[1], distance)
    for centre in range(n_runs - len(corners) - len(axial) + 1):
        rows = np.vstack([corners, np.zeros((centre, corners.shape[1])), axial])
        yield np.vstack([rows, np.zeros((n_runs - len(rows), corners.shape[1]))])


def _compared(coded: np.ndarray, plan: np.ndarray, words: np.ndarray) -> Departures | None:
    """The departures from one plan, whichever end of a factor is called -1; None where too many cells differ."""
    from scipy.optimize import linear_sum_assignment

    mirrored = np.stack([plan, -plan])  # (2, n_runs, n_factors)
    differs = np.abs(coded[None, :, :, None] - mirrored[:, :, None, :]) > SAME_LEVEL
    spread = ~np.any(plan, axis=1, keepdims=True) & words
    differs[:, spread] = False  # words have no middle: at the centre they are spread
    counts = differs.sum(axis=1)
    sign, least = counts.argmin(axis=0), counts.min(axis=0)  # (factor, planned factor)
    own = np.arange(coded.shape[1])
    under = linear_sum_assignment(least)[1]
    as_headed, exchanged = least[own, own].sum(), least[own, under].sum()
    if exchanged <= STRAY_CELLS and as_headed - exchanged > len(coded) / 4:
        own = under
    elif as_headed > MOST_CELLS * coded.size:
        return None
    cells = [
        (int(run), factor, float(mirrored[sign[factor, planned], run, planned]))
        for factor, planned in enumerate(own)
        for run in np.flatnonzero(differs[sign[factor, planned], :, factor, planned])
    ]
    return Departures(cells, [(factor, int(planned)) for factor, planned in enumerate(own) if factor != planned])
