"""measurements.csv: tidy rows, a reading or a mean of readings each, checked before anything is computed from them."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.output.words import nearest
from pellet_study.rigs.catalogue import Catalogue
from pellet_study.rigs.declared import Condition, Rig
from pellet_study.study.ranges import other_unit, refuse_unreadable
from pellet_study.tables import rows
from pellet_study.tables.numbers import BLANKS, SIZES, fits, is_number, number

COLUMNS = {  # what a file may have besides the conditions and parameters of its rigs, in the order in which they are read
    "rig": "name of the rig that was read",
    "observable": "name of what was read, its unit in the name",
    "value": "the reading, or the mean of `n` readings",
    "sd": "standard deviation of one reading; blank where unknown: then replicates or the fit must tell",
    "n": "number of readings in `value`; blank is 1",
    "setup": "name of a set-up: rows that share it share its error",
    "setup_sd": "uncertainty of setting up anew, in the observable's unit, which replicates of one set-up do not see",
    "split": "`fit` (the default), `holdout` (predicted, not fitted) or `leave_out` (shown, used for nothing)",
    "reason": "why a row is not fitted; required beside `leave_out`",
    "order": "when the reading was taken, 1, 2, ...; tested for drift",
    "note": "free text, kept",
    "resolution": "smallest step of the instrument, in the observable's unit: the least sd of a reading",
}
MOST_COLUMNS = 24  # that a message lists
REQUIRED = ("rig", "observable", "value")
SPLITS = ("fit", "holdout", "leave_out")
TEXTS = ("rig", "observable", "value", "setup", "split", "reason", "note")  # where * or / is no blank
ENCODINGS = ("utf-8-sig", "utf-16", "gb18030")


@dataclass(frozen=True, slots=True)
class Measurement:
    """One row: a reading, or the mean of `n` readings.

    `sd` is of one reading, None where unknown; `conditions` holds every condition of the rig, a number or a word each,
    defaults filled in, and `assumed` names those that were; `parameters` are those known for this row; `split` is `fit`,
    `holdout` or `leave_out`, `reason` says why a row is not fitted; `order` is when it was taken; `line` is the row's line
    in the file.
    """

    rig: str
    observable: str
    value: float
    sd: float | None
    n: int
    conditions: Mapping[str, Condition]
    parameters: Mapping[str, float]
    setup: str
    setup_sd: float
    split: str
    note: str
    line: int
    resolution: float = 0.0  # smallest step of the instrument, a least sd; 0 where it is not given
    reason: str = ""
    order: float | None = None
    assumed: tuple[str, ...] = ()


def read(
    file: Path, catalogue: Catalogue, named_by: str = "`measurements` in study.toml names it"
) -> tuple[Measurement, ...]:
    """The rows of a measurements file; `named_by` says who named it, where there is none.

    Raises
    ------
    InputError : names the file, the line, what was given and what is accepted
    """
    form, table = rows.read(file, named_by, ENCODINGS)
    first, header = next(table, (1, None))
    if header is None:
        names = ", ".join(REQUIRED)
        raise InputError(f"{file}: empty; line 1: column {names} is missing; expected a header with at least {names}")
    _check_header(file, first, header, catalogue, table)
    reader = _Rows(file, header, catalogue, form.decimal)
    found = tuple(reader.row(line, cells) for line, cells in table if any(cells))
    if not found:
        raise InputError(f"{file}: no rows; a row is a reading or a mean of readings")
    return found


def refuse_sizes(file: Path | str, rows: Sequence[Measurement]) -> None:
    """Refuse numbers of sizes that cannot be reckoned with, as their squares run over.

    Raises
    ------
    InputError : names the line, the column and the number
    """
    for row in rows:
        own = (("value", row.value), ("sd", row.sd or 0.0), ("setup_sd", row.setup_sd), ("resolution", row.resolution))
        for name, value in (*own, *row.conditions.items(), *row.parameters.items()):
            if isinstance(value, float) and not fits(value):
                raise InputError(f"{file}: line {row.line}: {name} {value!r}: expected {SIZES}; is the unit right?")


def _check_header(
    file: Path, first: int, header: list[str], catalogue: Catalogue, table: Iterator[tuple[int, list[str]]]
) -> None:
    """Refuse a column that is no rig's, or given twice, or missing; the rows tell which rigs the names are looked up in."""
    accepted = {*COLUMNS, *(name for rig in catalogue.rigs.values() for name in (*rig.conditions, *rig.parameters))}
    for name in header:
        if header.count(name) > 1:
            raise InputError(
                f"{file}: line {first}: column {name!r} is given {header.count(name)} times; each name only once"
            )
    unknown = next((name for name in header if name not in accepted), None)
    if unknown is not None:
        rigs = [rig.name for rig in _rigs_of(file, header, catalogue, table)]
        of_rigs = {n for rig in rigs for n in (*catalogue.rigs[rig].conditions, *catalogue.rigs[rig].parameters)}
        raise InputError(
            f"{file}: line {first}: column {unknown!r} is unknown{' in ' + ', '.join(rigs) if rigs else ''}"
            f"{nearest(unknown, {*COLUMNS, *of_rigs} if rigs else accepted, MOST_COLUMNS)}"
        )
    missing = [name for name in REQUIRED if name not in header]
    if missing:
        raise InputError(
            f"{file}: line {first}: column {', '.join(missing)} is missing; given were {', '.join(header)}"
        )


