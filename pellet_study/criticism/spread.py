"""The scatter of readings is data too: do the readings of one condition scatter as the model's do from seed to seed?

Of each rig's observable the relative standard deviation of one reading, pooled over the conditions, is compared with that of
one simulation at the calibrated point under the same conditions. F of their squares, two-sided, over all of them together.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.criticism.cell_means import cells_of

CLEAR = (
    0.001  # p below which the scatters differ: single readings are not normal, so that F is to be trusted no further
)
REGULAR, WILD = "too regular", "too wild"


@dataclass(frozen=True)
class Scatter:
    """Relative standard deviations of one reading and of one simulation, and p that they are the same."""

    rig: str
    observable: str
    measured: float
    simulated: float
    p: float

    @property
    def judgement(self) -> str:
        """What the model is; empty where nothing tells."""
        if self.p >= CLEAR:
            return ""
        return REGULAR if self.simulated < self.measured else WILD


def scatters(state: CalibratedStudy) -> tuple[Scatter, ...]:
    """The scatter of every observable that is simulated with more than one seed and read more than once."""
    model = state.model
    if not model.scatters:
        return ()
    spread, seeds = model.spread(state.fit.point)
    found = []
    cells = cells_of([row for row in state.study.rows if row.split == "fit"])
    for rig, observable in dict.fromkeys((c[0].rig, c[0].observable) for c in cells):
        mine = [k for k, cell in enumerate(cells) if (cell[0].rig, cell[0].observable) == (rig, observable)]
        squares, dof = np.zeros(2), np.zeros(2)
        for k in mine:
            cell, case = cells[k], state.cells.case[k]
            mean = sum(row.n * row.value for row in cell) / sum(row.n for row in cell)
            own = sum((row.n - 1) * row.sd**2 for row in cell if row.sd is not None)
            between = sum(row.n * (row.value - mean) ** 2 for row in cell)
            known = sum(row.n - 1 for row in cell if row.sd is not None) + len(cell) - 1
            if known and mean and seeds[case] > 0:
                squares += (own + between) / mean**2, seeds[case] * spread[case] ** 2
                dof += known, seeds[case]
        if dof.min() < 1 or not (squares > 0).all():
            continue
        measured, simulated = np.sqrt(squares / dof)
        ratio = (measured / simulated) ** 2
        tail = special.fdtrc(dof[0], dof[1], ratio) if ratio > 1 else special.fdtrc(dof[1], dof[0], 1 / ratio)
        found.append(Scatter(rig, observable, float(measured), float(simulated), float(min(1.0, 2 * tail))))
    return tuple(replace(one, p=min(1.0, len(found) * one.p)) for one in found)
