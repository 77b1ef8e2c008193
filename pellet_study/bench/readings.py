"""What was measured in the bench tests: a reading a rig, the mean of its rows."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pellet_study.bench.stages import STAGES
from pellet_study.errors import InputError
from pellet_study.study.measurements import Measurement


@dataclass(frozen=True)
class Reading:
    """A bench measurement: mean of n readings with their standard deviation (None where unknown), and its conditions."""

    value: float
    sd: float | None
    n: int
    conditions: dict[str, Any]


def readings(rows: Iterable[Measurement]) -> dict[str, Reading]:
    """The reading of each bench rig: the mean over its fit rows, which must share their conditions.

    Raises
    ------
    InputError : rows of one rig under different conditions, or with a known parameter
    """
    fitted = [row for row in rows if row.split == "fit"]
    found = {}
    for stage in STAGES:
        of_stage = [row for row in fitted if (row.rig, row.observable) == (stage.rig, stage.observable)]
        if of_stage:
            found[stage.rig] = _mean(stage.rig, of_stage)
    return found


def _mean(rig: str, rows: Sequence[Measurement]) -> Reading:
    """The mean of the rows of a rig, each with the weight of its readings."""
    if any(dict(row.conditions) != dict(rows[0].conditions) for row in rows):
        raise InputError(
            f"measurements, lines {', '.join(str(row.line) for row in rows)}: bench calibrates at one setting, but these "
            f"{rig} rows differ in their conditions; use `compare` for several, or leave one setting"
        )
    if any(row.parameters for row in rows):
        raise InputError(
            f"measurements, line {rows[0].line}: bench calibrates the parameters itself; leave the parameter columns of "
            f"the {rig} rows blank, or use `compare`"
        )
    n = sum(row.n for row in rows)
    value = sum(row.n * row.value for row in rows) / n
    squares = [row.n * row.sd**2 for row in rows if row.sd is not None]
    sd = float(np.sqrt(sum(squares) / n)) if len(squares) == len(rows) else None
    if sd is None and len(rows) > 1:
        sd = float(np.std([row.value for row in rows], ddof=1))
    return Reading(value, sd, n, dict(rows[0].conditions))
