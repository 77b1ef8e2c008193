"""How good a design is for a model, before anything is measured: efficiencies, variances, inflation, aliases.

References
----------
Atkinson, Donev, Tobias, Optimum Experimental Designs, with SAS, Oxford 2007, ch. 10, 11: D, A, G, V efficiency.
Zahran, Anderson-Cook, Myers, Fraction of design space to assess prediction capability of response surface designs,
J. Quality Technol. 35 (2003) 377, doi:10.1080/00224065.2003.11980235.
"""

from dataclasses import dataclass
from itertools import combinations, combinations_with_replacement

import numpy as np

from pellet_study.doe.augment import confounded
from pellet_study.doe.confounding import confounded_with
from pellet_study.doe.interactions import alias_shares
from pellet_study.doe.published_designs import recognise
from pellet_study.doe.terms import columns_of, interaction_terms, linear_terms, quadratic_terms
from pellet_study.errors import InputError

MODELS = ("main", "interactions", "quadratic")
POINTS = 4096
"""Places in the box (a Sobol sequence) at which the prediction variance is looked at, besides its corners."""

CORNERS = 12
"""Factors up to which every corner of the box is looked at."""


@dataclass(frozen=True)
class Score:
    """A design judged for a model.

    Attributes
    ----------
    kind : str
        What design it is.
    model : str
        `main`, `interactions` or `quadratic`.
    runs, terms, df_residual, pure_error_df : int
    confounded : list of str
        Terms that the runs do not separate; where there are any, the numbers below are None or empty.
    d_efficiency, a_efficiency, g_efficiency : float or None
        Percent: 100 |X'X|^(1/p)/n, 100 p/(n tr (X'X)^-1), 100 p/(n max variance in the box); 100 for an orthogonal
        two-level design and its main effects.
    average_variance, max_variance : float or None
        Variance of the predicted mean over that of a run, over the box -1 to 1; the average is exact.
    variance_quantiles : dict
        {share of the box: variance not exceeded in it}.
    vif : dict
        {term: variance inflation factor}.
    relative_se : dict
        {term: standard error of its coefficient over the standard deviation of a run}.
    aliases : dict
        {term: {term of next higher order: share that its coefficient carries}}, shares of 0 left out.
    block_confounded : dict
        {effect: share of it that lies between the blocks} of a two-level design, 1 where it cannot be told from them.
    """

    kind: str
    model: str
    runs: int
    terms: int
    df_residual: int
    pure_error_df: int
    confounded: list[str]
    d_efficiency: float | None
    a_efficiency: float | None
    g_efficiency: float | None
    average_variance: float | None
    max_variance: float | None
    variance_quantiles: dict[str, float]
    vif: dict[str, float]
    relative_se: dict[str, float]
    aliases: dict[str, dict[str, float]]
    block_confounded: dict[str, float]


def model_terms(names: list[str], model: str) -> dict[str, tuple[int, ...]]:
    """The terms of a model by its name.

    Raises
    ------
    InputError
        If there is no such model.
    """
    if model not in MODELS:
        raise InputError(f"there is no model {model!r}: expected one of {', '.join(MODELS)}")
    if model == "quadratic":
        return quadratic_terms(names)
    return {**linear_terms(names), **(interaction_terms(names) if model == "interactions" else {})}


