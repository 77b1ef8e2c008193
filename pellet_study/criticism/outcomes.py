"""What the rivals of the present model would do to its error, on the rows fitted and on those held out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.criticism.compare import HELD_OUT_FAILS, rms_error
from pellet_study.criticism.holdout import holdout_p
from pellet_study.criticism.lack_of_fit import lack_of_fit
from pellet_study.criticism.least_squares import Fit
from pellet_study.criticism.residuals import RowResidual, row_residuals
from pellet_study.criticism.rivals import Rival
from pellet_study.criticism.ways import physical
from pellet_study.output.words import number


@dataclass(frozen=True)
class Outcome:
    """The present model with some effects more, fitted anew; as in `Comparison`, what cannot be known is None.

    `values` are those of the effects' parameters, {effect.parameter: value}; `refused` says why they are not the answer.
    """

    effects: tuple[str, ...]
    values: Mapping[str, float]
    chi2: float | None
    dof: int
    lack_of_fit_p: float | None
    rms_error: float | None
    holdout_rms_error: float | None
    holdout_p: float | None
    rows: tuple[RowResidual, ...]
    refused: str = ""

    @property
    def holdout_contradicts(self) -> bool:
        """Whether the rows held out refute it."""
        return self.holdout_p is not None and self.holdout_p < HELD_OUT_FAILS


def outcome_of(state: CalibratedStudy, rival: Rival, refused: str = "") -> Outcome:
    """What a rival does to the error."""
    fitted, cells, model = rival.fit, state.cells, state.model
    there = replace(state, fit=fitted)
    rows = row_residuals(there)
    added = fitted.problem.free[len(state.fit.problem.free) :]
    return Outcome(
        effects=rival.effects,
        values={model.names[c]: float(fitted.point[c]) for c in added},
        chi2=fitted.chi2 + cells.replicate_chi2 if cells.scale_known else None,
        dof=sum(row.split == "fit" for row in state.study.rows) - len(fitted.problem.free),
        lack_of_fit_p=lack_of_fit(fitted, cells),
        rms_error=rms_error(rows, "fit"),
        holdout_rms_error=rms_error(rows, "holdout"),
        holdout_p=holdout_p(there, rows),
        rows=rows,
        refused=refused,
    )


def nearest_miss(
    state: CalibratedStudy,
    rivals: Sequence[Rival],
    beyond: Mapping[str, Fit],
    closed: str,
) -> Outcome | None:
    """Of the refused, what comes nearest to explaining the data, and why it was refused; None where nothing was fitted.

    Parameters
    ----------
    rivals : those fitted within their physical range, single effects and pairs
    beyond : {effect: fit without that limit}
    closed : why nothing could be added at all, empty where it could
    """
    everything = [*rivals, *(Rival((name,), fit, False) for name, fit in beyond.items())]
    if not everything:
        return None
    nearest = min(everything, key=lambda rival: rival.fit.chi2)
    if any(nearest.fit is fit for fit in beyond.values()):
        return outcome_of(state, nearest, implausible(state, nearest))
    return outcome_of(
        state, nearest, closed or nearest.objection or "its size is implausible, or another explains better"
    )


def implausible(state: CalibratedStudy, rival: Rival) -> str:
    """At which size only an effect would explain, and what it may be; nothing where its size is possible."""
    name, model = rival.effects[0], state.model
    parameters = model.study.catalogue.effects[name].parameters
    beyond = []
    for (parameter, quantity), (low, high) in zip(parameters.items(), physical(model, name), strict=True):
        value = rival.fit.point[model.column[f"{name}.{parameter}"]]
        if not low <= value <= high:
            unit = "" if quantity["unit"] in ("1", "") else f" {quantity['unit']}"
            beyond.append(
                f"{parameter} = {number(value, 3)}{unit}, physical {number(low, 3)} to {number(high, 3)}{unit}"
            )
    return f"it would need an implausible size: {'; '.join(beyond)}"
