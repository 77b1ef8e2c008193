"""study.toml edited in place, the other lines as they are."""

import fcntl
import logging
import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.study.study import Setting

log = logging.getLogger(__name__)


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Hold a study while its study.toml and history are edited; a second command that edits them waits."""
    if not folder.is_dir():
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            log.info("waiting for another command that edits %s", folder)
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def write_effect(file: Path, name: str, values: Mapping[str, Setting]) -> None:
    """Put an effect into study.toml, the other lines as they are."""
    inner = ", ".join(f"{key} = {_toml(setting)}" for key, setting in values.items())
    lines = _without(file, name)
    entry = f"{name} = {{ {inner} }}"
    header = next((k for k, line in enumerate(lines) if re.match(r"\s*\[\s*effects\s*\]", line)), None)
    if header is None:
        first_sub = next((k for k, line in enumerate(lines) if re.match(r"\s*\[\s*effects\s*\.", line)), None)
        if first_sub is None:
            lines += ([""] if lines and lines[-1].strip() else []) + ["[effects]", entry]
        else:
            lines[first_sub:first_sub] = ["[effects]", entry, ""]
    else:
        lines.insert(header + 1, entry)
    _replace(file, lines, lambda present: name in present)


def erase_effect(file: Path, name: str) -> None:
    """Take an effect out of study.toml, the other lines as they are."""
    _replace(file, _without(file, name), lambda present: name not in present)


def _without(file: Path, name: str) -> list[str]:
    """The lines of study.toml less those that make an effect present."""
    kept, section, dropping = [], "", False
    for line in file.read_text(encoding="utf-8").splitlines():
        header = re.match(r"\s*\[\s*([^\]]+?)\s*\]", line)
        if header:
            section = header.group(1).replace(" ", "")
            dropping = section == f"effects.{name}"
        user_code = section == "effects" and re.match(rf"\s*{re.escape(name)}\s*[.=]", line)
        if not dropping and not user_code:
            kept.append(line)
    return kept


def _toml(setting: Setting) -> str:
    if not setting.free:
        return repr(float(setting.value))
    return f"{{ value = {float(f'{setting.value:.6g}')!r}, min = {setting.low!r}, max = {setting.high!r} }}"


def _replace(file: Path, lines: list[str], right: Callable[[dict], bool]) -> None:
    """Write study.toml anew, whole or not at all, after checking that it says what it should."""
    text = "\n".join(lines) + "\n"
    try:
        fine = right(tomllib.loads(text).get("effects", {}))
    except tomllib.TOMLDecodeError:
        fine = False
    if not fine:
        raise InputError(f"{file}: [effects] is written in a way that cannot be edited here; edit it by hand")
    temporary = file.with_suffix(".toml.new")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(file)
