"""A design split into blocks: orthogonal where it can be, else with as little loss as was found, and how much that is.

References
----------
Box, Hunter, Ann. Math. Statist. 28 (1957) 195, doi:10.1214/aoms/1177707047: conditions of orthogonal blocking.
Cook, Nachtsheim, Computer-aided blocking of factorial and response-surface designs, Technometrics 31 (1989) 339,
doi:10.1080/00401706.1989.10488553: exchange of runs between blocks.
"""

from itertools import combinations

import numpy as np

from pellet_study.doe.confounding import shares_between
from pellet_study.doe.published_designs import box_behnken_blocks
from pellet_study.doe.screening_designs import coded_matrix
from pellet_study.doe.terms import columns_of, product_terms
from pellet_study.errors import InputError

HIGHEST_ORDER = 5
"""Interactions of up to so many factors make blocks, and are looked at to choose between ways to make them."""

MANY_FACTORS = 9
"""From so many factors on those of three are the highest that are looked at: there are thousands of the others."""

STARTS = 10
"""Random blocks that the exchange starts from."""

SECOND = 0.03
"""Weight of columns of second rank in the exchange: together they count less than one column of the first."""


def inflation(model_matrix: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Standard error of each column's coefficient with the blocks fitted, over that without them; inf where lost.

    Parameters
    ----------
    model_matrix : ndarray (n_runs, n_terms)
        With the intercept as its first column; the answer is for the other columns.
    blocks : ndarray (n_runs,)
        Labels.
    """
    columns = model_matrix[:, 1:]
    free = columns - columns.mean(axis=0)
    within = columns - _means(columns, blocks)
    before, after = free.T @ free, within.T @ within
    if np.linalg.matrix_rank(after) < len(after):
        return np.full(len(after), np.inf)
    return np.sqrt(np.diag(np.linalg.inv(after)) / np.diag(np.linalg.inv(before)))


def _means(columns: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """The mean of each column over the block of each run."""
    found = np.empty_like(columns)
    for block in np.unique(blocks):
        found[blocks == block] = columns[blocks == block].mean(axis=0)
    return found


def _check(n_blocks: int, n_runs: int) -> None:
    if not 1 <= n_blocks <= n_runs // 2:
        raise InputError(
            f"{n_blocks} blocks of {n_runs} runs were asked for: expected 1 to {n_runs // 2}, two runs or more in each"
        )


def screening_blocks(coded: np.ndarray, n_blocks: int) -> np.ndarray:
    """Blocks of a two-level design (n_runs, n_factors) with its centre points: the block of each run from 1.

    2 and 4 blocks are made by columns of signs that no main effect is mixed with: columns of the Plackett-Burman
    matrix that no factor uses, or products of factors, those that are mixed least with interactions of two factors, then of
    three, ... Where there are none, runs are exchanged, so that the main effects lose least, and then the interactions.

    Raises
    ------
    InputError
        If there are fewer than two runs for a block.
    """
    _check(n_blocks, len(coded))
    centre = ~coded.any(axis=1)
    corners = coded[~centre]
    full = np.column_stack([np.ones(len(corners)), corners])
    found = _by_signs(full, n_blocks)
    if found is None:
        products = (
            columns_of(corners, product_terms(list(map(str, range(corners.shape[1]))), 2))
            if corners.shape[1] > 1
            else None
        )
        found = exchanged(full, n_blocks, second=products)
    blocks = np.zeros(len(coded), dtype=int)
    blocks[~centre] = found
    blocks[centre] = 1 + np.arange(int(centre.sum())) % n_blocks
    return blocks


def _by_signs(full: np.ndarray, n_blocks: int) -> np.ndarray | None:
    """Blocks by one or two columns of signs, orthogonal to the columns of the model and so are their products.

    Of several ways the one whose blocks are mixed least with interactions, those of lowest order first.
    """
    if n_blocks == 1:
        return np.ones(len(full), dtype=int)
    if n_blocks not in (2, 4):
        return None
    free = _free_columns(full)
    ways: list[tuple[np.ndarray, ...]]
    if n_blocks == 2:
        ways = [(column,) for column in free]
    else:
        ways = [
            (first, second, first * second)
            for first, second in combinations(free, 2)
            if abs(first @ second) < 0.5 and np.abs(full.T @ (first * second)).max() < 0.5
        ]
    if not ways:
        return None
    best = min(ways, key=lambda columns: _mixed_with(full[:, 1:], np.column_stack(columns)))
    return 1 + (best[0] > 0).astype(int) + (2 * (best[1] > 0) if n_blocks == 4 else 0)


def _orders(n_factors: int) -> range:
    """How many factors the interactions have that are looked at."""
    return range(2, min(n_factors, HIGHEST_ORDER if n_factors < MANY_FACTORS else 3) + 1)


def _free_columns(full: np.ndarray) -> list[np.ndarray]:
    """Columns of signs orthogonal to the model's: unused ones and products of factors, each once whatever its sign."""
    n_factors = full.shape[1] - 1
    products = [
        full[:, list(word)].prod(axis=1)
        for size in _orders(n_factors)
        for word in combinations(range(1, n_factors + 1), size)
    ]
    found: dict[bytes, np.ndarray] = {}
    for column in [*products, *_unused(full)]:
        if np.abs(full.T @ column).max() < 0.5:
            found.setdefault((column * column[0]).tobytes(), column)
    return list(found.values())


def _mixed_with(signs: np.ndarray, between: np.ndarray) -> tuple[float, ...]:
    """How much of the interactions of two factors, of three, ... lies between the blocks: fewer of lower order are better."""
    n_factors = signs.shape[1]
    return tuple(
        round(float(shares_between(signs, list(combinations(range(n_factors), size)), between).sum()), 6)
        for size in _orders(n_factors)
    )


def _unused(full: np.ndarray) -> list[np.ndarray]:
    """Columns of the Plackett-Burman matrix that no factor uses, where the runs are its runs in their order."""
    n_runs, size = full.shape
    if n_runs not in (8, 12, 16, 20, 24):
        return []
    whole = coded_matrix(n_runs - 1, n_runs)
    return list(whole[:, size - 1 :].T) if np.array_equal(whole[:, : size - 1], full[:, 1:]) else []


def surface_blocks(coded: np.ndarray, model_matrix: np.ndarray, n_blocks: int) -> np.ndarray:
    """Blocks of a Box-Behnken design: as published, or by exchange where none were.

    Parameters
    ----------
    coded : ndarray (n_runs, n_factors)
    model_matrix : ndarray (n_runs, n_terms)
        Of the quadratic model.
    """
    _check(n_blocks, len(coded))
    if n_blocks == 1:
        return np.ones(len(coded), dtype=int)
    found = box_behnken_blocks(coded, n_blocks)
    return exchanged(model_matrix, n_blocks) if found is None else found


def exchanged(model_matrix: np.ndarray, n_blocks: int, seed: int = 0, second: np.ndarray | None = None) -> np.ndarray:
    """Blocks of equal size (one run more in the first) by exchange of runs, from random starts.

    Pairs of runs change places while that lowers :math:`\\sum_{ij} m_{ij}^2`, m the centred columns summed over block
    i: it is 0 where the blocks are orthogonal. Columns of `second` (n_runs, n) decide between blocks that are alike in these.
    """
    columns = _of_length_one(model_matrix[:, 1:])
    if second is not None:
        columns = np.column_stack([columns, SECOND * _of_length_one(second)])
    rng = np.random.default_rng(seed)
    best, least = np.arange(len(columns)) % n_blocks, np.inf
    for _ in range(STARTS):
        blocks = rng.permutation(np.arange(len(columns)) % n_blocks)
        loss = _exchange(columns, blocks, n_blocks)
        if loss < least - 1e-12:
            best, least = blocks, loss
        if least < 1e-12:
            break
    return best + 1


def _of_length_one(columns: np.ndarray) -> np.ndarray:
    """The columns, centred, each of length 1."""
    centred = columns - columns.mean(axis=0)
    return centred / np.maximum(np.linalg.norm(centred, axis=0), 1e-300)


def _exchange(columns: np.ndarray, blocks: np.ndarray, n_blocks: int) -> float:
    """Change pairs in place until none helps; returns what is left."""
    sums = np.array([columns[blocks == block].sum(axis=0) for block in range(n_blocks)])
    better = True
    while better:
        better = False
        for first in range(len(columns)):
            others = np.flatnonzero(blocks != blocks[first])
            move = columns[others] - columns[first]  # what the block of `first` gains, and that of the other loses
            gain = 2 * np.einsum("ij,ij->i", move, sums[blocks[first]] - sums[blocks[others]]) + 2 * np.einsum(
                "ij,ij->i", move, move
            )
            place = int(np.argmin(gain))
            if gain[place] < -1e-10:
                second = others[place]
                sums[blocks[first]] += move[place]
                sums[blocks[second]] -= move[place]
                blocks[first], blocks[second] = blocks[second], blocks[first]
                better = True
    return float(np.sum(sums**2))
