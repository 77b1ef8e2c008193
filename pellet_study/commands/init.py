"""`pellet-study init`: a study folder to start from."""

import argparse
from importlib.resources import files
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.files import writing
from pellet_study.output.terminal import done, say

EPILOG = """\
The folder starts with the source paper's three bench readings; put your own in measurements.csv.

example:
  pellet-study init seeds && pellet-study bench seeds
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.epilog = EPILOG
    parser.add_argument("folder", metavar="FOLDER", type=Path, help="folder to make")


def run(arguments: argparse.Namespace) -> dict:
    """Copy the template; nothing that exists is overwritten."""
    folder = arguments.folder
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder} exists and is not an empty folder; give the name of a new one")
    try:
        writing.folder(folder)
        for name in ("study.toml", "measurements.csv"):
            text = files("pellet_study.study").joinpath("template", name).read_text(encoding="utf-8")
            writing.text(folder / name, text)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from None
    say(f"{folder} is a study: study.toml says what is fixed and free, measurements.csv what was measured.")
    done(folder, f"bench {folder}")
    return {"path": str(folder.resolve())}
