"""A printed validation: its relative error and t test, and what such a validation can and cannot show."""

from itertools import product

import numpy as np

from pellet_study.doe.validation import Sample, equivalence
from pellet_study.errors import InputError
from pellet_study.paper.verdicts import CONSISTENT, DATA_MISSING, LEVEL, Item, compare, judged, printed_number

MOST_READINGS = 30
"""Largest number of readings that is tried where the paper does not print it."""


def percent_off(mean: float, target: float) -> float:
    """Relative error (%) of a mean; the target is not 0."""
    return 100 * abs(mean - target) / abs(target)


def in_percent(amount: float, target: float, digits: int) -> str:
    """` (1.2 %)`: an amount in percent of the target, nothing where that is 0."""
    return f" ({100 * amount / abs(target):.{digits}f} %)" if target else ""


def relative_error(section: str, mean: float, target: float, printed: str, half: float) -> Item:
    """The printed relative error, and what the rounding of both means (`half` a last digit) leaves open."""
    errors = [percent_off(mean + i * half, target + j * half) for i, j in product((-1, 0, 1), repeat=2)]
    return compare(
        section,
        "relative error, %",
        printed,
        percent_off(mean, target),
        f"rounding of both means allows {min(errors):.4f} to {max(errors):.4f} %",
        (min(errors), max(errors)),
    )


def less_than(section: str, says: str, limit: str, mean: float, target: float, printed: str | None) -> Item:
    """A claim that the relative error lies below a limit (%)."""
    error = percent_off(mean, target)
    reason = f"{error:.3f} % from the printed means"
    if printed is not None and error >= printed_number(limit) > printed_number(printed):
        reason += f"; below {limit} % only if the unrounded means give {printed} %"
    return judged(section, says, f"<{limit}", error, error < printed_number(limit), reason)


def interval_around(
    section: str, target: float, sd: float, intervals: list[tuple[float, float]], predicted: float, unit: str
) -> Item:
    """Whether target +- sd lies inside every prediction interval at the optimum, and how wide the first one is."""
    low, high = target - sd, target + sd
    bounds = " and ".join(f"{a:.4f} to {b:.4f}" for a, b in intervals)
    inside = all(a <= low and high <= b for a, b in intervals)
    width = intervals[0][1] - intervals[0][0]
    return judged(
        section,
        f"{target} +- {sd} and the 95 % prediction interval at the optimum",
        f"{low:.2f} to {high:.2f}",
        predicted,
        inside,
        f"{'' if inside else 'not '}inside {bounds}; an interval {width:.2f} {unit} wide"
        f"{in_percent(width, target, 1)}: a check with little power",
    )


def t_test(
    section: str,
    difference: float,
    sd: float,
    printed: str,
    unit: str,
    missing: str = "n and sd of the simulation are not given",
    each: int = 5,
) -> Item:
    """A printed P of a t test beside every number of readings that the printed means and sd leave open.

    Parameters
    ----------
    difference, sd : float
        Of the means; of the target's readings, response unit.
    missing : str
        What the paper does not print, in words.
    each : int
        Readings on both sides for which the needed sd and difference are worked out.
    """
    from scipy.special import ndtri, stdtr, stdtrit

    difference, p = abs(difference), printed_number(printed)
    sizes = range(2, MOST_READINGS + 1)
    one = {n: float(2 * stdtr(n - 1, -difference / (sd / np.sqrt(n)))) for n in sizes}
    two = {n: float(2 * stdtr(2 * n - 2, -difference / (sd * np.sqrt(2 / n)))) for n in sizes}
    if max(*one.values(), *two.values()) >= p:
        found = one if max(one.values()) >= p else two
        nearest = min(found, key=lambda n: abs(found[n] - p))
        kind = "one sample" if found is one else "two samples"
        reason = f"n = {nearest}, {kind}, gives {found[nearest]:.4f}; {missing}"
        return judged(section, "P of the t test", printed, found[nearest], True, reason, found[nearest] - p)
    needed_n = (-ndtri(p / 2) * sd / difference) ** 2
    needed_difference = -stdtrit(2 * each - 2, p / 2) * sd * np.sqrt(2 / each)
    reverse = min(one, key=lambda k: abs(1 - one[k] - p))
    return judged(
        section,
        "P of the t test",
        printed,
        max(one.values()),
        False,
        f"cannot come from the printed means and sd: the largest P of any n >= 2 is {max(one.values()):.4f} "
        f"(one sample) or {max(two.values()):.4f} (two samples); {printed} needs n = {needed_n:.3f} (normal "
        f"limit), a simulation sd of {_needed_sd(difference, sd, each, p):.1f} {unit} or a difference of "
        f"{needed_difference:.4f} {unit} (n "
        f"= {each} each); 1 - P comes near at n = {reverse} ({1 - one[reverse]:.4f}), so 1 - P may have been "
        f"printed; {missing}",
        max(one.values()) - p,
    )


