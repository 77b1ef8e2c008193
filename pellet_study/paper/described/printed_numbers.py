"""The printed numbers of an analysis beside the recomputed ones, and its design."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from pellet_study.doe import box_behnken
from pellet_study.doe.design_table import DesignTable
from pellet_study.doe.terms import INTERCEPT
from pellet_study.errors import InputError
from pellet_study.output.words import nearest
from pellet_study.paper.described.analyses import Fit, Key, numbers, spans
from pellet_study.paper.described.description import Analysis
from pellet_study.paper.verdicts import (
    INCONSISTENT,
    NOT_RECOMPUTABLE,
    REPRODUCED,
    TO_ROUNDING,
    Item,
    compare,
    half_last_digit,
    judged,
)

WORDS = {
    "coefficients": "coefficient",
    "standard_errors": "standard error",
    "effects": "effect",
    "contributions_percent": "contribution, %",
    "physical_coefficients": "coefficient in physical units",
    "p": "P",
    "f": "F",
    "sum_of_squares": "sum of squares",
    "df": "degrees of freedom",
    "mean_square": "mean square",
    "mean": "mean",
    "root_mean_square_error": "root mean square error",
    "r2": "R2",
    "r2_adjusted": "adjusted R2",
    "r2_predicted": "predicted R2",
    "press": "PRESS",
    "cv_percent": "C.V., %",
    "adequate_precision": "adequate precision",
    "lack_of_fit_p": "P of the lack of fit",
    "pseudo_standard_error": "Lenth's pseudo standard error",
    "margin_of_error": "Lenth's margin of error",
    "simultaneous_margin_of_error": "Lenth's simultaneous margin of error",
}


def printed_numbers(analysis: Analysis, table: DesignTable, fit: Fit) -> list[Item]:
    """One item a printed number, in the order of the description's keys.

    Raises
    ------
    InputError
        If a number is printed of a term, source or factor that the analysis has not.
    """
    values, possible = numbers(analysis, fit), spans(analysis, table)
    items = []
    for key, label, text in _printed(analysis, list(values)):
        value = values.get(key)
        if value is None:
            reason = "undefined here: the model leaves no residual, or nothing was replicated"
            items.append(Item(analysis.name, label, text, None, None, NOT_RECOMPUTABLE, reason))
        else:
            items.append(_compared(analysis.name, label, text, value, _reason(key, values), possible.get(key)))
    kind = analysis.printed.kind
    if kind is not None:
        point = getattr(fit, "stationary", None)
        found = point.kind if point else "none"
        items.append(judged(analysis.name, "stationary point", kind, found, found == kind, _eigenvalues(point)))
    return items


def _compared(section: str, label: str, text: str, value: float, reason: str, span) -> Item:
    """The judgement of a number; of one that differs, by how many units of its last digit."""
    item = compare(section, label, text, value, reason, span)
    if item.verdict == INCONSISTENT and item.difference is not None:
        units = abs(item.difference) / (2 * half_last_digit(text))
        off = f"{units:.2g} units of the last printed digit off"
        return replace(item, reason=f"{off}; {reason}" if reason else off)
    if item.verdict == TO_ROUNDING:
        allowed = f"rounding of what is printed allows {span[0]:.7g} to {span[1]:.7g}"
        return replace(item, reason=f"{allowed}; {reason}" if reason else allowed)
    return item


def _printed(analysis: Analysis, keys: list[Key]) -> Iterator[tuple[Key, str, str]]:
    """(key, words of the item, number as printed)."""
    printed = analysis.printed
    for kind, cells in printed.by_term.items():
        for name, text in cells.items():
            term = _known(analysis, name, {key[1] for key in keys if key[0] == kind}, kind)
            yield (kind, term), f"{name} {WORDS.get(kind, kind)}", text
    for source, row in printed.anova.items():
        known = _known(analysis, source, {key[1] for key in keys if key[0] == "anova"}, "anova")
        for column, text in row.items():
            yield ("anova", known, column), f"{source} {WORDS[column]}", text
    for kind, cells in (("summary", printed.summary), ("lenth", printed.lenth)):
        for name, text in cells.items():
            yield (kind, name), WORDS[name], text
    labels = {"coded": "{}, coded", "physical": "{}", "predicted": "response", "eigenvalues": "eigenvalue {}"}
    for kind, words, groups in (
        ("stationary", "stationary point", printed.stationary),
        ("steepest", "steepest ascent", printed.steepest),
    ):
        for group, cells in groups.items():
            for name, text in cells.items():
                known = _known(analysis, name, {key[2] for key in keys if key[:2] == (kind, group)}, f"{kind}.{group}")
                yield (kind, group, known), f"{words}: {labels[group].format(name)}", text


def term_of(name: str, known: Iterable[str]) -> str | None:
    """The term that a paper's name means: `A:B`, `A*B` and `AB`, `A²` and `A^2` are the same; `intercept` is `1`."""

    def short(word: str) -> str:
        return word.strip().replace("²", "2").translate(str.maketrans("", "", "*:^ "))

    known = list(known)
    if name.strip().lower().strip("()") in ("intercept", "constant"):
        name = INTERCEPT
    alike = (
        [term for term in known if term == name]
        + [term for term in known if short(term) == short(name)]
        + [term for term in known if short(term).lower() == short(name).lower()]
    )
    return alike[0] if alike else None


