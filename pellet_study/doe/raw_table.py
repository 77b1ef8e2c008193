"""The header and the rows of a table as text, before anybody says which column is what."""

from dataclasses import dataclass
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.tables import rows as table_rows
from pellet_study.tables.headers import split_unit
from pellet_study.tables.numbers import is_number

SIGNS = {
    "+": 1.0,
    "-": -1.0,
    "\u2212": -1.0,
    "\u2013": -1.0,
    "0": 0.0,
    "+1": 1.0,
    "-1": -1.0,
    "1": 1.0,
    "\u22121": -1.0,
}
"""Levels of a factor as signs."""

GENERIC = ("factor", "response", "component", "unnamed:")


@dataclass(frozen=True)
class Raw:
    """Header and lines of a table as text, and its decimal sign."""

    header: list[str]
    rows: list[tuple[int, list[str]]]
    decimal: str
    notes: list[str]

    def column(self, i: int) -> list[str]:
        return [row[i] for _, row in self.rows]


def read_raw(path: Path) -> Raw:
    """Header and rows of a table of any form that `pellet_study.tables` reads.

    Lines below the header without any number are its second part: units go behind the names that have none.

    Raises
    ------
    InputError
        If the file is missing, no table, empty, or a line has another number of cells than the header.
    """
    form, records = table_rows.read(Path(path))
    lines = list(records)
    if len(lines) < 2:
        raise InputError(f"the table {path} holds no runs: expected a header line and one line a run")
    header, lines, notes = _header(lines, form.decimal)
    for number_, row in lines:
        if len(row) != len(header):
            raise InputError(
                f"row {number_} of {path} has {len(row)} cells where the header has {len(header)}: expected "
                "one cell a column, separated as the header is (with commas between cells a decimal point, not comma)"
            )
    if not lines:
        raise InputError(f"the table {path} holds no runs: expected a header line and one line a run")
    return Raw(header, lines, form.decimal, [*([form.note] if form.note else []), *notes])


def _header(lines, decimal: str):
    """The names of the columns, the lines below them, and what was done."""
    top = [lines[0]]
    while len(top) < min(3, len(lines) - 1) and not any(is_number(cell, decimal) for cell in lines[len(top)][1]):
        if len(lines[len(top)][1]) != len(lines[0][1]) or any(cell.lower() in SIGNS for cell in lines[len(top)][1]):
            break
        top.append(lines[len(top)])
    if len(top) == 1:
        return lines[0][1], lines[1:], []
    named = next((k for k, (_, row) in enumerate(top) if not _is_generic(row)), 0)
    header, notes = list(top[named][1]), []
    for number_, row in top[named + 1 :]:
        header = [
            f"{name} ({unit})" if unit and name and not split_unit(name)[1] else name
            for name, unit in zip(header, row, strict=True)
        ]
        notes.append(f"row {number_} holds no numbers: taken as the units of the columns")
    return header, lines[len(top) :], notes


def _is_generic(row: list[str]) -> bool:
    """Whether a header line only counts: `Factor 1`, `Response 1`, as in exports of Design-Expert."""
    return all(not cell or cell.lower().startswith(GENERIC) for cell in row)


def check_header(header: list[str], path: Path) -> None:
    """Refuse a header that does not name the columns, each once."""
    if all(is_number(name) for name in header):
        raise InputError(
            f"the first line of {path} is all numbers ({', '.join(header[:3])} ...): expected the column names there"
        )
    repeated = sorted({name for name in header if name and header.count(name) > 1})
    if repeated:
        raise InputError(
            f"the column name {repeated[0]!r} stands {header.count(repeated[0])} times in {path}: expected "
            "each factor once; rename or remove one"
        )
    if len(header) < 2:
        raise InputError(f"{path} has the single column {header[0]!r}: expected factor columns, then the response")
