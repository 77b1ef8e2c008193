"""Lenth's method: the scatter of effects told from the small ones among them."""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe.blocks import columns_of_blocks
from pellet_study.doe.design_table import DesignTable
from pellet_study.doe.interactions import contrasts
from pellet_study.doe.terms import columns_of

COMPLETION_RUNS = 16

COMPLETION_STEPS = 2000

SPARSE_CONTRASTS = 7


# --------------------------------------------------------------------------------------------------- analysis
@dataclass(frozen=True)
class Lenth:
    """Lenth's margins of error of an effect, from the effects alone.

    `contrasts` says how many there were: the factors', and those of the design's unused columns where known.
    `assumption_met` is false where they are too few, or all of them factors though the design has more to show:
    that most contrasts are noise cannot be taken for granted then, and the margins are of no use.
    """

    contrasts: int
    pseudo_standard_error: float
    margin_of_error: float
    simultaneous_margin_of_error: float
    assumption_met: bool = True


def lenth(effects: list[float], alpha: float = 0.05, complete: bool = True) -> Lenth | None:
    r"""Lenth's margins of error.

    :math:`s_0 = 1.5\,\mathrm{median}|c|`, :math:`PSE = 1.5\,\mathrm{median}_{|c| < 2.5 s_0}|c|`,
    :math:`ME = t_{1-\alpha/2,\,m/3} PSE`, :math:`SME = t_{\gamma,\,m/3} PSE` with
    :math:`\gamma = (1 + (1-\alpha)^{1/m})/2`.

    Parameters
    ----------
    effects : list of float
        m contrasts in the unit of an effect; fewer than 3 give None.
    complete : bool
        Whether these are all contrasts of the design, noise included.

    References
    ----------
    doi:10.1080/00401706.1989.10488595
    """
    if len(effects) < 3:
        return None
    from scipy.special import stdtrit

    sizes = np.abs(effects)
    kept = sizes[sizes < 2.5 * 1.5 * np.median(sizes)]
    error = float(1.5 * np.median(kept)) if len(kept) else 0.0
    degrees = len(sizes) / 3
    simultaneous = (1 + (1 - alpha) ** (1 / len(sizes))) / 2
    margin, together = (float(stdtrit(degrees, level) * error) for level in (1 - alpha / 2, simultaneous))
    return Lenth(len(sizes), error, margin, together, complete and len(sizes) >= SPARSE_CONTRASTS)


def left_over_contrasts(table: DesignTable, centre: np.ndarray, terms: dict[str, tuple]) -> dict[str, float]:
    """{word: contrast} of a complete regular unreplicated design that no term has and no block hides; none of another.

    They hold interactions of higher order, or those that share a contrast (`AC+BD`), and the noise.
    """
    corners = np.flatnonzero(~centre)
    coded, response = table.coded.to_numpy()[corners], table.response.to_numpy()[corners]
    if len(np.unique(coded.round(6), axis=0)) < len(coded):
        return {}
    between = [column[corners] for column in columns_of_blocks(table.blocks).values()]
    taken = np.column_stack([columns_of(np.sign(coded), terms), *between])
    return {
        word: float(2 * column @ response / len(coded))
        for word, column in contrasts(table.names, coded).items()
        if np.abs(taken.T @ column).max() < 0.5
    }


def _unused_contrasts(table: DesignTable, centre: np.ndarray, terms: dict[str, tuple]) -> list[float]:
    """Contrasts of the columns that complete the terms' to a Hadamard matrix; none where not found.

    They hold the noise and the two-factor interactions, and sharpen Lenth's estimate. The order of the rows has
    no say in them: products of the factors' columns where the design is regular, then the first columns found
    with the rows in the order of `_standard_order`.
    """
    corners = np.flatnonzero(~centre)
    coded, response = table.coded.to_numpy()[corners], table.response.to_numpy()[corners]
    full = columns_of(coded, terms)
    runs, size = full.shape
    if runs > COMPLETION_RUNS or not np.allclose(full.T @ full, runs * np.eye(size)):
        return []
    order = _standard_order(coded, response)
    full, response = np.sign(full[order]), response[order]
    signs = 1 - 2.0 * ((np.arange(2 ** (runs - 1))[:, None] >> np.arange(runs)) & 1)
    for chosen in (_products(full), []):  # three times a 2 x 2 design has a product and yet no completion with it
        free = signs[np.abs(signs @ np.column_stack([full, *chosen])).max(axis=1) < 0.5]
        found = _completed(free, runs - size - len(chosen))
        if found is not None:
            return [float(2 * column @ response / runs) for column in [*chosen, *found]]
    return []


def _standard_order(coded: np.ndarray, response: np.ndarray) -> np.ndarray:
    """Rows by their levels; replicates by response, rising or falling as in the Rudin-Shapiro sequence.

    Replicates differ in nothing but the response. If all pairs rose, their differences would add up in one
    contrast and cancel in the others; in that sequence they spread evenly, as noise does.
    """
    levels = np.round(coded).astype(int)
    order = np.lexsort([response, *levels.T[::-1]])
    groups = np.split(order, np.flatnonzero(np.diff(levels[order], axis=0).any(axis=1)) + 1)
    replicated, rows = 0, list[np.ndarray]()
    for group in groups:
        falling = bin(replicated & replicated >> 1).count("1") % 2
        replicated += len(group) > 1
        rows.extend(group[::-1] if falling else group)
    return np.array(rows)


def _products(full: np.ndarray) -> list[np.ndarray]:
    """The products of the columns of a regular design that are no column of it yet; none if it is not regular."""
    columns = list(full.T)
    runs, given = full.shape
    for first in range(1, runs):  # the list grows while products of its members are new
        if first >= len(columns):
            break
        for second in range(1, first):
            product = columns[first] * columns[second]
            shares = np.abs(np.array(columns) @ product)
            if shares.max() < 0.5:
                columns.append(product)
            elif shares.max() < runs - 0.5:
                return []
    return columns[given:]


def _completed(free: np.ndarray, wanted: int) -> list[np.ndarray] | None:
    """So many mutually orthogonal ones of the columns, the first in lexical order; None where not found."""
    steps = 0

    def search(left: np.ndarray, missing: int) -> list[np.ndarray] | None:
        nonlocal steps
        if not missing:
            return []
        while len(left) >= missing and steps < COMPLETION_STEPS:
            steps += 1
            rest = search(left[1:][np.abs(left[1:] @ left[0]) < 0.5], missing - 1)
            if rest is not None:
                return [left[0], *rest]
            left = left[1:]
        return None

    return search(free, wanted)
