"""Entries of measurements.csv that look wrong beside a fitted model: one row alone, a unit, a standard deviation.

One row: where a model does not fit and, refitted without that row, does. A unit: where the readings of a rig lie beyond what
its free constants can make and, read in another unit, within; an sd: where the readings scatter far less, or more, than it says.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from pellet_study.criticism.calibration import CalibratedStudy, part_of
from pellet_study.criticism.constancy import Drift, constancy_tests
from pellet_study.criticism.grades import DOUBTFUL, judged, tests_of
from pellet_study.criticism.lack_of_fit import lack_by_rig, lack_of_fit
from pellet_study.criticism.least_squares import fit, problem_of
from pellet_study.criticism.residuals import RowResidual
from pellet_study.criticism.verdicts import Grade
from pellet_study.model.model import key
from pellet_study.study.measurements import Measurement
from pellet_study.study.ranges import unusual_parameter
from pellet_study.study.units import other_units

FAR_OFF = 0.05  # p that a row of a model that lacks nothing is as far off, over all rows together
TRIED = 3  # of the worst rows, each left out by itself
CLOSER = 1e-3  # p of readings as close to the model, below which their sd is doubted
FARTHER = 5.0  # standard errors, in the mean over the rows, from which on an sd is doubted; a power of ten lies beyond
NEAR = 3.0  # times: a unit is named where its size is that near
POWER = 0.3  # decades about a power of ten within which an sd is likely off by it
REACH = 1.5  # times beyond what the constants can make, to allow for what the model lacks


@dataclass(frozen=True)
class LoneRow:
    """A row without which a model that does not fit does, `with_effects` where that takes some; `predicted` without it, `unit`
    the hint of another unit."""

    row: Measurement
    predicted: float
    grade: Grade
    lack_of_fit_p: float | None
    unit: str
    with_effects: tuple[str, ...] = ()


def far_off(state: CalibratedStudy) -> float | None:
    """Standard errors beyond which the worst of all rows lies by chance with probability `FAR_OFF` (Bonferroni's t)."""
    if not state.cells.scale_known:
        return None
    return float(special.stdtrit(state.cells.dof, 1 - FAR_OFF / (2 * len(state.study.rows))))


def lone_row(state: CalibratedStudy, rows: Sequence[RowResidual], limit: float | None) -> LoneRow | None:
    """The one row that keeps a model from fitting; None where several do, or replicates stand beside it."""
    cells, model = state.cells, state.model
    candidates = state.study.absent()
    if limit is None or len(cells.case) - 1 <= len(state.fit.problem.free):
        return None
    place = {key(case): k for k, case in enumerate(model.cases)}
    alone: dict[int, list[RowResidual]] = {}
    for r in rows:
        if r.row.split == "fit":
            alone.setdefault(place[key(r.row)], []).append(r)
    worst = [of_case[0] for of_case in alone.values() if len(of_case) == 1 and abs(of_case[0].z or 0.0) > limit]
    worst = [
        r for r in worst if not (candidates and at_an_end(r.row, state.study.rows))
    ]  # an effect may show there only
    found: list[tuple[float, LoneRow]] = []
    for one in sorted(worst, key=lambda r: -abs(r.z or 0.0))[:TRIED]:
        case = place[key(one.row)]
        kept = part_of(cells, cells.case != case)
        without = replace(state, cells=kept, fit=fit(model, kept, problem_of(model, 1, state.fit.point)))
        lack = lack_of_fit(without.fit, kept)
        grade = judged(tests_of(lack, lack_by_rig(without), constancy_tests(without))).grade
        if grade is None or grade == Grade.FAILS or lack is None:
            continue
        predicted = float(model.predict(without.fit.point).mean[0, case])
        unit = state.study.catalogue.rigs[one.row.rig].units.get(one.row.observable, "")
        found.append((lack, LoneRow(one.row, predicted, grade, lack, as_predicted(one.row.value, predicted, unit))))
    return max(found, key=lambda item: item[0])[1] if found else None


def at_an_end(row: Measurement, rows: Sequence[Measurement]) -> bool:
    """Whether a row is the only one at the lowest or the highest level of a condition in its rig."""
    for name, value in row.conditions.items():
        levels = [
            float(r.conditions[name]) for r in rows if r.rig == row.rig and not isinstance(r.conditions[name], str)
        ]
        ends = (min(levels), max(levels)) if len(set(levels)) > 1 else ()
        if value in ends and levels.count(float(value)) == 1:
            return True
    return False


def as_predicted(value: float, predicted: float, unit: str) -> str:
    """`15.4 cm would be 154 mm`, where that is near what is predicted and the value as it stands is not; else nothing."""
    if value * predicted <= 0 or 1 / NEAR < value / predicted < NEAR:
        return ""
    for name, size in other_units(unit).items():
        if 1 / REACH < size * value / predicted < REACH:
            return f"{value:.4g} {name} would be {size * value:.4g} {unit}"
    return ""


def doubted_units(state: CalibratedStudy) -> list[str]:
    """What to say of readings that only another unit brings within reach of a rig's free constants."""
    model, fitted, said = state.model, state.fit, []
    problem = fitted.problem
    points = np.repeat(fitted.point[None], 1 + 2 * len(problem.free), axis=0)
    for k, column in enumerate(problem.free):
        points[1 + 2 * k, column], points[2 + 2 * k, column] = problem.low[k], problem.high[k]
    mean = model.predict(points).mean[:, state.cells.case]
    for (rig, observable), places in _groups(state).items():
        values, unit = state.cells.mean[places], state.study.catalogue.rigs[rig].units.get(observable, "")
        low, high = np.nanmin(mean[:, places], axis=0), np.nanmax(mean[:, places], axis=0)
        low, high = low - (1 - 1 / REACH) * np.abs(low), high + (REACH - 1) * np.abs(high)
        if np.mean((low <= values) & (values <= high)) > 0.5:
            continue
        for name, size in other_units(unit).items():
            if ((low <= size * values) & (size * values <= high)).all():
                said.append(
                    f"{rig} {observable}: most readings lie beyond what the constants can make within their ranges; {values[0]:.4g} "
                    f"{name} would be {size * values[0]:.4g} {unit}, within: are they given in {name}?"
                )
                break
    return said


def doubted_sd(state: CalibratedStudy, drifts: Sequence[Drift]) -> list[str]:
    """What to say of stated standard deviations that the readings' scatter about the model, or each other, belies.

    Too small an sd leaves scatter without a shape; where a constant drifts the misfit has one, and is the model's.
    """
    cells, said = state.cells, list[str]()
    for (rig, observable), times in cells.contradicted.items():
        if hint := _or_unit(times, state.study.catalogue.rigs[rig].units.get(observable, "")):
            said.append(
                f"{rig} {observable}: replicates scatter {_times(times)} times as much as their sd says: is sd too small{hint}?"
            )
    if state.model.scatters or not cells.scale_known or cells.whiten.ndim > 1:
        return said
    free = len(state.fit.problem.free)
    for (rig, observable), places in _groups(state).items():
        rows = [r for r in state.study.rows if (r.rig, r.observable, r.split) == (rig, observable, "fit")]
        if any(r.sd is None or r.setup_sd for r in rows) or (rig, observable) in cells.contradicted:
            continue
        repeats = len(rows) - len(places)
        dof = len(places) * max(1 - free / len(cells.case), 0.0) + repeats
        if dof < 1:
            continue
        squares = float((state.fit.residual[places] ** 2).sum()) + cells.replicate_chi2_of[rig, observable]
        ratio = float(np.sqrt(squares / dof))
        unit = state.study.catalogue.rigs[rig].units.get(observable, "")
        if ratio < 1 and special.chdtr(dof, squares) < CLOSER:
            said.append(
                f"{rig} {observable}: the readings lie {_times(1 / max(ratio, 1e-3))} times closer to the model than their sd says; is sd "
                f"too large{_or_unit(ratio, unit)}? No effect can be seen that is smaller than it"
            )
        elif ratio > FARTHER and not any(drift.p < DOUBTFUL for drift in drifts):
            said.append(
                f"{rig} {observable}: the readings lie {_times(ratio)} times farther from the model than their sd says; where "
                f"that is not the model, is sd too small{_or_unit(ratio, unit)}?"
            )
    return said


def _times(ratio: float) -> str:
    return f"{ratio:.2g}" if ratio < 100 else f"{float(f'{ratio:.1g}'):.0f}"


def _or_unit(ratio: float, unit: str) -> str:
    """`, or in cm where mm is declared`: the unit by which the sd would be right, else the power of ten that it is near."""
    size = float(np.log10(max(ratio, 1e-300)))
    near = {name: abs(float(np.log10(one)) - size) for name, one in other_units(unit).items()}
    name = min(near, key=lambda n: near[n], default=None)
    if name is not None and near[name] < POWER:
        return f", or in {name} where {unit} is declared"
    if round(size) and abs(size - round(size)) < POWER:
        return f", or off by a factor of {10 ** abs(round(size)):g}"
    return ""


def doubted_constants(state: CalibratedStudy, values: Mapping[str, float]) -> list[str]:
    """What to say of fitted constants beyond their usual range."""
    said = []
    free = {state.model.names[c] for c in state.fit.problem.free}
    for rig in state.study.rigs:
        for name, quantity in state.study.catalogue.rigs[rig].parameters.items():
            words = unusual_parameter(name, quantity, [values[name]]) if name in free else ""
            said += [f"fitted: {words}; is every column in its unit?"] if words else []
    return list(dict.fromkeys(said))


def _groups(state: CalibratedStudy) -> dict[tuple[str, str], np.ndarray]:
    """The places of each rig's and observable's cells."""
    found: dict[tuple[str, str], list[int]] = {}
    for k, c in enumerate(state.cells.case):
        case = state.model.cases[c]
        found.setdefault((case.rig, case.observable), []).append(k)
    return {group: np.array(places) for group, places in found.items()}
