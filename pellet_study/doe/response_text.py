"""The words about a transformed response, a selection of terms, and several responses together."""

from pellet_study.doe.box_cox import BoxCox
from pellet_study.doe.coded_box import Extent
from pellet_study.doe.fitted_response import FittedResponse
from pellet_study.doe.intervals import Interval
from pellet_study.doe.joint_set import JointSet
from pellet_study.doe.plackett_burman import Screening
from pellet_study.doe.selection import Selection
from pellet_study.doe.surface_text import box_cox_text
from pellet_study.doe.text import (
    FOLLOWS_SELECTION,
    between,
    extent_text,
    grid,
    heading_of_terms,
    number,
    percent,
    run_interval_text,
    selection_cautions,
)
from pellet_study.doe.transformation import Transformation, parse_transformation


def scale_text(
    name: str, scale: Transformation | None, box_cox: BoxCox | None, advised: str | None, predicted: bool = True
) -> str:
    """What Box and Cox's likelihood says of the scale of a response, what was done, and what its predictions mean."""
    told = (
        "Box-Cox: undefined (a response is not positive, or there is no residual)"
        if box_cox is None
        else box_cox_text(box_cox)
    )
    if scale is None:
        return f"{told}; so {name} is analysed as it is"
    by = "as advised" if advised and parse_transformation(advised) == scale else "as asked for"
    turned = ", which falls where it rises" if scale.power < 0 else ""
    return (
        f"{told}\n{name} is analysed as {scale.name_of(name)}, {by}{turned}: coefficients, ANOVA and residuals are on that scale"
        + (f"; predictions and goals are taken back to {name}'s own unit, and are of its median" if predicted else "")
    )


def back_transformed_text(response: FittedResponse, physical: dict[str, float], found: Interval) -> str:
    """A prediction at a point, taken back."""
    place = ", ".join(f"{name} {value:.5g}" for name, value in physical.items())
    text = f"predicted median of {response.name} {number(found.predicted, 6)} at {place}"
    if found.confidence and found.prediction:
        at = percent(found.level)
        text += f"; {at} confidence interval of the median {between(found.confidence)}"
        text += f", {run_interval_text(found)}"
    return text


def selection_text(found: Selection) -> str:
    """The terms left out by AICc and what the choice costs."""
    head = f"selection by AICc, backward, hierarchy kept: {number(found.aicc[0])} with all terms"
    if not found.dropped:
        return f"{head}, and no less without any: no term is left out"
    text = f"{head}, {number(found.aicc[-1])} without {', '.join(found.dropped)}"
    text += f"\n  its price: {FOLLOWS_SELECTION}"
    if found.r2_predicted_honest is not None:
        text += (
            f"; its predicted R2 is {number(found.surface.r2_predicted, 4)} as if the terms had been known beforehand, and "
            f"{number(found.r2_predicted_honest, 4)} with the selection made anew without each run predicted"
        )
    return text


def screenings_text(screenings: list[Screening]) -> str:
    """The effects of each factor on each response side by side, those significant at the screening's level starred."""
    names = [str(screening.table.response.name) for screening in screenings]
    terms = sorted(  # a response that lacks runs may lack interactions
        {
            term: indices for screening in screenings for term, indices in screening.model.terms.items() if indices
        }.items(),
        key=lambda item: (len(item[1]), item[1]),
    )
    rows = []
    for term, _ in terms:
        cells = []
        for screening in screenings:
            p = screening.p.get(term)
            star = "*" if p is not None and p < screening.alpha else " "
            cells.append(number(screening.effects.get(term)) + star)
        rows.append([term, *cells])
    level = f"{screenings[0].alpha:g}"
    return f"effects from -1 to +1 on each response (* p below {level})\n" + grid(
        [heading_of_terms(screenings[0]), *names], rows
    )


def joint_text(found: JointSet) -> str:
    """The joint target set, the most desirable setting, what to measure next."""
    several = len(found.parts) > 1
    names = ", ".join(part.response.name for part in found.parts)
    head = f"goals of {names} together, in the box of coded -1 to 1" if several else f"goal of {names}"
    lines = [head, *_goal_lines(found, several)]
    if any(part.goal.limited for part in found.parts):
        lines.append("  " + _shares(found, several))
    if found.pieces:
        lines += _piece_lines(found, several)
    elif found.extents and found.fraction < 1:
        lines += ["  settings that meet " + ("all goals:" if several else "it:"), *_extent_lines(found.extents)]
    lines += [*_setting_lines(found), *_limit_lines(found), *_ground_lines(found)]
    lines += selection_cautions(part.response for part in found.parts)
    if several:
        lines += _next_lines(found)
    return "\n".join(lines)


def _piece_lines(found: JointSet, several: bool) -> list[str]:
    """The box of each piece: between the pieces not all goals are met."""
    goals = "all goals" if several else "it"
    lines = [
        f"  the settings that meet {goals} are in {len(found.pieces)} pieces, between which {'not all are' if several else 'it is not'} met:"
    ]
    for k, piece in enumerate(found.pieces, start=1):
        lines += [f"   piece {k}, {100 * piece.fraction:.1f} % of the box:", *_extent_lines(piece.extents)]
    return lines


