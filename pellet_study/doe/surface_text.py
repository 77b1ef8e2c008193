"""The analysis of a response surface, and the settings that meet a target of it, in words and tables."""

from pellet_study.doe.answers import plain
from pellet_study.doe.box_behnken import PREDICTED_R2_GAP, Surface
from pellet_study.doe.box_cox import BoxCox
from pellet_study.doe.cautions import surface_cautions, suspects_first
from pellet_study.doe.optimum import TargetSet
from pellet_study.doe.text import (
    EQUAL_REPLICATES,
    FOLLOWS_SELECTION,
    SATURATED,
    anova_text,
    equation,
    exactly_equal,
    extent_text,
    grid,
    head,
    loss,
    no_replicates,
    number,
    percent,
    prediction_text,
    probability,
    sparsity,
    summary_line,
)


def surface_text(surface: Surface) -> str:
    """The analysis of a response surface."""
    s = surface
    parts = [
        head(s, "Quadratic response surface"),
        f"coded:    {equation(s.coefficients)}\nphysical: {equation(s.physical_coefficients, 8)}",
        anova_text(s.anova),
        summary_line(s)
        + f"\nadequate precision {number(s.adequate_precision, 4)} (above 4 wanted), PRESS {number(s.press)}",
        _checks_text(s),
        _runs_text(s),
    ]
    if s.lenth:
        beyond = [name for name, value in s.scaled_effects.items() if abs(value) > s.lenth.margin_of_error]
        parts.append(
            f"Lenth, {s.lenth.contrasts} coefficients scaled to equal variance: {percent(1 - s.alpha)} margin of error "
            f"{number(s.lenth.margin_of_error)}; beyond it: {', '.join(beyond) or 'none'}{sparsity(s.lenth)}"
        )
    if s.stationary:
        place = ", ".join(
            f"{f.name} {number(float(f.physical(x)), 4)} (coded {x:.3f})"
            for f, x in zip(s.table.factors, s.stationary.coded, strict=True)
        )
        level = f"{s.table.response.name} {number(s.stationary.predicted)}"
        parts.append(f"stationary point: {s.stationary.kind}, {level} at {place}")
    return "\n\n".join(parts)


def _checks_text(surface: Surface) -> str:
    lines = []
    if surface.normality:
        lines.append(f"residuals: Shapiro-Wilk W {number(surface.normality[0])}, p {probability(surface.normality[1])}")
    if surface.box_cox:
        lines.append(box_cox_text(surface.box_cox))
    lines.append("VIF " + ", ".join(f"{name} {value:.3f}" for name, value in surface.vif.items()))
    return "\n".join(lines)


def box_cox_text(found: BoxCox) -> str:
    """The power that the likelihood favours, and whether a transformation is indicated."""
    if found.beyond is not None:
        return (
            f"Box-Cox power beyond {found.beyond:g}: no power transformation helps; look for single runs that the model "
            "misses (Cook's D) and for terms that it lacks"
        )
    need = (
        "a transformation is indicated (--transform applies it)"
        if found.transformation_needed
        else "no transformation is indicated"
    )
    low = "below -5" if found.low is None else number(found.low, 3)
    high = "above 5" if found.high is None else number(found.high, 3)
    return f"Box-Cox power {number(found.power, 3)} ({percent(found.level)} interval {low} to {high}): {need}"


def _runs_text(surface: Surface) -> str:
    runs = plain(surface.runs)
    header = ["row", "observed", "fitted", "residual", "R-student", "leverage", "Cook's D"]
    empty = [None] * len(surface.table.lines)
    columns = zip(
        surface.table.lines,
        surface.model.response,
        runs["fitted"],
        runs["residuals"],
        runs["studentized"] or empty,
        runs["leverage"],
        runs["cooks_distance"] or empty,
        strict=True,
    )
    rows = [[str(line), *(number(value, 4) for value in values)] for line, *values in columns]
    return grid(header, rows)


