"""Files that look like a rig or an effect but lie where none is looked for: named, as an answer without them is another."""

import os
import re
from collections.abc import Iterator
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.files import opening
from pellet_study.rigs.catalogue import declares

PLACES = {"RIG": "rigs", "EFFECT": "effects"}
LOOKS_LIKE = re.compile(r"^(rig|effect)\s*(:[^=\n]*)?=\s*(\{|dict\b)", re.MULTILINE | re.IGNORECASE)
DEPTH = 2  # folders below a study that are looked into
LARGEST = 1_000_000  # bytes of a file that is read


def refuse_misplaced(folder: Path) -> None:
    """Refuse a file of a study, or of a library, that looks like a rig or an effect and would not be loaded.

    Raises
    ------
    InputError : names the file, and where it has to lie
    """
    for file in _files(folder):
        text = opening.content(file).decode(errors="replace")
        found = LOOKS_LIKE.search(text)
        own_place = file.parent == folder / file.parent.name and file.parent.name in PLACES.values()
        if found is None:
            if own_place and file.suffix == ".py" and not file.name.startswith("_"):
                what = next(what for what, place in PLACES.items() if place == file.parent.name)
                raise InputError(
                    f"{file}: declares no {what}, so that it would do nothing; a file in {file.parent.name}/ has "
                    f"`{what} = {{...}}` at the beginning of a line; begin its name with _ if it is none"
                )
            continue
        what = found[1].upper()
        place = folder / PLACES[what] / f"{file.name.split('.')[0]}.py"
        if file != place:
            raise InputError(
                f"{file}: looks like {_an(what)}, but is not looked for there; move it to {place}, or call it "
                f"{file.name}.off if it is not meant"
            )
        if not declares(text, what):
            raise InputError(
                f"{file}: looks like {_an(what)}, but {what} in capitals at the beginning of a line declares one; "
                f"write `{what} = {{...}}` there"
            )


def _an(what: str) -> str:
    return f"{'an' if what == 'EFFECT' else 'a'} {what.lower()}"


def _files(folder: Path) -> Iterator[Path]:
    """Files of a folder that may be Python, also those saved as text; not of other studies, of caches or behind links."""
    for found, folders, names in os.walk(folder):
        below = Path(found)
        deep = len(below.relative_to(folder).parts) >= DEPTH
        folders[:] = [] if deep else sorted(name for name in folders if _entered(below / name))
        for name in sorted(names):
            file = below / name
            ending = file.suffix.lower()
            text_of_code = name.lower().endswith(".py.txt") or (
                ending in ("", ".txt") and file.parent.name in PLACES.values()
            )
            if ending == ".py" or text_of_code:
                if file.is_file() and not file.is_symlink() and file.stat().st_size < LARGEST:
                    yield file


def _entered(folder: Path) -> bool:
    return not folder.name.startswith((".", "__")) and not (folder / "study.toml").exists()
