"""A TOML file read within bounds: its size, and how deep its keys go."""

import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pellet_study.errors import InputError
from pellet_study.files import opening

LARGEST = 1_000_000  # bytes
DEEPEST = 8  # parts of a key, a.b.c; what a study or a paper says has 4
QUOTED = re.compile(r'"""(?:[^\\]|\\.)*?"""|\'\'\'.*?\'\'\'|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'|#[^\n]*', re.DOTALL)
DEEP = re.compile(rf"(?:(?:[\w-]+|\"\")[ \t]*\.[ \t]*){{{DEEPEST},}}")


def toml_in(
    file: Path, missing: str, invalid: str = "no valid TOML", explain: Callable[[str], str | None] | None = None
) -> dict[str, Any]:
    """What a TOML file says; `missing` tells what to do where there is none, `invalid` how one is called that is no TOML, `explain`
    told the text of one that is none, may say why.

    Raises
    ------
    InputError : no such file, none that can be read, or no TOML
    """
    try:
        text = opening.text(file, LARGEST)
    except FileNotFoundError:
        raise InputError(f"{file}: no such file; {missing}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{file}: no UTF-8 text ({error.reason} at byte {error.start}); save it as UTF-8") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: cannot be read: {error}") from None
    deep = DEEP.search(QUOTED.sub('""', text))
    if deep:
        raise InputError(f"{file}: {invalid}: a key of more than {DEEPEST} parts, {deep[0][:40]}...")
    try:
        return tomllib.loads(text if "\n" in text else text.replace("\r", "\n"))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        known = explain(text) if explain else None
        raise InputError(f"{file}: {known or f'{invalid}: {error}'}") from None
