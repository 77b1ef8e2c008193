"""The one way a file is written: beside its place and renamed, so it is there whole or as it was before.

Inside a study (a folder with study.toml, which may itself be reached by a link) nothing is written through a link. What
is there already is replaced only where it is empty, the same, or what an earlier call wrote there, unless it is forced:
an answer in JSON is known by its form, a figure by its parts, a table by its columns, a page by the lines it shares.
"""

import json as json_of
import math
import os
import secrets
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from pellet_study.errors import InputError
from pellet_study.files import opening

if TYPE_CHECKING:
    import pandas as pd

STUDY = "study.toml"
MOST_RECOGNISED = 100_000_000  # bytes
LEAST_LINE = {
    ".html": 100
}  # letters of a line that tells that two pages are one; of HTML many pages share the short ones
PNG = b"\x89PNG\r\n\x1a\n"
SCREEN_DPI, JOURNAL_DPI = 150, 600  # of the figures; with no other remark in them
NO_FOLLOW = getattr(os, "O_NOFOLLOW", 0)

_forced: ContextVar[bool] = ContextVar("forced", default=False)


@contextmanager
def forced(force: bool = True) -> Iterator[None]:
    """Within it files that the package did not write are overwritten too; links are refused all the same."""
    before = _forced.set(force)
    try:
        yield
    finally:
        _forced.reset(before)


def data(file: Path, content: bytes, *, ours: Callable[[bytes, bytes], bool] | None = None) -> Path:
    """Write a file whole or not at all; returns its path.

    Parameters
    ----------
    ours : told (what is there, what is to be written), whether what is there may be replaced; default: by the name's ending

    Raises
    ------
    InputError : its place is a link or no regular file, or what is there is not what the package wrote
    OSError : as the system refuses it
    """
    check(file, content, ours=ours)
    file.parent.mkdir(parents=True, exist_ok=True)
    _replace(file, content)
    return file


def text(file: Path, content: str, *, ours: Callable[[bytes, bytes], bool] | None = None) -> Path:
    """Write a text as UTF-8; see `data`."""
    return data(file, content.encode("utf-8", "backslashreplace"), ours=ours)


def json(file: Path, answer: Any) -> Path:
    """Write an answer as JSON without nan or infinity; see `data`."""
    return text(file, as_json(answer))


def as_json(answer: Any) -> str:
    """An answer as its file says it.

    Raises
    ------
    InputError : a number in it is none; names the place
    """
    try:
        return json_of.dumps(answer, indent=1, allow_nan=False) + "\n"
    except ValueError:
        place = _no_number(answer)
        raise InputError(
            f"the answer has no finite number at {place}: these data do not give one; look for a reading, an sd or a level of "
            "another size than the others"
        ) from None


def _no_number(answer: Any, place: str = "") -> str | None:
    """Where in an answer the first number stands that is not finite."""
    if isinstance(answer, float):
        return None if math.isfinite(answer) else place.lstrip(".")
    parts = (
        answer.items() if isinstance(answer, dict) else enumerate(answer) if isinstance(answer, list | tuple) else ()
    )
    return next((found for name, part in parts if (found := _no_number(part, f"{place}.{name}"))), None)


def table(
    file: Path, frame: "pd.DataFrame", *, ours: Callable[[bytes, bytes], bool] | None = None, **form: Any
) -> Path:
    """Write a table as CSV without its index; `form` goes to `DataFrame.to_csv`; see `data`."""
    return text(file, frame.to_csv(None, index=False, lineterminator="\n", **form), ours=ours)


def folder(place: Path) -> Path:
    """Make a folder for files where it is missing; a link to one is fine, but not inside a study.

    Raises
    ------
    InputError : inside a study it is reached by a link
    """
    if _study_above(place) and not os.path.lexists(place / STUDY):
        refuse_link(place)
    place.mkdir(parents=True, exist_ok=True)
    return place


def remove(file: Path) -> None:
    """Take away what an earlier call wrote, where it is there; through no link, as nothing is written through one."""
    refuse_link(file)
    file.unlink(missing_ok=True)


@contextmanager
def appending(file: Path) -> Iterator[IO[str]]:
    """A text file open for more lines at its end; it is refused where `data` would be."""
    refuse_link(file)
    file.parent.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(file, os.O_WRONLY | os.O_APPEND | os.O_CREAT | NO_FOLLOW, 0o666)
    with open(descriptor, "a", newline="", encoding="utf-8") as stream:
        yield stream


