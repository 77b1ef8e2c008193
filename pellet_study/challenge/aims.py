"""Figures of trials beside their aims: shares with Clopper-Pearson intervals, and means or medians.

A figure is a row {figure, aim, measured, interval, trials, met}; one without trials is left out.
"""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from pellet_study.challenge.counting import interval

Row = dict[str, str]  # of a trial table
Figure = dict[str, str | int]


def share(
    label: str,
    chosen: Iterable[Row],
    hit: Callable[[Row], bool],
    *,
    least: float = 0.0,
    most: float = 1.0,
    bound: float = 1.0,
    aim: str | None = None,
    lenient: bool = False,
) -> list[Figure]:
    """The share of some trials that a rule hits.

    Parameters
    ----------
    least, most, bound : the aim is a share between `least` and `most`, the upper end of its interval at most `bound`
    aim : its words; default: made of these numbers; empty where the figure has no aim
    lenient : a missed aim that the interval still holds is "within scatter", not "no"
    """
    trials = list(chosen)
    if not trials:
        return []
    hits, n = sum(map(hit, trials)), len(trials)
    low, high = interval(hits, n)
    if aim is None:
        upper = f", upper bound < {100 * bound:g} %" if bound < 1 else ""
        aim = f">= {100 * least:g} %" if least else f"<= {100 * most:g} %{upper}"
    met = least <= hits / n <= most and high <= bound
    near = lenient and low <= most and high >= least
    return [_of_share(label, aim, hits, n, n, "yes" if met else "within scatter" if near else "no")]


def coverage(label: str, chosen: Sequence[Row], least: float, most: float, lenient: bool = False) -> list[Figure]:
    """How many of the intervals in the columns `covered` of `constants` hold the truth."""
    if not chosen:
        return []
    covered, constants = sum(int(r["covered"]) for r in chosen), sum(int(r["constants"]) for r in chosen)
    low, high = interval(covered, constants)
    near = lenient and low <= most and high >= least
    met = "yes" if least <= covered / constants <= most else "within scatter" if near else "no"
    return [_of_share(label, f"{100 * least:g} to {100 * most:g} %", covered, constants, len(chosen), met)]


def quantity(
    label: str,
    values: Sequence[float],
    *,
    least: float = 0.0,
    most: float = np.inf,
    aim: str | None = None,
    of: Callable[..., float] = np.median,
) -> list[Figure]:
    """A mean or a median that should lie between `least` and `most`; `aim` as in `share`."""
    if not len(values):
        return []
    value = float(of(values))
    words = f"<= {most:g}" if aim is None else aim
    return [_figure(label, words, f"{value:.3g}", "", len(values), "yes" if least <= value <= most else "no")]


def _of_share(label: str, aim: str, hits: int, n: int, trials: int, met: str) -> Figure:
    low, high = interval(hits, n)
    return _figure(label, aim, f"{100 * hits / n:.1f} %", f"{100 * low:.1f} to {100 * high:.1f} %", trials, met)


def _figure(label: str, aim: str, measured: str, between: str, trials: int, met: str) -> Figure:
    said = "" if aim in ("", "for comparison") else met
    return {"figure": label, "aim": aim, "measured": measured, "interval": between, "trials": trials, "met": said}
