"""Score tests: how far the residuals lie along given directions, and how far the largest of them would by chance."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from pellet_study.criticism.calibration import EXCESS
from pellet_study.criticism.cell_means import CellMeans

DRAWS = 5_000  # the least p is 1/5001, and one of 0.035 is known to 0.003
SEED = 20260101  # any number will do
# share of a direction that must survive the calibration to be tested: of less, what shows with three standard errors
# changes the readings by a hundred, over which no model is linear
VISIBLE = 0.03
WHOLE_CELLS = 2_000  # cells up to which all draws are one array: 40 MB
KEPT_CELLS = 5_000  # cells up to which they are kept for the next test, in one array or in blocks: 100 MB


def visible(directions: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """(k, n) directions less what the free constants absorb."""
    return directions - (directions @ basis) @ basis.T


@lru_cache(maxsize=8)
def _noise(group: tuple[int, ...], group_dof: tuple[int, ...]) -> np.ndarray:
    """Whitened readings that hide nothing, (DRAWS, n): Gaussian over a scale as uncertain as each group's.

    The same draws for every test, so that an answer does not depend on what ran before.
    """
    rng = np.random.default_rng(SEED)
    noise = rng.standard_normal((DRAWS, len(group)))
    for number, dof in enumerate(group_dof):
        if dof > 0:
            in_group = np.array(group) == number
            noise[:, in_group] /= np.sqrt(rng.chisquare(dof, (DRAWS, 1)) / dof)
    return noise.astype(np.float32)


def _noise_of(group: tuple[int, ...], group_dof: tuple[int, ...]) -> Iterator[np.ndarray]:
    """The same readings whole, or for many cells block by block; the blocks are drawn anew where they are too many to keep."""
    if len(group) <= WHOLE_CELLS:
        return iter([_noise(group, group_dof)])
    return iter(_kept_blocks(group, group_dof)) if len(group) <= KEPT_CELLS else _blocks(group, group_dof)


@lru_cache(maxsize=1)
def _kept_blocks(group: tuple[int, ...], group_dof: tuple[int, ...]) -> tuple[np.ndarray, ...]:
    return tuple(_blocks(group, group_dof))


def _blocks(group: tuple[int, ...], group_dof: tuple[int, ...]) -> Iterator[np.ndarray]:
    """Blocks of such readings, of streams of their own."""
    normal = np.random.default_rng(SEED)
    scales = [np.random.default_rng([SEED, number]) for number in range(len(group_dof))]
    number_of, size = np.array(group), max(1, DRAWS * WHOLE_CELLS // (10 * len(group)))
    for first in range(0, DRAWS, size):
        noise = normal.standard_normal((min(size, DRAWS - first), len(group)), dtype=np.float32)
        for number, (dof, scale) in enumerate(zip(group_dof, scales, strict=True)):
            if dof > 0:
                noise[:, number_of == number] /= np.sqrt(scale.chisquare(dof, (len(noise), 1)) / dof).astype(np.float32)
        yield noise


def standardised(
    left: np.ndarray, unit: np.ndarray, basis: np.ndarray, cells: CellMeans, two_sided: bool, birge: bool = True
) -> np.ndarray:
    """Scores along unit directions, in standard errors, (sets, k).

        score = z / s,  z = u'r,  s^2 = max(sum_g w_g (nu_g + R_g) / (nu_g + d_g - w_g), b^2 / EXCESS),  w_g = |u_g|^2

    How large an error is, each rig's readings g say with nu_g degrees of freedom, and so do the residuals that the
    direction leaves there: R_g their sum of squares, d_g their number less what the calibration absorbs. Where the
    residuals of all rigs together exceed the replicates' scatter by more than chance makes likely, their Birge ratio
    b^2 = (|r|^2 - z^2)/(d - 1), z the largest, takes its place (Birge 1932, doi:10.1103/PhysRev.40.207). Without
    `birge` the replicates alone are the measure; where no scatter is stated, the residuals alone.

    Parameters
    ----------
    left : (sets, n) whitened residuals, free of what the calibration absorbs
    unit : (k, n) unit vectors, free of it too
    basis : (n, rank), what it absorbs
    """
    z = left @ unit.T
    largest = np.abs(z).max(axis=1) if two_sided else np.maximum(z.max(axis=1), 0)
    dof = unit.shape[1] - basis.shape[1]
    squares = left**2
    excess = (squares.sum(axis=1) - largest**2).clip(0) / max(dof - 1, 1)
    if not cells.scale_known:
        return z / np.sqrt(np.maximum(excess, 1e-24))[:, None]
    if not birge:
        return z
    group, known = groups_of(cells)
    inside = (group[:, None] == np.arange(len(known))).astype(unit.dtype)
    nu, share = np.array(known, dtype=unit.dtype), unit**2 @ inside  # share: (k, groups)
    part = share / (nu + (1 - (basis**2).sum(axis=1)) @ inside - share)
    variance = part @ nu + squares @ inside @ part.T - 2 * z * (left @ (unit * (part @ inside.T)).T)
    variance += z**2 * (part * share).sum(axis=1)
    if dof > 1:
        variance = np.maximum(variance, excess[:, None] / EXCESS)
    return z / np.sqrt(variance)


def groups_of(cells: CellMeans) -> tuple[np.ndarray, tuple[int, ...]]:
    """Number of each cell's group, and each group's degrees of freedom."""
    return np.array(cells.group or (0,) * len(cells.case)), cells.group_dof or (int(cells.dof),)


def largest_null(
    unit: np.ndarray, basis: np.ndarray, cells: CellMeans, two_sided: bool, birge: bool = True
) -> np.ndarray:
    """Sorted draws of the largest standardised score over readings that hide nothing."""
    group, known = groups_of(cells)
    unit = unit.astype(np.float32)
    if birge or not cells.scale_known:
        basis = basis.astype(np.float32)
    largest = []
    for noise in _noise_of(tuple(group.tolist()), known):
        if birge or not cells.scale_known:
            noise = noise - (noise @ basis) @ basis.T
        z = standardised(noise, unit, basis, cells, two_sided, birge)
        largest.append((np.abs(z) if two_sided else z).max(axis=1))
    return np.sort(np.concatenate(largest))


def exceedance(null: np.ndarray, value: float) -> float:
    """Share of sorted null draws at or above a value, never quite zero."""
    return float((len(null) - np.searchsorted(null, value, side="left") + 1) / (len(null) + 1))
