"""Numbers, probabilities and names in words."""

from collections.abc import Iterable
from difflib import get_close_matches


def number(value: float | None, digits: int = 4) -> str:
    """A number with so many significant digits, `-` where unknown."""
    return "-" if value is None else f"{value:.{digits}g}"


def probability(p: float | None) -> str:
    """p in words a reader can use."""
    return "-" if p is None else ("< 0.001" if p < 0.001 else f"{p:.3f}")


def nearest(given: str, accepted: Iterable[str]) -> str:
    """`; accepted are a, b, c; did you mean b?` for an error message."""
    names = sorted(accepted)
    if not names:
        return "; there is none"
    near = get_close_matches(str(given), names, n=1)
    return f"; accepted are {', '.join(names)}" + (f"; did you mean {near[0]!r}?" if near else "")
