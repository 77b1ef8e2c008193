"""Tables of a fit: analyses of variance and coefficients beside their recomputed numbers."""

from collections.abc import Callable

from pellet_study.paper.verdicts import Item, compare

Columns = list[tuple[str, str, str]]
"""(words of the item, key of the printed cell, key of the recomputed row) in the order of the items."""


def f_of_p(name: str, key: str, row: dict) -> str:
    """The reason beside a P: the F it belongs to."""
    return f"F = {row['f']:.4f}" if key == "p" else ""


def anova(
    section: str,
    cells: dict[str, dict[str, str]],
    rows: dict[str, dict],
    columns: Columns,
    row_of: Callable[[str], str] = str,
    reason: Callable[[str, str, dict], str] = f_of_p,
) -> list[Item]:
    """Items of a printed analysis of variance.

    Parameters
    ----------
    cells : dict
        {printed name: {column: printed cell}}; empty cells are passed over.
    rows : dict
        {source: row} recomputed, see `anova.anova_row`.
    columns : list of tuple
        See `Columns`.
    row_of : callable
        Source of a printed name.
    reason : callable
        Reason of an item from the printed name, the row's key and the row.
    """
    items = []
    for name, cell in cells.items():
        row = rows[row_of(name)]
        for label, column, key in columns:
            if cell.get(column):
                items.append(compare(section, f"{name} {label}", cell[column], row[key], reason(name, key, row)))
    return items


def terms(section: str, printed: dict[str, str], values: dict[str, float], reasons=None, label: str = "") -> list[Item]:
    """Items of one number a term: coefficients, effects."""
    reasons = reasons or {}
    return [
        compare(section, f"{term} {label}".rstrip(), text, values[term], reasons.get(term, ""))
        for term, text in printed.items()
    ]
