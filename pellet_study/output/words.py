"""Numbers, probabilities and names in words."""

import re
from collections.abc import Iterable
from difflib import SequenceMatcher, get_close_matches

# control characters but for the end of a line and the tabulator; marks of direction, of bytes, and ends of lines
ACTING = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff]")

UNIT = re.compile(r"\s*[(\[\uff08\u3010].*$")  # of a column: `time (min)`

HANDFUL = 6  # names that are listed of many


def number(value: float | str | None, digits: int = 4) -> str:
    """A number with so many significant digits, a word as it is, `-` where unknown."""
    return "-" if value is None else value if isinstance(value, str) else f"{value:.{digits}g}"


def probability(p: float | None) -> str:
    """p in words a reader can use."""
    return "-" if p is None else ("< 0.001" if p < 0.001 else f"{p:.3f}")


def width(texts: Iterable[str], least: int) -> int:
    """Letters of a column that begins a line: at least so many, and two more than its longest text."""
    return max([least, *(len(text) + 2 for text in texts)])


def flush(text: str, room: int) -> str:
    """A text flush right in so many letters, a blank before it however long it is."""
    return f" {text}".rjust(room)


def plain(text: str) -> str:
    """A text that a terminal or a page only shows, whatever stands in file names, notes and other programs' words.

    Control characters, escape sequences and marks that turn the direction of writing around are written as `\\x1b`.
    """
    return ACTING.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


def shown(text: str) -> str:
    """Foreign text as one plain line."""
    return plain(" ".join(text.split()))


def nearest(given: object, accepted: Iterable[str], most: int = HANDFUL) -> str:
    """`; accepted are b, a, c; did you mean b?` for an error message: what is near first, the others by the alphabet.

    Of more than `most` those that are most like what was given.
    """
    names = sorted(accepted)
    if not names:
        return "; there is none"
    near = _near(given, names, HANDFUL)
    by_likeness = sorted(names, key=lambda name: -SequenceMatcher(None, str(given), name).ratio())
    rest = by_likeness if len(names) > HANDFUL else names
    listed = list(dict.fromkeys([*near, *rest]))
    shown = listed if len(listed) <= most + 1 else listed[:most]
    more = f" and {len(listed) - len(shown)} more" if len(listed) > len(shown) else ""
    return f"; accepted are {', '.join(shown)}{more}{did_you_mean(given, names)}"


def did_you_mean(given: object, accepted: Iterable[str]) -> str:
    """`; did you mean b?` for an error message; empty where no name is near."""
    near = _near(given, accepted, 1)
    return f"; did you mean {near[0]!r}?" if near else ""


def _near(given: object, accepted: Iterable[str], most: int) -> list[str]:
    """The names that are like a text, the nearest first: small and capital letters alike, with or without their unit."""
    names: dict[str, str] = {}
    for name in accepted:
        for word in (name, UNIT.sub("", name)):
            names.setdefault(word.casefold(), name)
    near = get_close_matches(str(given).casefold(), list(names), n=2 * most)
    return list(dict.fromkeys(names[word] for word in near))[:most]
