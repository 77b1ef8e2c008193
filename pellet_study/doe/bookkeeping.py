"""Which columns of a table are bookkeeping, by heading and by content: run numbers, types of point, blocks, dummies, notes."""

import re
import shlex

from pellet_study.doe.raw_table import SIGNS, Raw
from pellet_study.tables.headers import role, says_run_order
from pellet_study.tables.numbers import MISSING, is_number, number

QUANTITY = re.compile(r"[-+\u2212]?\d+([.,]\d+)?\s*[^\d\s.,;:/-]\S*$")
"""A number with its unit in the same cell."""

MOST_LEVELS = 5
"""Levels of a factor in any design known here; a column of more whole numbers in a row, each once, counts its rows."""

NUMBER_OF_RUN = "number of the run"
ORDER_OF_RUNS = "order of the runs"


def role_of(raw: Raw, i: int, fitted: bool = True) -> tuple[str | None, str | None]:
    """Why a column is left out, or what must be said of it; (None, None) for a factor or the response.

    `fitted` is False where nothing is fitted to the table, as to the runs of a path: it has no blocks then.
    """
    name, cells = raw.header[i], raw.column(i)
    said, filled, last = role(name), [cell for cell in cells if cell], i == len(raw.header) - 1
    if not name:
        return ("empty" if not filled else "counts the rows" if i == 0 and _each_once(filled) else None), None
    if said == "order":
        return ORDER_OF_RUNS, None
    why = _number_of_run(said == "count", filled, last)
    if why:
        return ORDER_OF_RUNS if says_run_order(name) and _whole(filled) else why, None
    if said == "count" and not last and _restarts(filled):
        return None, (
            f"{name!r} is named like the number of a run, and numbers several runs alike: --factor "
            f"{shlex.quote(f'{name}={_ends(cells, raw.decimal)}')} if it is a factor"
        )
    if said == "point type":
        return "type of point", None
    if said == "dummy":
        return "dummy, which estimates noise", None
    if said == "block" and filled and not last:
        if len(set(filled)) == 1:
            return "one block only", None
        return _block(name, cells, raw.decimal, fitted)
    if len(filled) > 1 and not any(is_number(cell, raw.decimal) or cell in SIGNS for cell in filled):
        return None, _words(name, filled, fitted)
    return None, None


def _each_once(filled: list[str]) -> bool:
    """Whether a column only counts: whole numbers, each once, or texts, each once."""
    if len(filled) < 2 or len(set(filled)) < len(filled):
        return False
    return all(number(cell).is_integer() for cell in filled if is_number(cell))


def _whole(filled: list[str]) -> list[int]:
    """The whole numbers of a column in order, each once; none where it holds anything else."""
    if not all(is_number(cell) and number(cell).is_integer() for cell in filled):
        return []
    return sorted({int(number(cell)) for cell in filled})


def _in_a_row(whole: list[int]) -> bool:
    return bool(whole) and whole[-1] - whole[0] == len(whole) - 1


def _number_of_run(named: bool, filled: list[str], last: bool) -> str | None:
    """What a column that numbers or names each run is left out as; None where it does not.

    A name such as `run` is enough for any numbers or texts, each once; without it whole numbers in a row, more of them
    than a factor has levels, or texts, each once. The last column holds the response, unless it counts by name and content.
    """
    if not _each_once(filled):
        return None
    whole = _whole(filled)
    if named and (not last or _in_a_row(whole)):
        return NUMBER_OF_RUN
    if last or len(filled) <= MOST_LEVELS:
        return None
    if _in_a_row(whole) and whole[0] in (0, 1):
        return f"{NUMBER_OF_RUN}: {whole[0]} to {whole[-1]}, each once"
    if any(is_number(cell) or cell in SIGNS or QUANTITY.match(cell) for cell in filled):
        return None
    return f"name of the run: {filled[0][:30]}, {filled[1][:30]}, ..., each once"


def _restarts(filled: list[str]) -> bool:
    """Whether whole numbers in a row from 1 come again, more of them than a factor has levels in most designs."""
    whole = _whole(filled)
    return len(whole) > 3 and _in_a_row(whole) and whole[0] in (0, 1)


def _block(name: str, cells: list[str], decimal: str, fitted: bool) -> tuple[str | None, str | None]:
    if not fitted:
        return BLOCK_OF_PATH, None
    return None, (
        f"{name!r} looks like a block (a day, a batch, a replicate): --block {shlex.quote(name)} fits it as blocks, --factor "
        f"{shlex.quote(f'{name}={_ends(cells, decimal)}')} as a factor"
    )


BLOCK_OF_PATH = "blocks, which a path cannot tell from its own rise and fall"


def _words(name: str, filled: list[str], fitted: bool) -> str | None:
    """What to ask of a column of texts; nothing where they only say that nothing was measured."""
    if all(cell.lower() in MISSING for cell in filled):
        return None
    if all(QUANTITY.match(cell) or cell.lower() in MISSING for cell in filled):
        return (
            f"{name!r} holds numbers with text behind them ({filled[0][:30]!r}): write the numbers alone, and what is behind "
            "them into the header, as NAME (UNIT)"
        )
    text = f"{name!r} holds text ({filled[0][:30]!r})"
    if not fitted or len(set(filled)) == len(filled):
        return text
    levels = shlex.quote(f"{name}={','.join(sorted(set(filled)))}")
    return f"{text}: --block {shlex.quote(name)} if its words say which block, --factor {levels} if they are the levels of a factor"


def _ends(cells: list[str], decimal: str) -> str:
    values = [number(cell, decimal) for cell in cells if is_number(cell, decimal)]
    return f"{min(values):g},{max(values):g}" if values and min(values) < max(values) else "LOW,HIGH"


def left_out_note(left_out: list[tuple[str, str]], fitted: bool = True) -> list[str]:
    """One sentence on all columns that were left out, grouped by the reason, and how one of them is made a factor."""
    reasons: dict[str, list[str]] = {}
    for name, why in left_out:
        if why != "empty":
            reasons.setdefault(why, []).append(name or "the unnamed first column")
    if not reasons:
        return []
    words = "; ".join(f"{', '.join(names)} ({why})" for why, names in reasons.items())
    return [f"no factors, left out: {words}" + ("; --factor NAME=LOW,HIGH makes a column a factor" if fitted else "")]
