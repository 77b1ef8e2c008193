"""The published optimum, and the coding of Table 11."""

from itertools import product

import numpy as np

from pellet_study.doe.intervals import interval
from pellet_study.doe.optimum import target_set
from pellet_study.paper import designs
from pellet_study.paper.designs import implied_angles
from pellet_study.paper.judging import settings
from pellet_study.paper.printed import printed_text, table
from pellet_study.paper.verdicts import LEVEL, Item, judged


def at_optimum(b_reversed: bool):
    """Prediction at the published optimum and its span over the rounding of the three levels."""
    point = printed_text()["optimum"]
    return settings.at_point(designs.surface(b_reversed), point, dict.fromkeys(point, 0.0005))


def optimum() -> list[Item]:
    """The published optimum, and Table 11's coding of B."""
    section, text = "Optimum", printed_text()
    target = text["repose_angle_physical_deg"]
    items = []
    for label, b_reversed in (
        ("coding of Table 11 (-1 = 0.90)", True),
        ("B coded the other way (-1 = 0.82)", False),
    ):
        item = f"predicted angle at the optimum, {label}"
        items.append(settings.prediction(section, item, f"{target}", *at_optimum(b_reversed)))
    found = target_set(designs.surface(), target, text["repose_angle_physical_pm"])
    return [*items, *settings.reach(section, found, "deg"), *_centre(section, target), *_coding(section)]


def _centre(section, target) -> list[Item]:
    """The centre runs of Table 12 beside the target and row 2 of Table 10."""
    data = designs.surface_table()
    runs = data.response[(data.coded == 0).all(axis=1)]
    low, high = implied_angles(2)
    statistics, p = settings.new_run(runs, (low, high))
    return [
        *settings.centre(section, data, target, printed_text()["repose_angle_verification_deg"]),
        judged(
            section,
            "row 2 of Table 10 and the centre runs (same B, C, G)",
            f"{low:.4f} or {high:.4f}",
            runs.mean(),
            max(p) > LEVEL,
            f"t({len(runs) - 1}) of one new run {statistics[0]:.3f} (p {p[0]:.3f}) or {statistics[1]:.3f} (p {p[1]:.3f})",
        ),
    ]


def _row_test(row: int, signs=(-1, 1, 1)) -> tuple[float, tuple[float, float], list[float]]:
    """Table 12's surface at a row of Table 10: prediction, interval, p of the two angles left open.

    `signs`: +1 where the coded level rises with the physical one; Table 11 as printed is (-1, 1, 1).
    """
    from scipy.special import stdtr

    surface = designs.surface(b_reversed=False)
    point = [
        float(sign * factor.coded(table(10)[factor.name].iloc[row - 1]))
        for sign, factor in zip(signs, surface.table.factors, strict=True)
    ]
    found = interval(surface.model, [point], LEVEL)
    width = np.sqrt(surface.model.mean_square_error + found.standard_error**2)
    p = [
        float(2 * stdtr(surface.model.df_residual, -abs(angle - found.predicted) / width))
        for angle in implied_angles(row)
    ]
    return found.predicted, found.prediction, p


def _coding(section) -> list[Item]:
    """Which coding of the factors the other tables support."""
    misfits = {}
    for signs in product((1, -1), repeat=3):
        predictions = [_row_test(row, signs)[0] for row in (1, 3)]
        misfits[signs] = sum(
            min((a - y) ** 2 for a in implied_angles(row)) for row, y in zip((1, 3), predictions, strict=True)
        )
    best = min(misfits, key=misfits.get)
    ranking = "; ".join(f"{signs} {misfits[signs]:.2f}" for signs in sorted(misfits, key=misfits.get)[:4])
    printed = (-1, 1, 1)
    items = [
        judged(
            section,
            "signs of the coding of B, C, G against rows 1 and 3 of Table 10",
            str(printed),
            str(best),
            best == printed,
            f"squared misfit of the eight codings, best first: {ranking}",
        )
    ]
    for row in (1, 3):
        predicted, (low, high), p = _row_test(row)
        other, _, p_other = _row_test(row, (1, 1, 1))
        angles = implied_angles(row)
        nearest = angles[int(np.argmin(np.abs(np.asarray(angles) - predicted)))]
        items.append(
            judged(
                section,
                f"Table 11's coding of B and row {row} of Table 10",
                f"{nearest:.4f}",
                predicted,
                max(p) > LEVEL,
                f"95 % prediction interval {low:.2f} to {high:.2f}, p {max(p):.4f}; B coded the other way "
                f"gives {other:.3f}, p {max(p_other):.3f}",
                predicted - nearest,
            )
        )
    return items
