"""Central composite designs: a two-level cube, axial points, centre points; and their orthogonal blocks.

References
----------
Box, Wilson, On the experimental attainment of optimum conditions, J. Roy. Statist. Soc. B 13 (1951) 1,
doi:10.1111/j.2517-6161.1951.tb00067.x. Box, Hunter, Multi-factor experimental designs for exploring response surfaces,
Ann. Math. Statist. 28 (1957) 195, doi:10.1214/aoms/1177707047: rotatability, orthogonal blocks.
Box, Hunter, The 2^(k-p) fractional factorial designs II, Technometrics 3 (1961) 449,
doi:10.1080/00401706.1961.10489967: the fractions of resolution V.
"""

from itertools import combinations, product

import numpy as np

from pellet_study.errors import InputError
from pellet_study.tables.numbers import number_given

FRACTIONS = {
    5: ("ABCD",),
    6: ("ABCDE",),
    7: ("ABCDEF",),
    8: ("ABCD", "ABEF"),
    9: ("ACDFG", "BCEFG"),
    10: ("ABCG", "BCDE", "ACDF"),
}
"""Generators of the last factors, resolution V at least: no main effect or two-factor interaction meets another."""


def cube(n_factors: int, fraction: bool = False) -> np.ndarray:
    """The corners of a two-level factorial (n_runs, n_factors), the last factor running fastest.

    Parameters
    ----------
    n_factors : int
        1 to 10.
    fraction : bool
        The smallest regular fraction of resolution V (5 factors and more).

    Raises
    ------
    InputError
        If there are too many factors.
    """
    if not 1 <= n_factors <= max(FRACTIONS):
        raise InputError(f"{n_factors} factors were asked for: expected 1 to {max(FRACTIONS)} for a factorial")
    words = FRACTIONS.get(n_factors, ()) if fraction else ()
    base = np.array(list(product((-1.0, 1.0), repeat=n_factors - len(words))))
    made = [base[:, ["ABCDEFGHIJ".index(letter) for letter in word]].prod(axis=1) for word in words]
    return np.column_stack([base, *made])


def axial_distance(axial: str | float, n_factors: int, n_corners: float, centre=(0, 0), factorial_copies=1) -> float:
    r"""How far axial points lie from the centre, in coded units.

    rotatable: :math:`\alpha = F^{1/4}`, F corners for each axial point; face: 1; orthogonal (blocks of cube and axial
    points): :math:`\alpha^2 = F (2k + n_{a0}) / (2 (F + n_{c0}))`, with the centre points of the axial and cube blocks.

    Parameters
    ----------
    axial : "rotatable", "face", "orthogonal" or float
        A number is the distance itself, 0.5 or more.
    n_factors : int
    n_corners : float
        Runs at the corners (for each copy of the axial points).
    centre : (int, int)
        Centre points in the cube blocks and in the axial block.

    Raises
    ------
    InputError
        If `axial` is neither of the words nor such a number.
    """
    if axial == "rotatable":
        return float(n_corners**0.25)
    if axial == "face":
        return 1.0
    if axial == "orthogonal":
        in_cube, in_axial = centre
        return float(np.sqrt(n_corners * (2 * n_factors + in_axial) / (2 * (n_corners + in_cube))))
    try:
        distance = number_given(axial) if isinstance(axial, str) else float(axial)
    except (TypeError, ValueError):
        distance = np.nan
    if not 0.5 <= distance <= 10:
        raise InputError(
            f"axial points at {axial!r} were asked for: expected rotatable, face, orthogonal or a distance in coded "
            "units from 0.5 to 10"
        )
    return distance


def axial_points(n_factors: int, distance: float) -> np.ndarray:
    """The 2 k axial points (2 k, n_factors), low before high."""
    points = np.zeros((2 * n_factors, n_factors))
    for i in range(n_factors):
        points[2 * i, i], points[2 * i + 1, i] = -distance, distance
    return points


