"""Blocks: groups of runs (days, batches, operators) that may differ in level, fitted beside the factors."""

from dataclasses import dataclass

import numpy as np

from pellet_study.errors import InputError


@dataclass(frozen=True)
class Block:
    """A grouping of the runs.

    Parameters
    ----------
    name : str
        Of the column.
    labels : tuple of str (n_runs,)
        The block of each run.
    """

    name: str
    labels: tuple[str, ...]

    @property
    def levels(self) -> list[str]:
        """The blocks in the order of the table."""
        return list(dict.fromkeys(self.labels))

    def columns(self) -> dict[str, np.ndarray]:
        """{`Block 1`: contrast (n_runs,)}: 1 in that block, -1 in the last, so that all coefficients add up to 0.

        The intercept is then that of the mean of the blocks, each counted once.
        """
        *first, last = self.levels
        labels = np.array(self.labels, dtype=object)
        return {f"{self.name} {level}": (labels == level) * 1.0 - (labels == last) for level in first}


def checked(block: Block, source: str) -> Block:
    """The block, or an error where it cannot be one.

    Raises
    ------
    InputError
        If all runs are in one block, or each is in its own.
    """
    size, runs = len(block.levels), len(block.labels)
    if size < 2 or (size == runs and runs > 2):
        what = "one block holds all runs" if size < 2 else "every run is a block of its own"
        raise InputError(
            f"column {block.name!r} of {source} is no block: {what}; expected some runs in each of two blocks or more. "
            f"Leave it out with --ignore"
        )
    return block


def columns_of_blocks(blocks) -> dict[str, np.ndarray]:
    """The contrasts of all blocks."""
    return {name: column for block in blocks for name, column in block.columns().items()}


def block_labels(blocks, chosen) -> list[str]:
    """The block of each of the runs chosen (n_runs,), by all groupings together; none without blocks."""
    if not blocks:
        return []
    together = [" ".join(words) for words in zip(*(block.labels for block in blocks), strict=True)]
    return [label for label, is_in in zip(together, chosen, strict=True) if is_in]


def sum_of_squares(blocks, response) -> tuple[float, int]:
    r"""Sum of squares of the blocks, fitted before the factors, and its degrees of freedom.

    For one grouping :math:`\sum_b n_b (\bar y_b - \bar y)^2`.
    """
    response = np.asarray(response, dtype=float)
    columns = list(columns_of_blocks(blocks).values())
    if not columns:
        return 0.0, 0
    matrix = np.column_stack([np.ones(len(response)), *columns])
    centred = response - response.mean()
    fitted = matrix @ np.linalg.lstsq(matrix, centred, rcond=None)[0]
    return float(np.sum(fitted**2)), int(np.linalg.matrix_rank(matrix)) - 1


def offsets(blocks, coefficients: dict[str, float]) -> dict[str, dict[str, float]]:
    """{column: {block: its level above the mean of the blocks}}, response unit."""
    found = {}
    for block in blocks:
        *first, last = block.levels
        values = {level: float(coefficients[f"{block.name} {level}"]) for level in first}
        found[block.name] = {**values, last: -sum(values.values())}
    return found
