"""What the powder calibration decided, in words."""

from collections.abc import Mapping

import numpy as np

from pellet_study.output.words import number, probability
from pellet_study.powder.decisions import Climb, Decision, Joint, Known, Optimum, Screening, Surface, Validation
from pellet_study.powder.heaps import FULL


def summary(decision: Decision) -> str:
    """One line of what a stage decided."""
    match decision:
        case Screening():
            return f"{heaps_of(decision)}; {selection(decision)}{curvature(decision)}"
        case Climb():
            centre = ", ".join(f"{k} {v:.3f}" for k, v in decision.centre.items())
            return f"{heaps_of(decision)}; {'target met' if decision.reached else 'target not met'} near {centre}"
        case Surface():
            return _surface(decision)
        case Optimum():
            return _optimum(decision)
        case Validation():
            return _validation(decision)


def heaps_of(decision: Screening | Climb | Surface, where: str = "") -> str:
    """How many heaps a stage took, and how many of them gave no angle."""
    lost = f", {decision.lost} of them gave no angle" if decision.lost else ""
    return f"{decision.heaps} heaps{where}{lost}"


def _surface(decision: Surface) -> str:
    boxes, which = len(decision.boxes), "1 box"
    if boxes > 1 and decision.chosen_box is not None:
        which = f"{boxes} boxes, the surface is that of number {decision.chosen_box + 1}"
    predicted = or_unknown(decision.r2_predicted, ".3f")
    if decision.r2_predicted_ceiling is not None:
        predicted += f" (the scatter of heaps at one point leaves at most {decision.r2_predicted_ceiling:.3f})"
    return f"{heaps_of(decision, f' in {which}')}; R2 {decision.r2:.3f}, predicted R2 {predicted}"


def _optimum(decision: Optimum) -> str:
    setting = levels(decision.point, decision.factors, decision.outside)
    would = f"{setting}; Bond number {decision.bond_number:.2f}"
    if decision.joint is not None and len(decision.joint.readings) > 1:
        return would + f"; of those that agree best with all readings{contradiction(decision.joint)}"
    if decision.reachable:
        return f"{would}; {100 * decision.fraction_of_box:.0f} % of the box would do"
    return (
        f"the target is not reachable in this box: it gives {decision.lowest:.1f} to {decision.highest:.1f} deg; "
        f"nearest {would}"
    )


def _validation(decision: Validation) -> str:
    low, high = decision.error_interval_percent
    error = f"error {decision.error_percent:.2f} %"
    if decision.standard_error_deg > FULL.wanted_error:  # no error smaller than these heaps can know
        error = f"error at most {max(abs(low), abs(high)):.1f} %"
    attempts, heaps, lost = decision.attempts, decision.heaps, decision.lost
    over = f"{heaps - lost} of {heaps} heaps ({lost} gave no angle)" if lost else f"{heaps} heaps"
    words = (
        f"{decision.mean_deg:.2f} +- {decision.standard_error_deg:.2f} deg over {over}; measured "
        f"{decision.measured_deg:g}: {error} (95 % {low:+.2f} to {high:+.2f} %); "
        f"{'equivalent' if decision.equivalent else 'not shown equivalent'} within {decision.margin_deg:g} deg"
    )
    for one in decision.others:
        words += (
            f"; {one.observable} {number(one.mean)} +- {number(one.standard_error, 2)}, measured {number(one.measured)}: "
            f"{'equivalent' if one.equivalent else 'not shown equivalent'} within {number(one.margin, 2)}"
        )
        if not one.equivalent and not one.attainable:
            words += ", which is of so few readings that no number of heaps could show it"
    if len(attempts) > 1:
        gone = sum(one.lost for one in attempts)
        setting = levels(decision.point, decision.factors, decision.outside)
        words += f"; attempt {len(attempts)}, the setting corrected to {setting}; {sum(one.heaps for one in attempts)} "
        words += "heaps in all" + (f", {gone} gave no angle" if gone else "")
    if not decision.equivalent and not decision.attainable:
        words += "; the measured angle is of so few readings that no number of heaps could show it"
    if decision.nothing_nearer:
        words += "; not corrected, as along the gradient the box has nothing nearer"
    return words


def or_unknown(value: float | None, form: str) -> str:
    """A number in words that may not follow from the runs there are, as where one of them alone fixes a coefficient."""
    return "not known" if value is None or not np.isfinite(value) else format(value, form)


