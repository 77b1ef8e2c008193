"""Read and check the table of a design that was run: factor columns, then the response in the last column."""

import csv
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.doe.factors import Factor
from pellet_study.errors import InputError

MISSING = {"", "na", "n/a", "nan", "-", "failed", "missing"}
RESERVED = {"1", "model", "residual", "lack of fit", "pure error", "total", "curvature"}
"""Names of the rows of an ANOVA and of the intercept: no factor may have them."""

LEVEL_TOLERANCE = 0.1
"""How far, in coded units, a level may lie from its nominal place; it is analysed where it was run."""


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
        What was noticed while reading: runs without a response, level names.
    """

    factors: list[Factor]
    coded: pd.DataFrame
    response: pd.Series
    lines: list[int]
    notes: list[str] = field(default_factory=list)

    @property
    def names(self) -> list[str]:
        return [factor.name for factor in self.factors]


def read_rows(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Header and numbered lines of a CSV file (UTF-8 with or without a byte order mark, any line ending).

    Raises
    ------
    InputError
        If the file is missing, not text, empty, or a line has another number of cells than the header.
    """
    try:
        content = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot read the table {path}: {error.strerror}; give the path of a CSV file") from None
    except UnicodeDecodeError:
        raise InputError(f"the table {path} is not UTF-8 text; save it as CSV (UTF-8)") from None
    rows = csv.reader(content.splitlines(), delimiter=_separator(content))
    lines = [(rows.line_num, [cell.strip() for cell in row]) for row in rows]
    lines = [(number, row) for number, row in lines if any(row)]
    if len(lines) < 2:
        raise InputError(f"the table {path} holds no runs: expected a header line and one line a run")
    header = lines[0][1]
    for number, row in lines[1:]:
        if len(row) != len(header):
            raise InputError(
                f"row {number} of {path} has {len(row)} cells where the header has {len(header)}: expected "
                "one cell a column, separated as the header is (decimal point, not comma)"
            )
    return header, lines[1:]


def _separator(content: str) -> str:
    """What separates the cells of the header: a comma, or where it has none a semicolon or a tab."""
    header = next((line for line in content.splitlines() if line.strip()), "")
    if "," in header:
        return ","
    others = [sign for sign in ";\t" if sign in header]
    if len(others) > 1:
        raise InputError("the header has both ';' and tabs between its cells: expected one separator; save with commas")
    return others[0] if others else ","


def _checked_header(header: list[str], path: Path) -> None:
    unnamed = [str(i + 1) for i, name in enumerate(header) if not name]
    if unnamed:
        raise InputError(f"column {unnamed[0]} of {path} has no name: name each factor and the response")
    if all(_is_number(name) for name in header):
        raise InputError(
            f"the first line of {path} is all numbers ({', '.join(header[:3])} ...): expected the column names there"
        )
    repeated = sorted({name for name in header if header.count(name) > 1})
    if repeated:
        raise InputError(
            f"the column name {repeated[0]!r} stands {header.count(repeated[0])} times in {path}: expected "
            "each factor once; rename or remove one"
        )
    if len(header) < 2:
        raise InputError(f"{path} has the single column {header[0]!r}: expected factor columns, then the response")


def _is_number(cell: str) -> bool:
    try:
        return np.isfinite(float(cell))
    except ValueError:
        return False


