"""The rows of a table file, CSV or xlsx, whatever program wrote it: a stream of lines with their cells.

The form of a CSV file (encoding, what separates cells, decimal sign) is read off its beginning; a line that is too
long is refused before it is read whole.
"""

import csv
import io
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.files import opening
from pellet_study.tables import encoding, workbook

LARGEST = 2_000_000_000  # bytes; the file is read line by line
LONGEST_LINE = 1_000_000
FIRST = 1 << 20  # bytes that the form is read off
LOOKED_AT = 1000  # records that decide what separates cells, and the decimal sign
SEPARATORS = ",;\t|"
SEP_LINE = re.compile(r"\ufeff?\"?sep=(.)\"?\s*", re.IGNORECASE)
STRANGE = re.compile("[\x00-\x08\x0b-\x1f\x7f\udc80-\udcff]")  # control characters; bytes that are no UTF-8
STRAY = "holds a stray carriage return (0x0d) that ends no line; delete it, or save the file with plain line ends"
COMMA_NUMBER = re.compile(r"\s*[-+\u2212\u2013]?\d*,\d+([eE][-+]?\d+)?\s*")
GROUPED = re.compile(r"\s*[-+\u2212\u2013]?\d{1,3}(,\d{3})+(\.\d*)?\s*")
STRAY_RETURN = re.compile("\r(?!\n)")
QUOTED = re.compile('"[^"]*"')  # where line ends are part of a cell
WORKBOOKS, FOREIGN = (".xlsx", ".xlsm"), (".xls", ".ods", ".numbers", ".xlsb")


@dataclass(frozen=True)
class Form:
    """How a table is written; `separator` is "" in a workbook, `said` by a line such as
    `sep=;`, `width` the columns that hold anything, as far as was looked."""

    encoding: str = "utf-8-sig"
    separator: str = ","
    decimal: str = "."
    said: bool = False
    width: int = 0

    @property
    def note(self) -> str | None:
        """What a reader of the answer should know; None for plain CSV."""
        found = [f"as {encoding.NAMES[self.encoding]}"] if self.encoding in encoding.NAMES else []
        found += ["with decimal commas"] if self.decimal == "," else []
        return f"read {' '.join(found)}" if found else None


def read(
    file: Path, advice: str = "give the path of a table (CSV or xlsx)", encodings: tuple[str, ...] = encoding.ALL
) -> tuple[Form, Iterator[tuple[int, list[str]]]]:
    """The form of a table, and number of the first line and cells of each record; `encodings` are those accepted.

    Raises
    ------
    InputError : names the file, the line, what was given and what to do
    """
    with _reading(file):
        if not file.exists() and not file.is_symlink():
            raise InputError(f"{file}: no such file; {advice}")
        opening.refuse(file, LARGEST, what="a file of comma-separated values")
    if file.suffix.lower() in FOREIGN:
        raise InputError(f"{file}: {file.suffix} is not read; save the table as xlsx, or as CSV (UTF-8)")
    if file.suffix.lower() in WORKBOOKS:
        records = list(workbook.rows_of(file))
        return Form(separator=""), _filled(iter(records), _width(cells for _, cells in records))
    form = _form(file, encodings)
    return form, _filled(_records(file, form), form.width)


def _width(records: Iterable[list[str]]) -> int:
    """The number of columns that hold anything."""
    return max((k for cells in records for k, cell in enumerate(cells, 1) if cell.strip()), default=0)


def _filled(records: Iterator[tuple[int, list[str]]], width: int) -> Iterator[tuple[int, list[str]]]:
    """Records that hold anything, without the empty cells that spreadsheets write to the right of all others."""
    for number, cells in records:
        if any(cells):
            yield number, cells[:width] if len(cells) > width and not any(cells[width:]) else cells


def _form(file: Path, encodings: tuple[str, ...]) -> Form:
    with _reading(file), open(file, "rb") as stream:
        first = stream.read(FIRST)
    name = encoding.encoding_of(first, encodings)
    text = first.decode(name, errors="replace").lstrip("\ufeff")
    if not STRANGE.search(text.replace("\r", "")) and (
        number := stray_return(QUOTED.sub(lambda quoted: " " * len(quoted[0]), text))
    ):
        raise InputError(f"{file}: line {number}: {STRAY}")
    said = SEP_LINE.fullmatch(text.split("\n", 1)[0])
    if said:
        text = text.split("\n", 1)[1] if "\n" in text else ""
    separator = said[1] if said else _separator(file, text)
    records = _sample(text, separator)
    return Form(name, separator, _decimal(records, separator), bool(said), _width(records))


