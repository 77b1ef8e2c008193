"""The words an answer may give, as enumerations whose values stand in the JSON, and what would change a verdict."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

SEPARATES = 4.0  # squared distance of predictions in standard errors, from which a measurement tells them apart


class Verdict(StrEnum):
    """Is an effect missing?"""

    ADEQUATE = "adequate"  # the present model explains the data
    MISSING = "missing"  # one explanation stands out
    TIED = "tied"  # several explain alike
    UNDECIDED = "undecided"  # a fit that decides did not end, or simulations scatter too much
    UNEXPLAINED = "unexplained"  # the model fails, and no candidate repairs it


class Grade(StrEnum):
    """Does the model fit?"""

    FITS = "fits"
    DOUBTFUL = "doubtful"
    FAILS = "does not fit"


class Note(StrEnum):
    """What speaks against a candidate effect; empty where nothing does."""

    NONE = ""
    WRONG_SIGN = "wrong sign"
    IMPLAUSIBLE_SIZE = "implausible size"
    NOT_SHOWN = "these data cannot show it"
    NOT_SIMULATED = "its simulations failed: not judged"


@dataclass(frozen=True)
class Undone:
    """The least set-up scatter, declared nowhere, that would undo a verdict, and the verdict it would leave.

    `standard_errors` is in those of a cell mean, at most one; `by_rig` maps a rig to the same as {observable: scatter in its
    unit}, at the median standard error of its cells.
    """

    standard_errors: float
    verdict: Verdict
    effects: tuple[tuple[str, ...], ...]
    by_rig: Mapping[str, Mapping[str, float]]
    by_line: tuple[Mapping[str, str | float], ...] = ()


@dataclass(frozen=True)
class Limited:
    """Simulations that scatter too much for a verdict: the rig, the variance of its simulations over that of its readings and
    the most that this may be, and what it would take: simulations, minutes of a processor."""

    rig: str
    noise_share: float
    most: float
    simulations: int
    cpu_minutes: float


@dataclass(frozen=True)
class FittedToo:
    """Held-out conditions whose rows, were they fitted too, would let an effect be named: [{rig, condition: value}].

    `drifting` says that its amount would drift, so that `refine` would add nothing.
    """

    conditions: tuple[Mapping[str, str | float], ...]
    verdict: Verdict
    effects: tuple[tuple[str, ...], ...]
    drifting: bool = False
