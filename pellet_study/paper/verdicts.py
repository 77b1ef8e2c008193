"""A printed number beside its recomputed one, and the rule that judges them.

reproduced: equal at the printed digits. reproduced to rounding: inside what the rounding of the printed
inputs allows. consistent: no test fails, but there is no number to compare with. inconsistent: it cannot be
so. data missing: the text does not give the data. not recomputable: the paper prints a derived number only.
"""

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


def printed_number(printed: str) -> float | None:
    """The number in a printed cell, its significance stars off; None for `<0.0001` and words."""
    text = printed.strip().rstrip("*")
    return float(text) if re.fullmatch(r"[-+]?\d+(\.\d+)?", text) else None


def half_last_digit(printed: str) -> float:
    """Half a unit of the last printed digit: how far the true number may lie from the printed one."""
    decimals = re.search(r"\.(\d+)", printed)
    return 0.5 * 10.0 ** -(len(decimals.group(1)) if decimals else 0)


def equal_as_printed(printed: str, value: float) -> bool:
    """Whether a number rounds to the printed one (`<0.0001`: lies below)."""
    if printed.startswith("<"):
        return value < float(printed.lstrip("<").rstrip("*"))
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
    if equal_as_printed(printed, value):
        verdict = REPRODUCED
    elif span is not None and number is not None and span[0] <= number <= span[1]:
        verdict = TO_ROUNDING
    else:
        verdict = INCONSISTENT
    return Item(section, item, printed, value, None if number is None else value - number, verdict, reason)


def judged(section, item, published, recomputed, is_consistent, reason, difference=None) -> Item:
    """A claim that a test or a count decides: consistent or inconsistent."""
    verdict = CONSISTENT if is_consistent else INCONSISTENT
    return Item(section, item, published, recomputed, difference, verdict, reason)