def read_numbers(path: Path, ignore: list[str] = ()) -> tuple[pd.DataFrame, list[int], list[str]]:
    """All columns of a table as numbers; runs without a response (last column) are left out and noted.

    Returns
    -------
    frame, lines, notes : DataFrame (n_runs, n_columns), list of int, list of str

    Raises
    ------
    InputError
        Naming column and row where a cell is no number.
    """
    header, rows = read_rows(path)
    _checked_header(header, path)
    unknown = [name for name in ignore if name not in header]
    if unknown:
        raise InputError(f"there is no column {unknown[0]!r} to ignore in {path}: its columns are {', '.join(header)}")
    keep = [i for i, name in enumerate(header) if name not in ignore]
    if len(keep) < 2:
        raise InputError(f"{path} keeps {len(keep)} columns: expected factor columns, then the response")
    values, lines, notes = [], [], []
    for number, row in rows:
        if row[keep[-1]].lower() in MISSING:
            notes.append(f"row {number} has no {header[keep[-1]]!r}: a run that failed; it is left out")
            continue
        for i in keep:
            if not _is_number(row[i]):
                raise InputError(
                    f"column {header[i]!r}, row {number} of {path}: {row[i]!r} is not a number; expected a "
                    "level of the factor or the measured response with a decimal point (leave the response of a failed run empty)"
                )
        values.append([float(row[i]) for i in keep])
        lines.append(number)
    if not values:
        raise InputError(
            f"no run of {path} has a value in its last column {header[keep[-1]]!r}: the response is missing"
        )
    return pd.DataFrame(values, columns=[header[i] for i in keep]), lines, notes


def read_design(path: Path, factors: list[Factor] = (), max_levels: int = 3, ignore: list[str] = ()) -> DesignTable:
    """The table of a design with its levels coded.

    A factor whose values are -1, 0, 1 is coded already; another (also one with axial levels such as -1.414) is
    coded min -> -1, middle -> 0, max -> 1, unless `factors` says otherwise (as for a factor whose -1 is its higher
    physical level, or axial levels beyond A=-1,1).

    Parameters
    ----------
    path : Path
        CSV; factor columns in coded or physical units, last column the response.
    factors : list of Factor
        Levels, where the table's own coded units need physical ones or its minimum is not -1.
    max_levels : int
        3 for a two-level design with centre points or a three-level one, 5 for a central composite.
    ignore : list of str
        Columns that are neither factor nor response, such as a run number.

    Raises
    ------
    InputError
        See `read_numbers`; also a constant column, a column with more levels than a design has, a middle
        level that is not in the middle, factors given that the table has not.
    """
    frame, lines, notes = read_numbers(path, ignore)
    return code_design(frame, factors, lines, notes, max_levels, str(path))


def code_design(frame, factors=(), lines=None, notes=(), max_levels: int = 3, source: str = "the table") -> DesignTable:
    """A DesignTable from numbers: see `read_design`."""
    names, response = list(frame.columns[:-1]), frame.columns[-1]
    lines = list(lines) if lines is not None else list(range(1, len(frame) + 1))
    for name in names:
        if name in RESERVED or set(name) & set("*^"):
            raise InputError(
                f"a factor of {source} is named {name!r}, which stands for a term or row of the analysis: "
                "rename the column; expected a name other than 1, model, residual, ... and without * and ^"
            )
    given = {factor.name: factor for factor in factors}
    unknown = [name for name in given if name not in names]
    if unknown:
        raise InputError(f"factor {unknown[0]!r} is not a column of {source}: its factors are {', '.join(names)}")
    _check_response(frame, names, lines, source)
    resolved = [_factor_of(frame[name], given.get(name), lines, source) for name in names]
    coded = pd.DataFrame(
        {name: _coded_column(frame[name], factor) for name, factor in zip(names, resolved, strict=True)}
    )
    for name in names:
        _check_levels(coded[name], frame[name], lines, max_levels, source)
    return DesignTable(resolved, coded, frame[response].astype(float), lines, list(notes))


def _check_response(frame, names, lines, source) -> None:
    response = frame.columns[-1]
    levels = frame[response].round(9).nunique()
    if levels == 1 and len(frame) > 1:
        raise InputError(
            f"the last column {response!r} of {source} is {frame[response].iloc[0]:g} in every row (rows "
            f"{lines[0]} to {lines[-1]}): expected the measured response, which varies; put it in the last "
            "column"
        )
    if set(frame[response].round(9)) <= {-1.0, 0.0, 1.0} or _looks_like_a_factor(frame):
        raise InputError(
            f"the last column {response!r} of {source} holds the levels of a factor in rows {lines[0]} to "
            f"{lines[-1]}: the response column is missing; expected the measured values in the last column"
        )


