"""Reduced models of a response surface: terms left out by name or by their p values, hierarchy kept."""

from pellet_study.doe.box_behnken import Surface, fit_surface
from pellet_study.doe.terms import INTERCEPT
from pellet_study.errors import InputError


def without(surface: Surface, dropped: list[str]) -> Surface:
    """The same table fitted without the named terms.

    Raises
    ------
    InputError
        If a term is not in the model, or a main effect would go while a product with it stays.
    """
    terms = {name: indices for name, indices in surface.model.terms.items() if name not in dropped}
    for name in dropped:
        if name not in surface.model.terms or name == INTERCEPT:
            raise InputError(f"{name!r} is no term of the model: its terms are {', '.join(surface.p)}")
        needed = _dependents(surface.model.terms[name], terms)
        if needed:
            raise InputError(f"{name!r} cannot be left out while {needed[0]!r} stays: leave that out first")
    return fit_surface(surface.table, terms, surface.alpha)


def _dependents(indices: tuple[int, ...], terms: dict) -> list[str]:
    """Terms of second order that contain a main effect."""
    if len(indices) != 1:
        return []
    return [name for name, other in terms.items() if len(other) == 2 and indices[0] in other]


def reduce_backward(surface: Surface, alpha: float = 0.1) -> tuple[Surface, list[str]]:
    """Backward elimination: leave out the least significant term while its p exceeds `alpha`, hierarchy kept.

    Returns
    -------
    surface, dropped : Surface, list of str
        The reduced fit and the terms left out, in order. Their p values are no longer honest: they were
        chosen.

    Raises
    ------
    InputError
        If the model is saturated: without p values there is nothing to choose by.
    """
    if surface.saturated:
        raise InputError("the model is saturated and has no p values: name the terms to leave out with --drop")
    dropped: list[str] = []
    while True:
        terms = surface.model.terms
        candidates = {
            name: p
            for name, p in surface.p.items()
            if p is not None and p > alpha and not _dependents(terms[name], terms)
        }
        if not candidates or len(terms) <= 2:
            return surface, dropped
        worst = max(candidates, key=candidates.get)
        dropped.append(worst)
        surface = without(surface, [worst])