def _rigs_of(file: Path, header: list[str], catalogue: Catalogue, table: Iterator[tuple[int, list[str]]]) -> list[Rig]:
    """The rigs that rows name, or InputError for the first that is none."""
    if "rig" not in header:
        return []
    place, lines = header.index("rig"), dict[str, int]()
    for line, cells in table:
        if len(cells) == len(header) and cells[place]:
            lines.setdefault(cells[place], line)
    return [catalogue.rig(name, f"{file}: line {line}: ") for name, line in lines.items()]


def _number(
    where: str, name: str, text: str, least: float | None = None, strict: bool = False, decimal: str = "."
) -> float:
    try:
        value = number(text, decimal)
    except ValueError:
        hint = _comma_hint(text) if decimal == "." else ""
        hint = "; other cells have a decimal comma: write one here too" if decimal == "," and "." in text else hint
        raise InputError(f"{where}: {name} {text[:60]!r}: expected a number{hint}") from None
    if not math.isfinite(value):
        raise InputError(f"{where}: {name} {text!r} is not finite; leave the cell blank where it is unknown")
    if least is not None and (value < least or (strict and value == least)):
        raise InputError(f"{where}: {name} {text!r}: expected {'more than' if strict else 'at least'} {least:g}")
    return value


def _comma_hint(text: str) -> str:
    """What to do where a number has a comma among numbers with a point."""
    if "," not in text:
        return ""
    if is_number(text, ","):
        return f"; {text} has a decimal comma, other cells a point: write {text.replace(',', '.')}"
    return "; a comma is neither a point nor part of a number here: write a point, and one number a cell"


def _check_split(where: str, split: str, reason: str) -> None:
    """Refuse an unknown split, a row left out without a reason, and a reason for a row that is fitted."""
    if split and split not in SPLITS:
        raise InputError(f"{where}: split {split!r} is unknown{nearest(split, SPLITS)}")
    if split == "leave_out" and not reason:
        raise InputError(f"{where}: split leave_out: a row that is left out says why in a column `reason`")
    if reason and split in ("", "fit"):
        raise InputError(
            f"{where}: reason {reason[:60]!r}, but the row is fitted; expected split leave_out or holdout beside it"
        )


