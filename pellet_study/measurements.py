"""measurements.csv: tidy rows, a reading or a mean of readings each, checked before anything is computed from them."""

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pellet_study.catalogue import Catalogue, nearest
from pellet_study.errors import InputError

COLUMNS = ("rig", "observable", "value", "sd", "n", "setup", "setup_sd", "split", "note")
REQUIRED = ("rig", "observable", "value")
SPLITS = ("fit", "holdout")


@dataclass(frozen=True)
class Measurement:
    """One row: a reading, or the mean of `n` readings.

    `sd` is of one reading, None where unknown; `conditions` holds every condition of the rig, defaults filled in;
    `parameters` those known for this row; `line` is the row's line in the file.
    """

    rig: str
    observable: str
    value: float
    sd: float | None
    n: int
    conditions: Mapping[str, float]
    parameters: Mapping[str, float]
    setup: str
    setup_sd: float
    split: str
    note: str
    line: int


def read(file: Path, catalogue: Catalogue) -> tuple[Measurement, ...]:
    """The rows of a measurements file.

    Raises
    ------
    InputError : names the file, the line, what was given and what is accepted
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{file}: no such file; `measurements` in study.toml names it") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: cannot be read: {error}") from None
    lines = list(csv.reader(text.splitlines()))
    if not lines:
        raise InputError(f"{file}: empty; expected a header with at least {', '.join(REQUIRED)}")
    header = [name.strip() for name in lines[0]]
    conditions = {name for rig in catalogue.rigs.values() for name in rig.conditions}
    parameters = {name for rig in catalogue.rigs.values() for name in rig.parameters}
    _check_header(file, header, conditions, parameters)
    rows = [
        _row(
            file,
            number,
            dict(zip(header, [cell.strip() for cell in cells], strict=True)),
            catalogue,
            conditions,
            parameters,
        )
        for number, cells in enumerate(lines[1:], start=2)
        if any(cell.strip() for cell in cells) and _right_length(file, number, cells, header)
    ]
    if not rows:
        raise InputError(f"{file}: no rows; a row is a reading or a mean of readings")
    return tuple(rows)


def _check_header(file: Path, header: list[str], conditions: set, parameters: set) -> None:
    for name in header:
        if header.count(name) > 1:
            raise InputError(
                f"{file}: line 1: column {name!r} is given {header.count(name)} times; each name only once"
            )
        if name not in COLUMNS and name not in conditions and name not in parameters:
            raise InputError(
                f"{file}: line 1: column {name!r} is unknown{nearest(name, {*COLUMNS, *conditions, *parameters})}"
            )
    missing = [name for name in REQUIRED if name not in header]
    if missing:
        raise InputError(
            f"{file}: line 1: column {', '.join(missing)} is missing; given were {', '.join(header)}"
        )


def _right_length(file: Path, line: int, cells: list[str], header: list[str]) -> bool:
    if len(cells) != len(header):
        raise InputError(f"{file}: line {line}: {len(cells)} cells, but the header has {len(header)}")
    return True


def _number(where: str, name: str, text: str, least: float | None = None, strict: bool = False) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{where}: {name} {text!r} is no number") from None
    if not math.isfinite(value):
        raise InputError(f"{where}: {name} {text!r} is not finite; leave the cell blank where it is unknown")
    if least is not None and (value < least or (strict and value == least)):
        raise InputError(
            f"{where}: {name} {text!r}: expected {'more than' if strict else 'at least'} {least:g}"
        )
    return value


def _row(
    file: Path, line: int, cells: dict, catalogue: Catalogue, all_conditions: set, all_parameters: set
) -> Measurement:
    where = f"{file}: line {line}"
    rig = catalogue.rig(cells["rig"], f"{where}: ")
    if cells["observable"] not in rig.observables:
        raise InputError(
            f"{where}: rig {rig.name} has no observable {cells['observable']!r}{nearest(cells['observable'], rig.observables)}"
        )
    conditions = {name: float(quantity["default"]) for name, quantity in rig.conditions.items()}
    known = {}
    for name, text in cells.items():
        if text == "" or name in COLUMNS:
            continue
        if name in rig.conditions:
            positive = bool(rig.conditions[name].get("positive"))
            conditions[name] = _number(where, name, text, 0.0 if positive else None, strict=positive)
        elif name in rig.parameters:
            known[name] = _number(where, name, text)
        else:
            kind = "condition" if name in all_conditions else "parameter"
            raise InputError(
                f"{where}: rig {rig.name} has no {kind} {name!r}, leave the cell blank; it has "
                f"{', '.join([*rig.conditions, *rig.parameters])}"
            )
    count = _number(where, "n", cells["n"], 1) if cells.get("n") else 1.0
    if count != int(count):
        raise InputError(f"{where}: n {cells['n']!r}: expected a whole number of readings")
    split = cells.get("split") or "fit"
    if split not in SPLITS:
        raise InputError(f"{where}: split {split!r}{nearest(split, SPLITS)}")
    return Measurement(
        rig=rig.name,
        observable=cells["observable"],
        value=_number(where, "value", cells["value"]),
        sd=_number(where, "sd", cells["sd"], 0.0, strict=True) if cells.get("sd") else None,
        n=int(count),
        conditions=conditions,
        parameters=known,
        setup=cells.get("setup", ""),
        setup_sd=_number(where, "setup_sd", cells["setup_sd"], 0.0) if cells.get("setup_sd") else 0.0,
        split=split,
        note=cells.get("note", ""),
        line=line,
    )
