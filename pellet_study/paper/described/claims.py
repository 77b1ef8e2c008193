"""Sentences of a paper that a recomputed number decides."""

from collections.abc import Callable

from pellet_study.errors import InputError
from pellet_study.output.words import nearest
from pellet_study.paper.described.analyses import Fit, rows_of
from pellet_study.paper.described.description import STATIONARY, Claim
from pellet_study.paper.described.printed_numbers import term_of
from pellet_study.paper.verdicts import NOT_RECOMPUTABLE, Item, judged

SIGNIFICANT = ("significant", "not significant")


def claim(said: Claim, fit: Fit, place: str) -> Item:
    """The judgement of one sentence.

    Raises
    ------
    InputError
        If it speaks of a term that the analysis has not.
    """
    return KINDS[said.kind](said, fit, place)


def _terms(said: Claim, known: list[str], place: str) -> list[str]:
    found = [term_of(word, known) for word in said.of]
    for word, term in zip(said.of, found, strict=True):
        if term is None:
            raise InputError(
                f"{place}, [[claim]] {said.says!r}, key 'of': expected terms of {said.analysis}{nearest(word, known)}; "
                f"found {word!r}"
            )
    return found


def _words(said: Claim, place: str, accepted: tuple[str, ...]) -> str:
    if len(said.of) != 1 or said.of[0] not in accepted:
        raise InputError(
            f"{place}, [[claim]] {said.says!r}, key 'of': expected one of {', '.join(accepted)}; found {said.of}"
        )
    return said.of[0]


def _significance(said: Claim, fit: Fit, place: str) -> Item:
    rows = rows_of(fit)
    p = {term: rows[term]["p"] for term in _terms(said, list(rows), place)}
    found = ", ".join(f"{term} P {'-' if value is None else f'{value:.4g}'}" for term, value in p.items())
    if None in p.values():
        return Item(
            said.analysis, said.says, said.kind, found, None, NOT_RECOMPUTABLE, "there is no error to test against"
        )
    wanted = said.kind == "significant"
    fine = all((value < said.level) == wanted for value in p.values())
    odd = [term for term, value in p.items() if (value < said.level) != wanted]
    reason = f"level {said.level:g}" + (
        f"; {', '.join(odd)} {'is' if len(odd) == 1 else 'are'} otherwise" if odd else ""
    )
    return judged(said.analysis, said.says, said.kind, found, fine, reason)


def _signs(said: Claim, fit: Fit, place: str) -> Item:
    values = fit.model.coefficients
    terms = _terms(said, list(values), place)
    sign = 1 if said.kind == "positive" else -1
    found = ", ".join(f"{term} {values[term]:+.4g}" for term in terms)
    return judged(said.analysis, said.says, said.kind, found, all(sign * values[term] > 0 for term in terms), "")


def _order(said: Claim, fit: Fit, place: str) -> Item:
    """The terms as printed, largest effect first, beside their sizes."""
    values = fit.model.coefficients
    terms = _terms(said, list(values), place)
    ordered = sorted(terms, key=lambda term: -abs(values[term]))
    sizes = ", ".join(f"{term} {abs(values[term]):.4g}" for term in ordered)
    return judged(
        said.analysis, said.says, " > ".join(said.of), " > ".join(ordered), ordered == terms, f"sizes {sizes}"
    )


def _stationary(said: Claim, fit: Fit, place: str) -> Item:
    wanted = _words(said, place, STATIONARY)
    point = getattr(fit, "stationary", None)
    found = point.kind if point else "none"
    reason = ""
    if point:
        at = zip(fit.table.factors, point.coded, strict=True)
        reason = "at " + ", ".join(f"{f.name} {float(f.physical(x)):.4g} (coded {x:.3g})" for f, x in at)
    return judged(said.analysis, said.says, wanted, found, found == wanted, reason)


def _lack_of_fit(said: Claim, fit: Fit, place: str) -> Item:
    wanted, p = _words(said, place, SIGNIFICANT), fit.lack_of_fit_p
    if p is None:
        reason = "no run was replicated, or the model leaves nothing to test: the lack of fit cannot be known"
        return Item(said.analysis, said.says, wanted, None, None, NOT_RECOMPUTABLE, reason)
    fine = (p < said.level) == (wanted == "significant")
    return judged(said.analysis, said.says, wanted, p, fine, f"P of the lack of fit, level {said.level:g}")


KINDS: dict[str, Callable[[Claim, Fit, str], Item]] = {
    "significant": _significance,
    "not significant": _significance,
    "positive": _signs,
    "negative": _signs,
    "order": _order,
    "stationary point": _stationary,
    "lack of fit": _lack_of_fit,
}