def score(names: list[str], coded, model: str, blocks=None, centre=None) -> Score:
    """Judge a design for a model.

    Parameters
    ----------
    names : list of str
    coded : array (n_runs, n_factors)
    model : str
        One of `MODELS`.
    blocks : sequence (n_runs,), optional
        The block of each run; fitted beside the terms.
    centre : array of bool (n_runs,), optional
        Which runs are centre points, where a categorical factor has no middle.

    Raises
    ------
    InputError
        If there is no such model.
    """
    coded = np.asarray(coded, dtype=float)
    terms = model_terms(names, model)
    matrix = columns_of(coded, terms)
    runs, size = matrix.shape
    extra = block_columns(blocks)
    full = np.column_stack([matrix, extra]) if extra is not None else matrix
    mixed = confounded(full, [*terms, *(f"block {i + 2}" for i in range(full.shape[1] - size))])
    distinct = len(np.unique(np.column_stack([coded.round(6), *([extra] if extra is not None else [])]), axis=0))
    centred = coded if centre is None else np.where(np.asarray(centre)[:, None], 0.0, coded)
    common = {
        "kind": recognise(centred),
        "model": model,
        "runs": runs,
        "terms": size,
        "df_residual": max(0, runs - int(np.linalg.matrix_rank(full))),
        "pure_error_df": runs - distinct,
        "confounded": mixed,
        "block_confounded": confounded_with(names, centred, blocks),
    }
    if mixed:
        nothing = dict.fromkeys(("d_efficiency", "a_efficiency", "g_efficiency", "average_variance", "max_variance"))
        return Score(**common, **nothing, variance_quantiles={}, vif={}, relative_se={}, aliases={})
    inverse = np.linalg.inv(full.T @ full)[:size, :size]  # of the terms, adjusted for the blocks
    spread = np.sum((matrix - matrix.mean(axis=0)) ** 2, axis=0)
    variances = _variances(terms, inverse, coded.shape[1])
    return Score(
        **common,
        d_efficiency=float(100 * np.exp(-np.linalg.slogdet(inverse)[1] / size) / runs),
        a_efficiency=float(100 * size / (runs * np.trace(inverse))),
        g_efficiency=float(100 * size / (runs * variances.max())),
        average_variance=float(np.trace(inverse @ box_moments(terms, coded.shape[1]))),
        max_variance=float(variances.max()),
        variance_quantiles={f"{share:g}": float(np.quantile(variances[:POINTS], share)) for share in (0.5, 0.9, 0.95)},
        vif={name: float(value) for name, value in zip(terms, np.diag(inverse) * spread, strict=True) if terms[name]},
        relative_se=dict(zip(terms, map(float, np.sqrt(np.diag(inverse))), strict=True)),
        aliases=_aliases(names, coded, terms, model),
    )


def block_columns(blocks) -> np.ndarray | None:
    """Columns that tell each block from the first (n_runs, n_blocks - 1); None where there is one only."""
    if blocks is None or len(labels := list(dict.fromkeys(blocks))) < 2:
        return None
    return np.column_stack([np.array([b == label for b in blocks], dtype=float) for label in labels[1:]])


def box_moments(terms: dict[str, tuple[int, ...]], n_factors: int) -> np.ndarray:
    """Mean of f f' over the box -1 to 1, f the terms: products of 1/(m + 1) for even powers m, else 0."""
    powers = np.array([[indices.count(i) for i in range(n_factors)] for indices in terms.values()])
    both = powers[:, None, :] + powers[None, :, :]
    return np.where(both % 2 == 0, 1 / (both + 1), 0.0).prod(axis=2)


def _variances(terms, inverse: np.ndarray, n_factors: int) -> np.ndarray:
    """Prediction variance at places of the box, then at its corners, faces and where a search ends."""
    from scipy.stats import qmc

    spread = 2 * qmc.Sobol(n_factors, seed=0).random(POINTS) - 1
    levels = (-1.0, 1.0) if n_factors > 6 else (-1.0, 0.0, 1.0)
    lattice = np.zeros((1, n_factors))
    if n_factors <= CORNERS:
        lattice = np.array(np.meshgrid(*[levels] * n_factors)).reshape(n_factors, -1).T
    points = columns_of(np.vstack([spread, lattice]), terms)
    return np.einsum("ij,jk,ik->i", points, inverse, points)


def _aliases(names: list[str], coded: np.ndarray, terms: dict, model: str) -> dict[str, dict[str, float]]:
    """Rows of (X1'X1)^-1 X1'X2, X2 the terms of the next order: interactions, squares and cubes, or cubes."""
    size = len(names)
    sign = "" if all(len(name) == 1 and name.isalpha() for name in names) else "*"
    if model == "main":
        higher = interaction_terms(names)
    else:
        triples = combinations(range(size), 3) if model == "interactions" else combinations_with_replacement(
            range(size), 3)  # fmt: skip
        higher = {sign.join(names[i] for i in indices): indices for indices in triples}
    if not higher:
        return {}
    return alias_shares(coded, terms, higher)
