"""study.toml edited in place, the other lines as they are."""

import logging
import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.files import locking, opening, writing
from pellet_study.files.toml import LARGEST
from pellet_study.study.study import Setting

log = logging.getLogger(__name__)
BOM = "\ufeff"


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Hold a study while its study.toml and history are edited; a second command that edits them waits."""
    if not folder.is_dir():
        yield
        return
    if not locking.available():
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        locking.hold(descriptor, folder, lambda: log.info("waiting for another command that edits %s", folder))
        yield
    finally:
        os.close(descriptor)


def write_effect(file: Path, name: str, values: Mapping[str, Setting]) -> None:
    """Put an effect into study.toml, the other lines as they are."""
    inner = ", ".join(f"{key} = {_toml(setting)}" for key, setting in values.items())
    bom, lines, end = _lines(file)
    lines = _without(lines, name)
    entry = f"{name} = {{ {inner} }}{end}"
    header = next((k for k, line in enumerate(lines) if re.match(r"\s*\[\s*effects\s*\]", line)), None)
    if header is None:
        first_sub = next((k for k, line in enumerate(lines) if re.match(r"\s*\[\s*effects\s*\.", line)), None)
        if first_sub is None:
            lines += ([end] if lines and lines[-1].strip() else []) + [f"[effects]{end}", entry]
        else:
            lines[first_sub:first_sub] = [f"[effects]{end}", entry, end]
    else:
        lines.insert(header + 1, entry)
    _replace(file, bom + "".join(lines), lambda present: name in present)


def erase_effect(file: Path, name: str) -> None:
    """Take an effect out of study.toml, the other lines as they are."""
    bom, lines, _ = _lines(file)
    _replace(file, bom + "".join(_without(lines, name)), lambda present: name not in present)


def _lines(file: Path) -> tuple[str, list[str], str]:
    """A byte order mark where there is one, the lines of study.toml with their ends, and how most of them end."""
    text = opening.text(file, LARGEST, encoding="utf-8")
    bom = BOM if text.startswith(BOM) else ""
    lines = re.findall(r"[^\n]*\n|[^\n]+", text[len(bom) :])
    end = "\r\n" if 2 * sum(line.endswith("\r\n") for line in lines) > len(lines) else "\n"
    if lines and not lines[-1].endswith("\n"):
        lines[-1] += end
    return bom, lines, end


def _without(lines: list[str], name: str) -> list[str]:
    """The lines of study.toml less those that make an effect present."""
    kept, section, dropping = [], "", False
    for line in lines:
        header = re.match(r"\s*\[\s*([^\]]+?)\s*\]", line)
        if header:
            section = header.group(1).replace(" ", "")
            dropping = section == f"effects.{name}"
        of_effect = section == "effects" and re.match(rf"\s*{re.escape(name)}\s*[.=]", line)
        if not dropping and not of_effect:
            kept.append(line)
    return kept


def _toml(setting: Setting) -> str:
    if not setting.free:
        return repr(float(setting.value))
    return f"{{ value = {float(f'{setting.value:.6g}')!r}, min = {setting.low!r}, max = {setting.high!r} }}"


def _replace(file: Path, text: str, right: Callable[[dict], bool]) -> None:
    """Write study.toml anew, whole or not at all, after checking that it says what it should.

    Where it is a link, the file in the study that it leads to is written.
    """
    try:
        fine = right(tomllib.loads(text.removeprefix(BOM)).get("effects", {}))
    except tomllib.TOMLDecodeError:
        fine = False
    if not fine:
        raise InputError(f"{file}: [effects] is written in a way that cannot be edited here; edit it by hand")
    target = file
    if file.is_symlink():
        target, study = file.resolve(), file.parent.resolve()
        if not target.is_relative_to(study):
            raise InputError(
                f"{file}: is a link to {target}, outside the study, which is not edited; copy that file here, or edit it by hand"
            )
    writing.text(target, text, ours=writing.anything)
