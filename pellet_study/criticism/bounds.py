"""A constant that ends at its bound: what that means, and what can be done there."""

from dataclasses import replace

from pellet_study.criticism.calibration import CalibratedStudy, fit_study
from pellet_study.criticism.likely_unit import LikelyUnit
from pellet_study.study.study import Study


def stuck_words(state: CalibratedStudy, name: str, span: tuple[float, float], unit: LikelyUnit | None = None) -> str:
    """What it means that a constant ends at its bound, and what can be done there.

    To set the bound farther out is advised where the constant may lie there, where no unit is the likely cause, and, where
    that can be seen without simulations, where it does not end at the farther bound as well.
    """
    (low, high), (least, most) = span, declared_limits(state, name)
    value = state.fit.point[state.model.column[name]]
    upper = high - value < value - low
    bound, limit = (high, most) if upper else (low, least)
    if unit is not None:
        return f"{name} ends at {bound:g}, a bound of its range: see the unit of {unit.column} first"
    if (limit <= bound) if upper else (limit >= bound):
        return (
            f"{name} ends at {bound:g}, beyond which there is none: the model does not hold the data; look for a missing "
            "effect, and for a wrong unit in measurements.csv"
        )
    if _stuck_there_too(state.study, name, limit, upper):
        return (
            f"{name} ends at {bound:g}, a bound of its range in the study, and would end at {limit:g} too, beyond which there is none: "
            "the model does not hold the data; look for a missing effect, and for a wrong unit in measurements.csv"
        )
    return (
        f"{name} ends at {bound:g}, a bound of its range in the study: the range, or the model, does not hold the data; where "
        f"the data may be right, set its {'max' if upper else 'min'} farther out first ({limit:g} at most)"
    )


def declared_limits(state: CalibratedStudy, name: str) -> tuple[float, float]:
    """Beyond what a constant is none: the usual range of a rig's parameter where it declares one, else its limits; an effect's."""
    catalogue, (first, _, second) = state.study.catalogue, name.partition(".")
    if second:
        quantities = [catalogue.effects[first].parameters[second]]
        spans = [(q["min"], q["max"]) for q in quantities]
    else:
        rigs = (catalogue.rigs[rig].parameters for rig in state.study.rigs)
        quantities = [parameters[name] for parameters in rigs if name in parameters]
        spans = [q.get("physical", (q["min"], q["max"])) for q in quantities]
    return max(float(low) for low, _ in spans), min(float(high) for _, high in spans)


def _stuck_there_too(study: Study, name: str, limit: float, upper: bool) -> bool:
    """Whether a constant of formulas ends at a farther bound as well; False where that takes simulations."""
    if name not in study.parameters or any(study.catalogue.rigs[rig].on_yade for rig in study.rigs):
        return False
    wider = replace(study.parameters[name], **{"high" if upper else "low": limit})
    fitted = fit_study(replace(study, parameters={**study.parameters, name: wider}))
    column = fitted.model.column[name]
    return any(bool(at) for c, at in zip(fitted.fit.problem.free, fitted.fit.at_bound, strict=True) if c == column)
