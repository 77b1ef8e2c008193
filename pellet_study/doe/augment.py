"""Axial points added to a two-level design that was run, so that it becomes a response surface.

Reference
---------
Myers, Montgomery, Anderson-Cook, Response Surface Methodology, 4th ed., Wiley 2016, ch. 8: sequential composites.
"""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe.blocking import inflation
from pellet_study.doe.composite import axial_distance, axial_points
from pellet_study.doe.factors import factor_meant
from pellet_study.doe.terms import columns_of, quadratic_terms
from pellet_study.errors import InputError


@dataclass(frozen=True)
class Augmented:
    """The runs to add, and what all runs together can tell.

    Attributes
    ----------
    names : list of str
        The factors of the surface.
    added : ndarray (n_added, n_factors)
        Coded runs of all factors of the table: axial points of the surface's, then centre points.
    distance : float
        Of the axial points, in coded units.
    lost : list of str
        Terms of the quadratic model that the runs do not separate, with the second block fitted; empty: all can be
        fitted.
    block_inflation : float
        Largest standard error of a term relative to that without the block; 1 where the blocks are orthogonal.
    """

    names: list[str]
    added: np.ndarray
    distance: float
    lost: list[str]
    block_inflation: float


def add_axial(
    names: list[str],
    coded,
    factors: list[str] | None = None,
    axial: str | float = "rotatable",
    centre_points: int = 3,
    held: dict[str, float] | None = None,
) -> Augmented:
    r"""Axial points for a two-level design, as a second block.

    rotatable: :math:`\alpha = F^{1/4}`, F the runs at the corners, replicates counted; of a screening of which
    fewer factors are kept the corners of these are replicated.

    Parameters
    ----------
    names : list of str
        All factors of the table.
    coded : array (n_runs, n_factors)
        Runs at -1 and +1, and centre points.
    factors : list of str, optional
        Those of the surface (2 or more); the others stay at `held`. Default: all.
    axial : str or float
        See `composite.axial_distance`.
    centre_points : int
        New ones, made with the axial points; without any the blocks can hardly be told from the curvature.
    held : dict, optional
        {other factor: coded level} in the new runs; default 0.

    Raises
    ------
    InputError
        If a name is no factor, fewer than two are kept, the runs are not at two levels, or a number is out of range.
    """
    coded = np.asarray(coded, dtype=float)
    meant = set(names if factors is None else (factor_meant(name, names) for name in factors))
    kept = [name for name in names if name in meant]
    held = {factor_meant(name, names): level for name, level in (held or {}).items()}
    if len(kept) < 2 or centre_points < 0:
        raise InputError(
            f"{len(kept)} factor(s) and {centre_points} centre points were asked for: expected two factors or more, and "
            "0 centre points or more"
        )
    places = [names.index(name) for name in kept]
    centre = (np.abs(coded[:, places]) < 0.5).all(axis=1)
    corners = coded[~centre][:, places]
    if not np.all(np.abs(np.abs(corners) - 1) < 0.1):
        raise InputError(
            "the table is no two-level design: expected runs at low and high levels, and centre points; a table "
            "with axial or middle levels has a surface already, analyse it with bbd"
        )
    distance = axial_distance(axial, len(kept), len(corners), (int(centre.sum()), centre_points))
    added = np.tile([(held or {}).get(name, 0.0) for name in names], (2 * len(kept) + centre_points, 1)).astype(float)
    added[:, places] = 0.0
    added[: 2 * len(kept), places] = axial_points(len(kept), distance)
    together = np.vstack([coded, added])[:, places]
    blocks = np.repeat([1, 2], [len(coded), len(added)])
    terms = quadratic_terms(kept)
    matrix = columns_of(together, terms)
    lost = confounded(np.column_stack([matrix, blocks == 2]), [*terms, "block"])
    worst = np.inf if lost else float(inflation(matrix, blocks).max())
    return Augmented(kept, added, distance, lost, worst)


def confounded(matrix: np.ndarray, names: list[str]) -> list[str]:
    """Names of the columns that take part in an exact linear dependence; none where all are separated."""
    _, singular, vectors = np.linalg.svd(matrix / np.maximum(np.linalg.norm(matrix, axis=0), 1e-300))
    rank = int(np.sum(singular > 1e-9 * singular[0]))
    involved = np.abs(vectors[rank:]).max(axis=0, initial=0.0) > 1e-6
    return [name for name, is_in in zip(names, involved, strict=True) if is_in]
