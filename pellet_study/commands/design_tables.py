"""What `pb` and `bbd` share: the table of a design, its arguments, what is left out, where it is written."""

import argparse
import sys
from contextlib import contextmanager
from pathlib import Path

from pellet_study.errors import InputError


def add_table_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments that `pb` and `bbd` share."""
    parser.add_argument("table", metavar="TABLE.csv", type=Path, nargs="?", help="the design that was run")
    parser.add_argument(
        "--factor", metavar="NAME=LOW,HIGH[,UNIT]", action="append", default=[],
        help="physical values of -1 and +1 (LOW may be the larger); default: the column's least and greatest",
    )  # fmt: skip
    parser.add_argument("--ignore", metavar="NAME", action="append", default=[], help="a column that is no factor")
    parser.add_argument(
        "--block", metavar="NAME", action="append", default=[],
        help="a column that says in which block (day, batch) a run was made: fitted beside the factors",
    )  # fmt: skip
    parser.add_argument("--alpha", type=float, default=0.05, help="significance level (0.05)")
    parser.add_argument("--unit", default="", help="unit of the response, for the figures")
    parser.add_argument("--figures", metavar="DIR", type=Path, help="write the figures there (PNG)")


def kept(arguments: argparse.Namespace) -> str:
    """Where an analysis went."""
    places = [str(place) for place in (arguments.figures, arguments.json) if place]
    return ", ".join(places) or "above (--json FILE and --figures DIR keep them)"


def check_arguments(arguments: argparse.Namespace) -> None:
    """Refuse what argparse cannot.

    Raises
    ------
    InputError
        If there is neither a table nor a design to make, or alpha is no level.
    """
    if (arguments.table is None) == (arguments.design is None):
        raise InputError("expected a table to analyse (TABLE.csv) or a design to make (--design), one of the two")
    if not 0 < arguments.alpha < 1:
        raise InputError(f"--alpha {arguments.alpha:g}: expected a level between 0 and 1, such as 0.05")


def warn(messages: list[str]) -> None:
    """Warnings go to the error stream, below the answer."""
    for message in messages:
        print(f"pellet-study: warning: {message}", file=sys.stderr)


@contextmanager
def writing(path: Path):
    """Turn a failure to write into an error that names the place.

    Raises
    ------
    InputError
        If the place cannot be written to.
    """
    try:
        yield
    except OSError as error:
        raise InputError(
            f"cannot write {path}: {error.strerror or error}; give a place that can be written to"
        ) from None


def write_design(frame, path: Path | None, force: bool = False) -> dict:
    """Print a design or write it as a table whose response is to be filled in.

    Raises
    ------
    InputError
        If there is a file already and it is not forced, or the place cannot be written to.
    """
    frame = frame.assign(response="")
    if path is None:
        print(frame.to_csv(index=False), end="")
    else:
        if path.exists() and not force:
            raise InputError(
                f"{path} exists, and runs may have been filled in: give another name, or overwrite it with --force"
            )
        with writing(path):
            frame.to_csv(path, index=False)
        print(f"{len(frame)} runs written to {path}; run them in random order, fill in the last column")
    return {"runs": len(frame), "design": frame.drop(columns="response").to_dict(orient="records")}
