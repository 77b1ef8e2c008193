"""Runs made on a path, read back: the factors of the screening, then the response; other columns are told apart."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from pellet_study.doe.columns import read_columns
from pellet_study.doe.design_table import DesignTable
from pellet_study.doe.raw_table import read_raw
from pellet_study.errors import InputError
from pellet_study.tables.headers import found_in, role


def ignored_in(paths: Sequence[Path], ignore: Sequence[str]) -> list[list[str]]:
    """For each of several tables the names of `ignore` that it has.

    Raises
    ------
    InputError
        If no table has a name.
    """
    headers = [read_raw(path).header for path in paths]
    for name in ignore:
        if not any(found_in(name, header) for header in headers):
            where = "; ".join(f"{path} has {', '.join(header)}" for path, header in zip(paths, headers, strict=True))
            raise InputError(f"there is no column {name!r} to ignore: {where}")
    return [[name for name in ignore if found_in(name, header)] for header in headers]


def read_path(
    path: Path, table: DesignTable, ignore: Sequence[str] = (), errors: bool = False
) -> tuple[pd.DataFrame, list[str]]:
    """The runs of a path (n_runs, n_factors + 1), the response last, and notes.

    Where the screening's response and a column of errors (how far each run was from a target) stand side by side, the
    response is taken, or with `errors` the errors.

    Raises
    ------
    InputError
        See `columns.read_columns`; also where a column is neither a factor of the screening nor the response.
    """
    found = read_columns(path, ignore, factors=table.names)
    names = list(found.frame.columns)
    others = [name for name in names if name not in table.names]
    notes = [f"{path.name}: {note}" for note in found.notes]
    if not others:
        raise InputError(f"{path} has no response: expected factors ({', '.join(table.names)}), then the response")
    measured = [name for name in others if role(name) != "error"]
    missed = [name for name in others if role(name) == "error"]
    chosen = names[-1]
    if missed and str(table.response.name) in measured:
        chosen = missed[-1] if errors else str(table.response.name)
    unknown = [
        name for name in others if name != chosen and not (name in missed + [str(table.response.name)] and missed)
    ]
    if unknown:
        raise InputError(
            f"{path} has the columns {', '.join(unknown)}, which are no factors of the table "
            f"({', '.join(table.names)}): expected factors, then the response; leave others out with --ignore"
        )
    rest = [name for name in others if name != chosen]
    if rest:
        notes.append(f"{path.name}: the best run is that of {chosen!r}; {', '.join(rest)} left out")
    return found.frame[[*(name for name in names if name in table.names), chosen]], notes
