"""What is wanted of a response, and how desirable a value of it is.

References
----------
Derringer, Suich, Simultaneous optimization of several response variables, J. Quality Technology 12 (1980) 214,
doi:10.1080/00224065.1980.11980968. Importances: Derringer, A balancing act, Quality Progress 27 (1994) 51.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pellet_study.errors import InputError

KINDS = ("target", "maximise", "minimise", "limits")
ROUNDING = 1e-9  # share of a limit by which a value at it may seem to lie beyond


@dataclass(frozen=True)
class Goal:
    r"""What is wanted of one response.

    Parameters
    ----------
    kind : str
        "target": two-sided, :math:`d = ((y-L)/(T-L))^r` below the target T and :math:`((U-y)/(U-T))^s` above it;
        "maximise": :math:`d = ((y-L)/(U-L))^r`, 1 from U on; "minimise": :math:`((U-y)/(U-L))^s`, 1 up to L;
        "limits": 1 between L and U; all 0 where the value is unacceptable.
    low, high : float
        L and U in the response's unit; -inf or inf where there is no limit ("limits" only).
    target : float or None
        T, for "target".
    weights : (float, float)
        Exponents r (below) and s (above): larger ones want the response nearer to what is best.
    importance : float
        Of the response among the others, an exponent in the geometric mean.
    limited : bool
        Whether the limit was given, or is only where the predictions of the box end.

    Raises
    ------
    InputError
        If the limits are not in order, an exponent or the importance is not positive.
    """

    kind: str
    low: float
    high: float
    target: float | None = None
    weights: tuple[float, float] = (1.0, 1.0)
    importance: float = 1.0
    limited: bool = True

    def __post_init__(self):
        inner = (self.low, self.high) if self.target is None else (self.low, self.target, self.high)
        rising = all(first < second for first, second in pairwise(inner))
        finite = np.isfinite([self.low, self.high])
        if self.kind not in KINDS or not rising or not (finite.any() if self.kind == "limits" else finite.all()):
            between = "" if self.target is None else f" with the target {self.target:g} between them"
            expected = "the lower one first" + ("" if self.target is None else " and the target between them")
            raise InputError(f"the limits {self.low:g} and {self.high:g} were given{between}: expected {expected}")
        if not all(np.isfinite(w) and w > 0 for w in (*self.weights, self.importance)):
            raise InputError(
                f"weights {self.weights[0]:g}, {self.weights[1]:g} and importance {self.importance:g}: expected "
                "positive numbers"
            )

    @property
    def accepted(self) -> tuple[float, float]:
        """The values that will do: what lies beyond the best end of a one-sided goal does too."""
        low = -np.inf if self.kind == "minimise" or not self.limited else self.low
        return low, np.inf if self.kind == "maximise" or not self.limited else self.high

    @property
    def flanks(self) -> list[tuple[float, float, float]]:
        """(value of desirability 0, value of desirability 1, exponent) of each side on which it falls; none of limits."""
        below = (self.low, self.high if self.target is None else self.target, self.weights[0])
        above = (self.high, self.low if self.target is None else self.target, self.weights[1])
        return {"target": [below, above], "maximise": [below], "minimise": [above]}.get(self.kind, [])

    @property
    def exponent(self) -> float:
        """In the geometric mean; 0 of limits, which are kept and not weighed (as Design-Expert does)."""
        return 0.0 if self.kind == "limits" else self.importance

    def miss(self, response) -> np.ndarray:
        """How far values lie beyond what is acceptable, 0 or less where they do not."""
        y, (low, high) = np.asarray(response, dtype=float), self.accepted
        return np.maximum(low - y, y - high)

    def met(self, response) -> np.ndarray:
        """Whether values are acceptable, the limits themselves included but for rounding."""
        ends = [abs(end) for end in self.accepted if np.isfinite(end)]
        return self.miss(response) <= ROUNDING * max(ends, default=0.0)

    def desirability(self, response) -> np.ndarray:
        """d of response values, 0 to 1."""
        y = np.asarray(response, dtype=float)
        sides = [np.clip((y - zero) / (one - zero), 0, 1) ** weight for zero, one, weight in self.flanks]
        return np.min([*sides, self.met(y) * 1.0], axis=0)

    def in_words(self) -> str:
        """The goal as a phrase."""
        if self.kind == "target":
            return f"target {self.target:g}, acceptable {self.low:g} to {self.high:g}"
        if self.kind == "limits":
            if np.isinf(self.high):
                return f"at least {self.low:g}"
            return f"at most {self.high:g}" if np.isinf(self.low) else f"between {self.low:g} and {self.high:g}"
        best, worst = (self.high, self.low) if self.kind == "maximise" else (self.low, self.high)
        if not self.limited:
            return (
                f"{self.kind}; no limit given, so any value will do: desirability from 0 at {worst:.4g} to 1 at "
                f"{best:.4g}, the ends predicted in the box"
            )
        side = "below" if self.kind == "maximise" else "above"
        return f"{self.kind}, unacceptable {side} {worst:.4g}, no better beyond {best:.4g}"


def overall(desirabilities, exponents) -> np.ndarray:
    r"""Overall desirability :math:`D = (\prod d_i^{w_i})^{1/\sum w_i}`, 0 where any is 0.

    Parameters
    ----------
    desirabilities : array (n_responses, ...)
    exponents : array (n_responses,)
        Importances, 0 or more; where all are 0, D is 1 unless a desirability is 0.
    """
    d, w = np.asarray(desirabilities, dtype=float), np.asarray(exponents, dtype=float)
    logs = np.log(np.where(d > 0, d, 1.0))
    return np.where((d > 0).all(axis=0), np.exp(np.tensordot(w / (w.sum() or 1.0), logs, axes=1)), 0.0)
