"""The steepest climb: Table 10, which prints relative errors and no angles."""

import numpy as np

from pellet_study.doe.intervals import interval
from pellet_study.doe.steepest_climb import first_order_model
from pellet_study.paper import designs
from pellet_study.paper.designs import implied_angles
from pellet_study.paper.judging.path import steps_as_gradient
from pellet_study.paper.printed import printed_text, table, tables
from pellet_study.paper.verdicts import LEVEL, NOT_RECOMPUTABLE, Item, judged

GRADIENT_WORDS = (
    "all ranges are equal, so ",
    "; signs agree, lengths do not: the path is the diagonal of the box from its corner of lowest prediction",
)


def _climb_model():
    """Main effects B, C, G of Table 7, and the rows of Table 10 in its coded units."""
    model, factors = first_order_model(designs.screening(), ["B", "C", "G"])
    points = np.column_stack([factor.coded(table(10)[factor.name]) for factor in factors])
    return model, factors, points


def climb() -> list[Item]:
    """Table 10: relative errors only, no angles."""
    section, target = "Table 10", printed_text()["repose_angle_physical_deg"]
    model, factors, points = _climb_model()
    items = []
    for i, point in enumerate(points):
        low, high = implied_angles(i + 1)
        predicted = interval(model, [point], LEVEL)
        items.append(
            Item(
                section,
                f"row {i + 1}: relative error, %",
                tables()["tables"]["10"]["printed"][i][-1],
                None,
                None,
                NOT_RECOMPUTABLE,
                f"angle not printed: {low:.4f} or {high:.4f} deg; the B, C, G model of Table 7 gives "
                f"{predicted.predicted:.3f} ({predicted.prediction[0]:.2f} to "
                f"{predicted.prediction[1]:.2f}), an error of "
                f"{100 * abs(predicted.predicted - target) / target:.2f} %",
            )
        )
    return [
        *items,
        steps_as_gradient(section, model, factors, points, 1, *GRADIENT_WORDS),
        _climb_monotone(section),
        *_climb_repeats(section, model, points),
    ]


def _climb_monotone(section) -> Item:
    errors = table(10)["Relative error"].to_numpy(dtype=float)
    turns = int(np.sum(np.diff(np.sign(np.diff(errors))) != 0))
    angles: list = []
    for row in range(1, len(errors) + 1):
        angles.append(next((a for a in implied_angles(row) if not angles or a > angles[-1]), np.nan))
    rising = np.isfinite(angles).all()
    centre = float(designs.screening_table().response.iloc[-1])
    return judged(
        section,
        "a monotone path",
        "",
        "error falls then rises once" if turns == 1 else f"{turns} turns",
        turns == 1 and rising,
        f"a rising angle fits ({', '.join(f'{a:.2f}' for a in angles)}), its last step "
        f"{angles[-1] - angles[-2]:+.1f} deg after {angles[-2] - angles[-3]:+.1f}; the falling branch "
        f"contradicts the centre run {centre} of Table 7",
    )


def _climb_repeats(section, model, points) -> list[Item]:
    """Rows of Table 10 whose B, C, G were run in Table 7 as well."""
    screening = designs.screening()
    coded, response = screening.table.coded[["B", "C", "G"]].to_numpy(), screening.table.response.to_numpy()
    reach = sum(abs(screening.effects[name]) for name in "ADEF") / 2
    items = []
    for row in (1, 6):
        same = np.flatnonzero((coded == np.round(points[row - 1])).all(axis=1))
        mean, angles = response[same].mean(), implied_angles(row)
        low, high = interval(model, [points[row - 1]], LEVEL).prediction
        nearest = min(angles, key=lambda angle: abs(angle - mean))
        inside = any(low <= angle <= high for angle in angles)
        runs = ", ".join(f"run {i + 1} = {response[i]}" for i in same)
        error = (
            100 * abs(mean - printed_text()["repose_angle_physical_deg"]) / printed_text()["repose_angle_physical_deg"]
        )
        reason = f"{runs}; 95 % prediction interval {low:.2f} to {high:.2f}"
        if not inside:
            reason += (
                f" excludes both {angles[0]:.2f} and {angles[1]:.2f}; that run is {error:.2f} % off the "
                f"target, and A, D, E, F together move the angle by at most {reach:.3f} deg: a misprint or "
                "another setting of them"
            )
        items.append(
            judged(
                section,
                f"row {row} and Table 7 at the same B, C, G",
                f"{nearest:.4f}",
                mean,
                inside,
                reason,
                mean - nearest,
            )
        )
    return items
