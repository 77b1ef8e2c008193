"""Rows beside their predictions."""

from dataclasses import dataclass

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.criticism.scatter import last_digit, no_less_than_resolution, pooled_sd
from pellet_study.model.model import key
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Study


@dataclass(frozen=True)
class RowResidual:
    """One row of the file beside its prediction; `z` in units of the row's standard uncertainty, None if unknown."""

    row: Measurement
    predicted: float
    residual: float
    z: float | None


def row_residuals(state: CalibratedStudy) -> tuple[RowResidual, ...]:
    """Every row beside its prediction; z by the uncertainty of the row itself (not of its cell)."""
    model, study = state.model, state.study
    place = {key(case): k for k, case in enumerate(model.cases)}
    predicted = model.predict(state.fit.point)
    reading = reading_sd(study)
    residuals = []
    for k, row in enumerate(study.rows):
        c = place[key(row)]
        value = float(predicted.mean[0, c])
        spread = reading[k]
        z = None
        if spread is not None:
            if row.sd is not None:
                spread *= state.cells.contradicted.get((row.rig, row.observable), 1.0)
            total = np.sqrt(spread**2 / row.n + row.setup_sd**2 + predicted.variance[0, c])
            z = float((row.value - value) / total)
        residuals.append(RowResidual(row, value, row.value - value, z))
    return tuple(residuals)


def reading_sd(study: Study) -> list[float | None]:
    """Standard deviation of one reading for each row: as stated, else pooled from replicates, else None."""
    blank: dict[tuple[str, str], dict[tuple, list[Measurement]]] = {}
    stated: dict[tuple[str, str], list[float]] = {}
    for row in study.rows:
        group = row.rig, row.observable
        if row.sd is not None:
            stated.setdefault(group, []).append(row.sd)
        elif row.split == "fit":
            blank.setdefault(group, {}).setdefault((key(row), row.setup), []).append(row)
    of_stated = {group: float(np.sqrt(np.mean(np.square(sds)))) for group, sds in stated.items()}
    pooled: dict[tuple[str, str], tuple] = {}
    for group, replicates in blank.items():
        means = np.array([np.average([r.value for r in c], weights=[r.n for r in c]) for c in replicates.values()])
        dof = np.array([len(c) - 1.0 for c in replicates.values()])
        if not len(means) or dof.sum() == 0:
            continue
        within = np.array(
            [sum(r.n * (r.value - m) ** 2 for r in c) for c, m in zip(replicates.values(), means, strict=True)]
        )
        sd = np.sqrt(within / np.maximum(dof, 1))
        resolution = np.array([max(r.resolution for r in c) for c in replicates.values()])
        step = np.array([last_digit([r.value for r in c]) for c in replicates.values()])
        pooled_sds, _ = no_less_than_resolution("", pooled_sd(means, sd, dof), np.abs(means), resolution, step)
        pooled[group] = (means, pooled_sds)
    known: list[float | None] = []
    for row in study.rows:
        spread = None if row.sd is None else max(row.sd, row.resolution)
        if spread is None and (row.rig, row.observable) in pooled:
            means, sd = pooled[row.rig, row.observable]
            spread = float(sd[np.argmin(np.abs(means - row.value))])
        known.append(of_stated.get((row.rig, row.observable)) if spread is None else spread)
    return known