def _sample(text: str, separator: str) -> list[list[str]]:
    """The first records with anything in them, as far as they can be read."""
    found = []
    try:
        for cells in csv.reader(io.StringIO(text), delimiter=separator):
            if any(cell.strip() for cell in cells):
                found.append(cells)
            if len(found) == LOOKED_AT:
                break
    except csv.Error:
        pass
    return found


def _separator(file: Path, text: str) -> str:
    """What splits the header into most columns that the rows have too; a comma where nothing does."""
    header = next((line for line in text.splitlines() if line.strip()), "")
    scores = {}
    for sign in SEPARATORS:
        if sign not in header:
            continue
        records = _sample(text[: 64 * 1024], sign)
        if records and len(records[0]) > 1:
            scores[sign] = sum(len(cells) == len(records[0]) for cells in records[1:]) / max(1, len(records) - 1)
    if not scores:
        return ","
    best = max(scores.values())
    kept = [sign for sign, score in scores.items() if score == best]
    if "," in kept:
        return ","
    if len(kept) > 1:
        raise InputError(
            f"{file}: the header has both {' and '.join(map(repr, kept))} between its cells: expected one separator; "
            "save with commas"
        )
    return kept[0]


def _decimal(records: list[list[str]], separator: str) -> str:
    """The decimal sign: a comma where whole cells are numbers with one."""
    commas = [cell for cells in records for cell in cells if COMMA_NUMBER.fullmatch(cell)]
    if separator == ",":  # quoted; there 1,234 is rather one thousand two hundred and thirty-four
        commas = [cell for cell in commas if not GROUPED.fullmatch(cell)]
    return "," if commas else "."


def _records(file: Path, form: Form) -> Iterator[tuple[int, list[str]]]:
    lines = _lines(file, form.encoding)
    start = 1
    if form.said:
        next(lines)
        start = 2
    records, before = csv.reader(lines, delimiter=form.separator, strict=True), start - 1
    while True:
        try:
            cells = next(records, None)
        except csv.Error as error:
            raise InputError(
                f"{file}: line {start}: no valid CSV ({error}); is a quote opened and not closed?"
            ) from None
        if cells is None:
            return
        yield start, [cell.strip() for cell in cells]
        start = before + records.line_num + 1


def stray_return(text: str) -> int | None:
    """The line of the first carriage return that ends no line, in a text whose lines end with a line feed; None without."""
    if "\n" not in text:
        return None  # carriage returns are its line ends
    place = STRAY_RETURN.search(text)
    return text.count("\n", 0, place.start()) + 1 if place else None


class _reading:
    """Failures to read a file, as errors that name it."""

    def __init__(self, file: Path):
        self.file = file

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        if isinstance(error, OSError | ValueError):
            raise InputError(f"{self.file}: cannot be read: {error}") from None


def _lines(file: Path, name: str) -> Iterator[str]:
    """Lines of a text file, checked."""
    errors = "surrogateescape" if name == "utf-8-sig" else "strict"
    with _reading(file), open(file, encoding=name, errors=errors, newline="") as stream:
        for number in count(1):
            line = stream.readline(LONGEST_LINE + 1)
            if len(line) > LONGEST_LINE:
                raise InputError(
                    f"{file}: line {number}: longer than {LONGEST_LINE} characters; a row is a line of its own"
                )
            strange = STRANGE.search(line.rstrip("\r\n"))
            if strange:
                byte = ord(strange[0]) - (0xDC00 if strange[0] >= "\udc80" else 0)
                raise InputError(
                    f"{file}: line {number}: holds the byte 0x{byte:02x}, which is no UTF-8 text; save the table as CSV, "
                    "UTF-8"
                )
            if not line:
                return
            yield line.rstrip("\r\n") + "\n" if line.endswith(("\r", "\n")) else line
