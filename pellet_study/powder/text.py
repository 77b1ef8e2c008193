"""What the powder calibration found, in words."""

from collections.abc import Mapping

import numpy as np

from pellet_study.powder.heaps import FULL


def summary(stage: str, decision: Mapping) -> str:
    """One line of what a stage decided."""
    lost = f", {decision['lost']} of them gave no angle" if decision.get("lost") else ""
    if stage == "screening":
        return f"{decision['heaps']} heaps{lost}; {selection(decision)}" + curvature(decision)
    if stage == "climb":
        centre = ", ".join(f"{k} {v:.3f}" for k, v in decision["centre"].items())
        return f"{decision['heaps']} heaps{lost}; {'target met' if decision['reached'] else 'target not met'} near {centre}"
    if stage == "surface":
        boxes = len(decision["boxes"])
        which = f"{boxes} boxes, the surface is that of number {decision['chosen_box'] + 1}" if boxes > 1 else "1 box"
        return f"{decision['heaps']} heaps in {which}{lost}; R2 {decision['r2']:.3f}, predicted R2 {known(decision['r2_predicted'], '.3f')}"
    if stage == "optimum":
        would = f"{levels(decision)}; Bond number {decision['bond_number']:.2f}"
        if decision["reachable"]:
            return f"{would}; {100 * decision['fraction_of_box']:.0f} % of the box would do"
        return (
            f"the target is not reachable in this box: it gives {decision['lowest']:.1f} to {decision['highest']:.1f} deg; "
            f"nearest {would}"
        )
    low, high = decision["error_interval_percent"]
    error = f"error {decision['error_percent']:.2f} %"
    if decision["standard_error_deg"] > FULL.wanted_error:  # no error smaller than these heaps can know
        error = f"error at most {max(abs(low), abs(high)):.1f} %"
    attempts, heaps = decision["attempts"], decision["heaps"]
    over = (
        f"{heaps - decision['lost']} of {heaps} heaps ({decision['lost']} gave no angle)"
        if decision["lost"]
        else f"{heaps} heaps"
    )
    words = (
        f"{decision['mean_deg']:.2f} +- {decision['standard_error_deg']:.2f} deg over {over}; measured "
        f"{decision['measured_deg']:g}: {error} (95 % {low:+.2f} to {high:+.2f} %); "
        f"{'equivalent' if decision['equivalent'] else 'not shown equivalent'} within {decision['margin_deg']:g} deg"
    )
    if len(attempts) > 1:
        gone = sum(one["lost"] for one in attempts)
        words += f"; attempt {len(attempts)}, the setting corrected to {levels(decision)}; {sum(one['heaps'] for one in attempts)} "
        words += "heaps in all" + (f", {gone} gave no angle" if gone else "")
    if not decision["equivalent"] and not decision.get("attainable", True):
        words += "; the measured angle is of so few readings that no number of heaps could show it"
    return words + (
        "; not corrected, as along the gradient the box has nothing nearer" if decision.get("nothing_nearer") else ""
    )


def known(value: float | None, form: str) -> str:
    """A number in words that may not follow from the runs there are, as where one of them alone fixes a coefficient."""
    return "not known" if value is None or not np.isfinite(value) else format(value, form)


def levels(decision: Mapping) -> str:
    """The levels of a decision's point, with a word where one lies outside the range it was screened in."""
    point, outside = decision["point"], decision.get("outside", {})
    names = decision.get("factors", point)
    return ", ".join(f"{k} {point[k]:.3f}" + (f" ({outside[k]})" if k in outside else "") for k in names)


def selection(decision: Mapping) -> str:
    """Which effects of a screening are clear, which factors go on, and why."""
    clear, factors = decision["clear"], decision["factors"]
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


def curvature(decision: Mapping) -> str:
    """The centre points of a screening against its corners, in words; "" without centre points."""
    if decision.get("curvature_deg") is None:
        return ""
    return (
        f"; curvature (centre points minus the others) {decision['curvature_deg']:+.2f} +- "
        f"{known(decision['curvature_standard_error_deg'], '.2f')} deg"
    )
