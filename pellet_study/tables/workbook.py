"""The rows of an xlsx workbook's first sheet that has any, as text cells (openpyxl, the extra `xlsx`)."""

from collections.abc import Iterator
from pathlib import Path
from zipfile import ZipFile

from pellet_study.errors import InputError
from pellet_study.files import opening

LARGEST, LARGEST_UNPACKED = 50_000_000, 500_000_000  # bytes


def rows_of(file: Path) -> Iterator[tuple[int, list[str]]]:
    """Number and cells of each row; formulas by their stored value.

    Raises
    ------
    InputError
        If openpyxl is not installed, or the file is no workbook.
    """
    try:
        from openpyxl import load_workbook
    except ImportError:
        raise InputError(
            f"{file}: reading a workbook needs openpyxl: pip install 'pellet-study[xlsx]', or save the table as CSV"
        ) from None
    content = opening.stream(file, LARGEST)
    try:
        with ZipFile(content) as archive:
            size = sum(part.file_size for part in archive.infolist())
        if size > LARGEST_UNPACKED:
            raise ValueError(f"{size} bytes when unpacked, expected at most {LARGEST_UNPACKED}")
        book = load_workbook(content, read_only=True, data_only=True)
    except Exception as error:  # whatever a broken archive or its XML brings up
        raise InputError(f"{file}: no xlsx workbook ({error}); save it as xlsx, or as CSV") from None
    try:
        for sheet in book.worksheets:
            filled = False
            for number, row in enumerate(sheet.iter_rows(values_only=True), 1):
                cells = [_text(value) for value in row]
                filled = filled or any(cells)
                yield number, cells
            if filled:
                return
    finally:
        book.close()


def _text(value) -> str:
    """A cell as CSV would have it."""
    if value is None:
        return ""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value).strip()
    return repr(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)
