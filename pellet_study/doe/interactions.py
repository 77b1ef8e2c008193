"""Which interactions a two-level design tells apart, and what its left-over contrasts are called.

References
----------
Box, Hunter, The 2^(k-p) fractional factorial designs I, Technometrics 3 (1961) 311,
doi:10.1080/00401706.1961.10489951. Wu, Chen, A graph-aided method for planning two-level experiments when certain
interactions are important, Technometrics 34 (1992) 162, doi:10.2307/1269232: clear effects.
"""

import numpy as np

from pellet_study.doe.terms import columns_of, interaction_terms, linear_terms, product_terms

LEAST_SHARE_OF_CORNERS = 0.75
"""More of the corners than this must be there: fewer are a Plackett-Burman design, not a factorial that lost runs."""

MOST_INFLATION = 4.0
"""An interaction is fitted where the other terms and the blocks inflate its variance by no more: its error at most doubles."""

MOST_CORNERS = 128
"""Corners up to which left-over contrasts are named."""


def fraction_size(corners: np.ndarray) -> int:
    """Corners of the smallest full factorial or regular fraction that holds these (n_runs, n_factors) at -1 and +1."""
    rows = (np.unique(corners, axis=0) < 0).astype(int)
    left = rows[1:] ^ rows[:1]
    rank = 0
    for column in range(left.shape[1]):  # elimination modulo 2
        pivots = np.flatnonzero(left[rank:, column])
        if len(pivots):
            left[[rank, rank + pivots[0]]] = left[[rank + pivots[0], rank]]
            others = left[:, column].astype(bool)
            others[rank] = False
            left[others] ^= left[rank]
            rank += 1
    return int(2**rank)


def clear_interactions(names: list[str], coded: np.ndarray, centre: np.ndarray, beside=()) -> dict[str, tuple]:
    """{term: indices} of the two-factor interactions of a design that tells them from main effects and from one another.

    Of a full factorial, or a fraction of resolution V and more, that is all of them but those that blocks hide; none where
    some share a contrast (resolution IV), or a main effect carries one (resolution III, Plackett-Burman).

    Parameters
    ----------
    names : list of str
    coded : array (n_runs, n_factors)
        Runs at -1 and +1, replicated or with some lost, and centre points.
    centre : array of bool (n_runs,)
        Which runs are those.
    beside : sequence of arrays (n_runs,)
        The columns of the blocks. What they hide at the corners is not fitted, though centre points in each block would tell
        it, for that costs the other terms more than it gives.
    """
    pairs = interaction_terms(names)
    signs = np.sign(coded[~centre])
    if not pairs or len(np.unique(signs, axis=0)) <= LEAST_SHARE_OF_CORNERS * fraction_size(signs):
        return {}
    products = columns_of(signs, pairs)
    mains = columns_of(signs, linear_terms(names))
    between = np.column_stack([np.ones(len(signs)), *(column[~centre] for column in beside)])
    first = np.column_stack([mains, between])
    found = {}
    for place, (name, indices) in enumerate(pairs.items()):
        others = np.column_stack([first, np.delete(products, place, axis=1)])
        column = products[:, place]
        left = _left(column, others)
        if left @ left * MOST_INFLATION >= np.sum((column - column.mean()) ** 2) > 1e-9:
            found[name] = indices
        elif np.abs(_left(column, between)).max() > 1e-9:  # else the blocks hide it, and it alone
            return {}
    return found


def _left(columns: np.ndarray, others: np.ndarray) -> np.ndarray:
    """What the others leave of columns (n_runs, ...) by least squares."""
    return columns - others @ np.linalg.lstsq(others, columns, rcond=None)[0]


def contrasts(names: list[str], corners: np.ndarray) -> dict[str, np.ndarray]:
    """{word: column (n_runs,)} of all contrasts of a complete regular design, equally replicated; none of another.

    A contrast is named by the effects of lowest order that it holds, with their signs: `AC+BD`.
    """
    signs = np.sign(corners)
    distinct, times = np.unique(signs, axis=0, return_counts=True)
    size = fraction_size(signs)
    if len(distinct) != size or size > MOST_CORNERS or np.ptp(times):
        return {}
    words: dict[bytes, list[tuple[str, np.ndarray]]] = {}
    order: dict[bytes, int] = {}
    for length in range(1, len(names) + 1):
        if len(words) == size - 1:
            break
        for word, indices in product_terms(names, length).items():
            column = signs[:, list(indices)].prod(axis=1)
            key = (column * column[0]).astype(np.int8).tobytes()
            if np.ptp(column) and order.setdefault(key, length) == length:
                words.setdefault(key, []).append((word, column))
    return {_label(members): members[0][1] for members in words.values()}


def _label(members: list[tuple[str, np.ndarray]]) -> str:
    """The words of one contrast, each with its sign relative to the first."""
    (first, column), *others = members
    return first + "".join(("+" if other[0] == column[0] else "-") + word for word, other in others)


def alias_shares(coded: np.ndarray, fitted: dict[str, tuple], others: dict[str, tuple]) -> dict[str, dict[str, float]]:
    r"""{fitted term: {other term: share of it that its coefficient carries}}: rows of :math:`(X_1'X_1)^{-1}X_1'X_2`.

    Shares of 0 are left out; the intercept has no row.
    """
    named = [name for name, indices in fitted.items() if indices]
    if not others:
        return {name: {} for name in named}
    shares = np.linalg.lstsq(columns_of(coded, fitted), columns_of(coded, others), rcond=None)[0]
    rows = [row for row, indices in zip(shares, fitted.values(), strict=True) if indices]
    return {
        name: {other: float(round(value, 12)) for other, value in zip(others, row, strict=True) if abs(value) > 1e-9}
        for name, row in zip(named, rows, strict=True)
    }


def aliases(names: list[str], coded, fitted: dict[str, tuple] | None = None) -> dict[str, dict[str, float]]:
    """Aliases of the fitted terms (default: main effects) with the interactions that are not fitted.

    Those of two factors and, where some of two are fitted, those of three: E(b_A) = beta_A + sum share * beta_interaction.

    Parameters
    ----------
    names : list of str
    coded : array (n_runs, n_factors)
        The runs at -1 and +1.
    fitted : dict, optional
        {term: indices}.
    """
    fitted = linear_terms(names) if fitted is None else fitted
    others = {name: indices for name, indices in interaction_terms(names).items() if name not in fitted}
    if any(len(indices) == 2 for indices in fitted.values()):
        others |= product_terms(names, 3)
    return alias_shares(coded, fitted, others)