def check(file: Path, content: bytes = b"", *, ours: Callable[[bytes, bytes], bool] | None = None) -> None:
    """Refuse a place that may not be written to; see `data`."""
    refuse_link(file)
    try:
        status = os.lstat(file)
    except FileNotFoundError:
        return
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{file}: is no regular file, nothing is written there; give another name")
    if _forced.get() or status.st_size == 0:
        return
    there = opening.content(file, MOST_RECOGNISED) if status.st_size <= MOST_RECOGNISED else None
    if there is None or (there != content and not (ours or _ours(file.suffix.lower()))(there, content)):
        raise InputError(
            f"{file}: is there already, and not as pellet-study writes it: give another name or move it away, or overwrite "
            "it with --force"
        )


def refuse_link(file: Path) -> None:
    """Refuse a place that is a link, or that inside a study is reached by one.

    Raises
    ------
    InputError : names the link and where it leads
    """
    place, study = Path(os.path.abspath(file)), _study_above(file)
    above = place.parents[: place.parents.index(study)] if study else ()
    for part in (place, *above):
        if part.is_symlink():
            raise InputError(
                f"{file}: {part.name} is a link to {os.readlink(part)}, and nothing is written through a link; remove the "
                "link, or give the place it leads to"
            )


def _study_above(file: Path) -> Path | None:
    """The study that a place lies in, as it was named: the nearest folder above that has a study.toml."""
    return next((above for above in Path(os.path.abspath(file)).parents if os.path.lexists(above / STUDY)), None)


def anything(there: bytes, content: bytes) -> bool:
    """Whatever is there may be replaced: its content was looked at by who writes it."""
    return True


def nothing(there: bytes, content: bytes) -> bool:
    """What is there is replaced only where it is the same."""
    return False


def is_answer(there: bytes, content: bytes = b"") -> bool:
    """Whether a file is an answer as `json` writes it."""
    try:
        found = json_of.loads(there)
        return isinstance(found, dict) and as_json(found).encode() == there
    except (ValueError, RecursionError):
        return False


def is_picture(there: bytes, content: bytes = b"") -> bool:
    """Whether a file is a PNG."""
    return there.startswith(PNG)


def is_figure(there: bytes, content: bytes = b"") -> bool:
    """Whether a PNG has the parts of our figures: a size, a density, the picture."""
    if not there.startswith(PNG):
        return False
    parts: list[tuple[bytes, bytes]] = []
    place = len(PNG)
    while place + 8 <= len(there) and len(parts) < 4:
        size = int.from_bytes(there[place : place + 4], "big")
        parts.append((there[place + 4 : place + 8], there[place + 8 : place + 8 + min(size, 16)]))
        place += 12 + size
    densities = tuple(2 * round(dpi / 0.0254).to_bytes(4, "big") for dpi in (SCREEN_DPI, JOURNAL_DPI))  # dots a metre
    return [name for name, _ in parts[:3]] == [b"IHDR", b"pHYs", b"IDAT"] and parts[1][1].startswith(densities)


def _same_columns(there: bytes, content: bytes) -> bool:
    """Whether two tables share most of their columns."""
    one, other = (set(text.split(b"\n", 1)[0].strip().split(b",")) for text in (there, content))
    return 2 * len(one & other) > min(len(one), len(other))


def _shares_lines(there: bytes, content: bytes, least: int) -> bool:
    """Whether two pages share a line that says something."""
    one, other = (
        {line.strip() for line in text.splitlines() if len(line.strip()) >= least} for text in (there, content)
    )
    return bool(one & other)


def _ours(suffix: str) -> Callable[[bytes, bytes], bool]:
    """How what an earlier call wrote is known, by the ending of its name."""
    by_ending = {".json": is_answer, ".png": is_figure, ".csv": _same_columns, ".xlsx": nothing}
    return by_ending.get(suffix, partial(_shares_lines, least=LEAST_LINE.get(suffix, 12)))


def _replace(file: Path, content: bytes) -> None:
    """Put the content into a new file beside it, with the mode of what is there, and rename that."""
    new = file.with_name(f".pellet-study-{secrets.token_hex(8)}.new")
    descriptor = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL | NO_FOLLOW | getattr(os, "O_BINARY", 0), 0o666)
    try:
        with open(descriptor, "wb") as stream:
            if file.exists():
                os.chmod(new, stat.S_IMODE(file.stat().st_mode))
            stream.write(content)
        os.replace(new, file)
    except BaseException:
        new.unlink(missing_ok=True)
        raise
