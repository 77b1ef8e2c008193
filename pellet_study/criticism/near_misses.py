"""A near miss: the right kind of effect by another law than nature's, which explains only if its amount drifts.

A candidate that is refused is looked at once more with its amount free to go with one condition of a rig in which it
acts, a (1 + b s), s the standardised condition (the direction J_a s(log c) of `constancy`, to first order). It is a near
miss where it takes most of the misfit as it is, explains the data with the drift, and where its amount stays within its
physical range at every level that was measured. Its size is then no constant of nature, and it is not added.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, with_own_noise
from pellet_study.criticism.constancy import Direction, drift_directions, freed, shapes_of
from pellet_study.criticism.rivals import Rival, failing_rigs, objection_to
from pellet_study.criticism.signatures import Signature
from pellet_study.criticism.ways import columns_of, physical
from pellet_study.rigs.declared import Condition

MOST = (
    0.8  # share of the misfit beyond its degrees of freedom that a near miss takes with one amount for all conditions
)


@dataclass(frozen=True)
class Drifting:
    """How the amount of a near miss goes with a condition of a rig: its size at the lowest and the highest level, {level: size}."""

    effect: str
    parameter: str
    rig: str
    condition: str
    amounts: dict[Condition, float]

    @property
    def way(self) -> str:
        """Whether it rises or falls."""
        first, last = self.amounts.values()
        return "rise" if last > first else "fall"


def near_misses(
    state: CalibratedStudy,
    rivals: Sequence[Rival],
    shown: Sequence[Signature],
    plausible: Collection[str],
    below: float = np.inf,
) -> tuple[list[Rival], tuple[Drifting, ...]]:
    """All single effects that are near misses, the best first, and how the amount of each drifts; empty where none is.

    How well each does is no reason to drop another: their laws are wrong, and the drift is of first order.

    Parameters
    ----------
    rivals : single effects that were fitted and refused
    plausible : those of a possible size
    below : chi2 that they must come to with the drift
    """
    failing, excess = failing_rigs(state), state.fit.chi2 - (len(state.cells.case) - len(state.fit.problem.free))
    found: dict[tuple[str, ...], Drifting] = {}
    near = []
    for rival in rivals:
        if rival.explains or len(rival.effects) != 1 or not set(rival.effects) <= set(plausible):
            continue
        if state.fit.chi2 - rival.fit.chi2 < MOST * excess:
            continue
        drifting = drift_that_explains(state, rival, failing, shown, below)
        if drifting is not None:
            near.append(rival)
            found[rival.effects] = drifting
    near.sort(key=lambda rival: rival.fit.chi2)
    return near, tuple(found[rival.effects] for rival in near)


def drift_that_explains(
    state: CalibratedStudy, rival: Rival, failing: frozenset[str], shown: Sequence[Signature], below: float
) -> Drifting | None:
    """The drift of a rival's amount over one condition with which it explains the data best; None where none does."""
    noisy, fitted = with_own_noise(state, rival.fit)
    amount = columns_of(state.model, rival.effects[0])[0]
    names = [state.model.names[c] for c in fitted.problem.free]
    labels, directions = drift_directions(state.model, noisy.cells, fitted, names)
    best: tuple[float, Drifting] | None = None
    for label, direction in zip(labels, directions, strict=True):
        if label.parameter != state.model.names[amount] or label.shape != "rises":
            continue
        with_it, slope = freed(fitted, direction)
        drifting = amounts_of(state, rival.effects[0], label, float(fitted.point[amount]), slope)
        if drifting is None or with_it.chi2 >= (below if best is None else best[0]):
            continue
        if not objection_to(noisy, with_it, rival.effects, failing, shown):
            best = with_it.chi2, drifting
    return None if best is None else best[1]


def amounts_of(state: CalibratedStudy, name: str, label: Direction, amount: float, slope: float) -> Drifting | None:
    """The amount at the lowest and the highest level of a condition; None where some of them lie beyond the physical range."""
    cases = [state.model.cases[c] for c in state.cells.case if state.model.cases[c].rig == label.rig]
    over = next(s for condition, shape, s in shapes_of(cases) if (condition, shape) == (label.condition, label.shape))
    levels = np.array([case.conditions[label.condition] for case in cases], dtype=float)
    ends: dict[Condition, float] = {
        float(levels[k]): amount + slope * float(over[k]) for k in (levels.argmin(), levels.argmax())
    }
    low, high = physical(state.model, name)[0]
    absent = state.study.catalogue.effects[name].neutral()[label.parameter.partition(".")[2]]
    if not all(low <= size <= high and (size - absent) * (amount - absent) > 0 for size in ends.values()):
        return None
    return Drifting(name, label.parameter.partition(".")[2], label.rig, label.condition, ends)
