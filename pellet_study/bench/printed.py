"""What the source paper prints of its bench tests: readings, solutions, and the sweeps of Tables 3 and 5."""

from dataclasses import dataclass

import numpy as np

from pellet_study.bench.parabola import Parabola, fit_parabola
from pellet_study.bench.stages import Stage
from pellet_study.paper import printed

_MEASURED = {"a1": "b1_physical_mm", "a2": "b2_physical_deg", "a3": "b3_physical_mm"}
_SOLUTION = {"a1": "a1_solution", "a2": "a2_solution", "a3": "a3_solution"}


@dataclass(frozen=True)
class PrintedSweep:
    """The paper's rows of a sweep, (n,) each, and the parabola through them."""

    x: np.ndarray
    y: np.ndarray
    curve: Parabola


def measured(stage: Stage) -> float:
    """The paper's reading of a stage, in the unit of its observable."""
    return printed.tables()["text"][_MEASURED[stage.symbol]]


def solution(stage: Stage) -> float:
    """The paper's value of a stage's parameter."""
    return printed.tables()["text"][_SOLUTION[stage.symbol]]


def sweep(stage: Stage) -> PrintedSweep | None:
    """The paper's sweep of a stage, None where it is not printed."""
    if stage.table is None:
        return None
    rows = printed.table(stage.table)
    x, y = rows.iloc[:, 1].to_numpy(float), rows.iloc[:, 2].to_numpy(float)
    return PrintedSweep(x, y, fit_parabola(x, y))
