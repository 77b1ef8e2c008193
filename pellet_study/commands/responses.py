"""Several responses in one table: which columns they are, and what is said of each, as `NAME=...` or bare where there is one."""

import argparse
from collections.abc import Callable, Iterable, Mapping
from typing import TypeVar

from pellet_study.errors import InputError
from pellet_study.output.words import nearest
from pellet_study.tables.headers import found_in
from pellet_study.tables.numbers import number_given

TOLD = ("target", "uncertainty", "maximise", "minimise", "limits", "weight", "importance", "transform", "unit", "declare_margin",
        "verify")  # fmt: skip
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


Answer = TypeVar("Answer")


def each_able(names: Iterable[str], answer: Callable[[str], Answer]) -> tuple[dict[str, Answer], dict[str, str]]:
    """{response: its answer} of those that have one, and {response: why not} of the others.

    Raises
    ------
    InputError
        If none has: each with its reason, or the one reason of all.
    """
    found, failed = {}, {}
    for name in names:
        try:
            found[name] = answer(name)
        except InputError as error:
            failed[name] = str(error)
    if not found:
        alike = len(set(failed.values())) == 1
        raise InputError(next(iter(failed.values())) if alike else _reasons(failed))
    return found, failed


def _reasons(failed: Mapping[str, str]) -> str:
    return "; ".join(f"{name} is not analysed: {reason}" for name, reason in failed.items())


def not_analysed(failed: Mapping[str, str]) -> list[str]:
    """One warning for each response that has no answer."""
    return [_reasons({name: reason}) for name, reason in failed.items()]


def read_tables(
    arguments: argparse.Namespace, factors, max_levels: int, ignore=None, blocks=None
) -> tuple[dict, dict[str, str]]:
    """{response: DesignTable}: the table read once for each response asked for, the others' columns left out; {response: why not}.

    Raises
    ------
    InputError
        If a response is named twice or none can be read, see `design_table.read_design`.
    """
    from pellet_study.doe.design_table import read_design

    others = {name or "": other for name, other in others_of(arguments)}

    def read(name: str):
        left = [*(arguments.ignore if ignore is None else ignore), *others[name]]
        grouped = arguments.block if blocks is None else blocks
        return read_design(arguments.table, factors, max_levels, left, grouped, name or None)

    found, failed = each_able(others, read)
    return {str(table.response.name): table for table in found.values()}, failed


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
    of_all = False
    for word in _words(arguments, option) or []:
        name, value = _parted(option, word, names)
        if name is None and option == "transform" and not value:
            of_all = True
            continue
        if name is None and len(names) > 1:
            raise InputError(
                f"--{option} {word}: {len(names)} responses are analysed; say which, as in {names[0]}={word or '...'}"
            )
        name = names[0] if name is None else name
        if name in found:
            raise InputError(f"--{option} was given twice for {name!r}: expected it once")
        found[name] = value
    return {**dict.fromkeys(names, ""), **found} if of_all else found


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
        raise InputError(f"--{option} {text}: expected a number with a decimal point, such as 41.7")
    return value


def figure_prefixes(names: Iterable[str]) -> dict[str, str]:
    """{response: what the names of its figures begin with}: nothing where there is one response, each its own where not."""
    names, found, taken = list(names), {}, set()
    for name in names if len(names) > 1 else ():
        plain = "".join(sign if sign.isalnum() else "_" for sign in name).strip("_") or "response"
        count = 1
        while (prefix := f"{plain}_{count}_" if count > 1 else f"{plain}_").lower() in taken:
            count += 1  # `a/b` and `a.b` are one to a file system, and so are `A` and `a` to some
        taken.add(prefix.lower())
        found[name] = prefix
    return found or dict.fromkeys(names, "")


def heading(name: str, names) -> list[str]:
    """What stands above the answer of one of several responses."""
    return [f"---- {name} ----"] if len(names) > 1 else []


def warnings_of(each: dict[str, list[str]]) -> list[str]:
    """All warnings, those of one of several responses under its name, those of all of them once."""
    of_all = [warning for warning in next(iter(each.values())) if all(warning in found for found in each.values())]
    if len(each) == 1:
        return of_all
    return of_all + [f"{name}: {w}" for name, found in each.items() for w in found if w not in of_all]
