"""The table of a design run only in part, or not at all: every run with its levels, responses where there are any."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.doe.columns import STANDARD_ORDER, read_columns
from pellet_study.doe.design_table import _looks_like_a_factor
from pellet_study.doe.factors import Factor, physical_design
from pellet_study.doe.levels import resolve
from pellet_study.doe.run_sheet import BLOCK, RUN
from pellet_study.tables.headers import found_in, split_unit


@dataclass(frozen=True)
class PlannedTable:
    """A design, run or not.

    Attributes
    ----------
    factors : list of Factor
    coded : ndarray (n_runs, n_factors)
    response : Series (n_runs,) or None
        NaN where a run has none; None where the table has no such column.
    blocks : tuple of str or None
        The block of each run.
    lines : list of int
    notes : list of str
    standard_order : list of int
        As the sheet has it, else the order of the rows.
    other_responses : DataFrame (n_runs, n_others)
        Of a table with several; NaN where a run has none.
    ignored : dict
        {column that was ignored: its cells, as text}.
    """

    factors: list[Factor]
    coded: np.ndarray
    response: pd.Series | None
    blocks: tuple[str, ...] | None
    lines: list[int]
    notes: list[str]
    standard_order: list[int]
    other_responses: pd.DataFrame = field(default_factory=pd.DataFrame)
    ignored: dict[str, list[str]] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        return [factor.name for factor in self.factors]

    @property
    def centre(self) -> np.ndarray:
        """Which runs are at the middle of every factor that has one."""
        numeric = [not factor.levels for factor in self.factors]
        return (np.abs(self.coded[:, numeric]) < 0.5).all(axis=1) & any(numeric)

    @property
    def lost(self) -> list[int]:
        """Indices of the runs that lack a response."""
        if self.response is None:
            return []
        return [
            i
            for i in range(len(self.coded))
            if self.response.isna().iloc[i] or self.other_responses.iloc[i].isna().any()
        ]


def read_planned(path: Path, factors=(), ignore=(), blocks=(), responses=()) -> PlannedTable:
    """Read a design; see `design_table.read_design` for the arguments.

    Parameters
    ----------
    responses : sequence of str, optional
        The columns that are responses, where there are several or it is not the last.

    Raises
    ------
    InputError
        As `read_design`.
    """
    categories = {factor.name: factor.levels for factor in factors if factor.levels}
    given_names = [factor.name for factor in factors]

    def read(name: str | None):
        left = [*ignore, *(other for other in responses if other != name)]
        return read_columns(path, left, blocks, given_names, categories, unmeasured=True, response=name)

    found, *further = [read(name) for name in responses or (None,)]
    others = pd.DataFrame({other.frame.columns[-1]: other.frame.iloc[:, -1] for other in further}, found.frame.index)
    frame, notes = found.frame, list(found.notes)
    last = frame.columns[-1]
    response = frame[last]
    complete = not responses and not response.isna().any()
    if complete and (set(response.round(9)) <= {-1.0, 0.0, 1.0} or _looks_like_a_factor(frame)):
        notes.append(f"{last} holds the levels of a factor: taken as one, so there is no response")
        response, columns = None, list(frame.columns)
    else:
        columns = list(frame.columns[:-1])
    given = {}
    for factor in factors:
        name = found_in(factor.name, columns)
        if name is not None:
            unit = "" if split_unit(name)[1] else factor.unit
            given[name] = Factor(name, factor.low, factor.high, unit, factor.levels)
    resolved, coded, more = resolve(frame[columns], given, found.lines, 5, str(path))
    labels = tuple(" ".join(words) for words in zip(*(b.labels for b in found.blocks), strict=True)) or None
    numbered = found.standard_order
    order = list(range(1, len(frame) + 1)) if numbered is None else numbered.tolist()
    ignored = {name: cells for name, cells in found.ignored.items() if name not in responses}
    return PlannedTable(resolved, coded.to_numpy(), response, labels, found.lines, notes + more, order, others, ignored)


def extended(table: PlannedTable, added: np.ndarray, block: str, seed: int, response: str = "response") -> pd.DataFrame:
    """The table with runs added as a block of their own, in random order after those that are there.

    Returns
    -------
    DataFrame
        `run`, `standard_order`, `block`, the factors, the response, empty where it is to be measured.
    """
    order = np.random.default_rng(seed).permutation(len(added))
    old, new = table.blocks or ("1",) * len(table.coded), [block] * len(added)
    coded = np.vstack([table.coded, added[order]])
    n_old, first = len(table.coded), max(table.standard_order, default=0) + 1
    frame = pd.DataFrame({RUN: np.arange(1, len(coded) + 1)})
    frame[STANDARD_ORDER] = [*table.standard_order, *(first + order)]
    frame[BLOCK] = [*old, *new]
    frame = pd.concat([frame, physical_design(coded, table.factors)], axis=1)
    columns = (
        {response: pd.Series([np.nan] * n_old)} if table.response is None else {table.response.name: table.response}
    )
    for name, values in {**columns, **table.other_responses}.items():
        frame[str(name)] = ["" if pd.isna(value) else value for value in values] + [""] * len(added)
    return frame


def runs_to_repeat(table: PlannedTable, chosen: list[int], seed: int) -> pd.DataFrame:
    """The runs with all responses and then those to repeat, in random order; the other lost runs are left out.

    Columns that were ignored stand in it too: the runs to repeat are made at their levels.
    """
    order = [
        *(i for i in range(len(table.coded)) if i not in table.lost),
        *np.random.default_rng(seed).permutation(chosen),
    ]
    whole = extended(table, np.empty((0, len(table.factors))), "", seed)
    for name, cells in reversed(table.ignored.items()):
        if name not in whole:
            whole.insert(whole.columns.get_loc(BLOCK) + 1 + len(table.factors), name, cells)
    frame = whole.iloc[order].reset_index(drop=True)
    frame[RUN] = np.arange(1, len(frame) + 1)
    return frame if table.blocks else frame.drop(columns=BLOCK)


def next_block(table: PlannedTable) -> str:
    """A label for a new block."""
    labels = set(table.blocks or ("1",))
    return next(str(k) for k in range(2, len(labels) + 3) if str(k) not in labels)
