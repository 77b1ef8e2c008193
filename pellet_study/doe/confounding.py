"""What the blocks of a two-level design are mixed (confounded) with: a difference between blocks looks like it.

Reference
---------
Box, Hunter, The 2^(k-p) fractional factorial designs I, Technometrics 3 (1961) 311,
doi:10.1080/00401706.1961.10489951: blocks by interactions.
"""

import numpy as np

from pellet_study.doe.terms import product_terms

SUMMED_UP = 3
"""Interactions of so many factors are looked at in any design; of more only where blocks touch none of these."""

MOST_FACTORS = 8
"""Factors up to which interactions of all orders are looked at."""

WHOLE = 1 - 1e-9


def confounded_with(names: list[str], coded, labels) -> dict[str, float]:
    """{effect: share of its variation at the corners that lies between blocks}, 1 where they cannot be told apart there; 0 left out.

    Main effects and interactions of up to three factors; where blocks touch none of these, those of lowest order that they
    touch. Nothing where the runs are all in one block, or are not at two levels.

    Parameters
    ----------
    names : list of str
    coded : array (n_runs, n_factors)
        Runs at -1 and +1, and centre points.
    labels : sequence (n_runs,) or None
        The block of each run.
    """
    coded = np.asarray(coded, dtype=float)
    corners = np.abs(coded).max(axis=1) > 0.5
    here = [label for label, is_in in zip(labels if labels is not None else (), corners, strict=False) if is_in]
    signs, kinds = np.sign(coded[corners]), list(dict.fromkeys(here))
    if len(kinds) < 2 or not np.all(np.abs(np.abs(coded[corners]) - 1) < 0.1):
        return {}
    blocks = np.column_stack([np.array([label == kind for label in here], dtype=float) for kind in kinds[1:]])
    found: dict[str, float] = {}
    highest = len(names) if len(names) <= MOST_FACTORS else min(SUMMED_UP, len(names))
    for size in range(1, highest + 1):
        if found and size > SUMMED_UP:
            break
        terms = product_terms(names, size)
        shares = shares_between(signs, list(terms.values()), blocks)
        found |= {name: float(share) for name, share in zip(terms, shares, strict=True) if share > 1e-9}
    return found


def shares_between(signs: np.ndarray, products: list[tuple[int, ...]], blocks: np.ndarray) -> np.ndarray:
    """Share (n_products,) of the variation of each product of factors that lies between blocks."""
    if not products:
        return np.zeros(0)
    columns = np.column_stack([signs[:, list(indices)].prod(axis=1) for indices in products])
    columns = columns - columns.mean(axis=0)
    within = np.column_stack([np.ones(len(signs)), blocks])
    between = within @ np.linalg.lstsq(within, columns, rcond=None)[0]
    total = np.sum(columns**2, axis=0)
    return np.sum(between**2, axis=0) / np.where(total > 0, total, np.inf)


def hidden(confounded: dict[str, float]) -> list[str]:
    """The effects that cannot be told from a difference between blocks at all."""
    return [name for name, share in confounded.items() if share > WHOLE]
