"""Keys within keys: `rows[].sd` is of each entry, `joint.responses{}.goal` of each value under a name of the reader's own."""

import re
from collections.abc import Iterator, Mapping

OTHER = re.compile(r"keys of `([\w ]+)`")


def within(key: str, meanings: Mapping[str, str]) -> dict[str, str]:
    """Keys inside of another."""
    return {f"{key}.{name}": meaning for name, meaning in meanings.items()}


def paths(value: object, meanings: Mapping[str, str], at: str = "") -> Iterator[str]:
    """Every key of an answer, except names of the reader's own and what its meaning tells in words.

    A meaning with braces, `{factor: level}`, says that the keys are names; one with a key in backticks, or with another answer's
    keys, tells what is inside by itself.
    """
    if isinstance(value, list):
        for item in value:
            yield from paths(item, meanings, f"{at}[]")
        return
    told = meanings.get(at.removesuffix("[]"), "")
    below = any(name.startswith((f"{at}.", f"{at}{{}}")) for name in meanings) if at else True
    if not isinstance(value, dict) or (not below and ("`" in told or OTHER.search(told))):
        return
    for name, item in value.items():
        if "{" in told:
            yield from paths(item, meanings, f"{at}{{}}") if below else ()
        else:
            path = f"{at}.{name}" if at else name
            yield path
            yield from paths(item, meanings, path)
