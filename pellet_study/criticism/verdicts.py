"""The words an answer may give, as enumerations whose values stand in the JSON."""

from enum import StrEnum


class Verdict(StrEnum):
    """Is an effect missing?"""

    ADEQUATE = "adequate"  # the present model explains the data
    MISSING = "missing"  # one explanation stands out
    TIED = "tied"  # several explain alike
    UNDECIDED = "undecided"  # a fit that decides did not end
    UNEXPLAINED = "unexplained"  # the model fails, and no candidate repairs it


class Note(StrEnum):
    """What speaks against a candidate effect; empty where nothing does."""

    NONE = ""
    WRONG_SIGN = "wrong sign"
    IMPLAUSIBLE_SIZE = "implausible size"
    NOT_SHOWN = "these data cannot show it"
    NOT_SIMULATED = "its simulations failed: not judged"
