"""Several responses in one table: which columns they are, and what is said of each, as `NAME=...` or bare where there is one."""

import argparse

from pellet_study.errors import InputError
from pellet_study.output.words import nearest
from pellet_study.tables.headers import found_in
from pellet_study.tables.numbers import number_given

TOLD = ("target", "uncertainty", "maximise", "minimise", "limits", "weight", "importance", "transform", "unit")
"""Options given once for each response."""

ALONE = ("maximise", "minimise", "transform")
"""Those that may be given without a value: then they hold the empty text."""


def add_response_argument(parser: argparse.ArgumentParser) -> None:
    """The argument that `pb` and `bbd` share."""
    parser.add_argument(
        "--response", metavar="NAME", nargs="+", action="extend", default=[],
        help="columns that are responses, each analysed (default: the last column); after TABLE.csv. Of a new design: the "
        "columns to fill in (default: response)",
    )  # fmt: skip


def read_tables(arguments: argparse.Namespace, factors, max_levels: int, ignore=None) -> dict:
    """{response: DesignTable}: the table read once for each response asked for, the others' columns left out.

    Raises
    ------
    InputError
        If a response is named twice, and see `design_table.read_design`.
    """
    from pellet_study.doe.design_table import read_design

    found = {}
    for name, others in others_of(arguments):
        left = [*(arguments.ignore if ignore is None else ignore), *others]
        table = read_design(arguments.table, factors, max_levels, left, arguments.block, name)
        found[str(table.response.name)] = table
    return found


def response_columns(arguments: argparse.Namespace) -> tuple[str, ...]:
    """The columns of a new design that are to be filled in."""
    return tuple(arguments.response) or ("response",)


def others_of(arguments: argparse.Namespace) -> list[tuple[str | None, list[str]]]:
    """Each response that was asked for with the names of the others; (None, []) where none was, for the last column."""
    names = arguments.response
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"--response {name} came twice: expected each response once")
    return [(name, [other for other in names if other != name]) for name in names] or [(None, [])]


def each_response(arguments: argparse.Namespace, names: list[str]) -> dict[str, argparse.Namespace]:
    """{response: the arguments with its own values in `TOLD`}: a text, or None where nothing was said.

    Raises
    ------
    InputError
        If an option names no response that is analysed, none where there are several, or one twice.
    """
    told = {option: _told(arguments, option, names) for option in TOLD if isinstance(_words(arguments, option), list)}
    found = {}
    for name in names:
        own = argparse.Namespace(**vars(arguments))
        for option, values in told.items():
            setattr(own, option, values.get(name))
        own.unit = own.unit or ""
        found[name] = own
    return found


def _words(arguments: argparse.Namespace, option: str) -> list[str] | None:
    return getattr(arguments, option, None)


def _told(arguments: argparse.Namespace, option: str, names: list[str]) -> dict[str, str]:
    """{response: text} of one option; a text without a name belongs to the only response."""
    found: dict[str, str] = {}
    for word in _words(arguments, option) or []:
        name, value = _parted(option, word, names)
        if name is None and option == "transform" and not value:
            found |= {other: "" for other in names if other not in found}  # all of them
            continue
        if name is None and len(names) > 1:
            raise InputError(
                f"--{option} {word}: {len(names)} responses are analysed; say which, as in {names[0]}={word or '...'}"
            )
        name = names[0] if name is None else name
        if name in found:
            raise InputError(f"--{option} was given twice for {name!r}: expected it once")
        found[name] = value
    return found


def _parted(option: str, word: str, names: list[str]) -> tuple[str | None, str]:
    """The response named and the value given; None where none was named."""
    if option in ALONE and (known := found_in(word, names)):
        return known, ""
    name, sign, value = word.rpartition("=")
    if not sign:
        return None, word
    known = found_in(name, names)
    if known is None:
        raise InputError(f"--{option} {word}: {name!r} is no response analysed{nearest(name, names)}")
    return known, value


def number_or_none(text: str) -> float | None:
    """The number that a text is."""
    try:
        return number_given(text)
    except ValueError:
        return None


def one_number(option: str, text: str | None) -> float | None:
    """The number given to an option, None where it was not given.

    Raises
    ------
    InputError
        If it is no number.
    """
    if text is None:
        return None
    value = number_or_none(text)
    if value is None:
        raise InputError(f"--{option} {text}: expected a number")
    return value


def figure_prefix(name: str, names) -> str:
    """What the names of a response's figures begin with: nothing where there is one response."""
    if len(names) == 1:
        return ""
    return ("".join(sign if sign.isalnum() else "_" for sign in name).strip("_") or "response") + "_"


def heading(name: str, names) -> list[str]:
    """What stands above the answer of one of several responses."""
    return [f"---- {name} ----"] if len(names) > 1 else []


def warnings_of(each: dict[str, list[str]]) -> list[str]:
    """All warnings, those of one of several responses under its name, those of all of them once."""
    of_all = [warning for warning in next(iter(each.values())) if all(warning in found for found in each.values())]
    if len(each) == 1:
        return of_all
    return of_all + [f"{name}: {w}" for name, found in each.items() for w in found if w not in of_all]
