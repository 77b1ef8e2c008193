"""A printed number beside its recomputed one, and the rule that judges them.

reproduced: equal at the printed digits. reproduced to rounding: inside what the rounding of the printed
inputs allows. consistent: no test fails, but there is no number to compare with. inconsistent: it cannot be
so. data missing: the text does not give the data. not recomputable: the paper prints a derived number only.
"""

import math
import re
from dataclasses import asdict, dataclass

REPRODUCED = "reproduced"
TO_ROUNDING = "reproduced to rounding"
CONSISTENT = "consistent"
INCONSISTENT = "inconsistent"
DATA_MISSING = "data missing"
NOT_RECOMPUTABLE = "not recomputable"
VERDICTS = (REPRODUCED, TO_ROUNDING, CONSISTENT, INCONSISTENT, DATA_MISSING, NOT_RECOMPUTABLE)

LEVEL = 0.05
"""Level of every test of the audit."""


@dataclass(frozen=True)
class Item:
    """One line of the audit; `published` is the text printed, `reason` says what the recomputation found."""

    section: str
    item: str
    published: str
    recomputed: float | str | None
    difference: float | None
    verdict: str
    reason: str = ""

    def as_dict(self) -> dict:
        return asdict(self)


NUMBER = re.compile(r"[-+\u2212]?(\d+(?P<decimals>\.\d*)?|(?P<bare>\.\d+))([eE](?P<power>[-+]?\d+))?")


def _plain(printed: str) -> str:
    """A printed cell without its significance stars."""
    return printed.strip().rstrip("*").strip()


def printed_number(printed: str) -> float | None:
    """The number in a printed cell, its significance stars off; None for `<0.0001` and words."""
    text = _plain(printed)
    return float(text.replace("\u2212", "-")) if NUMBER.fullmatch(text) else None


def is_printed(text: str) -> bool:
    """Whether a text is a number as papers print it, or an upper bound such as `<0.0001`."""
    number = printed_number(text.strip().removeprefix("<"))
    return number is not None and math.isfinite(number)


def half_last_digit(printed: str) -> float:
    """Half a unit of the last printed digit: how far the true number may lie from the printed one."""
    found = NUMBER.search(printed)
    if found is None:
        return 0.5
    decimals = len(found["decimals"] or found["bare"] or ".") - 1
    return 0.5 * 10.0 ** (int(found["power"] or 0) - decimals)


def equal_as_printed(printed: str, value: float) -> bool:
    """Whether a number rounds to the printed one (`<0.0001`: lies below)."""
    if printed.strip().startswith("<"):
        return value < printed_number(printed.strip().lstrip("<"))
    return abs(value - printed_number(printed)) <= half_last_digit(printed) * (1 + 1e-6)


def compare(section, item, printed, value, reason="", span=None) -> Item:
    """The judgement of a number.

    Parameters
    ----------
    printed : str
        As in the paper.
    value : float
        Recomputed.
    span : (float, float), optional
        What `value` can be while the printed inputs move within their last digit.
    """
    number = printed_number(printed)
    half = half_last_digit(printed)
    if equal_as_printed(printed, value):
        verdict = REPRODUCED
    elif span is not None and number is not None and span[0] - half <= number <= span[1] + half:
        verdict = TO_ROUNDING
    else:
        verdict = INCONSISTENT
    return Item(section, item, printed, value, None if number is None else value - number, verdict, reason)


def judged(section, item, published, recomputed, is_consistent, reason, difference=None) -> Item:
    """A claim that a test or a count decides: consistent or inconsistent."""
    verdict = CONSISTENT if is_consistent else INCONSISTENT
    return Item(section, item, published, recomputed, difference, verdict, reason)


def counts(items: list[Item]) -> dict[str, int]:
    """{verdict: how many}."""
    found = [item.verdict for item in items]
    return {verdict: found.count(verdict) for verdict in sorted(set(found))}
