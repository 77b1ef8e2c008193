"""What was measured, as a part of the page."""

from collections.abc import Sequence
from pathlib import Path

from pellet_study.output.style import label
from pellet_study.output.words import number
from pellet_study.report import particles
from pellet_study.report.parts import table
from pellet_study.study.study import Study

MOST_ROWS = 20


def _counts(study: Study) -> str:
    held = sum(row.split == "holdout" for row in study.rows)
    return (
        f"{len(study.rows)} rows of measurements, {held} of them held out"
        if held
        else f"{len(study.rows)} rows of measurements"
    )


def _measured(study: Study, folder: Path) -> dict:
    summary = []
    for rig in study.rigs:
        mine = [row for row in study.rows if row.rig == rig]
        for observable in dict.fromkeys(row.observable for row in mine):
            rows = [row for row in mine if row.observable == observable]
            values = [row.value for row in rows]
            varied = _varied(rows)
            summary.append(
                [
                    rig,
                    label(observable),
                    len(rows),
                    sum(row.n for row in rows),
                    _span(values),
                    "; ".join(f"{label(c)} {_span([r.conditions[c] for r in rows])}" for c in varied) or "one setting",
                ]
            )
    conditions = list(dict.fromkeys(c for rig in study.rigs for c in _varied([r for r in study.rows if r.rig == rig])))
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
    always = ("rig", "observable", "value", "sd", "n")
    kept = [k for k in range(len(head)) if head[k] in always or len({r[k] for r in rows}) > 1]
    caption = "Every row" if len(rows) == len(study.rows) else f"The first {len(rows)} of {len(study.rows)} rows"
    return {
        "summary": table(
            ("rig", "observable", "rows", "readings", "from to", "conditions"),
            summary,
            (2, 3, 4),
            "By rig and observable",
        ),
        "rows": table(
            [head[k] for k in kept],
            [[row[k] for k in kept] for row in rows],
            [m for m, k in enumerate(kept) if 2 <= k < len(head) - 2],
            caption + " of measurements.csv (conditions, split and note are left out where they never change)",
        ),
        "pictures": particles.particles(study, folder),
    }


def _varied(rows) -> list[str]:
    return [c for c in rows[0].conditions if len({r.conditions[c] for r in rows}) > 1]


def _span(values: Sequence[float]) -> str:
    low, high = min(values), max(values)
    return number(low) if low == high else f"{number(low)} to {number(high)}"