class _Rows:
    """Rows of one file, checked; rows of one case share what they say of it."""

    def __init__(self, file: Path, header: list[str], catalogue: Catalogue, decimal: str = "."):
        self.file, self.header, self.catalogue, self.decimal = file, header, catalogue, decimal
        self.conditions = {name for rig in catalogue.rigs.values() for name in rig.conditions}
        self.numeric = [k for k, name in enumerate(header) if name not in TEXTS]
        self.of_case = [header.index("rig"), header.index("observable")]
        self.of_case += [k for k, name in enumerate(header) if name not in COLUMNS]
        self.place = {name: header.index(name) if name in header else None for name in COLUMNS}
        self.cases: dict[tuple, tuple] = {}

    def row(self, line: int, cells: list[str]) -> Measurement:
        """The row of a line, or InputError."""
        where = f"{self.file}: line {line}"
        if len(cells) != len(self.header):
            raise InputError(
                f"{where}: {len(cells)} cells, but the header has {len(self.header)}; expected {','.join(self.header)}"
            )
        for k in self.numeric:
            if cells[k] and cells[k].lower() in BLANKS:
                cells[k] = ""
        key = tuple([cells[k] for k in self.of_case])
        if key not in self.cases:
            self.cases[key] = self._case(where, dict(zip(self.header, cells, strict=True)))
        rig, observable, conditions, known, assumed = self.cases[key]
        value, sd, n, setup, setup_sd, split, reason, order, note = (
            "" if (place := self.place[name]) is None else cells[place] for name in tuple(COLUMNS)[2:-1]
        )
        place = self.place["resolution"]
        resolution = cells[place] if place is not None else ""
        count = _number(where, "n", n, 1, decimal=self.decimal) if n else 1.0
        if count != int(count):
            raise InputError(f"{where}: n {n!r}: expected a whole number of readings")
        _check_split(where, split, reason)
        reading = _number(where, "value", value, decimal=self.decimal)
        if split != "leave_out":
            refuse_unreadable(where, self.catalogue.rigs[rig], observable, value, reading)
        return Measurement(
            rig=rig,
            observable=observable,
            value=reading,
            sd=_number(where, "sd", sd, 0.0, strict=True, decimal=self.decimal) if sd else None,
            n=int(count),
            conditions=conditions,
            parameters=known,
            setup=setup,
            setup_sd=_number(where, "setup_sd", setup_sd, 0.0, decimal=self.decimal) if setup_sd else 0.0,
            split=split or SPLITS[0],
            note=note,
            line=line,
            resolution=_number(where, "resolution", resolution, 0.0, decimal=self.decimal) if resolution else 0.0,
            reason=reason,
            order=_number(where, "order", order, decimal=self.decimal) if order else None,
            assumed=assumed,
        )

    def _case(self, where: str, cells: dict[str, str]) -> tuple[str, str, dict, dict, tuple[str, ...]]:
        """Rig, observable, conditions with defaults filled in, known parameters, the conditions filled in."""
        rig = self.catalogue.rig(cells["rig"], f"{where}: ")
        if cells["observable"] not in rig.observables:
            raise InputError(
                f"{where}: rig {rig.name} has no observable {cells['observable']!r}"
                f"{nearest(cells['observable'], rig.observables)}"
            )
        conditions = rig.default_conditions()
        known = {}
        for name, text in cells.items():
            if text == "" or name in COLUMNS:
                continue
            if options := rig.options(name):
                if text not in options:
                    raise InputError(f"{where}: {name} {text!r} is unknown{nearest(text, options)}")
                conditions[name] = text
            elif name in rig.conditions:
                low = rig.conditions[name].get("min", -math.inf)
                positive = low > 0 or bool(rig.conditions[name].get("positive"))
                conditions[name] = _number(
                    where, name, text, 0.0 if low >= 0 or positive else None, strict=positive, decimal=self.decimal
                )
            elif name in rig.parameters:
                known[name] = _number(where, name, text, decimal=self.decimal)
                low, high = rig.parameters[name]["min"], rig.parameters[name]["max"]
                if not low <= known[name] <= high:
                    hint = other_unit(rig.parameters[name], (known[name],))
                    raise InputError(f"{where}: {name} {text!r}: expected a value from {low:g} to {high:g}{hint}")
            else:
                kind = "condition" if name in self.conditions else "parameter"
                raise InputError(
                    f"{where}: rig {rig.name} has no {kind} {name!r}, leave the cell blank; it has "
                    f"{', '.join([*rig.conditions, *rig.parameters])}"
                )
        assumed = tuple(name for name in rig.conditions if not cells.get(name))
        return rig.name, cells["observable"], conditions, known, assumed
