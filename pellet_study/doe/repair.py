"""A design with lost runs: which of them to repeat first, by the information that they bring back.

References
----------
Wynn, Results in the theory and construction of D-optimum experimental designs, J. Roy. Statist. Soc. B 34 (1972) 133,
doi:10.1111/j.2517-6161.1972.tb00896.x. Atkinson, Donev, Tobias, Optimum Experimental Designs, with SAS, Oxford 2007.
"""

from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np

from pellet_study.doe.augment import confounded
from pellet_study.errors import InputError

EXHAUSTIVE = 20_000
"""Choices of runs that are all tried; beyond, runs are added one at a time and then exchanged."""

RIDGE = 1e-8
"""Added to X'X so that the first runs can be chosen where no model can be fitted yet."""


@dataclass(frozen=True)
class Repair:
    """Runs to repeat.

    Attributes
    ----------
    repeated : list of int
        Indices of the lost runs to make again, the most valuable first.
    lost : list of int
    confounded_now : list of str
        Terms that the runs at hand do not separate.
    confounded_after : list of str
        The same with the repeated runs.
    efficiency : list of float
        D-efficiency relative to the complete design, in percent: now, and after each of `repeated`, in their order;
        :math:`100 (|X'X| / |X_c'X_c|)^{1/p}`, runs not divided by.
    needed : int
        Fewest repeats after which all terms are separated.
    worst_inflation : list of float
        Largest standard error of a term relative to the complete design, at the same steps; inf where one is lost.
    """

    repeated: list[int]
    lost: list[int]
    confounded_now: list[str]
    confounded_after: list[str]
    efficiency: list[float]
    needed: int
    worst_inflation: list[float]


def repair(matrix: np.ndarray, lost: list[int], names: list[str], repeats: int | None = None) -> Repair:
    """Which lost runs to repeat so that the determinant of X'X is largest (D-optimal).

    Parameters
    ----------
    matrix : ndarray (n_runs, n_terms)
        Model matrix of the complete design.
    lost : list of int
        Rows without a response.
    names : list of str
        Of the terms.
    repeats : int, optional
        How many; default: as few as separate all terms, at least one.

    Raises
    ------
    InputError
        If nothing is lost, more are asked for than are lost, or the complete design itself does not separate the
        terms.
    """
    if not lost:
        raise InputError("no run is lost: every row has a response; analyse the table")
    mixed = confounded(matrix, names)
    if mixed:
        raise InputError(
            f"the complete design does not separate the terms {', '.join(map(repr, mixed))}: repeating its runs cannot; "
            "take a smaller model (--model main), or add other runs"
        )
    kept = [i for i in range(len(matrix)) if i not in set(lost)]
    needed = matrix.shape[1] - np.linalg.matrix_rank(matrix[kept]) if kept else matrix.shape[1]
    size = max(1, int(needed)) if repeats is None else repeats
    if not 1 <= size <= len(lost):
        raise InputError(f"{size} runs to repeat were asked for and {len(lost)} are lost: expected 1 to {len(lost)}")
    chosen = _ordered(matrix, kept, _best(matrix, kept, lost, size))
    steps = [kept + chosen[:k] for k in range(size + 1)]
    return Repair(
        repeated=chosen,
        lost=list(lost),
        confounded_now=confounded(matrix[kept], names),
        confounded_after=confounded(matrix[kept + chosen], names),
        efficiency=[_efficiency(matrix, rows) for rows in steps],
        needed=int(needed),
        worst_inflation=[_inflation(matrix, rows) for rows in steps],
    )


def _log_determinant(rows: np.ndarray) -> float:
    return float(np.linalg.slogdet(rows.T @ rows + RIDGE * np.eye(rows.shape[1]))[1])


def _best(matrix, kept, lost, size) -> list[int]:
    """The D-optimal choice of so many lost runs."""
    value = lambda chosen: _log_determinant(matrix[kept + list(chosen)])  # noqa: E731
    if comb(len(lost), size) <= EXHAUSTIVE:
        return list(max(combinations(lost, size), key=value))
    chosen = _ordered(matrix, kept, lost)[:size]
    improved = True
    while improved:
        improved = False
        for place, other in ((p, o) for p in range(size) for o in lost):
            trial = [*chosen[:place], other, *chosen[place + 1 :]]
            if other not in chosen and value(trial) > value(chosen) + 1e-9:
                chosen, improved = trial, True
    return chosen


def _ordered(matrix, kept, chosen) -> list[int]:
    """The chosen runs, each time the one first that brings most."""
    left, order = list(chosen), list[int]()
    while left:
        best = max(left, key=lambda i: _log_determinant(matrix[[*kept, *order, i]]))
        order.append(best)
        left.remove(best)
    return order


def _efficiency(matrix: np.ndarray, rows: list[int]) -> float:
    part, size = matrix[rows], matrix.shape[1]
    if np.linalg.matrix_rank(part) < size:
        return 0.0
    difference = np.linalg.slogdet(part.T @ part)[1] - np.linalg.slogdet(matrix.T @ matrix)[1]
    return float(100 * np.exp(difference / size))


def _inflation(matrix: np.ndarray, rows: list[int]) -> float:
    part = matrix[rows]
    if np.linalg.matrix_rank(part) < matrix.shape[1]:
        return float("inf")
    now, complete = (np.diag(np.linalg.inv(m.T @ m)) for m in (part, matrix))
    return float(np.sqrt(now / complete).max())