def _looks_like_a_factor(frame: pd.DataFrame) -> bool:
    """Whether the last column has two or three evenly spaced levels, orthogonal to all the others."""
    levels = np.unique(frame.iloc[:, -1].round(9))
    if len(frame) < 8 or len(levels) > 3 or not np.allclose(np.diff(levels, 2), 0):
        return False
    centred = frame.to_numpy() - frame.to_numpy().mean(axis=0)
    products = np.abs(centred[:, :-1].T @ centred[:, -1])
    return bool(np.all(products < 1e-9 * np.linalg.norm(centred[:, :-1], axis=0) * np.linalg.norm(centred[:, -1])))


def _is_coded(values: pd.Series) -> bool:
    """Whether a column holds coded levels: -1 and 1, besides them at most 0."""
    return {-1.0, 1.0} <= set(values.round(6)) <= {-1.0, 0.0, 1.0}


def _factor_of(values: pd.Series, given: Factor | None, lines, source) -> Factor:
    if values.round(12).nunique() == 1:
        raise InputError(
            f"column {values.name!r} of {source} is {values.iloc[0]:g} in every row (rows {lines[0]} to "
            f"{lines[-1]}): expected a factor at two levels at least; remove the column"
        )
    if given is not None:
        return given
    if _is_coded(values):
        return Factor(values.name)
    return Factor(values.name, values.min(), values.max())


def _coded_column(values: pd.Series, factor: Factor) -> np.ndarray:
    """Coded levels; a column of -1, 0, 1 stays as it is even where physical levels are given."""
    coded = values.to_numpy() if _is_coded(values) else factor.coded(values)
    nearest = np.round(coded)
    return np.where(np.abs(coded - nearest) < 1e-9, nearest, coded)


def _check_levels(coded: pd.Series, values: pd.Series, lines, max_levels: int, source: str) -> None:
    levels = _distinct(coded)
    if len(levels) > max_levels:
        _refuse_odd_level(coded, values, lines, source)
        raise InputError(
            f"column {coded.name!r} of {source} has {len(levels)} different values (row {lines[0]}: "
            f"{values.iloc[0]:g}, row {lines[1]}: {values.iloc[1]:g}, ...): not a design; expected at most "
            f"{max_levels} levels (low, middle, high). Leave out a column that is no factor, such as a run "
            "number, with --ignore"
        )
    if len(levels) <= 3:
        _check_three(coded, values, lines, source)


def _refuse_odd_level(coded: pd.Series, values: pd.Series, lines, source: str) -> None:
    """Name the row where a column would be a design's but for one run."""
    counts = coded.round(6).value_counts().sort_index()
    odd = [
        level
        for level in counts.index[counts == 1]
        if len(counts) <= 4 and np.allclose(np.diff(counts.index.drop(level), 2), 0)
    ]
    if len(odd) != 1:
        return
    row = int(np.argmax(coded.round(6) == odd[0]))
    others = ", ".join(f"{level:g}" for level in sorted(values[coded.round(6) != odd[0]].unique()))
    raise InputError(
        f"column {coded.name!r}, row {lines[row]} of {source}: {values.iloc[row]:g} is a level of that run alone; "
        f"expected one of {others}. Correct it, or give the levels with --factor"
    )


def _distinct(coded: pd.Series) -> list[float]:
    """Levels that lie further apart than the tolerance."""
    levels = []
    for value in np.sort(coded.unique()):
        if not levels or value - levels[-1] > LEVEL_TOLERANCE:
            levels.append(value)
    return levels


def _check_three(coded: pd.Series, values: pd.Series, lines, source: str) -> None:
    off = np.abs(coded - np.clip(np.round(coded), -1, 1)).to_numpy()
    if (off > LEVEL_TOLERANCE).any():
        _refuse_odd_level(coded, values, lines, source)
        row = int(np.argmax(off))
        raise InputError(
            f"column {coded.name!r}, row {lines[row]} of {source}: {values.iloc[row]:g} is "
            f"{coded.iloc[row]:.3g} in coded units; expected -1, 0 or 1 (low, half way, high). Give the "
            "levels with --factor, or a logarithmic factor as its logarithm"
        )
