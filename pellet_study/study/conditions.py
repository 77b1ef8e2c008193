"""What a study's rows say of their conditions, and what is assumed where they say nothing.

A condition that no row of a rig gives keeps the rig's default and is said to be assumed; one that only some give is
refused: a blank cell is no measurement at the default.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.output.words import number
from pellet_study.rigs.catalogue import Catalogue
from pellet_study.study.measurements import Measurement
from pellet_study.study.ranges import refuse_beyond, unusual, unusual_parameter, unusual_readings
from pellet_study.study.spreads import unusual_sd

SHOWN = 3  # groups of equal rows that are named


def check_conditions(file: Path | str, rows: Sequence[Measurement], catalogue: Catalogue) -> None:
    """Refuse rows whose conditions are incomplete or beyond what their rig can simulate; rows left out may be so.

    Raises
    ------
    InputError : names the line and the column
    """
    for rig, of_rig in _cases(rows).items():
        for name, quantity in catalogue.rigs[rig].conditions.items():
            filled = [row for row in of_rig if name not in row.assumed]
            blank = next((row for row in of_rig if name in row.assumed), None)
            if blank is not None and quantity.get("required"):
                raise InputError(
                    f"{file}: line {blank.line}: column {name} is missing or blank; {rig} requires it in every row "
                    f"({quantity.get('meaning', name)}, {quantity.get('unit', '1')}): there is no default for it"
                )
            if blank is not None and filled:
                raise InputError(
                    f"{file}: line {blank.line}: column {name} is blank, but line {filled[0].line} of {rig} gives "
                    f"{number(filled[0].conditions[name])}: fill the cell, or set split to leave_out with a reason; only where "
                    f"no row of {rig} gives it the default, {number(quantity['default'])}, is taken"
                )
            if "options" in quantity:  # a word, not a number
                continue
            column = [float(row.conditions[name]) for row in filled]
            for row, value in zip(filled, column, strict=True):
                refuse_beyond(f"{file}: line {row.line}", name, value, quantity, column)


def _cases(rows: Sequence[Measurement]) -> dict[str, list[Measurement]]:
    """The first row of each different case that is used, by rig."""
    first = {id(row.conditions): row for row in reversed(rows) if row.split != "leave_out"}
    found: dict[str, list[Measurement]] = {}
    for row in sorted(first.values(), key=lambda row: row.line):
        found.setdefault(row.rig, []).append(row)
    return found


def remarks(rows: Sequence[Measurement], catalogue: Catalogue, fixed: Mapping[str, float]) -> tuple[str, ...]:
    """What to know of the rows before anything is computed: unusual values and standard deviations, equal rows.

    Parameters
    ----------
    fixed : values of parameters that study.toml fixes
    """
    said = []
    for rig, of_rig in _cases(rows).items():
        declared = catalogue.rigs[rig]
        for name, quantity in declared.conditions.items():
            if "options" in quantity:
                continue
            given = [float(row.conditions[name]) for row in of_rig if name not in row.assumed]
            said.append((rig, unusual(name, quantity, list(dict.fromkeys(given)))))
        for name, quantity in declared.parameters.items():
            known = [row.parameters[name] for row in of_rig if name in row.parameters]
            known += [fixed[name]] if name in fixed else []
            said.append((rig, unusual_parameter(name, quantity, known)))
        for observable in dict.fromkeys(row.observable for row in of_rig):
            read = [r.value for r in rows if (r.rig, r.observable) == (rig, observable) and r.split != "leave_out"]
            said.append((rig, unusual_readings(declared, observable, read)))
    return (*(f"{rig}: {words}" for rig, words in said if words), *unusual_sd(rows), *_equal_rows(rows))


def _equal_rows(rows: Iterable[Measurement]) -> list[str]:
    """A sentence on rows that are equal in every column, or nothing."""
    groups: dict[tuple, list[int]] = {}
    for row in rows:
        case = (row.rig, row.observable, *row.conditions.values(), *row.parameters.items())
        reading = (row.value, row.sd, row.n, row.setup, row.setup_sd, row.split, row.reason, row.order, row.note)
        groups.setdefault((*case, *reading), []).append(row.line)
    equal = [_listed(lines) for lines in groups.values() if len(lines) > 1]
    if not equal:
        return []
    more = f"; and {len(equal) - SHOWN} more groups" if len(equal) > SHOWN else ""
    return [
        f"equal in every column: lines {'; '.join(equal[:SHOWN])}{more}; each counts as a reading of its own: take out what "
        "was copied (an `order` column tells readings apart)"
    ]


def _listed(lines: Sequence[int]) -> str:
    """`2 and 6`, or `2, 6, 9 and 4 more`."""
    if len(lines) > SHOWN:
        return f"{', '.join(map(str, lines[:SHOWN]))} and {len(lines) - SHOWN} more"
    return " and ".join(map(str, lines))
