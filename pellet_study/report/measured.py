"""What was measured, as a part of the page."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pellet_study.criticism.facts import assumed_words
from pellet_study.criticism.used_sd import AS_STATED, UsedSd, used_sds
from pellet_study.output.style import declared
from pellet_study.output.words import number
from pellet_study.report.particles import particles
from pellet_study.report.parts import Picture, Table, table
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Study

MOST_ROWS = 20
ALWAYS = ("rig", "observable", "value", "sd", "n")  # columns that stand even where they never change
USED = ("sd used", "setup", "setup_sd")  # columns of the fit that stand wherever they say anything


@dataclass(frozen=True)
class MeasuredPart:
    """The measurements by rig, row by row, and pictures of what was simulated."""

    summary: Table
    rows: Table
    pictures: list[Picture]
    left_out: Table | None = None
    assumed: str = ""


def counts(study: Study) -> str:
    """How many rows there are, and how many of them are held out."""
    held = sum(row.split == "holdout" for row in study.rows)
    words = f"{len(study.rows)} rows of measurements"
    words = f"{words}, {held} of them held out" if held else words
    return f"{words}; {len(study.left_out)} more left out" if study.left_out else words


def measured(study: Study, folder: Path) -> MeasuredPart:
    """What was measured in a study."""
    return MeasuredPart(
        summary(study), first_rows(study), particles(study, folder), left_out(study), assumed_words(study)
    )


def summary(study: Study) -> Table:
    """A row for every observable of a rig."""
    found = []
    for rig in study.rigs:
        units = study.units_of(rig)
        of_rig = [row for row in study.rows if row.rig == rig]
        for observable in dict.fromkeys(row.observable for row in of_rig):
            rows = [row for row in of_rig if row.observable == observable]
            changing = [f"{declared(c, units)} {_span([row.conditions[c] for row in rows])}" for c in varied(rows)]
            found.append(
                [
                    rig,
                    declared(observable, units),
                    len(rows),
                    sum(row.n for row in rows),
                    _span([row.value for row in rows]),
                    "; ".join(changing) or "one setting",
                ]
            )
    head = ("rig", "observable", "rows", "readings", "from to", "conditions")
    return table(head, found, (2, 3, 4), "By rig and observable")


def first_rows(study: Study) -> Table:
    """The first rows of measurements.csv with every column that the fit uses, without others that never change there."""
    units, shown = study.units, study.rows[:MOST_ROWS]
    conditions = list(dict.fromkeys(c for rig in study.rigs for c in varied([r for r in study.rows if r.rig == rig])))
    known = list(dict.fromkeys(name for row in study.rows for name in row.parameters))
    used = dict(zip(map(id, study.rows), used_sds(study.rows), strict=True))
    head = ["rig", "observable", "value", "sd", "n", *(declared(c, units) for c in conditions)]
    head += [*USED, *(declared(name, units) for name in known), "order", "split", "reason", "note"]
    rows = [
        [
            row.rig,
            declared(row.observable, study.units_of(row.rig)),
            number(row.value),
            number(row.sd, 3),
            f"{row.n:g}",
            *(number(row.conditions.get(c)) for c in conditions),
            _used(used[id(row)]),
            row.setup,
            number(row.setup_sd, 3) if row.setup_sd else "",
            *(number(row.parameters.get(name)) for name in known),
            "" if row.order is None else f"{row.order:g}",
            row.split,
            row.reason,
            row.note,
        ]
        for row in shown
    ]
    of_fit = {*USED, *(declared(name, units) for name in known)}
    kept = [
        k
        for k in range(len(head))
        if head[k] in ALWAYS or len({row[k] for row in rows}) > 1 or (head[k] in of_fit and any(row[k] for row in rows))
    ]
    caption = "Every row" if len(rows) == len(study.rows) else f"The first {len(rows)} of {len(study.rows)} rows"
    return table(
        [head[k] for k in kept],
        [[row[k] for k in kept] for row in rows],
        [m for m, k in enumerate(kept) if 2 <= k < len(head) - 3 and head[k] not in ("setup", "sd used")],
        caption + " of measurements.csv (a column that never changes is left out)",
    )


def _used(used: UsedSd) -> str:
    """`2.6 (replicates scatter 5.1 times as much ...)` where it is not the stated one."""
    return "" if used.why == AS_STATED else f"{number(used.sd, 3)} ({used.why})"


def left_out(study: Study) -> Table | None:
    """Rows of which nothing is made, each with its reason; None without any."""
    if not study.left_out:
        return None
    rows = [
        [
            row.rig,
            declared(row.observable, study.units_of(row.rig)),
            number(row.value),
            "; ".join(
                f"{declared(c, study.units_of(row.rig))} {number(v)}"
                for c, v in row.conditions.items()
                if c not in row.assumed
            ),
            row.reason,
        ]
        for row in study.left_out
    ]
    caption = "Left out (split leave_out): used for nothing"
    return table(("rig", "observable", "value", "conditions", "reason"), rows, (2,), caption)


def varied(rows: Sequence[Measurement]) -> list[str]:
    """The conditions of a rig's rows that change from row to row."""
    return [c for c in rows[0].conditions if len({row.conditions[c] for row in rows}) > 1]


def _span(values: Sequence) -> str:
    if isinstance(values[0], str):
        return ", ".join(dict.fromkeys(values))
    low, high = min(values), max(values)
    return number(low) if low == high else f"{number(low)} to {number(high)}"
