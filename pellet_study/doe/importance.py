"""Which factors matter most to a response: those whose terms the fit can spare least."""

from itertools import combinations

import numpy as np

from pellet_study.doe.linear_model import LinearFit


def importance(model: LinearFit) -> dict[str, float]:
    """{factor: sum of squares that the fit loses with every term in which the factor stands}, response unit squared."""
    response, size = model.response, len(model.terms)
    terms = list(model.terms.values())

    def left(kept: np.ndarray) -> float:
        columns = model.matrix[:, kept]
        return float(np.sum((response - columns @ np.linalg.lstsq(columns, response, rcond=None)[0]) ** 2))

    full = left(np.ones(model.matrix.shape[1], dtype=bool))
    found = {}
    for i, name in enumerate(model.names):
        kept = np.array([i not in terms[k] if k < size else True for k in range(model.matrix.shape[1])])
        found[name] = left(kept) - full
    return found


def important_pairs(model: LinearFit, most: int = 3) -> list[tuple[int, int]]:
    """Pairs of places of the `most` most important factors, the most important first."""
    weight = list(importance(model).values())
    ranked = sorted(range(len(weight)), key=lambda i: -weight[i])[:most]
    return list(combinations(ranked, 2))
