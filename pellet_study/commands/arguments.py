"""What commands share: the study they are about, and how it is loaded."""

import argparse
from pathlib import Path

from pellet_study.output.terminal import say, warn
from pellet_study.study import Study, load


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


def say_assumed(study: Study) -> dict:
    """Print what an answer rests on that no file of the study says, and warn of unusual values; returns its JSON key."""
    from pellet_study.criticism.facts import assumed_words

    if words := assumed_words(study):
        say(f"assumed: {words} (defaults, as no file of the study gives them)\n")
    warn(study.remarks)
    return {"assumed": study.assumed}


def named(arguments: argparse.Namespace) -> str:
    """STUDY as the next command has to name it: with its library."""
    return f"{arguments.study}" + (f" --library {arguments.library}" if arguments.library else "")
