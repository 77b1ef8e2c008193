"""Which columns of a table are factors and response, which are blocks, and which are bookkeeping to be left out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd

from pellet_study.doe.blocks import Block, checked
from pellet_study.doe.bookkeeping import BLOCK_OF_PATH, ORDER_OF_RUNS, left_out_note, role_of
from pellet_study.doe.raw_table import SIGNS, Raw, check_header, read_raw
from pellet_study.errors import InputError
from pellet_study.output.words import nearest
from pellet_study.tables.headers import found_in, says_run_order
from pellet_study.tables.numbers import MISSING, SIZES, fits, is_number, number

STANDARD_ORDER = "standard_order"
"""The column of a run sheet that says where in the design each run stands."""
MOST_NUMBERED = 10  # times its rows that the design of a table may have runs


@dataclass(frozen=True)
class Columns:
    """A table as numbers.

    Attributes
    ----------
    frame : DataFrame (n_runs, n_columns)
        Factors, the response last; runs without a response are left out.
    lines : list of int
        The line of the file each run stands on.
    notes : list of str
        What was done while reading.
    blocks : list of Block
    left_out : list of str
        Columns that are neither factor nor response nor block.
    order : Series (n_runs,) or None
        In which order the runs were made, where a column that was left out says so; its name is the column's.
    standard_order : Series (n_runs,) or None
        Where in the design each run stands, from 1, where the sheet of the design says so.
    decimal : str
        The decimal sign of the file.
    ignored : dict
        {column that was named to be ignored: the cells of the runs, as text}.
    """

    frame: pd.DataFrame
    lines: list[int]
    notes: list[str]
    blocks: list[Block] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    order: pd.Series | None = None
    standard_order: pd.Series | None = None
    decimal: str = "."
    ignored: dict[str, list[str]] = field(default_factory=dict)


def read_columns(
    path: Path,
    ignore: Sequence[str] = (),
    blocks: Sequence[str] = (),
    factors: Sequence[str] = (),
    categories: Mapping[str, tuple[str, ...]] = MappingProxyType({}),
    unmeasured: bool = False,
    response: str | None = None,
    fitted: bool = True,
) -> Columns:
    """The columns of a table as numbers, each in its role.

    Parameters
    ----------
    path : Path
        CSV or xlsx; the last column that is not left out is the response.
    ignore, blocks, factors : sequence of str
        Columns that are neither factor nor response; that are blocks; that are factors whatever they are called.
        A name without its unit will do.
    categories : mapping, optional
        {factor: its levels in words}: of two the first is read as -1 and the second as 1, of more as 0, 1, 2, ...
    unmeasured : bool
        Keep runs without a response (NaN), as in the sheet of a design that is not run yet.
    response : str, optional
        The response's column, where it is not the last.
    fitted : bool
        False where nothing is fitted to the table, as to the runs of a path: blocks are left out then.

    Raises
    ------
    InputError
        Naming column and row where a cell is no number, and all columns of which it must be said what they are.
    """
    raw = read_raw(path)
    check_header(raw.header, path)
    if response is not None:
        raw = _response_last(raw, response, [*ignore, *blocks], path)
        factors = [*factors, raw.header[-1]]
    known = {kind: [_known(name, raw.header, kind, path) for name in names] for kind, names in
             (("ignore", ignore), ("use as block", blocks))}  # fmt: skip
    given = {found_in(name, raw.header) for name in factors}
    kept, left_out, asked = [], [], []
    for i, name in enumerate(raw.header):
        if name in known["use as block"] and not fitted:
            left_out.append((name, BLOCK_OF_PATH))
        if name in known["ignore"] or name in known["use as block"]:
            continue
        why, question = (None, None) if name in given else role_of(raw, i, fitted)
        if question:
            asked.append(question)
        elif why:
            left_out.append((name, why))
        else:
            kept.append(i)
    _ask(asked, path)
    unnamed = [i for i in kept if not raw.header[i]]
    if unnamed:
        raise InputError(f"column {unnamed[0] + 1} of {path} has no name: name each factor and the response")
    said = left_out_note(left_out, fitted)
    if len(kept) < 2:
        raise InputError(
            "; ".join([f"{path} keeps {len(kept)} columns: expected factor columns, then the response", *said])
        )
    notes = [*raw.notes, *said]
    words = {raw.header.index(_known(name, raw.header, "read words from", path)): codes_of(levels)
             for name, levels in categories.items()}  # fmt: skip
    frame, lines, used, failed = _numbers(raw, kept, path, words, unmeasured)
    found = [
        checked(Block(name, tuple(raw.rows[k][1][raw.header.index(name)] for k in used)), str(path))
        for name in dict.fromkeys(known["use as block"] if fitted else ())
    ]
    order = _run_order(raw, [name for name, why in left_out if why == ORDER_OF_RUNS], used)
    named = [name for name, why in left_out if why != "empty"]
    ignored = {n: [raw.rows[k][1][raw.header.index(n)] for k in used] for n in dict.fromkeys(known["ignore"])}
    return Columns(frame, lines, notes + failed, found, named, order, _standard_order(raw, used), raw.decimal, ignored)


def _run_order(raw: Raw, names: Sequence[str], used: Sequence[int]) -> pd.Series | None:
    """The column that says in which order the runs used were made, if there is one with a number for each."""
    for name in filter(says_run_order, names):
        cells = [raw.rows[k][1][raw.header.index(name)] for k in used]
        if all(is_number(cell, raw.decimal) for cell in cells):
            return pd.Series([number(cell, raw.decimal) for cell in cells], name=name)
    return None


def _standard_order(raw: Raw, used: Sequence[int]) -> pd.Series | None:
    """The standard order of the runs used, if the table has that column and it numbers the runs, each once."""
    cells = raw.column(raw.header.index(STANDARD_ORDER)) if STANDARD_ORDER in raw.header else []
    if not cells or len(set(cells)) < len(cells) or not all(cell.isdecimal() and int(cell) > 0 for cell in cells):
        return None
    if max(map(int, cells)) > MOST_NUMBERED * len(cells):  # a date, or the number of a batch
        return None
    return pd.Series([int(cells[k]) for k in used], name=STANDARD_ORDER)


def _response_last(raw: Raw, response: str, taken: Sequence[str], path: Path) -> Raw:
    """The table with the response's column moved to the end."""
    name = _known(response, raw.header, "take for the response", path)
    if name in {found_in(other, raw.header) for other in taken}:
        raise InputError(
            f"column {name!r} of {path} is a response and is to be left out or a block as well: expected one of them; name "
            "each response once with --response, and not with --ignore or --block"
        )
    i = raw.header.index(name)

    def moved(cells: list[str]) -> list[str]:
        return [*cells[:i], *cells[i + 1 :], cells[i]]

    return replace(raw, header=moved(raw.header), rows=[(line, moved(row)) for line, row in raw.rows])


