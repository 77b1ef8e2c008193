"""Readings taken in the order of a condition: where the model fails along it, a drift with time would look the same."""

from collections.abc import Sequence

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.criticism.constancy import Drift
from pellet_study.criticism.grades import DOUBTFUL
from pellet_study.criticism.time_drift import along


def order_warnings(state: CalibratedStudy, drifts: Sequence[Drift]) -> list[str]:
    """What to say where a constant drifts with a condition in whose order the readings were taken: time would look the same."""
    said = []
    for rig in state.study.rigs:
        rows = [row for row in state.study.rows if row.rig == rig and row.split == "fit" and row.order is not None]
        ran = along(rows) if rows else ()
        names = [c for c in ran if any(d.rig == rig and d.condition == c and d.p < DOUBTFUL for d in drifts)]
        if names:
            said.append(in_order_words(rig, names))
    return said


def in_order_words(rig: str, conditions: Sequence[str]) -> str:
    """That readings were taken in the order of conditions, and what to do."""
    names = " and ".join(conditions)
    return (
        f"{rig} was read in the order of {names}: a drift with time would look like an effect of it, and nothing tells the two "
        "apart; randomise the order, and take readings again in it"
    )
