"""Is a whole column in another unit? The model refitted with it in each unit that people write it in.

Where a model does not fit, and with all readings of an observable, or all values of a
condition, in one other unit it fits with no constant at a bound, that unit is the likely cause.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

from scipy import stats

from pellet_study.criticism.calibration import CalibratedStudy, fit_study
from pellet_study.criticism.cell_means import cell_means
from pellet_study.criticism.constancy import constancy_tests
from pellet_study.criticism.grades import judged, tests_of
from pellet_study.criticism.lack_of_fit import lack_by_rig, lack_of_fit
from pellet_study.criticism.verdicts import Grade
from pellet_study.errors import InputError
from pellet_study.output.words import number
from pellet_study.study.measurements import Measurement
from pellet_study.study.ranges import limits
from pellet_study.study.units import in_unit, other_units

Rows = tuple[Measurement, ...]
TOO_WELL = 1e-4  # p of so small a chi2, below which an sd is too large to be in that unit


@dataclass(frozen=True)
class LikelyUnit:
    """A column of a rig that fits in another unit; `chi2` and `chi2_there` of the model as given and in that unit."""

    rig: str
    column: str
    declared: str
    unit: str
    chi2: float
    chi2_there: float
    with_sd: bool = False

    @property
    def words(self) -> str:
        """The sentence."""
        also = " and their sd" if self.with_sd else ""
        return (
            f"{self.rig}: {self.column}{also} given in {self.unit} instead of{in_unit(self.declared) or ' as a number'} is the "
            f"likely cause: read so, every row fits (chi2 {number(self.chi2)} falls to {number(self.chi2_there)})"
        )


def likely_unit(state: CalibratedStudy) -> LikelyUnit | None:
    """The unit that explains what does not fit; None where the model fits, nothing tells, or no unit does.

    A condition is tried where rigs are formulas only: elsewhere that would take simulations.
    """
    if not state.cells.scale_known or not state.fit.problem.free or _grade(state) != Grade.FAILS:
        return None
    for (rig, column, unit), (name, size) in _tried(state):
        if column in state.study.catalogue.rigs[rig].observables:
            for with_sd in (True, False):
                if there := _refitted(state, partial(_reading, rig, column, size, with_sd), same_cases=True):
                    return LikelyUnit(rig, column, unit, name, state.fit.chi2, there, with_sd)
        elif there := _refitted(state, partial(_condition, rig, column, size), same_cases=False):
            return LikelyUnit(rig, column, unit, name, state.fit.chi2, there)
    return None


def _tried(state: CalibratedStudy) -> Iterator[tuple[tuple[str, str, str], tuple[str, float]]]:
    """((rig, column, its unit), (another unit, its size)) of every column that has one."""
    study = state.study
    formulas = all(not study.catalogue.rigs[rig].on_yade for rig in study.rigs)
    for rig in study.rigs:
        declared, rows = study.catalogue.rigs[rig], [row for row in study.rows if row.rig == rig]
        columns: dict[str, str] = {o: declared.units.get(o, "") for o in dict.fromkeys(r.observable for r in rows)}
        if formulas:
            columns |= {c: _unit_of(q, c, rows) for c, q in declared.conditions.items()}
        for column, unit in columns.items():
            for name, size in other_units(unit).items():
                yield (rig, column, unit), (name, size)


def _unit_of(quantity: Mapping, condition: str, rows: list[Measurement]) -> str:
    """The unit of a condition that is given as a number; "" of a word, or where its default is assumed."""
    return "" if "options" in quantity or condition in rows[0].assumed else str(quantity.get("unit", ""))


def _reading(rig: str, observable: str, size: float, with_sd: bool, row: Measurement) -> Measurement:
    """A row with its reading in another unit."""
    if (row.rig, row.observable) != (rig, observable):
        return row
    sd = row.sd * size if with_sd and row.sd is not None else row.sd
    setup_sd, resolution = (x * size if with_sd else x for x in (row.setup_sd, row.resolution))
    return replace(row, value=row.value * size, sd=sd, setup_sd=setup_sd, resolution=resolution)


def _condition(rig: str, condition: str, size: float, row: Measurement) -> Measurement:
    """A row with a condition in another unit."""
    if row.rig != rig:
        return row
    return replace(row, conditions={**row.conditions, condition: float(row.conditions[condition]) * size})


def _refitted(state: CalibratedStudy, changed: Callable[[Measurement], Measurement], same_cases: bool) -> float | None:
    """chi2 of the model refitted to rows read otherwise; None where it does not fit them, or they cannot be."""
    study = replace(state.study, rows=tuple(map(changed, state.study.rows)))
    if not _possible(study.rows, state):
        return None
    try:
        if same_cases:
            cells = cell_means(state.model, [row for row in study.rows if row.split == "fit"])
            refitted = fit_study(study, state.model, cells)
        else:
            refitted = fit_study(study)
    except (InputError, ArithmeticError, ValueError):
        return None
    fits = not any(refitted.fit.at_bound) and _grade(refitted) == Grade.FITS
    dof = len(refitted.cells.case) - len(refitted.fit.problem.free)
    by_chance = dof < 1 or stats.chi2.cdf(refitted.fit.chi2, dof) > TOO_WELL
    return refitted.fit.chi2 if refitted.cells.scale_known and fits and by_chance else None


def _possible(rows: Rows, state: CalibratedStudy) -> bool:
    """Whether the rigs can simulate the conditions of some rows."""
    for row in rows:
        for name, quantity in state.study.catalogue.rigs[row.rig].conditions.items():
            if "options" not in quantity:
                low, high = limits(quantity)
                if not low <= float(row.conditions[name]) <= high:
                    return False
    return True


def _grade(state: CalibratedStudy) -> Grade | None:
    """How well a model fits."""
    tests = tests_of(lack_of_fit(state.fit, state.cells), lack_by_rig(state), constancy_tests(state))
    return judged(tests).grade
