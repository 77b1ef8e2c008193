"""The terms of a model by name: main effects, products of two factors, squares, and their columns at coded points."""

import re
from itertools import combinations

import numpy as np

from pellet_study.errors import InputError

INTERCEPT = "1"


def _one_letter(names: list[str]) -> bool:
    """Whether all factors have one letter, so that products can be written without a sign: BC, B2."""
    return all(len(name) == 1 and name.isalpha() for name in names)


def linear_terms(names: list[str]) -> dict[str, tuple[int, ...]]:
    """{term: indices of the factors multiplied}: the intercept and the main effects."""
    return {INTERCEPT: (), **{name: (i,) for i, name in enumerate(names)}}


def interaction_terms(names: list[str]) -> dict[str, tuple[int, ...]]:
    """{term: indices}: the two-factor interactions, `BC` for one-letter factors, else `first*second`."""
    return product_terms(names, 2)


def product_terms(names: list[str], size: int) -> dict[str, tuple[int, ...]]:
    """{term: indices}: the products of so many different factors, `ABC` or `first*second*third`."""
    sign = "" if _one_letter(names) else "*"
    return {sign.join(names[i] for i in chosen): chosen for chosen in combinations(range(len(names)), size)}


def quadratic_terms(names: list[str]) -> dict[str, tuple[int, ...]]:
    """{term: indices}: the above and the squares, named `B2` for one-letter factors, else `name^2`."""
    sign = "" if _one_letter(names) else "^"
    squares = {f"{name}{sign}2": (i, i) for i, name in enumerate(names)}
    return {**linear_terms(names), **interaction_terms(names), **squares}


def columns_of(coded, terms: dict[str, tuple[int, ...]]) -> np.ndarray:
    """The model matrix (n_points, n_terms) of coded points (n_points, n_factors)."""
    coded = np.atleast_2d(np.asarray(coded, dtype=float))
    return np.column_stack([coded[:, list(indices)].prod(axis=1) for indices in terms.values()])


def resolve_terms(text: str, terms: dict) -> list[str]:
    """Term names from a comma-separated list (`BC,B2`, also `B*C`, `B^2`).

    Raises
    ------
    InputError
        If one is no term of the model.
    """
    chosen = []
    for word in filter(None, (part.strip() for part in text.split(","))):
        short = re.sub(r"[*:^]", "", word)
        found = next((name for name in terms if name == word or re.sub(r"[*:^]", "", name) == short), None)
        if found is None or found == INTERCEPT:
            raise InputError(f"{word!r} is no term of the model: its terms are {', '.join(list(terms)[1:])}")
        chosen.append(found)
    return chosen
