"""How far blocks differ in level beyond what single runs differ: what a run in a new block adds to its prediction.

References
----------
Henderson, Estimation of variance and covariance components, Biometrics 9 (1953) 226, doi:10.2307/3001853: method 3.
Satterthwaite, An approximate distribution of estimates of variance components, Biometrics Bulletin 2 (1946) 110,
doi:10.2307/3002019.
"""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe.blocks import columns_of_blocks
from pellet_study.doe.linear_model import LinearFit


@dataclass(frozen=True)
class BlockScatter:
    """The variance component of one grouping of the runs.

    Attributes
    ----------
    name : str
        Of the block's column.
    n_blocks : int
    mean_square, df : float, int
        Of the blocks, adjusted for all that is fitted beside them.
    size : float
        k of E(mean square) = sigma^2 + k sigma_b^2: runs in a block where these are equal and orthogonal.
    variance : float
        sigma_b^2, 0 where the blocks differ no more than single runs explain.
    """

    name: str
    n_blocks: int
    mean_square: float
    df: int
    size: float
    variance: float

    @property
    def share(self) -> float:
        """The times that sigma_b^2 stands in the variance of a run in a new block: that block, and the mean of those run."""
        return 1 + 1 / self.n_blocks


def block_scatter(model: LinearFit) -> list[BlockScatter]:
    """The component of each grouping; none without blocks or without a residual."""
    error = model.mean_square_error
    if error is None:
        return []
    found = []
    for block in model.blocks:
        own = np.column_stack(list(columns_of_blocks([block]).values()))
        mine = set(columns_of_blocks([block]))
        beside = model.matrix[:, [name not in mine for name in model.columns]]
        left = _left(own, beside)
        df = own.shape[1]
        squares = float(np.sum((left @ np.linalg.lstsq(left, model.response, rcond=None)[0]) ** 2))
        levels = np.column_stack([np.array(block.labels, dtype=object) == level for level in block.levels]).astype(
            float
        )
        size = float(np.sum(_left(levels, beside) ** 2)) / df
        mean_square = squares / df
        variance = max(0.0, (mean_square - error) / size)
        found.append(BlockScatter(block.name, len(block.levels), mean_square, df, size, variance))
    return found


def _left(columns: np.ndarray, others: np.ndarray) -> np.ndarray:
    return columns - others @ np.linalg.lstsq(others, columns, rcond=None)[0]


def variance_of_new(model: LinearFit, of_runs: float, scatter: list[BlockScatter]) -> tuple[float, float]:
    r"""Variance of what runs in one new block read less what is predicted, and its degrees of freedom.

    :math:`s^2 c + \sum_g \hat\sigma_g^2 (1 + 1/b_g)`, c the share of the runs and of the fit (`of_runs`), with Satterthwaite's
    degrees of freedom of the mean squares that it is made of.
    """
    error = model.mean_square_error or 0.0
    parts = [one for one in scatter if one.variance > 0]
    total = error * of_runs + sum(one.variance * one.share for one in parts)
    weights = [one.share / one.size for one in parts]
    spread = ((of_runs - sum(weights)) * error) ** 2 / model.df_residual
    spread += sum((weight * one.mean_square) ** 2 / one.df for weight, one in zip(weights, parts, strict=True))
    return total, total**2 / spread if spread else float(model.df_residual)
