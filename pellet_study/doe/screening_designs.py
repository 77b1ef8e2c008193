"""The two-level designs that Plackett and Burman published.

Reference
---------
Plackett, Burman, The design of optimum multifactorial experiments, Biometrika 33 (1946) 305,
doi:10.1093/biomet/33.4.305.
"""

import numpy as np
import pandas as pd

from pellet_study.doe.factors import Factor, physical_design
from pellet_study.errors import InputError

MAX_FACTORS = 23


GENERATORS = {
    8: "+++-+--",
    12: "++-+++---+-",
    16: "++++-+-++--+---",
    20: "++--++++-+-+----++-",
    24: "+++++-+-++--++--+-+----",
}
"""First rows of the cyclic designs printed by Plackett and Burman (1946)."""


def default_runs(n_factors: int) -> int:
    """12, 20 or 24: in these sizes no main effect is wholly aliased with a two-factor interaction.

    Raises
    ------
    InputError
        If there are no factors or more than 23.
    """
    if not 1 <= n_factors <= MAX_FACTORS:
        raise InputError(f"{n_factors} factors were asked for: expected 1 to {MAX_FACTORS}")
    return next(runs for runs in (12, 20, 24) if n_factors < runs)


def coded_matrix(n_factors: int, runs: int | None = None, centre_points: int = 0) -> np.ndarray:
    """Coded Plackett-Burman design (runs + centre_points, n_factors).

    Rows are the generator shifted right again and again, then a row of -1: for 7 factors the 12 runs of the
    source paper's Table 7, in its order.

    Parameters
    ----------
    n_factors : int
        1 to 23.
    runs : int, optional
        8, 12, 16, 20 or 24; default see `default_runs`.
    centre_points : int
        Runs at the middle of every factor, added at the end.

    Raises
    ------
    InputError
        If runs is not one of the sizes or too small, or centre_points negative.
    """
    size = default_runs(n_factors) if runs is None else runs
    if size not in GENERATORS or size <= n_factors:
        raise InputError(
            f"a design of {size} runs for {n_factors} factors was asked for: expected one of "
            f"{', '.join(map(str, GENERATORS))} runs, more than factors"
        )
    if centre_points < 0:
        raise InputError(f"{centre_points} centre points were asked for: expected 0 or more")
    row = np.array([1.0 if sign == "+" else -1.0 for sign in GENERATORS[size]])
    cyclic = np.array([np.roll(row, shift) for shift in range(size - 1)])
    matrix = np.vstack([cyclic, -np.ones(size - 1)])[:, :n_factors]
    return np.vstack([matrix, np.zeros((centre_points, n_factors))])


def design(factors: list[Factor], runs: int | None = None, centre_points: int = 0) -> pd.DataFrame:
    """The design in the physical units of its factors: one column per factor; see `coded_matrix`."""
    return physical_design(with_words(coded_matrix(len(factors), runs, centre_points), factors), factors)


def with_words(coded: np.ndarray, factors: list[Factor], n_blocks: int = 1) -> np.ndarray:
    """The design with centre points spread over the levels of its categorical factors, which have no middle.

    Those of different blocks (every `n_blocks`-th is in the same one) are spread alike.

    Raises
    ------
    InputError
        If a categorical factor has more than two levels, or there are centre points and no other factor.
    """
    many = [factor.name for factor in factors if len(factor.levels) > 2]
    if many:
        raise InputError(
            f"factor {many[0]!r} has more than two levels: a two-level design takes the two of most interest, written "
            f"{many[0]}=one,other"
        )
    categorical = [i for i, factor in enumerate(factors) if factor.levels]
    centre = np.flatnonzero(~coded.any(axis=1))
    if len(centre) and len(categorical) == len(factors):
        raise InputError("all factors are categorical, so there is no centre: leave --centre out")
    coded = coded.copy()
    for place, i in enumerate(categorical):
        coded[centre, i] = np.where(np.arange(len(centre)) // n_blocks >> place & 1, 1.0, -1.0)
    return coded