def _needed_sd(difference: float, sd: float, n: int, p: float) -> float:
    """The sd of the simulated readings with which Welch's test gives p."""
    from scipy.optimize import brentq
    from scipy.stats import ttest_ind_from_stats

    def excess(other: float) -> float:
        return ttest_ind_from_stats(difference, sd, n, 0, other, n, equal_var=False).pvalue - p

    return brentq(excess, sd, 1000 * max(1.0, sd))


def t_test_of_samples(section: str, runs: Sample, target: Sample, printed: str) -> Item:
    """A printed P where sd and n of both sides are printed too: Welch's test, and the one with a common variance."""
    from scipy.stats import ttest_ind_from_stats

    values = [
        float(
            ttest_ind_from_stats(runs.mean, runs.sd, runs.n, target.mean, target.sd, target.n, equal_var=equal).pvalue
        )
        for equal in (False, True)
    ]
    nearest = min(values, key=lambda value: abs(value - printed_number(printed)))
    reason = f"{values[0]:.4f} with unequal variances (Welch), {values[1]:.4f} with a common one"
    return compare(section, "P of the t test", printed, nearest, reason)


def what_it_shows(section: str, target: Sample, runs: Sample, unit: str) -> Item:
    """The smallest margin within which the printed readings show equality (two one-sided tests), or what is missing for it."""
    item = "what the validation can show"
    try:
        limit = _smallest_margin(runs, target)
    except InputError:
        missing = [word for word, value in (("sd", runs.sd), ("n", runs.n)) if not value or value < 2 and word == "n"]
        return Item(
            section,
            item,
            "",
            None,
            None,
            DATA_MISSING,
            f"one number, {runs.mean:g} beside {target.mean:g} {unit}, whose {' and '.join(missing) or 'scatter'} "
            "are not printed: that it came near cannot be told from chance, and no test of equality is possible; "
            "print every run, and declare the margin before it",
        )
    known = "" if target.sd else " (the target taken as known: sd or n of its readings is not printed)"
    return Item(
        section,
        item,
        "",
        limit,
        None,
        CONSISTENT,
        f"equality within +-{limit:.4g} {unit}{in_percent(limit, target.mean, 2)} at level "
        f"{LEVEL:g}, no tighter{known}; a P of no difference above {LEVEL:g} shows no equality",
    )


def _smallest_margin(runs: Sample, target: Sample) -> float:
    """Below it the two one-sided tests do not reject, whatever was declared."""
    found = equivalence(runs, target, 1.0, LEVEL)
    return max(abs(end) for end in found.interval)


def what_it_cannot_show(section: str, unidentified: list[str], fraction: float, response: str) -> Item:
    """One response met at one setting does not identify the factors."""
    names = ", ".join(unidentified) or "none over its whole range"
    return Item(
        section,
        "what the validation cannot show",
        "",
        f"{100 * fraction:.1f} % of the box",
        None,
        CONSISTENT,
        f"a run at any setting of that share of the box would have met {response} as well, so meeting it confirms the "
        f"fit at one point and not the factors (not identified: {names}); that needs another response or another rig",
    )
