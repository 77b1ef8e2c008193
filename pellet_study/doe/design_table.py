"""Read and check the table of a design that was run: factor columns, then the response in the last column."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.doe.blocks import Block
from pellet_study.doe.columns import read_columns
from pellet_study.doe.factors import Factor
from pellet_study.doe.levels import resolve
from pellet_study.doe.rounding import rounding_variance
from pellet_study.errors import InputError
from pellet_study.output.words import nearest
from pellet_study.tables.headers import found_in, split_unit

RESERVED = {"1", "model", "residual", "lack of fit", "pure error", "total", "curvature"}
"""Names of the rows of an ANOVA and of the intercept: no factor may have them."""


@dataclass(frozen=True)
class DesignTable:
    """A design as it was run.

    Attributes
    ----------
    factors : list of Factor
    coded : DataFrame (n_runs, n_factors)
        The factor columns in coded units.
    response : Series (n_runs,)
        In the unit of the table; its name is the response's.
    lines : list of int
        The line of the file each run stands on.
    notes : list of str
        What was noticed while reading: runs without a response, columns left out, levels off their place.
    blocks : list of Block
        Groups of runs that may differ in level.
    left_out : list of str
        Columns of the file that are neither factor nor response nor block.
    order : Series (n_runs,) or None
        In which order the runs were made, where the file says so.
    standard_order : Series (n_runs,) or None
        Where in its design each run stands, from 1, where the file says so.
    decimal : str
        The decimal sign of the file.
    rounding : float or None
        Variance of the rounding of a response that is not as read, such as a logarithm; None: by its own decimals.
    """

    factors: list[Factor]
    coded: pd.DataFrame
    response: pd.Series
    lines: list[int]
    notes: list[str] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    order: pd.Series | None = None
    standard_order: pd.Series | None = None
    decimal: str = "."
    rounding: float | None = None

    @property
    def rounding_variance(self) -> float:
        """The variance that rounding alone gives to a response, response unit squared."""
        return rounding_variance(self.response) if self.rounding is None else self.rounding

    @property
    def names(self) -> list[str]:
        return [factor.name for factor in self.factors]


def read_numbers(path: Path, ignore: Sequence[str] = ()) -> tuple[pd.DataFrame, list[int], list[str]]:
    """All columns of a table but bookkeeping as numbers, their lines, and notes; see `columns.read_columns`."""
    found = read_columns(path, ignore)
    return found.frame, found.lines, found.notes


MOST_LEVELS = 3  # of a column that was ignored, up to which it may be a factor


def read_design(
    path: Path,
    factors: Sequence[Factor] = (),
    max_levels: int = 3,
    ignore: Sequence[str] = (),
    blocks: Sequence[str] = (),
    response: str | None = None,
) -> DesignTable:
    """The table of a design with its levels coded; see `levels` for how.

    Parameters
    ----------
    path : Path
        CSV or xlsx; factor columns in coded or physical units, last column the response.
    factors : list of Factor
        Levels, where the table's own coded units need physical ones or its minimum is not -1. A column named here
        is a factor whatever it is called, and is analysed where it was run.
    max_levels : int
        3 for a two-level design with centre points or a three-level one, 5 for a central composite.
    ignore : list of str
        Columns that are neither factor nor response, such as an operator.
    blocks : list of str
        Columns that say in which block a run was made.
    response : str, optional
        The response's column, where it is not the last; runs without a value of it are left out.

    Raises
    ------
    InputError
        See `columns.read_columns`; also a constant column, a column with more levels than a design has, a middle
        level that is not in the middle, factors given that the table has not.
    """
    categories = {factor.name: factor.levels for factor in factors if factor.levels}
    found = read_columns(path, ignore, blocks, [factor.name for factor in factors], categories, response=response)
    words = [f"{name}: -1 is {levels[0]}, +1 is {levels[1]}" for name, levels in categories.items()]
    table = code_design(
        found.frame, factors, found.lines, found.notes + words, max_levels, str(path), found.blocks, found.left_out
    )
    notes = [*table.notes, *_unequal_replicates(table, found.ignored)]
    return replace(table, order=found.order, standard_order=found.standard_order, decimal=found.decimal, notes=notes)


def _unequal_replicates(table: DesignTable, ignored: Mapping[str, Sequence[str]]) -> list[str]:
    """That runs taken for replicates were made at different levels of a factor that was ignored."""
    keys = [
        *(pd.Series(table.coded[name].round(6)) for name in table.names),
        *(pd.Series(b.labels) for b in table.blocks),
    ]
    places = pd.concat([key.reset_index(drop=True) for key in keys], axis=1).apply(tuple, axis=1)
    unequal = []
    for name, cells in ignored.items():
        levels = pd.Series(list(cells))
        few = levels.nunique() <= MOST_LEVELS and levels.value_counts().min() > 1  # of a factor, not of a response
        if few and levels.groupby(places.to_numpy()).nunique().max() > 1:
            unequal.append(name)
    if not unequal:
        return []
    names, are = ", ".join(unequal), "was" if len(unequal) == 1 else "were"
    return [
        f"runs that count as replicates differ in {names}, which {are} ignored: their scatter, the pure error, holds what that does; "
        "where it acts, fit it as a factor, or one with named levels with --block"
    ]


def code_design(
    frame, factors=(), lines=None, notes=(), max_levels: int = 3, source: str = "the table", blocks=(), left_out=()
) -> DesignTable:
    """A DesignTable from numbers: see `read_design`."""
    names, response = list(frame.columns[:-1]), frame.columns[-1]
    lines = list(lines) if lines is not None else list(range(1, len(frame) + 1))
    for name in names:
        if name in RESERVED or set(split_unit(name)[0]) & set("*^"):
            raise InputError(
                f"a factor of {source} is named {name!r}, which stands for a term or row of the analysis: "
                "rename the column; expected a name other than 1, model, residual, ... and without * and ^"
            )
    given = {}
    for factor in factors:
        name = found_in(factor.name, names)
        if name is None:
            raise InputError(f"factor {factor.name!r} is no factor of {source}{nearest(factor.name, names)}")
        given[name] = replace(
            factor, name=name, unit="" if split_unit(name)[1] else factor.unit
        )  # a header has it once
    _check_response(frame, names, lines, source)
    resolved, coded, more = resolve(frame[names], given, lines, max_levels, source)
    return DesignTable(
        resolved, coded, frame[response].astype(float), lines, [*notes, *more], list(blocks), list(left_out)
    )


def _check_response(frame, names, lines, source) -> None:
    response = frame.columns[-1]
    if np.ptp(frame[response]) <= 1e-12 * np.abs(frame[response]).max() and len(frame) > 1:
        raise InputError(
            f"the response column {response!r} of {source} is {frame[response].iloc[0]:g} in every row (rows "
            f"{lines[0]} to {lines[-1]}): expected the measured response, which varies; put it in the last "
            "column"
        )
    coded = set(frame[response].round(9)) <= {-1.0, 0.0, 1.0} and np.abs(frame[response]).max() > 0.5
    if coded or _looks_like_a_factor(frame):
        raise InputError(
            f"the response column {response!r} of {source} holds the levels of a factor in rows {lines[0]} to "
            f"{lines[-1]}: the response column is missing; expected the measured values in the last column"
        )


def _looks_like_a_factor(frame: pd.DataFrame) -> bool:
    """Whether the last column has two or three evenly spaced levels, orthogonal to all the others."""
    response = frame.iloc[:, -1]
    levels = np.unique((response / np.abs(response).max()).round(9))
    if len(frame) < 8 or len(levels) > 3 or not np.allclose(np.diff(levels, 2), 0):
        return False
    centred = frame.to_numpy() - frame.to_numpy().mean(axis=0)
    products = np.abs(centred[:, :-1].T @ centred[:, -1])
    return bool(np.all(products < 1e-9 * np.linalg.norm(centred[:, :-1], axis=0) * np.linalg.norm(centred[:, -1])))