def _limit_lines(found: JointSet) -> list[str]:
    """Which responses lie on their limit at the recommended setting, and what a setting safely inside costs."""
    tight = [part for part in found.parts if part.limit is not None]
    if not tight or not found.met:
        return []
    lines = [
        f"{part.response.name} lies on its limit {number(part.limit)} there: about half of single runs would miss it, "
        "whatever its desirability"
        for part in tight
    ]
    if found.assured is None:
        lines.append(
            "  no setting is assured inside all limits with these runs: measure more, or take a setting off the limit"
        )
        return lines
    place = ", ".join(f"{name} {number(value)}" for name, value in found.assured.physical.items())
    price = ", ".join(
        f"{part.response.name} {number(found.assured.predicted[part.response.name])} for {number(part.prediction.predicted)}"
        for part in found.parts
    )
    lines.append(
        f"  assured inside, overall desirability {found.assured.desirability:.3f}: {place}; its price: {price}"
    )
    return lines


def _ground_lines(found: JointSet) -> list[str]:
    """Responses whose fit predicts worse than the mean, on which the recommendation rests all the same."""
    poor = [part.response for part in found.parts if (part.response.surface.r2_predicted or 0.0) < 0]
    if not poor:
        return []
    words = ", ".join(f"{response.name} (predicted R2 {response.surface.r2_predicted:.3f})" for response in poor)
    return [
        f"caution: this setting and the shares above rest on {words}, whose fit predicts a new run worse than the mean of the "
        "runs does: reduce that model (--reduce), or let its goal go, before you use the setting"
    ]


def _goal_lines(found: JointSet, several: bool) -> list[str]:
    lines = []
    for part in found.parts:
        line = f"  {part.response.name}: {part.goal.in_words()}"
        if part.goal.limited:
            line += f"; met in {100 * part.fraction:.1f} % of the box"
            line += f", all the others in {100 * part.fraction_of_the_others:.1f} %" if several else ""
        lines.append(line)
    return lines


def _shares(found: JointSet, several: bool) -> str:
    if found.fraction:
        text = f"{100 * found.fraction:.1f} % of the box meets {'all goals' if several else 'it'} as predicted"
    elif found.met:
        text = f"less than 0.01 % of the box meets {'all goals' if several else 'it'} as predicted"
    else:
        text = "no setting of the box meets " + ("all goals" + _let_go(found) if several else "it")
    if found.fraction_not_excluded is None:
        return text + "; a fit leaves no residual, so nothing is known of its uncertainty"
    at = f"{percent(1 - found.alpha)} confidence interval" + (" of each response" if several else "")
    return (
        f"{text}; with the {at}: {100 * found.fraction_not_excluded:.1f} % cannot be excluded, "
        f"{100 * (found.fraction_assured or 0):.1f} % is assured"
    )


def _let_go(found: JointSet) -> str:
    """Which goal stands most in the way."""
    freed = max(found.parts, key=lambda part: part.fraction_of_the_others)
    if not freed.fraction_of_the_others:
        return ", nor all but any one of them"
    share = f"{100 * freed.fraction_of_the_others:.1f} %"
    return f"; if {freed.response.name} were let go, {share} would meet the rest"


def _extent_lines(extents: list[Extent]) -> list[str]:
    return [f"    {extent_text(extent)}" for extent in extents]


def _setting_lines(found: JointSet) -> list[str]:
    place = ", ".join(f"{name} {number(value)}" for name, value in found.physical.items())
    coded = ", ".join(f"{x:.3f}" for x in found.coded)
    name = "most desirable" if found.desirability > 0 else "nearest (its worst response misses by least)"
    at = percent(1 - found.alpha)
    header = ["response", "predicted", f"{at} mean from", "to", f"{at} one run from", "to", "desirability"]
    rows = []
    for part in found.parts:
        ends = [*(part.prediction.confidence or (None, None)), *(part.prediction.prediction or (None, None))]
        values = [number(value, 4) for value in (*ends, part.desirability)]
        rows.append([part.response.name, number(part.prediction.predicted), *values])
    first = f"{name}, overall desirability {found.desirability:.3f} (Derringer-Suich): {place} (coded {coded})"
    return [first, grid(header, rows)]


def _next_lines(found: JointSet) -> list[str]:
    lines = []
    if found.fraction_not_excluded is not None and any(part.goal.limited for part in found.parts):
        lines.append("next: " + _what_to_measure(found, found.fraction_not_excluded))
    targets = sum(part.goal.kind == "target" for part in found.parts)
    free = len(found.factors) - targets
    if targets and free > 0:
        lines.append(
            f"the exact target{'s' if targets > 1 else ''} of {targets} response{'s leave' if targets > 1 else ' leaves'} {free} "
            f"of {len(found.factors)} dimensions free: more responses, or a choice such as the desirability's, pick a point"
        )
    return lines


def _what_to_measure(found: JointSet, not_excluded: float) -> str:
    """The response whose replicates shrink the set most."""
    if not not_excluded:
        return "the fits exclude the whole box, so no replicate helps: widen the ranges of the factors, or the goals"
    now, best = f"{100 * not_excluded:.1f} %", found.next_response
    if best is None:
        return f"no further replicate of one response alone would shrink the {now} that cannot be excluded"
    others = ", ".join(
        f"{part.response.name} {100 * (part.after_replicate or 0):.1f} %" for part in found.parts if part is not best
    )
    return (
        f"measure {best.response.name}: all runs once more would leave {100 * (best.after_replicate or 0):.1f} % of the box "
        f"that cannot be excluded, for {now} now; the same effort on another: {others}"
    )
