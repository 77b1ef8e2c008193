"""The one way an input is opened: a regular file, at most so large; nothing waits for a pipe, nothing reads a device."""

import io
import json
import os
import stat
from pathlib import Path
from typing import Any

from pellet_study.errors import InputError

LARGEST = 200_000_000  # bytes of a table or a picture
LARGEST_ANSWER = 100_000_000  # bytes of JSON that a command wrote


def content(file: Path, most: int = LARGEST, *, what: str = "a file") -> bytes:
    """The bytes of a regular file.

    Raises
    ------
    FileNotFoundError, OSError : as `open` does
    InputError : it is a folder, a pipe or a device, or larger than `most` bytes
    """
    descriptor = os.open(file, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with open(descriptor, "rb") as stream:
        check(file, os.fstat(descriptor), most, what)
        found = stream.read(most + 1)
    if len(found) > most:
        raise InputError(f"{file}: grew beyond {most} bytes while it was read; expected {what} of at most {most} bytes")
    return found


def check(file: Path, status: os.stat_result, most: int = LARGEST, what: str = "a file") -> None:
    """Refuse what is no regular file, or larger than `most` bytes.

    Raises
    ------
    InputError : it is
    """
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{file}: expected {what}, found {_kind(status.st_mode)}; give a regular file")
    if status.st_size > most:
        raise InputError(f"{file}: has {status.st_size} bytes; expected {what} of at most {most} bytes")


def refuse(file: Path, most: int = LARGEST, what: str = "a file") -> None:
    """Refuse a file before another library opens it by its name.

    Raises
    ------
    FileNotFoundError, OSError : as `stat` does
    InputError : it is a folder, a pipe or a device, or larger than `most` bytes
    """
    check(file, os.stat(file), most, what)


def text(file: Path, most: int = LARGEST, *, what: str = "a text file", encoding: str = "utf-8-sig") -> str:
    """The text of a regular file, line ends as they are; UnicodeDecodeError (a ValueError) where it is none."""
    return content(file, most, what=what).decode(encoding)


def stream(file: Path, most: int = LARGEST) -> io.BytesIO:
    """The bytes of a regular file as a stream, for libraries that read one; see `content`."""
    return io.BytesIO(content(file, most))


def json_in(file: Path, most: int = LARGEST_ANSWER) -> Any:
    """What a JSON file says; ValueError where it is damaged, too deep, or holds a number that is none."""
    try:
        return json.loads(text(file, most, what="a JSON file"), parse_constant=_no_number)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def fill_streams() -> None:
    """Open what is closed of descriptors 0 to 2 on nothing, so that no file takes the place of a stream of a program."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest that is free


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is no number")


def _kind(mode: int) -> str:
    kinds = ((stat.S_ISDIR, "a folder"), (stat.S_ISFIFO, "a pipe"), (stat.S_ISSOCK, "a socket"))
    return next((word for is_one, word in kinds if is_one(mode)), "a device")
