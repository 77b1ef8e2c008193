"""Fold-over of a two-level design: runs with signs reversed, and what they free from aliasing.

References
----------
Box, Hunter, The 2^(k-p) fractional factorial designs I, Technometrics 3 (1961) 311,
doi:10.1080/00401706.1961.10489951. Li, Lin, Optimal foldover plans for two-level
fractional factorial designs, Technometrics 45 (2003) 142, doi:10.1198/004017003188618779.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from pellet_study.doe.factors import factor_meant
from pellet_study.doe.interactions import aliases
from pellet_study.doe.terms import columns_of, interaction_terms, linear_terms
from pellet_study.errors import InputError


@dataclass(frozen=True)
class FoldOver:
    """The runs to add, and the aliases before and after.

    Attributes
    ----------
    names : list of str
        Factors.
    folded : list of str
        Those whose signs are reversed.
    added : ndarray (n_added, n_factors)
        Coded runs to make, in the order of those they mirror.
    before, after : dict
        {factor: {two-factor interaction: share that its effect carries}} of the design, and of both halves
        with a block for each.
    freed : dict
        {factor: interactions that its effect no longer carries}.
    interactions_freed : list of str
        Two-factor interactions that are clear of all main effects and other interactions now, and were not.
    """

    names: list[str]
    folded: list[str]
    added: np.ndarray
    before: dict[str, dict[str, float]]
    after: dict[str, dict[str, float]]
    freed: dict[str, list[str]]
    interactions_freed: list[str]

    @property
    def full(self) -> bool:
        return len(self.folded) == len(self.names)


def fold_over(names: list[str], coded, on: list[str] | None = None) -> FoldOver:
    """Mirror the runs of a two-level design in all factors, or in those named.

    In all factors: of a design of resolution III (such as Plackett-Burman's) every main effect becomes clear of every
    two-factor interaction. In one factor: its main effect and its own interactions become clear of the rest.

    Parameters
    ----------
    names : list of str
    coded : array (n_runs, n_factors)
        Runs at -1 and +1; centre points are not mirrored.
    on : list of str, optional
        Factors whose signs are reversed; default all.

    Raises
    ------
    InputError
        If a name is no factor, runs are not at two levels, or the mirrored runs are there already.
    """
    coded = np.asarray(coded, dtype=float)
    corners = np.round(coded[np.abs(coded).max(axis=1) > 0.5])
    if not len(corners) or not np.all(np.abs(corners) == 1):
        raise InputError("the design is not at two levels: expected runs at low and high levels, and centre points")
    folded = list(names) if on is None else [factor_meant(name, names) for name in on]
    signs = np.array([-1.0 if name in folded else 1.0 for name in names])
    added = corners * signs
    if sorted(map(tuple, added)) == sorted(map(tuple, corners)):
        raise InputError(
            f"the fold-over on {', '.join(folded)} repeats the runs that are there and frees nothing: the effects of "
            + ("all factors" if on is None else ", ".join(folded))
            + " are clear of two-factor interactions already; add axial points instead, or replicate"
        )
    both = np.vstack([corners, added])
    before, after = aliases(names, corners), _with_blocks(names, both)
    return FoldOver(
        names=list(names),
        folded=folded,
        added=added,
        before=before,
        after=after,
        freed={name: [pair for pair in before[name] if pair not in after[name]] for name in names},
        interactions_freed=sorted(
            set(_clear(names, both, halves=True)) - set(_clear(names, corners)),
            key=list(interaction_terms(names)).index,
        ),
    )


def _blocks(n_runs: int) -> np.ndarray:
    """The contrast of the two halves."""
    return np.repeat([-1.0, 1.0], n_runs // 2)


def _with_blocks(names: list[str], both: np.ndarray) -> dict[str, dict[str, float]]:
    """Aliases of the main effects where the halves are blocks."""
    pairs = interaction_terms(names)
    first = np.column_stack([columns_of(both, linear_terms(names)), _blocks(len(both))])
    shares = np.linalg.lstsq(first, columns_of(both, pairs), rcond=None)[0][1 : 1 + len(names)] if pairs else []
    return {
        name: {pair: float(round(value, 12)) for pair, value in zip(pairs, row, strict=True) if abs(value) > 1e-9}
        for name, row in zip(names, shares, strict=True)
    } or {name: {} for name in names}


def _clear(names: list[str], runs: np.ndarray, halves: bool = False) -> list[str]:
    """Interactions orthogonal to the mean, main effects, blocks and all other two-factor interactions."""
    pairs = interaction_terms(names)
    if not pairs:
        return []
    others = [columns_of(runs, linear_terms(names))] + ([_blocks(len(runs))[:, None]] if halves else [])
    products = columns_of(runs, pairs)
    with_others = np.abs(products.T @ np.column_stack(others)).max(axis=1)
    among = np.abs(products.T @ products)
    np.fill_diagonal(among, 0)
    return [pair for pair, a, b in zip(pairs, with_others, among.max(axis=1), strict=True) if a < 1e-6 and b < 1e-6]


def resolution(coded) -> int | None:
    """III, IV or V (V: or more) of a two-level design, by its aliases; None where main effects are mixed themselves.

    III: some main effect carries a two-factor interaction; IV: only interactions carry one another; V: neither.
    """
    coded = np.asarray(coded, dtype=float)
    runs = coded[np.abs(coded).max(axis=1) > 0.5]
    mains = np.column_stack([np.ones(len(runs)), runs])
    gram = mains.T @ mains
    if not np.allclose(gram, np.diag(np.diag(gram))):
        return None
    pairs = [runs[:, i] * runs[:, j] for i, j in combinations(range(runs.shape[1]), 2)]
    if not pairs:
        return 5
    products = np.column_stack(pairs)
    if np.abs(mains.T @ products).max() > 1e-6:
        return 3
    among = products.T @ products
    return 4 if np.abs(among - np.diag(np.diag(among))).max() > 1e-6 else 5
