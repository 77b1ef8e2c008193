"""Power before the runs: how likely a design finds an effect of a stated size, and how many runs that takes.

References
----------
Cohen, Statistical Power Analysis for the Behavioral Sciences, 2nd ed., 1988: noncentral F and t. O'Brien, Muller, in
Edwards (ed.), Applied Analysis of Variance in Behavioral Science, Dekker 1993.
"""

from dataclasses import dataclass

import numpy as np

from pellet_study.errors import InputError

MAX_REPLICATES = 1000


@dataclass(frozen=True)
class Power:
    """Power of the test of each term.

    Attributes
    ----------
    sd, effect, alpha, wanted : float
        Scatter of a run, size of the effect, level of the test, power wanted.
    runs, df_residual : int
    power : dict
        {term: probability that its test is significant}; None where the design leaves no residual.
    detectable : dict
        {term: effect found with the power wanted}; None likewise.
    replicates : int or None
        Fewest whole replicates of the design with which every main effect reaches the power wanted; None: not with
        1000.
    """

    sd: float
    effect: float
    alpha: float
    wanted: float
    runs: int
    df_residual: int
    power: dict[str, float | None]
    detectable: dict[str, float | None]
    replicates: int | None

    @property
    def runs_needed(self) -> int | None:
        return None if self.replicates is None else self.replicates * self.runs


def power_of(noncentrality: float, df_error: int, alpha: float = 0.05, df_effect: int = 1) -> float:
    r"""Power of an F test, exact: :math:`P(F'_{\nu_1,\nu_2,\lambda} > F_{1-\alpha,\nu_1,\nu_2})`.

    With one degree of freedom that is the two-sided t test with noncentrality :math:`\sqrt\lambda`.
    """
    from scipy.special import fdtri
    from scipy.stats import ncf

    if noncentrality == 0:
        return alpha
    return float(ncf.sf(fdtri(df_effect, df_error, 1 - alpha), df_effect, df_error, noncentrality))


def noncentrality_for(power: float, df_error: int, alpha: float = 0.05) -> float:
    """The noncentrality with which an F test of one degree of freedom has this power."""
    from scipy.optimize import brentq

    high = 1.0
    while power_of(high, df_error, alpha) < power:
        high *= 2
    return float(brentq(lambda value: power_of(value, df_error, alpha) - power, 1e-9, high))


def design_power(
    matrix: np.ndarray,
    terms: dict[str, tuple[int, ...]],
    sd: float,
    effect: float,
    alpha: float = 0.05,
    wanted: float = 0.8,
) -> Power:
    r"""Power of each term of a model on a design: :math:`\lambda = b^2 / (\sigma^2 [(X'X)^{-1}]_{jj})`.

    Parameters
    ----------
    matrix : ndarray (n_runs, n_terms)
        Model matrix, the terms' columns first; further columns (blocks, curvature) cost degrees of freedom.
    terms : dict
        See `terms.quadratic_terms`.
    sd : float
        Standard deviation of a run made again, response unit, above 0.
    effect : float
        Change of the response from -1 to +1 (main effects and interactions: b = effect/2), and from the middle to
        either end (squares: b = effect).
    alpha, wanted : float
        Between 0 and 1.

    Raises
    ------
    InputError
        If a number is out of range, or the runs do not separate the terms.
    """
    for name, value, fine in (
        ("the standard deviation", sd, sd > 0),
        ("the effect", effect, effect != 0),
        ("the level alpha", alpha, 0 < alpha < 1),
        ("the power wanted", wanted, alpha < wanted < 1),
    ):
        if not np.isfinite(value) or not fine:
            raise InputError(
                f"{name} is {value:g}: expected an sd above 0, an effect other than 0, alpha between 0 and 1 and a power "
                "between alpha and 1"
            )
    runs, size = matrix.shape
    if np.linalg.matrix_rank(matrix) < size:
        raise InputError(
            f"the {runs} runs do not separate the {size} terms: no power can be given; take a smaller model, or "
            "score the design to see which terms are mixed"
        )
    share = np.diag(np.linalg.inv(matrix.T @ matrix))
    found, detectable = {}, {}
    df = runs - size
    limit = noncentrality_for(wanted, df, alpha) if df else None
    for j, (name, indices) in enumerate(terms.items()):
        if not indices:
            continue
        half = 1.0 if _is_square(indices) else 0.5
        found[name] = power_of((half * effect / sd) ** 2 / share[j], df, alpha) if df else None
        detectable[name] = float(np.sqrt(limit * share[j]) * sd / half) if df else None
    mains = [j for j, indices in enumerate(terms.values()) if len(indices) == 1]
    return Power(
        sd, abs(effect), alpha, wanted, runs, df, found, detectable,
        _replicates(runs, size, float(share[mains].max()), abs(effect) / 2 / sd, alpha, wanted),
    )  # fmt: skip


def _is_square(indices: tuple[int, ...]) -> bool:
    return len(indices) == 2 and indices[0] == indices[1]


def _replicates(runs, size, share, ratio, alpha, wanted) -> int | None:
    for count in range(1, MAX_REPLICATES + 1):
        df = count * runs - size
        if df > 0 and power_of(ratio**2 * count / share, df, alpha) >= wanted:
            return count
    return None


def screening_runs(n_factors: int, sd: float, effect: float, alpha: float = 0.05, wanted: float = 0.8) -> int | None:
    """Fewest runs of an orthogonal two-level design, a multiple of 4, that finds a main effect with the power wanted.

    All effects but the factors' are taken as noise: n - 1 - n_factors degrees of freedom. None above 1000 runs.
    """
    first = 4 * (n_factors // 4 + 1)
    for runs in range(first, 1001, 4):
        df = runs - 1 - n_factors
        if df > 0 and power_of(runs * (effect / 2 / sd) ** 2, df, alpha) >= wanted:
            return runs
    return None
