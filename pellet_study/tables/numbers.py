"""A cell as a number: signs, digits and blanks as spreadsheets, statistics programs and word processors write them."""

import math
import re

SIGNS = str.maketrans(
    {
        **dict.fromkeys("\u2212\u2013\u2010\u2011\ufe63\uff0d", "-"),  # minus, en dash, hyphens, full width
        **dict.fromkeys("\ufe62\uff0b", "+"),
        **dict.fromkeys("\u00a0\u202f\u2009'\u2019", ""),  # what groups thousands: thin spaces, Swiss apostrophes
        "\uff0e": ".",
        "\uff0c": ",",
    }
)
THOUSANDS = {".": re.compile(r"[-+]?\d{1,3}(,\d{3})+(\.\d*)?"), ",": re.compile(r"[-+]?\d{1,3}(\.\d{3})+,\d+")}
BLANKS = frozenset({"", "*", "/", "-", "--", "\u2013", "\u2014", "\u2212", "?", ".", "na", "n/a", "#n/a", "#na", "#nv"})
"""Cells that say only that there is nothing, in lower case."""

LEAST, MOST = 1e-60, 1e60
SIZES = f"0 or a size from {LEAST:g} to {MOST:g}"
"""Which numbers are accepted: physical quantities lie far inside, and their powers do not run over."""

MISSING = BLANKS | {
    *("nan", "null", "none", "failed", "missing", "lost", "\u65e0", "\u7f3a\u5931", "\u5931\u8d25"),
    *("#value!", "#wert!", "#div/0!", "#ref!", "#bezug!", "#num!", "#zahl!", "#name?", "#null!", "#n/d"),
}
"""Cells that say that a run has no response, in lower case."""


def number(text: str, decimal: str = ".") -> float:
    """The number in a cell, written with this decimal sign.

    Raises
    ------
    ValueError : it is none, or one with the other decimal sign
    """
    if decimal == "." and "_" not in text:
        try:
            return float(text)
        except ValueError:
            pass
    plain = text.strip().translate(SIGNS)
    if THOUSANDS[decimal].fullmatch(plain):
        plain = plain.replace("," if decimal == "." else ".", "")
    if "_" in plain or (decimal == "," and "." in plain):
        raise ValueError(f"no number with a decimal {'comma' if decimal == ',' else 'point'}: {text!r}")
    return float(plain.replace(",", ".") if decimal == "," else plain)


def fits(value: float) -> bool:
    """Whether a number is 0, or of a size whose squares and their products are numbers still."""
    return value == 0 or LEAST <= abs(value) <= MOST


def number_given(text: str) -> float:
    """A number of a command's option: finite, of a size that can be reckoned with, with a decimal point.

    Raises
    ------
    ValueError : says what was given and what is expected
    """
    try:
        value = number(text)
    except ValueError:
        hint = "; write a decimal point, not a comma" if "," in text else ""
        raise ValueError(f"expected a number, got {text[:60]!r}{hint}") from None
    if not math.isfinite(value) or not fits(value):
        raise ValueError(f"expected {SIZES}, got {text[:60]!r}")
    return value


def is_number(text: str, decimal: str = ".") -> bool:
    """Whether a cell holds a finite number."""
    try:
        return abs(number(text, decimal)) < float("inf")
    except ValueError:
        return False
