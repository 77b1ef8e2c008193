"""Validation of a calibrated setting: equivalence to the target, against a margin declared before the runs.

References
----------
Schuirmann, A comparison of the two one-sided tests procedure and the power approach, J. Pharmacokinet.
Biopharm. 15 (1987) 657, doi:10.1007/BF01068419.
Phillips, Power of the two one-sided tests procedure in bioequivalence, J. Pharmacokinet. Biopharm. 18 (1990)
137, doi:10.1007/BF01063556: the exact power by Owen's Q, here as one integral over the estimated scatter.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from pellet_study.errors import InputError


@dataclass(frozen=True)
class Sample:
    """Mean, standard deviation and number of readings; n = 1 without sd is a value known exactly."""

    mean: float
    sd: float | None = None
    n: int = 1


@dataclass(frozen=True)
class Equivalence:
    """Two one-sided tests beside the t test.

    Attributes
    ----------
    difference, standard_error : float
        Mean of the runs minus target, response unit.
    df : float
        Welch's where the target has a scatter of its own, else n - 1.
    p_lower, p_upper, p : float
        Of the two one-sided tests (difference <= -margin, difference >= margin), and the larger.
    interval : (float, float)
        Confidence interval of the difference at level 1 - 2 alpha; equivalent means inside +- margin.
    t, p_difference : float
        The t test of no difference; a large p is no proof of equality.
    power : float
        Probability of showing equivalence if there is no difference, with these n and sd.
    n_for_power : int or None
        Smallest n of the runs with 80 % power, the target's scatter as it is; None above 1000.
    """

    runs: Sample
    target: Sample
    margin: float
    alpha: float
    difference: float
    standard_error: float
    df: float
    p_lower: float
    p_upper: float
    interval: tuple[float, float]
    t: float
    p_difference: float
    power: float
    n_for_power: int | None

    @property
    def p(self) -> float:
        return max(self.p_lower, self.p_upper)

    @property
    def equivalent(self) -> bool:
        return self.p < self.alpha

    @property
    def different(self) -> bool:
        return self.p_difference < self.alpha


def sample_of(values) -> Sample:
    """Mean, sd and n of readings.

    Raises
    ------
    InputError
        If there are fewer than two.
    """
    values = np.asarray(values, dtype=float)
    if len(values) < 2:
        raise InputError(f"{len(values)} run was given to validate with: expected 2 or more, for a standard deviation")
    return Sample(float(values.mean()), float(values.std(ddof=1)), len(values))


def equivalence(runs: Sample, target: Sample, margin: float, alpha: float = 0.05) -> Equivalence:
    r"""Two one-sided t tests (TOST) of :math:`|\mu_{runs} - \mu_{target}| < \text{margin}`.

    Parameters
    ----------
    runs : Sample
        With sd and n >= 2.
    target : Sample
        With sd and n >= 2 for a measured target (Welch's test); without sd a known number.
    margin : float
        Positive, response unit, declared before the runs.
    alpha : float

    Raises
    ------
    InputError
        If the margin is not positive, or a sample has no scatter to test with.
    """
    if not np.isfinite(margin) or margin <= 0:
        raise InputError(f"the margin is {margin:g}: expected a positive number in the response's unit")
    if runs.sd is None or runs.n < 2 or (target.sd is not None and target.n < 2):
        raise InputError(
            "the runs (and a target with an sd) need n of 2 or more: give every reading, or mean, sd and n"
        )
    from scipy.special import stdtr, stdtrit

    standard_error, df = welch(runs, target)
    if standard_error == 0:
        raise InputError("all runs are equal and the target has no scatter: there is nothing to test with")
    difference = runs.mean - target.mean
    half_width = float(stdtrit(df, 1 - alpha) * standard_error)
    t = difference / standard_error
    return Equivalence(
        runs=runs,
        target=target,
        margin=float(margin),
        alpha=alpha,
        difference=difference,
        standard_error=standard_error,
        df=df,
        p_lower=float(stdtr(df, -(difference + margin) / standard_error)),
        p_upper=float(stdtr(df, (difference - margin) / standard_error)),
        interval=(difference - half_width, difference + half_width),
        t=t,
        p_difference=float(2 * stdtr(df, -abs(t))),
        power=tost_power(margin, standard_error, df, alpha),
        n_for_power=_runs_for_power(runs, target, margin, alpha),
    )


@dataclass(frozen=True)
class WithinLimits:
    """One-sided t tests of a mean against the limits of what is acceptable, at the level `alpha` each.

    `p` is {"at least" or "at most": (limit, p value)}.
    """

    runs: Sample
    alpha: float
    p: dict[str, tuple[float, float]]

    @property
    def shown(self) -> bool:
        """Whether the mean is shown to lie within all limits."""
        return bool(self.p) and all(p < self.alpha for _, p in self.p.values())


def within_limits(values, accepted: tuple[float, float], alpha: float = 0.05) -> WithinLimits:
    r"""Tests of :math:`\mu > L` and :math:`\mu < U`: :math:`t = (\bar y - L)\sqrt n/s` on n - 1 degrees of freedom.

    Parameters
    ----------
    values : array (n,)
        Readings, two or more.
    accepted : (float, float)
        L and U in the response's unit, infinite where there is no limit.
    alpha : float

    Raises
    ------
    InputError
        If there are fewer than two readings, or all are equal.
    """
    from scipy.special import stdtr

    runs = sample_of(values)
    if not runs.sd:
        raise InputError("all runs are equal: there is nothing to test with; give readings of runs of their own")
    error = runs.sd / np.sqrt(runs.n)
    sides = (("at least", accepted[0], 1), ("at most", accepted[1], -1))
    p = {
        word: (float(end), float(stdtr(runs.n - 1, -sign * (runs.mean - end) / error)))
        for word, end, sign in sides
        if np.isfinite(end)
    }
    return WithinLimits(runs, alpha, p)


@dataclass(frozen=True)
class BesidePrediction:
    """How many of n runs lie in the interval, at `level`, that the fit predicts of one run at their setting.

    Where the fit was made in blocks, `mean` is that of the runs and `of_mean` the interval predicted of it, all of them in
    one new block: they share its level, so that only their mean can contradict the fit.
    """

    inside: int
    n: int
    prediction: tuple[float, float]
    level: float
    mean: float | None = None
    of_mean: tuple[float, float] | None = None

    @property
    def p(self) -> float:
        """Probability of so few or fewer where the fit holds (binomial); about so, as all runs share the error of the fit."""
        from scipy.special import bdtr

        return float(bdtr(self.inside, self.n, self.level))

    @property
    def contradicted(self) -> bool:
        """Whether so few are improbable at 1 - level; of a fit in blocks, whether the mean lies beyond its interval."""
        if self.mean is not None and self.of_mean is not None:
            return not self.of_mean[0] <= self.mean <= self.of_mean[1]
        return self.p < (1 - self.level) * (1 + 1e-9)


def beside_prediction(
    values, prediction: tuple[float, float], level: float, mean=None, of_mean: tuple[float, float] | None = None
) -> BesidePrediction:
    """Runs (n,) beside the prediction interval of one run, and their mean beside its own, in the response's unit."""
    low, high = prediction
    inside = sum(low <= value <= high for value in values)
    return BesidePrediction(inside, len(values), prediction, level, mean, of_mean)


def welch(runs: Sample, target: Sample) -> tuple[float, float]:
    """Standard error of the difference of two means and its degrees of freedom; 0 where neither scatters (Welch, Biometrika 34 (1947) 28)."""
    parts = [(sample.sd**2 / sample.n, sample.n - 1) for sample in (runs, target) if sample.sd is not None]
    total = sum(variance for variance, _ in parts)
    if total == 0:
        return 0.0, float(parts[0][1])
    return float(np.sqrt(total)), float(total**2 / sum(variance**2 / df for variance, df in parts if variance))


@lru_cache(1)
def _nodes():
    """Gauss-Legendre nodes and weights; 128 of them give the integral to twelve digits."""
    return np.polynomial.legendre.leggauss(128)


def tost_power(margin: float, standard_error: float, df: float, alpha: float = 0.05, difference: float = 0.0) -> float:
    r"""Exact power of TOST where the true difference is :math:`\delta` (0: none).

    :math:`\int_0^{U} [\Phi(\frac{m-\delta}{\sigma_d} - t u) - \Phi(-\frac{m+\delta}{\sigma_d} + t u)]\, f(u)\, du`,
    m the margin, :math:`\sigma_d` the standard error, t its quantile, f the density of
    :math:`u = \sqrt{\chi^2_{df}/df}`, and :math:`U = m/(t \sigma_d)`, beyond which nothing passes.
    """
    from scipy.special import gammaln, ndtr, stdtrit

    t = float(stdtrit(df, 1 - alpha))
    width = 12 / np.sqrt(2 * df)  # the density is 0 but for rounding farther from 1
    low, high = max(0.0, 1 - width), min(margin / (t * standard_error), 1 + width)
    if high <= low:
        return 0.0
    nodes, weights = _nodes()
    u = low + (high - low) * (nodes + 1) / 2
    half = df / 2
    density = np.exp(np.log(2) + half * np.log(half) - gammaln(half) + (df - 1) * np.log(u) - half * u**2)
    passed = ndtr((margin - difference) / standard_error - t * u) - ndtr(
        -(margin + difference) / standard_error + t * u
    )
    return float(np.clip((high - low) / 2 * np.sum(weights * density * passed), 0, 1))


def _runs_for_power(runs: Sample, target: Sample, margin: float, alpha: float, power: float = 0.8) -> int | None:
    for n in range(2, 1001):
        standard_error, df = welch(Sample(runs.mean, runs.sd, n), target)
        if standard_error == 0 or tost_power(margin, standard_error, df, alpha) >= power:
            return n
    return None
