"""What was measured, as a part of the page."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pellet_study.criticism.facts import assumed_words
from pellet_study.output.style import label
from pellet_study.output.words import number
from pellet_study.report.particles import particles
from pellet_study.report.parts import Picture, Table, table
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Study

MOST_ROWS = 20
ALWAYS = ("rig", "observable", "value", "sd", "n")  # columns that stand even where they never change


@dataclass(frozen=True)
class MeasuredPart:
    """The measurements by rig, row by row, and pictures of what was simulated."""

    summary: Table
    rows: Table
    pictures: list[Picture]
    assumed: str = ""


def counts(study: Study) -> str:
    """How many rows there are, and how many of them are held out."""
    held = sum(row.split == "holdout" for row in study.rows)
    words = f"{len(study.rows)} rows of measurements"
    return f"{words}, {held} of them held out" if held else words


def measured(study: Study, folder: Path) -> MeasuredPart:
    """What was measured in a study."""
    return MeasuredPart(summary(study), first_rows(study), particles(study, folder), assumed_words(study))


def summary(study: Study) -> Table:
    """A row for every observable of a rig."""
    found = []
    for rig in study.rigs:
        of_rig = [row for row in study.rows if row.rig == rig]
        for observable in dict.fromkeys(row.observable for row in of_rig):
            rows = [row for row in of_rig if row.observable == observable]
            changing = [f"{label(c)} {_span([row.conditions[c] for row in rows])}" for c in varied(rows)]
            found.append(
                [
                    rig,
                    label(observable),
                    len(rows),
                    sum(row.n for row in rows),
                    _span([row.value for row in rows]),
                    "; ".join(changing) or "one setting",
                ]
            )
    head = ("rig", "observable", "rows", "readings", "from to", "conditions")
    return table(head, found, (2, 3, 4), "By rig and observable")


def first_rows(study: Study) -> Table:
    """The first rows of measurements.csv, without columns that never change there."""
    conditions = list(dict.fromkeys(c for rig in study.rigs for c in varied([r for r in study.rows if r.rig == rig])))
    head = ["rig", "observable", "value", "sd", "n", *(label(c) for c in conditions), "split", "note"]
    rows = [
        [
            row.rig,
            label(row.observable),
            number(row.value),
            number(row.sd, 3),
            f"{row.n:g}",
            *(number(row.conditions.get(c)) for c in conditions),
            row.split,
            row.note,
        ]
        for row in study.rows[:MOST_ROWS]
    ]
    kept = [k for k in range(len(head)) if head[k] in ALWAYS or len({row[k] for row in rows}) > 1]
    caption = "Every row" if len(rows) == len(study.rows) else f"The first {len(rows)} of {len(study.rows)} rows"
    return table(
        [head[k] for k in kept],
        [[row[k] for k in kept] for row in rows],
        [m for m, k in enumerate(kept) if 2 <= k < len(head) - 2],
        caption + " of measurements.csv (conditions, split and note are left out where they never change)",
    )


def varied(rows: Sequence[Measurement]) -> list[str]:
    """The conditions of a rig's rows that change from row to row."""
    return [c for c in rows[0].conditions if len({row.conditions[c] for row in rows}) > 1]


def _span(values: Sequence) -> str:
    if isinstance(values[0], str):
        return ", ".join(dict.fromkeys(values))
    low, high = min(values), max(values)
    return number(low) if low == high else f"{number(low)} to {number(high)}"
