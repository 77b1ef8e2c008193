"""Names of factors and responses as figures can show them: folded where long, in words where no font has the letters."""

from collections.abc import Callable, Sequence

from pellet_study.output import fonts, style
from pellet_study.tables.headers import split_unit

LONG = 16
"""Letters of a name that still fits beside a point."""


def in_words(names: Sequence[str], response: str = "") -> dict[str, str]:
    """{name: what stands for it} of those that cannot be drawn: `factor 2 (min)`, `response (%)`."""
    found = {}
    for name, words in [*((name, f"factor {i}") for i, name in enumerate(names, 1)), (response, "response")]:
        if fonts.missing(name):
            unit = split_unit(name)[1]
            found[name] = f"{words} ({unit})" if unit and not fonts.missing(unit) else words
    return found


def drawable(names: Sequence[str], response: str = "") -> Callable[[str], str]:
    """A function that makes a text with these names drawable; letters that are left over become `?`."""
    instead = in_words(names, response)

    def of(text: str) -> str:
        for name in sorted(instead, key=len, reverse=True):
            text = text.replace(name, instead[name])
        return "".join("?" if fonts.missing(letter) else letter for letter in text)

    return of


def degraded(names: Sequence[str], *responses: str) -> list[str]:
    """One warning where names are replaced in the figures of some responses: what stands for which, and what to install."""
    instead = {name: words for response in responses or ("",) for name, words in in_words(names, response).items()}
    if not instead:
        return []
    words = ", ".join(f"{words} for {name}" for name, words in instead.items())
    return [
        f"no installed font has the letters of some names; the figures say {words}. Install a font that has them (on "
        "Debian fonts-noto-cjk or fonts-wqy-microhei) and draw again"
    ]


def letter(i: int) -> str:
    """What stands for the i-th of some long names: A, B, ..., Z, A1, B1, ..."""
    return chr(ord("A") + i % 26) + (str(i // 26) if i >= 26 else "")


def folded(text: str, width: int = 30) -> str:
    """A label in lines of so many letters, of which Chinese and its like count double."""
    return style.folded(text, width)
