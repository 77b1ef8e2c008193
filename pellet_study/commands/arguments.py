"""What commands share: the study they are about, and how it is loaded."""

import argparse
from collections.abc import Callable, Collection
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

from pellet_study.errors import InputError
from pellet_study.output import style
from pellet_study.output.terminal import say, warn
from pellet_study.study import Study, load

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def add_study(parser: argparse.ArgumentParser) -> None:
    """STUDY, a folder, and a library beside it."""
    parser.add_argument("study", metavar="STUDY", type=Path, help="folder with study.toml and measurements.csv")
    parser.add_argument(
        "--library",
        metavar="DIR",
        type=Path,
        help="folder with effects/ and rigs/ that several studies share; what is in it is run as code",
    )


def study_of(arguments: argparse.Namespace) -> Study:
    """The study that the arguments name.

    Raises
    ------
    InputError : anything in it, or in the library, cannot be used
    """
    return load(arguments.study, arguments.library)


def say_assumed(study: Study, varied: Collection[str] = ()) -> dict:
    """Print what an answer rests on that no file of the study says, and warn of unusual values; returns its JSON key.

    `varied` are parameters that the command varies over a range of its own.
    """
    from pellet_study.criticism.facts import assumed_words

    if words := assumed_words(study, varied):
        say(f"assumed: {words} (defaults, as no file of the study gives them)\n")
    warn(study.remarks)
    return {"assumed": study.assumed_without(varied)}


def named(arguments: argparse.Namespace) -> str:
    """STUDY as the next command has to name it: with its library."""
    return f"{arguments.study}" + (f" --library {arguments.library}" if arguments.library else "")


def add_figures(parser: argparse.ArgumentParser) -> None:
    """Figures of a study, into its folder or another, and their look."""
    parser.add_argument(
        "--figures",
        metavar="DIR",
        type=Path,
        nargs="?",
        const=Path(),
        help="draw the figures, into DIR (STUDY/figures)",
    )
    add_look(parser)


def add_look(parser: argparse.ArgumentParser) -> None:
    """Format and width of the figures."""
    parser.add_argument("--format", choices=style.FORMATS, help="of the figures (png)")
    parser.add_argument(
        "--width", metavar="MM", type=_width_mm,
        help="of the figures, for a journal's column in its letters: single (85 mm), double (175 mm) or a number of mm",
    )  # fmt: skip


def _width_mm(text: str) -> float:
    """A width in mm, or that of a column by its name."""
    try:
        return style.COLUMNS[text] if text in style.COLUMNS else float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected single, double or a number of mm, such as 85") from None


def look_of(arguments: argparse.Namespace) -> AbstractContextManager[None]:
    """Within it figures are made and saved as the arguments say.

    Raises
    ------
    InputError : no page has the width asked for
    """
    return style.column(arguments.width, arguments.format)


def check_look(arguments: argparse.Namespace) -> None:
    """A format and a width are of figures that are asked for, and a page has that width.

    Raises
    ------
    InputError : they are not, or none has
    """
    if arguments.figures is None and (arguments.format is not None or arguments.width is not None):
        raise InputError("--format and --width are of figures: give --figures too")
    with look_of(arguments):
        pass


def write_figures(arguments: argparse.Namespace, draw: Callable[[], "dict[str, Figure]"]) -> list[Path]:
    """Draw the figures where they are asked for, {name: figure}, and write them as asked; returns their paths.

    Raises
    ------
    InputError : no page has the width asked for, or the place cannot be written to
    """
    if arguments.figures is None:
        return []
    folder = arguments.figures if arguments.figures != Path() else arguments.study / "figures"
    with look_of(arguments):
        drawn = draw()
        try:
            return style.save_all(drawn, folder)
        except OSError as error:
            raise InputError(
                f"cannot write {folder}: {error.strerror or error}; give a place that can be written to"
            ) from None