def composite_matrix(
    n_factors: int,
    axial: str | float = "rotatable",
    centre_points: int = 5,
    fraction: bool = False,
    n_blocks: int = 1,
) -> tuple[np.ndarray, np.ndarray]:
    """Coded central composite design (n_runs, n_factors), and the block of each run from 1.

    The axial points are the last block and the corners the others; centre points are spread over the blocks as evenly
    as their number allows, at the end of each. The blocks are orthogonal with `axial="orthogonal"`, or where that
    distance is the one asked for (rotatable with 2, 4 or half of 5 factors and the right centre points).

    Parameters
    ----------
    n_factors : int
        2 to 10.
    axial : str or float
        See `axial_distance`.
    centre_points : int
        In all, 1 or more.
    fraction : bool
        See `cube`.
    n_blocks : int
        1, or 2, 3 or 5: one for the axial points, the others for 1, 2 or 4 parts of the cube.

    Raises
    ------
    InputError
        If the number of factors, centre points or blocks is out of range.
    """
    if n_factors < 2 or n_factors > max(FRACTIONS):
        raise InputError(
            f"{n_factors} factors were asked for: expected 2 to {max(FRACTIONS)} for a central composite design"
        )
    if centre_points < 1:
        raise InputError(f"{centre_points} centre points were asked for: expected 1 or more")
    corners = cube(n_factors, fraction)
    parts = np.ones(len(corners), dtype=int)
    if n_blocks > 1:
        found = cube_blocks(corners, n_blocks - 1)
        if found is None:
            raise InputError(
                f"{n_blocks} blocks of a central composite of {n_factors} factors were asked for: expected 1, or "
                f"{_possible(corners)}: one for the axial points, the others for equal parts of the cube"
            )
        parts = found
    shares = [centre_points // n_blocks + (i < centre_points % n_blocks) for i in range(n_blocks)]
    in_axial = shares[-1] if n_blocks > 1 else 0
    distance = axial_distance(axial, n_factors, len(corners), (centre_points - in_axial, in_axial))
    if n_blocks == 1:
        rows = np.vstack([corners, axial_points(n_factors, distance), np.zeros((centre_points, n_factors))])
        return rows, np.ones(len(rows), dtype=int)
    pieces = [corners[parts == block] for block in range(1, n_blocks)] + [axial_points(n_factors, distance)]
    pieces = [np.vstack([rows, np.zeros((share, n_factors))]) for rows, share in zip(pieces, shares, strict=True)]
    return np.vstack(pieces), np.repeat(np.arange(1, n_blocks + 1), [len(rows) for rows in pieces])


def _possible(corners: np.ndarray) -> str:
    return " or ".join(str(parts + 1) for parts in (1, 2, 4) if cube_blocks(corners, parts) is not None)


def cube_blocks(corners: np.ndarray, n_parts: int) -> np.ndarray | None:
    """Equal parts (1, 2 or 4) of a factorial that no main effect or two-factor interaction is mixed with.

    Returns
    -------
    ndarray (n_runs,) or None
        The part of each run from 1; None where there are no such parts.
    """
    n_runs, n_factors = corners.shape
    if n_parts == 1:
        return np.ones(n_runs, dtype=int)
    if n_parts not in (2, 4):
        return None
    kept = np.column_stack([np.ones(n_runs), corners, *(corners[:, i] * corners[:, j] for i, j in
                            combinations(range(n_factors), 2))])  # fmt: skip
    words = [
        corners[:, list(word)].prod(axis=1)
        for size in range(n_factors, 2, -1)
        for word in combinations(range(n_factors), size)
    ]
    free = [word for word in words if np.abs(kept.T @ word).max() < 0.5]
    if n_parts == 2:
        return (1 + (free[0] > 0)).astype(int) if free else None
    for first, second in combinations(free, 2):
        both = first * second
        if np.abs(kept.T @ both).max() < 0.5 and abs(first @ second) < 0.5:
            return (1 + (first > 0) + 2 * (second > 0)).astype(int)
    return None