def levels(point: Mapping[str, float], factors: list[str], outside: Mapping[str, str]) -> str:
    """The levels of a point in some factors, with a word where one lies outside the range it was screened in."""
    return ", ".join(f"{k} {point[k]:.3f}" + (f" ({outside[k]})" if k in outside else "") for k in factors)


def selection(decision: Screening) -> str:
    """Which effects of a screening are clear, which factors go on, and why."""
    clear, factors = decision.clear, decision.factors
    unclear = [name for name in factors if name not in clear]
    left = [name for name in clear if name not in factors]
    words = f"beyond two standard errors: {', '.join(clear) or 'none'}; the three largest effects go on: {', '.join(factors)}"
    if unclear == factors:
        words += ", none of them clear"
    elif unclear:
        words += f", of which {', '.join(unclear)} {'is' if len(unclear) == 1 else 'are'} not clear"
    if left:
        words += f"; {', '.join(left)} {'is' if len(left) == 1 else 'are'} left out although clear"
    return words


def curvature(decision: Screening) -> str:
    """The centre points of a screening against its corners, in words; "" without centre points."""
    if decision.curvature_deg is None:
        return ""
    return (
        f"; curvature (centre points minus the others) {decision.curvature_deg:+.2f} +- "
        f"{or_unknown(decision.curvature_standard_error_deg, '.2f')} deg"
    )


SHOWN = 3  # further readings
CLEARLY = 0.97  # of the share that is left: less is the error of a mean over some made-up readings


def contradiction(joint: Joint) -> str:
    """ "; but ..." where readings cannot be had, or not together; else ""."""
    words = [
        f"{one.observable} {number(one.measured)} cannot be had in the box, which gives {number(one.lowest)} to {number(one.highest)}"
        for one in joint.readings
        if one.out_of_reach
    ]
    if not words and joint.contradictory:
        without = f"; without {joint.doubtful} the others agree" if joint.doubtful else ""
        words = [f"the readings contradict each other in the box (p {probability(joint.distance_p)}){without}"]
    return f"; but {'; '.join(words)}" if words else ""


def joint_lines(joint: Joint) -> list[str]:
    """What the readings tell of each factor, in lines."""
    lines = [
        "",
        f"what the readings tell{anywhere(joint)}, on the surfaces of {joint.heaps} heaps{contradiction(joint)}:",
    ]
    lines += [
        f"  {one.observable:24s} measured {number(one.measured)} +- {number(one.standard_error, 2)}, at the setting "
        f"{number(one.predicted)} +- {number(one.predicted_standard_error, 2)}, box {number(one.lowest)} to {number(one.highest)}"
        for one in joint.readings
    ]
    lines += [f"  {known_words(one)}" for one in joint.known]
    share = f"  the settings that hold 95 % of the posterior take {percent(joint.share_of_box)} of the box"
    if len(joint.readings) > 1:
        share += f"; of {joint.readings[0].observable} alone {percent(joint.share_of_box_first)}"
    lines.append(share)
    return [*lines, f"  {next_words(joint)}"]


def anywhere(joint: Joint) -> str:
    """ ", with A, D, E and F anywhere in their ranges"; "" where the surface has all factors."""
    if not joint.varied:
        return ""
    several = len(joint.varied) > 1
    names = f"{', '.join(joint.varied[:-1])} and {joint.varied[-1]}" if several else joint.varied[0]
    return f", with {names} anywhere in {'their ranges' if several else 'its range'}"


def next_words(joint: Joint) -> str:
    """Which further readings would shrink the set most, in a sentence."""
    would = [gain for gain in joint.gains if gain.share_of_box < CLEARLY * joint.share_of_box][:SHOWN]
    if not would:
        return "No further reading of this pouring would shrink that."
    names = [one.observable for one in joint.readings]
    words = [
        f"{gain.n} {'more ' if gain.observable in names else ''}{'reading' if gain.n == 1 else 'readings'} of {gain.observable} "
        f"(sd {number(gain.sd, 2)}) {percent(gain.share_of_box)}"
        for gain in would
    ]
    return f"Read next, with what would be left on average: {'; '.join(words)}."


def known_words(one: Known) -> str:
    """`C  0.312 to 0.367  identified: a fifth of ...`."""
    words = f"{one.factor} {number(one.low, 3)} to {number(one.high, 3)} (95 %): {one.word}, {percent(one.share_of_range)} of its range in the box"
    if one.at_end:
        words += (
            f"; it ends at the box ({', '.join(number(end) for end in one.at_end)}), beyond which nothing was simulated"
        )
    return words


def percent(share: float) -> str:
    """A share as percent, two digits."""
    return f"{number(100 * share, 2)} %"
