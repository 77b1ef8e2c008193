"""Runs made on a path, read back: the factors of the screening, then the response; other columns are told apart."""

from collections.abc import Collection, Sequence
from pathlib import Path

import pandas as pd

from pellet_study.doe.columns import read_columns, unknown_column
from pellet_study.doe.design_table import DesignTable
from pellet_study.doe.raw_table import read_raw
from pellet_study.errors import InputError
from pellet_study.tables.headers import found_in, role, split_unit


def named_in(paths: Sequence[Path], names: Sequence[str], kind: str) -> list[list[str]]:
    """For each of several tables those of the names that it has; `kind` is what they are to be used for.

    Raises
    ------
    InputError
        If no table has a name.
    """
    if not names:
        return [[] for _ in paths]
    headers = {path: read_raw(path).header for path in paths}
    for name in names:
        if not any(found_in(name, header) for header in headers.values()):
            raise unknown_column(name, kind, headers)
    return [[name for name in names if found_in(name, header)] for header in headers.values()]


def read_path(
    path: Path, table: DesignTable, ignore: Sequence[str] = (), errors: bool = False, blocks: Sequence[str] = ()
) -> tuple[pd.DataFrame, list[str]]:
    """The runs of a path (n_runs, n_factors + 1), the response last, and notes.

    Where the screening's response and a column of errors (how far each run was from a target) stand side by side, the
    response is taken, or with `errors` the errors. Blocks are left out: a path has no runs to tell them by. So is a
    categorical factor, which a path holds at one of its levels.

    Raises
    ------
    InputError
        See `columns.read_columns`; also where a column is neither a factor of the screening nor the response.
    """
    words = {factor.name: factor.levels for factor in table.factors if factor.levels}
    bare = {split_unit(name)[0]: name for name in table.names}  # a path may leave the units out
    found = read_columns(path, ignore, blocks, [*table.names, *bare], words, fitted=False)
    found.frame.columns = [name if name in table.names else bare.get(name, name) for name in found.frame.columns]
    _refuse_changing(found.frame, words, path)
    names = [name for name in found.frame.columns if name not in words]
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


def _refuse_changing(frame: pd.DataFrame, words: Collection[str], path: Path) -> None:
    """A path that changes a categorical factor on its way is no path."""
    changed = [name for name in words if name in frame and frame[name].nunique() > 1]
    if changed:
        raise InputError(
            f"{path} has runs at two levels of {changed[0]!r}: expected the runs of a path at one of them; leave the response of "
            "the others empty"
        )