def _known(name: str, header: list[str], kind: str, path: Path) -> str:
    found = found_in(name, header)
    if found is None:
        raise unknown_column(name, kind, {path: header})
    return found


def unknown_column(name: str, kind: str, headers: Mapping[Path, list[str]]) -> InputError:
    """That no table has a column which was to be ignored or the like, with what each has and the name that is near."""
    where = ", nor".join(f" in {path}{nearest(name, filter(None, header))}" for path, header in headers.items())
    return InputError(f"there is no column {name!r} to {kind}{where}")


def _ask(asked: list[str], path: Path) -> None:
    if asked:
        raise InputError(
            f"{path} has columns of which it must be said what they are: " + "; ".join(asked) + ". Or leave "
            f"{'it' if len(asked) == 1 else 'them'} out with --ignore NAME; expected factor columns, then the response"
        )


def codes_of(levels: tuple[str, ...]) -> dict[str, float]:
    """{level in words: number it is read as}."""
    return dict(zip(levels, (-1.0, 1.0) if len(levels) == 2 else map(float, range(len(levels))), strict=True))


def _numbers(raw: Raw, kept: list[int], path: Path, words: dict[int, dict[str, float]], unmeasured: bool):
    """The kept columns as numbers, their lines, the rows used, and a note on each run without a response."""
    values, lines, used, notes = [], [], [], []
    last = kept[-1]
    signs = {i for i in kept[:-1] if all(cell in SIGNS for cell in raw.column(i) if cell)}
    for k, (line, row) in enumerate(raw.rows):
        missing = row[last].lower() in MISSING
        if missing and not unmeasured:
            notes.append(f"row {line} has no {raw.header[last]!r}: a run that failed; it is left out")
            continue
        for i in kept[:-1] if missing else kept:
            if i in words:
                if row[i] not in words[i]:
                    raise InputError(
                        f"column {raw.header[i]!r}, row {line} of {path}: {row[i]!r} is none of its levels "
                        f"{', '.join(words[i])}; correct it, or name all levels with --factor"
                    )
                continue
            if not (row[i] in SIGNS if i in signs else is_number(row[i], raw.decimal)):
                sign = "comma, as other cells of the table have" if raw.decimal == "," else "point"
                raise InputError(
                    f"column {raw.header[i]!r}, row {line} of {path}: {row[i]!r} is not a number; expected a level of the "
                    f"factor or the measured response with a decimal {sign} (leave the response of a failed run empty)"
                )
            if i not in signs and not fits(number(row[i], raw.decimal)):
                raise InputError(
                    f"column {raw.header[i]!r}, row {line} of {path}: {row[i]!r}: expected {SIZES}; write it in another unit"
                )
        values.append(
            [
                np.nan
                if missing and i == last
                else words[i][row[i]]
                if i in words
                else SIGNS[row[i]]
                if i in signs
                else number(row[i], raw.decimal)
                for i in kept
            ]
        )
        lines.append(line)
        used.append(k)
    if not values:
        raise InputError(f"no run of {path} has a value in the column {raw.header[last]!r}: the response is missing")
    frame = pd.DataFrame(np.array(values, dtype=float), columns=[raw.header[i] for i in kept])
    return frame, lines, used, notes
