"""A steepest climb and where its runs turned, in words."""

from collections.abc import Sequence

from pellet_study.doe.factors import Factor
from pellet_study.doe.path_turning import Turning
from pellet_study.doe.steepest_climb import Climb
from pellet_study.doe.text import (
    grid,
    number,
    percent,
)


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
        f"{f.name} "
        + (
            f"{' or '.join(f.levels)} (predicted is the mean of both)"
            if f.levels
            else f"{f.centre:.5g}{f' {f.unit}' if f.unit else ''}"
        )
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