def surface_warnings(surface: Surface) -> list[str]:
    """What a reader of the response surface must know."""
    found = [*surface.table.notes, *surface_cautions(surface)]
    if surface.saturated:
        margin = "Lenth's margin and " if surface.lenth and surface.lenth.assumption_met else ""
        found.append(f"{SATURATED}; judge the effects by {margin}a half-normal plot, or leave terms out with --drop")
    if not surface.orthogonal:
        every = {name: value**0.5 for name, value in surface.vif.items()}  # the squares too
        found.append(loss(every, "if it were orthogonal to the other terms"))
    if exactly_equal(surface):
        found.append(EQUAL_REPLICATES)
    if not surface.pure_error_df:
        found.append(f"{no_replicates(surface)}, so the lack of fit cannot be tested; replicate the centre point")
    if surface.r2_predicted is None and not surface.saturated:
        found.append("one run alone carries a term (leverage 1), so the predicted R2 is undefined")
    elif _falls_short(surface):
        short = (
            f"the predicted R2 ({surface.r2_predicted:.3f}) falls far below the adjusted one "
            f"({surface.r2_adjusted:.3f}): the model follows single runs; look at Cook's distances, reduce "
            "the model or run more"
        )
        found += suspects_first(surface, [short])
    inflated = {name: value for name, value in surface.vif.items() if value > 5}
    if inflated:
        worst = max(inflated, key=inflated.get)
        found.append(f"the runs separate the terms poorly: VIF of {worst} {inflated[worst]:.1f} (1 is orthogonal)")
    return found


def _falls_short(surface: Surface) -> bool:
    """Whether the predicted R2 falls far below the adjusted one; a negative one is said apart."""
    predicted = surface.r2_predicted
    return predicted is not None and predicted >= 0 and surface.r2_adjusted - predicted > PREDICTED_R2_GAP


SELECTED = f"\nIn it {FOLLOWS_SELECTION}; those of the full model above are honest."
"""Below the head of a reduced model."""


EXTRAPOLATION = (
    "the point is an extrapolation: no run constrains the model there as at the design's own points (a "
    "Box-Behnken design has no corners); make runs there, or use a face-centred design"
)


def target_text(found: TargetSet) -> str:
    """The settings that hit a target."""
    label = f"target {found.target:g}" + (f" +- {found.uncertainty:g}" if found.uncertainty else "")
    span = f"the predicted response runs from {number(found.lowest)} to {number(found.highest)}"
    point = prediction_text(found.physical, found.prediction)
    if not found.reachable_within_uncertainty:
        return f"{label} is not reached in the box: {span}\nnearest: {point}"
    if found.reachable:
        first = f"{label}: met on a sheet of {len(found.extents) - 1} dimensions, not at one point"
    else:
        first = f"{label}: met within the uncertainty only, not exactly: {span}"
    lines = [first, "  " + _shares(found)]
    if found.uncertainty:
        lines.append("  settings within the uncertainty:")
    lines += [f"  {extent_text(extent)}" for extent in found.extents]
    lines.append(f"recommended ({found.rule_in_words}): {point}")
    lines += _measurement_lines(found)
    return "\n".join(lines)


def _shares(found: TargetSet) -> str:
    """How much of the box meets the target, by each reading of "meets"."""
    one_percent = f"{100 * found.fraction_one_percent:.1f} %"
    if found.uncertainty:
        text = f"{100 * found.fraction:.1f} % of the box lies within the uncertainty, {one_percent} within 1 % of the "
    else:
        text = f"{one_percent} of the box lies within 1 % of the "
    if found.fraction_not_excluded is None:
        return text + "target; - cannot be excluded (no residual, so the fit's own uncertainty is unknown)"
    return text + f"target; {100 * found.fraction_not_excluded:.1f} % cannot be excluded with the fit's own uncertainty"


def _measurement_lines(found: TargetSet) -> list[str]:
    lines = []
    for option in found.measurements:
        place = ""
        if option.coded is not None:
            levels = zip(found.surface.table.factors, option.coded, strict=True)
            place = " at " + ", ".join(f"{f.name} {number(float(f.physical(x)), 4)}" for f, x in levels)
        lines.append(f"next: {option.what}{place} would leave {100 * option.fraction:.1f} % of the box")
    if len(found.extents) > 1:
        lines.append(
            "next: no measurement of this response alone makes the sheet a point; a second response with "
            "another slope does"
        )
    return lines
