"""Readings that were taken after an answer asked for them, put into a study's measurements.

The rows go to the end of measurements.csv, as it is written: its encoding, separator and decimal sign. A condition that it
had no column for gets one, in which the rows that are there already have the default that was assumed for them.
"""

import csv
import io
import logging
import tempfile
from collections.abc import Sequence
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.files import opening, writing
from pellet_study.rigs.catalogue import Catalogue
from pellet_study.study.history import read_history
from pellet_study.study.load import load, measurements_of
from pellet_study.study.measurements import ENCODINGS, TEXTS, Measurement, read, refuse_sizes
from pellet_study.study.user_code import catalogue_of
from pellet_study.tables import rows
from pellet_study.tables.rows import Form

log = logging.getLogger(__name__)
BOM = b"\xef\xbb\xbf"


def measured(folder: Path, file: Path, library: Path | None = None) -> tuple[Measurement, ...]:
    """Put the rows of a file, written as measurements.csv is, at the end of a study's measurements; returns them.

    Where the last rows there are these already, nothing is written: a call that was interrupted is finished, and where an answer
    was given with them they are refused.

    Raises
    ------
    InputError : the rows cannot be used, alone or together with those there are; nothing is written
    """
    everything, there = catalogue_of(folder, library), measurements_of(folder)
    new = read(file, everything, "--measure names it")
    refuse_sizes(file, new)
    form, old_table = rows.read(there, "`measurements` in study.toml names it", ENCODINGS)
    if not form.separator:
        raise InputError(f"{there}: is a workbook, to which no rows are added; add them there, and leave out --measure")
    added_form, new_table = rows.read(file, encodings=ENCODINGS)
    old, more = [cells for _, cells in old_table], [cells for _, cells in new_table]
    width = len(old[0])
    header, lines = together(old, _with_decimal(more, added_form, form), everything)
    count = len(more) - 1
    if len(header) == width and old[1:][-count:] == lines[-count:]:
        _refuse_answered(folder, there, file, library)
        log.warning(
            "the last rows of %s are those of %s already, put there by a call that was interrupted", there, file
        )
        return new
    content = _written(there, form, [header, *lines], count, fresh=len(header) > width)
    _check(folder, there, file, content, library)
    writing.data(there, content, ours=writing.anything)
    return new


def together(
    old: Sequence[list[str]], more: Sequence[list[str]], everything: Catalogue
) -> tuple[list[str], list[list[str]]]:
    """Header and rows of two tables under one header; old rows have the default of a condition that only the new have."""
    header = [*old[0], *(name for name in more[0] if name not in old[0])]
    lines = []
    for cells in old[1:]:
        row = dict(zip(old[0], cells, strict=False))
        conditions = everything.rigs[row["rig"]].conditions if row.get("rig") in everything.rigs else {}
        defaults = {name: f"{conditions[name]['default']}" for name in header[len(old[0]) :] if name in conditions}
        lines.append([row.get(name, defaults.get(name, "")) for name in header])
    lines += [[dict(zip(more[0], cells, strict=False)).get(name, "") for name in header] for cells in more[1:]]
    return header, lines


def _with_decimal(table: Sequence[list[str]], own: Form, wanted: Form) -> list[list[str]]:
    """A table with the decimal sign of another."""
    if own.decimal == wanted.decimal:
        return list(table)
    numeric = [name not in TEXTS or name == "value" for name in table[0]]
    return [
        table[0],
        *(
            [c.replace(own.decimal, wanted.decimal) if n else c for c, n in zip(r, numeric, strict=False)]
            for r in table[1:]
        ),
    ]


def _written(there: Path, form: Form, table: Sequence[list[str]], count: int, fresh: bool) -> bytes:
    """The file with the last `count` rows of a table at its end; all of it anew where the header has changed."""
    before = opening.content(there)
    stream = io.StringIO()
    writer = csv.writer(stream, delimiter=form.separator, lineterminator="\n")
    if fresh:
        writer.writerows(table)
        said = f"sep={form.separator}\n" if form.said else ""
        text = said + stream.getvalue()
    else:
        writer.writerows(table[-count:])
        text = before.decode(form.encoding)
        text += ("" if text.endswith(("\n", "\r")) else "\n") + stream.getvalue()
    if form.encoding == "utf-8-sig" and not before.startswith(BOM):
        return text.encode()
    return text.encode(form.encoding)


def _refuse_answered(folder: Path, there: Path, file: Path, library: Path | None) -> None:
    """Refuse rows that are at the end already where an answer has been given with them: twice the same says nothing new."""
    steps = read_history(folder)
    if steps and steps[-1].get("basis") == load(folder, library).basis:
        raise InputError(
            f"{file}: its rows are the last of {there} already, and the last answer was given with them: nothing is added. Leave out "
            f"--measure; further readings that came out the same are added to {there} by hand"
        )


def _check(folder: Path, there: Path, file: Path, content: bytes, library: Path | None) -> None:
    """Refuse rows with which the study could not be loaded."""
    with tempfile.TemporaryDirectory() as scratch:
        trial = Path(scratch) / there.name
        trial.write_bytes(content)
        try:
            load(folder, library, instead=trial)
        except InputError as error:
            raise InputError(str(error).replace(str(trial), f"{there} with {file} added")) from None
