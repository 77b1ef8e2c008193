"""A TOML file read within bounds: its size, and how deep its keys go."""

import re
import tomllib
from pathlib import Path
from typing import Any

from pellet_study.errors import InputError
from pellet_study.files import opening

LARGEST = 1_000_000  # bytes
DEEPEST = 8  # parts of a key, a.b.c; what a study or a paper says has 4
QUOTED = re.compile(r'"""(?:[^\\]|\\.)*?"""|\'\'\'.*?\'\'\'|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'|#[^\n]*', re.DOTALL)
DEEP = re.compile(rf"(?:(?:[\w-]+|\"\")[ \t]*\.[ \t]*){{{DEEPEST},}}")


def toml_in(file: Path, missing: str, invalid: str = "no valid TOML") -> dict[str, Any]:
    """What a TOML file says; `missing` tells what to do where there is none, `invalid` how one is called that is no TOML.

    Raises
    ------
    InputError : no such file, none that can be read, or no TOML
    """
    try:
        text = opening.text(file, LARGEST).replace("\r\n", "\n")
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
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{file}: {invalid}: {error}") from None