def _known(analysis: Analysis, name: str, known: set[str], kind: str) -> str:
    found = term_of(name, sorted(known))
    if found is None:
        raise InputError(
            f"{analysis.table.parent / 'paper.toml'}, [[analysis]] ({analysis.name}), printed.{kind}, key {name!r}: "
            f"expected a name that this analysis has{nearest(name, known)}"
        )
    return found


def _reason(key: Key, values: dict[Key, float | None]) -> str:
    """Where F and P come from."""
    if key[0] != "anova" or key[2] not in ("f", "p"):
        return ""
    source, column = key[1:]
    ratio = values["anova", source, "f"]
    if column == "p" or ratio is None:
        return "" if ratio is None else f"F = {ratio:.4f}"
    square = values["anova", source, "mean_square"]
    return f"{square:.6g} / {square / ratio:.6g}" if ratio else ""


def _eigenvalues(point) -> str:
    if point is None:
        return "the second-order part is singular or there is none"
    return f"eigenvalues {', '.join(f'{value:.4g}' for value in sorted(point.eigenvalues, reverse=True))}"


# ----------------------------------------------------------------------------------------------------- design
def design(analysis: Analysis, table: DesignTable) -> list[Item]:
    """Whether the runs are the design that the paper names."""
    if analysis.design is None:
        return []
    coded = table.coded.to_numpy()
    found, reason = CHECKS[analysis.design](coded)
    item = f"{len(coded)} runs of {coded.shape[1]} factors"
    verdict = REPRODUCED if found else INCONSISTENT
    return [Item(analysis.name, item, analysis.design, str(found), None, verdict, reason)]


def _corners(coded: np.ndarray) -> np.ndarray:
    return coded[np.isclose(np.abs(coded), 1).all(axis=1)]


def _two_level(coded: np.ndarray) -> tuple[bool, str]:
    """Orthogonal and balanced corners, else centre points only."""
    corners = _corners(coded)
    runs, size = corners.shape
    rest = coded[~np.isclose(np.abs(coded), 1).all(axis=1)]
    orthogonal = bool(runs and np.allclose(corners.T @ corners, runs * np.eye(size)) and not corners.sum(axis=0).any())
    fine = orthogonal and not np.abs(rest).max(initial=0) > 1e-6
    return fine, f"{runs} corners, {'' if orthogonal else 'not '}orthogonal and balanced; {len(rest)} centre points"


def _plackett_burman(coded: np.ndarray) -> tuple[bool, str]:
    fine, reason = _two_level(coded)
    return fine and len(_corners(coded)) % 4 == 0, reason


def _factorial(coded: np.ndarray) -> tuple[bool, str]:
    """Every combination of the levels as often as every other."""
    levels = [np.unique(np.round(column, 6)) for column in coded.T]
    points, counts = np.unique(np.round(coded, 6), axis=0, return_counts=True)
    complete = len(points) == np.prod([len(column) for column in levels])
    if complete and len(set(counts)) == 1:
        return True, f"every combination {counts[0]} times"
    fine, reason = _two_level(coded)
    return fine, f"a fraction: {reason}" if fine else f"{len(points)} different runs; {reason}"


def _box_behnken(coded: np.ndarray) -> tuple[bool, str]:
    centre = int((coded == 0).all(axis=1).sum())
    if coded.shape[1] < 3 or not centre:
        return False, "a Box-Behnken design has 3 factors or more and centre points"
    wanted = box_behnken.coded_matrix(coded.shape[1], centre)
    same = sorted(map(tuple, np.round(coded, 6) + 0.0)) == sorted(map(tuple, wanted + 0.0))
    return same, f"{len(wanted) - centre} edges and {centre} centre points"


def _composite(coded: np.ndarray) -> tuple[bool, str]:
    """Corners, axial pairs and centre points."""
    off = np.abs(coded) > 1e-6
    corners, axial = int((off.sum(axis=1) == coded.shape[1]).sum()), off.sum(axis=1) == 1
    distances = np.abs(coded[axial]).max(axis=1) if axial.any() else np.zeros(0)
    pairs = {(int(np.argmax(row)), float(np.sign(x[row][0]))) for row, x in zip(off[axial], coded[axial], strict=True)}
    fine = corners >= 4 and len(pairs) == 2 * coded.shape[1] and np.ptp(distances) < 0.02 * distances.max()
    centre = len(coded) - corners - int(axial.sum())
    reason = f"{corners} corners, {len(distances)} axial runs, {centre} centre points"
    return bool(fine), reason + (f"; axial distance {distances.mean():.4g}" if len(distances) else "")


CHECKS = {
    "Plackett-Burman": _plackett_burman,
    "factorial": _factorial,
    "Box-Behnken": _box_behnken,
    "central composite": _composite,
}
