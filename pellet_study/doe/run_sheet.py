"""A design as a sheet to run: random order from a seed, standard order, blocks, units; as CSV or a workbook."""

import errno
import io
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.doe.blocking import inflation
from pellet_study.doe.columns import STANDARD_ORDER
from pellet_study.doe.confounding import confounded_with
from pellet_study.doe.factors import Factor, physical_design
from pellet_study.errors import InputError
from pellet_study.files import writing

RUN, BLOCK = "run", "block"
BOOKKEEPING = (RUN, STANDARD_ORDER, BLOCK)
"""Columns of a sheet that are no factors."""

WORKBOOK = ".xlsx"


@dataclass(frozen=True)
class RunSheet:
    """A design in the order of its runs.

    Attributes
    ----------
    frame : DataFrame (n_runs, ...)
        `run` (1, 2, ...), `standard_order`, `block` where there are several, the factors in physical units, the
        responses, empty where they are to be measured.
    factors : list of Factor
    coded : ndarray (n_runs, n_factors)
        In the order of the runs.
    seed : int
        Of the random order.
    n_blocks : int
    worst_inflation : float
        Of the standard errors by the blocks: 1 where they are orthogonal, inf where a term is lost in them.
    confounded : dict
        {effect: share of it that lies between the blocks} of a two-level design, see `confounding.block_confounding`.
    """

    frame: pd.DataFrame
    factors: list[Factor]
    coded: np.ndarray
    seed: int
    n_blocks: int = 1
    worst_inflation: float = 1.0
    confounded: dict[str, float] = field(default_factory=dict)

    @property
    def orthogonal_blocks(self) -> bool:
        return self.worst_inflation < 1 + 1e-6

    @property
    def design(self) -> pd.DataFrame:
        """The factors alone, by name, in the order of the runs."""
        columns = [factor.label for factor in self.factors]
        return self.frame[columns].rename(columns={factor.label: factor.name for factor in self.factors})


def new_seed() -> int:
    """A seed that nobody chose."""
    return int(np.random.SeedSequence().generate_state(1)[0] % 1_000_000)


def run_sheet(
    coded: np.ndarray,
    factors: list[Factor],
    blocks: np.ndarray | None = None,
    seed: int | None = None,
    responses: tuple[str, ...] = ("response",),
    model_matrix: np.ndarray | None = None,
) -> RunSheet:
    """A design with its runs in random order, within the blocks, which stay in their order.

    Parameters
    ----------
    coded : ndarray (n_runs, n_factors)
        In standard order.
    factors : list of Factor
    blocks : ndarray (n_runs,), optional
        The block of each run from 1.
    seed : int, optional
        0 or more, for the same order again; default: a new one each time.
    responses : tuple of str
        Names of the columns to fill in.
    model_matrix : ndarray (n_runs, n_terms), optional
        Of the model to be fitted, for what the blocks cost.

    Raises
    ------
    InputError
        If the seed is negative, or a factor or response has a name of the sheet's own columns, or two are alike.
    """
    if seed is not None and seed < 0:
        raise InputError(f"the seed {seed} was given: expected a whole number, 0 or more")
    labels = [factor.label for factor in factors]
    for name in [*(factor.name for factor in factors), *responses]:
        if name.lower() in BOOKKEEPING or [*labels, *responses].count(name) > 1:
            raise InputError(
                f"a column would be named {name!r}, as another of the sheet is: expected names other than "
                f"{', '.join(BOOKKEEPING)}, each once; rename it"
            )
    used = new_seed() if seed is None else seed
    blocks = np.ones(len(coded), dtype=int) if blocks is None else np.asarray(blocks)
    order = np.random.default_rng(used).permutation(len(coded))
    order = order[np.argsort(blocks[order], kind="stable")]
    frame = physical_design(coded, factors).iloc[order].reset_index(drop=True)
    frame.columns = labels
    frame.insert(0, RUN, np.arange(1, len(frame) + 1))
    frame.insert(1, STANDARD_ORDER, order + 1)
    n_blocks = len(np.unique(blocks))
    if n_blocks > 1:
        frame.insert(2, BLOCK, blocks[order])
    for name in responses:
        frame[name] = ""
    worst = float(inflation(model_matrix, blocks).max()) if n_blocks > 1 and model_matrix is not None else 1.0
    mixed = confounded_with([factor.name for factor in factors], coded, blocks)
    return RunSheet(frame, list(factors), np.asarray(coded)[order], used, n_blocks, worst, mixed)


def write_sheet(frame: pd.DataFrame, path: Path) -> None:
    """Write a sheet, as a workbook where the name ends in .xlsx, else as CSV.

    Raises
    ------
    InputError
        If openpyxl, which writes workbooks, is not installed, or there is another table already.
    OSError
        If the place cannot be written to.
    """
    if not path.absolute().parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path.parent))
    if path.suffix.lower() != WORKBOOK:
        writing.table(path, frame, ours=writing.nothing)
        return
    try:
        from openpyxl import Workbook
        from openpyxl.styles import Font
    except ImportError:
        raise InputError(
            f"{path}: writing a workbook needs openpyxl: pip install 'pellet-study[xlsx]', or give a name in .csv"
        ) from None
    book = Workbook()
    sheet = book.active
    sheet.title = "runs"
    sheet.append(list(frame.columns))
    for row in frame.itertuples(index=False):
        sheet.append([None if value == "" or value is None else _cell(value) for value in row])
    for cell in sheet[1]:
        cell.font = Font(bold=True)
        sheet.column_dimensions[cell.column_letter].width = max(10, len(str(cell.value)) + 2)
    sheet.freeze_panes = "A2"
    content = io.BytesIO()
    book.save(content)
    writing.data(path, content.getvalue(), ours=writing.nothing)


def _cell(value):
    """A value of the kinds a workbook holds."""
    return value.item() if isinstance(value, np.generic) else value
