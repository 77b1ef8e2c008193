"""The analyses in words and tables; nothing is computed here."""

from collections.abc import Sequence

from pellet_study.doe.answers import plain
from pellet_study.doe.blocks import offsets
from pellet_study.doe.box_behnken import PREDICTED_R2_GAP, BoxCox, Surface
from pellet_study.doe.cautions import screening_cautions, surface_cautions, suspects_first
from pellet_study.doe.factors import Factor
from pellet_study.doe.lenth import Lenth
from pellet_study.doe.linear_model import INTERCEPT, Interval
from pellet_study.doe.optimum import TargetSet
from pellet_study.doe.plackett_burman import Screening
from pellet_study.doe.published_designs import UNKNOWN, design_of
from pellet_study.doe.steepest_climb import Climb, Turning
from pellet_study.doe.validation import Equivalence


def number(value, digits: int = 5) -> str:
    """A number for reading; `-` where undefined."""
    return "-" if value is None else f"{value:.{digits}g}"


def probability(value) -> str:
    """A p value to four decimals, as ANOVA tables print it."""
    if value is None:
        return "-"
    return "<0.0001" if value < 1e-4 else f"{value:.4f}"


def grid(header: list[str], rows: list[list[str]]) -> str:
    """Left-aligned first column, right-aligned others."""
    table = [header, *rows]
    widths = [max(len(row[i]) for row in table) for i in range(len(header))]
    lines = []
    for row in table:
        cells = [
            cell.ljust(w) if i == 0 else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def anova_text(rows: list[dict]) -> str:
    """An ANOVA table."""
    header = ["source", "sum of squares", "df", "mean square", "F", "p"]
    cells = [
        [
            row["source"],
            number(row["sum_of_squares"], 6),
            str(row["df"]),
            number(row["mean_square"], 6),
            number(row["f"]),
            probability(row["p"]),
        ]
        for row in rows
    ]
    return grid(header, cells)


def _summary_line(analysis: Screening | Surface) -> str:
    return (
        f"R2 {number(analysis.r2)}, adjusted {number(analysis.r2_adjusted)}, predicted "
        f"{number(analysis.r2_predicted)}; C.V. {number(analysis.cv_percent, 4)} %; lack of fit p "
        f"{probability(analysis.lack_of_fit_p)}"
    )


def equation(coefficients: dict[str, float], digits: int = 6) -> str:
    """A polynomial in words of its terms."""
    parts = []
    for name, value in coefficients.items():
        size = f"{abs(value):.{digits}g}" + ("" if name == INTERCEPT else f" {name}")
        parts.append((" - " if value < 0 else " + ") + size)
    text = "".join(parts)
    return text[3:] if text.startswith(" + ") else "-" + text[3:]


def _head(analysis: Screening | Surface, kind: str) -> str:
    levels = "; ".join(f"{f.label} {f.word(-1)} to {f.word(1)}" for f in analysis.table.factors)
    return (
        f"{kind}: {len(analysis.table.response)} runs, {len(analysis.table.factors)} "
        f"factor{'s' if len(analysis.table.factors) > 1 else ''}, response "
        f"{analysis.table.response.name}{_design_text(analysis)}\nlevels -1 to +1: {levels}{_blocks_text(analysis)}"
    )


def _design_text(analysis: Screening | Surface) -> str:
    """What design the runs are, where it is a known one."""
    name = design_of(analysis.table)
    return "" if UNKNOWN in name else f"\ndesign: {name}"


def _blocks_text(analysis: Screening | Surface) -> str:
    """Each block's level beside the mean of the blocks, for which the equation holds."""
    extra = dict(zip(analysis.model.columns, analysis.model.results.params, strict=True))
    lines = []
    for name, levels in offsets(analysis.table.blocks, extra).items():
        words = ", ".join(f"{level} {value:+.5g}" for level, value in levels.items())
        lines.append(f"\nblocks of {name}: {words} (beside the mean of the blocks, which all predictions are for)")
    return "".join(lines)


# -------------------------------------------------------------------------------------------------- screening
def screening_text(screening: Screening) -> str:
    """The analysis of a Plackett-Burman table."""
    s = screening
    order = sorted(s.effects, key=lambda name: -abs(s.effects[name]))
    rows = [
        [
            name,
            number(s.effects[name]),
            number(s.sums_of_squares[name], 6),
            f"{s.contributions[name]:.2f}",
            probability(s.p[name]),
            probability(s.p_adjusted[name]),
            number(s.detectable_effects[name], 4),
        ]
        for name in order
    ]
    header = [
        "factor",
        "effect",
        "sum of squares",
        "contribution %",
        "p",
        "p (Holm)",
        f"found {100 * s.power:.0f} %",
    ]
    parts = [
        _head(s, "Full factorial" if design_of(s.table).startswith("full") else "Plackett-Burman"),
        grid(header, rows) + f"\n(last column: the smallest effect this design finds with probability {s.power:g})",
        anova_text(s.anova),
        _summary_line(s),
    ]
    if s.lenth:
        parts.append(
            f"Lenth, {s.lenth.contrasts} contrasts: pseudo standard error "
            f"{number(s.lenth.pseudo_standard_error)}, {percent(1 - s.alpha)} margin of error {number(s.lenth.margin_of_error)}, "
            f"simultaneous {number(s.lenth.simultaneous_margin_of_error)}; beyond the margin: "
            f"{', '.join(n for n in order if abs(s.effects[n]) > s.lenth.margin_of_error) or 'none'}"
            f"{_sparsity(s.lenth)}"
        )
    if s.curvature:
        parts.append(
            f"curvature: centre points minus the straight line {s.curvature.estimate:+.5g}, F "
            f"{number(s.curvature.f)}, p {probability(s.curvature.p)}"
        )
    parts.append(_alias_text(s))
    return "\n\n".join(parts)


def _sparsity(lenth: Lenth) -> str:
    """A sentence where Lenth's method cannot be relied on."""
    if lenth.assumption_met:
        return ""
    return (
        "\nLenth's assumption that most contrasts are noise is not met here (too few contrasts beyond the factors): "
        "do not judge by this margin"
    )


MANY_INTERACTIONS = 28
"""Beyond this number (8 factors) the aliases are summed up; the JSON answer has them all."""


def _alias_text(screening: Screening) -> str:
    """Each main effect with the two-factor interactions it carries."""
    names = screening.table.names
    if len(names) * (len(names) - 1) / 2 > MANY_INTERACTIONS:
        shares = [abs(share) for found in screening.aliases.values() for share in found.values()]
        most = max(len(found) for found in screening.aliases.values())
        return (
            f"aliases: each effect carries up to {most} two-factor interactions, shares up to "
            f"{max(shares, default=0):.3g}"
        )
    lines = ["aliases: each effect also carries these shares of two-factor interactions"]
    for name, of_pairs in screening.aliases.items():
        groups: dict[str, list[str]] = {}
        for pair, share in of_pairs.items():
            groups.setdefault(f"{share:+.3g}", []).append(pair)
        words = "; ".join(f"{share} of {', '.join(pairs)}" for share, pairs in groups.items())
        lines.append(f"  {name}: {words or 'none'}")
    return "\n".join(lines)


def screening_warnings(screening: Screening) -> list[str]:
    """What a reader of the screening must know."""
    found = list(screening.table.notes)
    found += screening_cautions(screening)
    if screening.saturated:
        found.append(
            "the design is saturated: as many terms as runs, no residual, so no p values; judge the effects "
            "by Lenth's margin of error and the half-normal plot"
        )
    if not screening.orthogonal:
        found.append(_loss(screening.standard_error_inflation, "in an orthogonal design with as many runs"))
    if not screening.pure_error_df and not screening.saturated:
        found.append("there are no replicated runs, so lack of fit cannot be tested and the residual holds both")
    elif _exactly_equal(screening):
        found.append(EQUAL_REPLICATES)
    return found


EQUAL_REPLICATES = (
    "the replicated runs are exactly equal, so the pure error is 0 and the lack of fit cannot be tested; check that "
    "they are runs of their own and not copies"
)


def _exactly_equal(analysis: Screening | Surface) -> bool:
    """Whether there are replicates, and no difference within them."""
    return any(row["source"] == "pure error" and row["sum_of_squares"] == 0 for row in analysis.anova)


def _loss(inflation: dict[str, float], than: str) -> str:
    """What is lost where the runs are not orthogonal."""
    worst = max(inflation, key=inflation.get)
    return (
        "the runs that are there are not orthogonal: effects are least-squares estimates and share information; the "
        f"standard error of {worst} is {100 * (inflation[worst] - 1):.1f} % larger than {than}"
    )


# ---------------------------------------------------------------------------------------------------- surface
def surface_text(surface: Surface) -> str:
    """The analysis of a response surface."""
    s = surface
    parts = [
        _head(s, "Quadratic response surface"),
        f"coded:    {equation(s.coefficients)}\nphysical: {equation(s.physical_coefficients, 8)}",
        anova_text(s.anova),
        _summary_line(s)
        + f"\nadequate precision {number(s.adequate_precision, 4)} (above 4 wanted), PRESS {number(s.press)}",
        _checks_text(s),
        _runs_text(s),
    ]
    if s.lenth:
        beyond = [name for name, value in s.scaled_effects.items() if abs(value) > s.lenth.margin_of_error]
        parts.append(
            f"Lenth, {s.lenth.contrasts} coefficients scaled to equal variance: {percent(1 - s.alpha)} margin of error "
            f"{number(s.lenth.margin_of_error)}; beyond it: {', '.join(beyond) or 'none'}{_sparsity(s.lenth)}"
        )
    if s.stationary:
        place = ", ".join(
            f"{f.name} {number(float(f.physical(x)), 4)} (coded {x:.3f})"
            for f, x in zip(s.table.factors, s.stationary.coded, strict=True)
        )
        parts.append(f"stationary point: {s.stationary.kind}, {number(s.stationary.predicted)} at {place}")
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


def percent(level: float) -> str:
    """A level as `95 %`."""
    return f"{100 * level:.6g} %"


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
        found.append(
            "the design is saturated: as many terms as runs, no residual, so no p values; judge the effects "
            "by Lenth's margin and a half-normal plot, or leave terms out with --drop"
        )
    if not surface.orthogonal:
        found.append(_loss(surface.standard_error_inflation, "if it were orthogonal to the other terms"))
    if _exactly_equal(surface):
        found.append(EQUAL_REPLICATES)
    if not surface.pure_error_df:
        found.append("there are no replicated runs, so the lack of fit cannot be tested; replicate the centre point")
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


def prediction_text(physical: dict[str, float], found: Interval) -> str:
    """A prediction at a point."""
    place = ", ".join(f"{name} {value:.5g}" for name, value in physical.items())
    text = f"predicted {number(found.predicted, 6)} at {place}"
    if found.confidence:
        text += (
            f"; {percent(found.level)} confidence interval of the mean {number(found.confidence[0])} to "
            f"{number(found.confidence[1])}, {percent(found.level)} prediction interval of one run {number(found.prediction[0])} to "
            f"{number(found.prediction[1])}"
        )
    return text


SELECTED = (
    "\nIts terms were chosen by these very data: the p values and intervals below follow that selection and are too "
    "small; those of the full model above are honest."
)

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
    for extent in found.extents:
        low, high = extent.coded
        note = "  not identified: its whole range will do" if extent.unidentified else ""
        lines.append(
            f"  {extent.name}: {number(extent.physical[0])} to {number(extent.physical[1])} (coded {low:.3f} "
            f"to {high:.3f}){note}"
        )
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


# ------------------------------------------------------------------------------------------ climb, validation
def climb_text(climb: Climb, held: Sequence[Factor] = ()) -> str:
    """A path as a table, and where the factors that it does not move are held."""
    names = list(climb.points.columns)
    rows = []
    for i, point in enumerate(climb.points.to_dict(orient="records")):
        low_high = climb.prediction_intervals[i] or (None, None)
        rows.append(
            [
                str(i + 1),
                *(number(point[n], 5) for n in names),
                number(climb.predicted[i]),
                *map(number, low_high),
            ]
        )
    header = ["point", *(factor.label for factor in climb.factors), "predicted", "from", "to"]
    stopped = ""
    if len(rows) < climb.points_asked:
        stopped = (
            f"\na limit stopped the path after {len(rows)} of {climb.points_asked} points; take smaller steps "
            "(--climb-step), or widen the limits (--climb-limits)"
        )
    way = "equal coded steps" if climb.equal_steps else "along the gradient"
    return (
        f"steepest climb, {way} ({climb.angle_to_gradient_deg:.1f} deg off the fitted gradient), with "
        f"{percent(climb.level)} prediction intervals\n" + grid(header, rows) + stopped + _held_text(held)
    )


def _held_text(held: Sequence[Factor]) -> str:
    """The levels of the factors that a path does not move, for which its predictions hold."""
    if not held:
        return ""
    words = ", ".join(
        f"{f.name} " + (" or ".join(f.levels) if f.levels else f"{f.centre:.5g}{f' {f.unit}' if f.unit else ''}")
        for f in held
    )
    return f"\nall other factors are held in every run of the path, at the middle of their range: {words}"


def turning_text(turning: Turning) -> str:
    """Where a path turned and what follows."""
    place = ", ".join(f"{name} {value:.5g}" for name, value in turning.centre.items())
    alone = len(turning.order) == turning.points
    position = f"run {turning.point} of {turning.points}" if alone else f"point {turning.point} of {turning.points}"
    if turning.replicates > 1:
        position += f" (mean of {turning.replicates} runs)"
    if turning.at_start:
        return f"the path never improved on its first run ({place}): start the next design there, or look again"
    if turning.within_scatter:
        return (
            f"the path may have turned at {position}: {place}; but what follows falls by {number(turning.fall, 3)} only, within "
            f"the scatter of the runs (up to {number(turning.needed, 3)}): make one run further along the path, or repeat these, "
            "before you centre the next design"
        )
    if not turning.turned:
        return f"the path has not turned: its last run ({place}) is the best; go on along it"
    levels = "; ".join(f"{f.name} {f.low:g}, {f.centre:g}, {f.high:g}" for f in turning.next_factors)
    return f"the path turned at {position}: {place}\ncentre the next design there (levels -1, 0, +1): {levels}"


def equivalence_text(found: Equivalence) -> str:
    """The equivalence test, the t test beside it."""
    runs, target = found.runs, found.target
    known = (
        f"{target.mean:.5g} (taken as known)"
        if target.sd is None
        else f"{target.mean:.5g}, sd {target.sd:.4g}, n {target.n}"
    )
    low, high = found.interval
    confidence = 100 * (1 - 2 * found.alpha)
    lines = [
        f"validation: runs mean {runs.mean:.5g}, sd {runs.sd:.4g}, n {runs.n}; target {known}",
        f"  difference {found.difference:.4g}, {confidence:.0f} % interval {low:.4g} to {high:.4g}; margin "
        f"+-{found.margin:g}",
        f"  equivalence (two one-sided t tests): p {probability(found.p)}: "
        + ("equivalent within the margin" if found.equivalent else "equivalence is not shown"),
        f"  difference (t test): p {probability(found.p_difference)}: "
        + (
            "a difference is shown"
            if found.different
            else "no difference is shown, which does not show that there is none"
        ),
        f"  power to show equivalence if there is no difference: {found.power:.2f}"
        + (f"; 0.80 needs n = {found.n_for_power}" if found.n_for_power else "; no n of the runs alone reaches 0.80"),
    ]
    return "\n".join(lines)
