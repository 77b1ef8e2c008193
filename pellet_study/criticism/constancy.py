"""Constancy: does a calibrated constant drift with a condition, or differ between rigs? Score tests, the worst first."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.criticism.cell_means import CellMeans
from pellet_study.criticism.lack_of_fit import absorbed_basis
from pellet_study.criticism.least_squares import Fit
from pellet_study.criticism.score_tests import VISIBLE, exceedance, largest_null, standardised, visible
from pellet_study.model.model import Case, Model

# p over all directions together below which a constant drifts, and the model fails; the gate of `diagnose` has most of
# the 5 % of alarms that nothing hidden may raise
DRIFT = 0.001
BESIDE = 0.05  # p of what is left of a drift beside worse ones, below which it stands by itself
SAME = 1e-3  # of a direction's square, what is its own beside others, from which on it is told from them
NO_MORE = 2.0  # standard errors that a drift must be beyond another one to be told from it


@dataclass(frozen=True)
class Drift:
    """A calibrated constant that does not stay constant: z over one condition, p over all directions together.

    `shape` is `rises`, `bends`, `differs` (of a rig from the others), or the word at which it differs from the others. `alone` is
    false where it only comes along with a larger one, `instead` names the conditions that changed along with its own, so that
    these data do not tell which of them it is.
    """

    parameter: str
    rig: str
    condition: str
    shape: str
    z: float
    p: float
    alone: bool = True
    instead: tuple[str, ...] = ()


def constancy_tests(
    state: CalibratedStudy, rigs: frozenset[str] | None = None, birge: bool = True
) -> tuple[Drift, ...]:
    """Constancy of every calibrated constant over every condition, the worst first; p is over all of them together.

    Parameters
    ----------
    rigs : only in these
    birge : in units of the residual scatter where it exceeds the replicates' (`standardised`); without, in units of the
        replicates' scatter where that is known, as lack of fit is, so that misfit elsewhere excuses nothing
    """
    names = [state.model.names[c] for c in state.fit.problem.free]
    labels, directions = drift_directions(state.model, state.cells, state.fit, names)
    inside = [k for k, label in enumerate(labels) if rigs is None or label.rig in rigs]
    labels = [labels[k] for k in inside]
    if not labels:
        return ()
    directions, basis = directions[inside], absorbed_basis(state.fit.jacobian)
    seen = visible(directions, basis)
    size = np.linalg.norm(seen, axis=1)
    keep = size > VISIBLE * np.maximum(np.linalg.norm(directions, axis=1), 1e-300)
    if not keep.any():
        return ()
    unit = seen[keep] / size[keep, None]
    if not state.cells.scale_known and len(state.cells.case) - basis.shape[1] < 2:
        return ()
    z = standardised(state.fit.residual[None], unit, basis, state.cells, True, birge)[0]
    null = largest_null(unit, basis, state.cells, True, birge)
    kept = [label for label, k in zip(labels, keep, strict=True) if k]
    drifts = [
        Drift(label.parameter, label.rig, label.condition, label.shape, float(v), exceedance(null, abs(v)))
        for label, v in zip(kept, z, strict=True)
    ]
    return tuple(_apart(drifts, unit @ unit.T, null))


def _apart(drifts: Sequence[Drift], alike: np.ndarray, null: np.ndarray) -> list[Drift]:
    """The worst first; those that are nothing beyond a worse one are told from those that stand by themselves.

    Parameters
    ----------
    alike : (k, k) correlations of their directions
    null : draws of the largest |z| where nothing drifts
    """
    order = sorted(range(len(drifts)), key=lambda k: -abs(drifts[k].z))
    z = np.array([d.z for d in drifts])
    alone: list[int] = []
    for k in order:
        among = np.linalg.pinv(alike[np.ix_(alone, alone)], hermitian=True) @ np.column_stack(
            [z[alone], alike[alone, k]]
        )
        rest = 1 - float(alike[k, alone] @ among[:, 1])
        beyond = (z[k] - float(alike[k, alone] @ among[:, 0])) / np.sqrt(rest) if rest > SAME else 0.0
        if not alone or exceedance(null, abs(beyond)) < BESIDE:
            alone.append(k)
    found = []
    for k in order:
        own = drifts[k]
        others = [
            drifts[m].condition
            for m in order
            if m not in alone and (drifts[m].rig, drifts[m].parameter) == (own.rig, own.parameter)
            if drifts[m].condition not in (own.condition, "rig") and _no_more(z[k], z[m], float(alike[k, m]))
        ]
        found.append(replace(own, alone=k in alone, instead=tuple(dict.fromkeys(others)) if k in alone else ()))
    return found


def _no_more(z: float, other: float, alike: float) -> bool:
    """Whether a drift is nothing beyond another one, so that either may be meant."""
    rest = 1 - alike**2
    return rest < SAME or abs(z - alike * other) < NO_MORE * np.sqrt(rest)


def freed(fitted: Fit, direction: np.ndarray) -> tuple[Fit, float]:
    """A fit with one whitened direction freed besides its own, to first order, and how far along it the data are."""
    seen = visible(direction[None], absorbed_basis(fitted.jacobian))[0]
    square = float(seen @ seen)
    slope = float(seen @ fitted.residual) / square if square > 0 else 0.0
    residual = fitted.residual - slope * seen
    jacobian = np.column_stack([fitted.jacobian, direction])
    return replace(fitted, residual=residual, chi2=float(residual @ residual), jacobian=jacobian), slope


class Direction(NamedTuple):
    """What a direction of drift is of: a constant in a rig, over a condition, or over `rig` against the other rigs."""

    parameter: str
    rig: str
    condition: str
    shape: str


def drift_directions(
    model: Model, cells: CellMeans, fitted: Fit, names: Sequence[str]
) -> tuple[list[Direction], np.ndarray]:
    """What each direction is of, and the (k, n) directions, whitened.

    The change of the predictions with a constant, J_k, weighted with the standardised condition over one rig's cells, with
    its square, with one where a condition is a certain word, or, for a constant that other rigs share, with one.
    """
    rigs = np.array([model.cases[c].rig for c in cells.case], dtype=object)
    labels, directions = [], []
    diagonal = cells.whiten.ndim == 1
    raw = fitted.jacobian if diagonal else np.linalg.solve(cells.whiten, fitted.jacobian)
    for rig in dict.fromkeys(rigs):
        in_rig = rigs == rig
        over = shapes_of([model.cases[c] for c in cells.case[in_rig]])
        for column, name in enumerate(names):
            if not np.linalg.norm(fitted.jacobian[in_rig, column]) > 0:
                continue
            shapes = list(over)
            if np.linalg.norm(fitted.jacobian[~in_rig, column]) > 0:
                shapes.append(("rig", "differs", np.ones(in_rig.sum())))
            for condition, shape, values in shapes:
                weights = np.zeros(len(rigs))
                weights[in_rig] = values
                direction = weights * raw[:, column]
                labels.append(Direction(name, rig, condition, shape))
                directions.append(direction if diagonal else cells.whiten @ direction)
    return labels, np.array(directions)


def shapes_of(cases: Sequence[Case]) -> list[tuple[str, str, np.ndarray]]:
    """(condition, shape, value at each case) of the ways in which something may go with the conditions of a rig's cases."""
    shapes = []
    for condition in cases[0].conditions:
        values = np.array([case.conditions[condition] for case in cases])
        words = values.dtype.kind == "U"
        levels = len(np.unique(values))
        if levels < 2:
            continue
        if words:  # of two words the one says what the other does
            named = np.unique(values) if levels > 2 else np.unique(values)[1:]
            shapes += [(condition, str(word), (values == word).astype(float)) for word in named]
            continue
        s = np.log(values) if (values > 0).all() else values
        s = (s - s.mean()) / s.std()
        shapes.append((condition, "rises", s))
        if levels > 2:
            shapes.append((condition, "bends", s**2 - 1))
    return shapes
