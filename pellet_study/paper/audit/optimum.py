"""The published optimum, and the coding of Table 11."""

from itertools import product

import numpy as np

from pellet_study.doe.linear_model import interval
from pellet_study.doe.optimum import target_set
from pellet_study.paper import designs
from pellet_study.paper.designs import implied_angles
from pellet_study.paper.printed import printed_text, table
from pellet_study.paper.verdicts import INCONSISTENT, LEVEL, REPRODUCED, Item, compare, judged


def at_optimum(b_reversed: bool):
    """Prediction at the published optimum and its span over the rounding of the three levels."""
    surface, point = designs.surface(b_reversed), printed_text()["optimum"]
    half = 0.0005
    corners = [
        [float(f.coded(point[f.name] + sign * half)) for f, sign in zip(surface.table.factors, signs, strict=True)]
        for signs in product((-1, 1), repeat=3)
    ]
    coded = [float(f.coded(point[f.name])) for f in surface.table.factors]
    span = surface.model.predict(corners)
    return coded, interval(surface.model, [coded], LEVEL), (float(span.min()), float(span.max()))


def optimum() -> list[Item]:
    """The published optimum, and Table 11's coding of B."""
    section, text = "Optimum", printed_text()
    target = text["repose_angle_physical_deg"]
    items = []
    for label, b_reversed in (
        ("coding of Table 11 (-1 = 0.90)", True),
        ("B coded the other way (-1 = 0.82)", False),
    ):
        coded, predicted, span = at_optimum(b_reversed)
        reason = (
            f"coded {', '.join(f'{x:.3f}' for x in coded)}; 95 % confidence {predicted.confidence[0]:.4f} to "
            f"{predicted.confidence[1]:.4f}, prediction {predicted.prediction[0]:.4f} to "
            f"{predicted.prediction[1]:.4f}; rounding of the optimum spans {span[0]:.4f} to {span[1]:.4f}"
        )
        items.append(
            compare(
                section,
                f"predicted angle at the optimum, {label}",
                f"{target}",
                predicted.predicted,
                reason,
                span,
            )
        )
    found = target_set(designs.surface(), target, text["repose_angle_physical_pm"])
    return [*items, *_reach(section, found), *_centre(section, target), *_coding(section)]


def _reach(section, found) -> list[Item]:
    """Whether the target can be met in the box, and by one setting only."""
    top = found.surface.stationary
    inside = bool(np.all(np.abs(top.coded) <= 1))
    extents = "; ".join(f"{e.name} {e.coded[0]:.3f} to {e.coded[1]:.3f}" for e in found.sheet_extents)
    unique = not found.sheet_extents or all(e.coded[1] - e.coded[0] < 1e-3 for e in found.sheet_extents)
    unidentified = [e.name for e in found.sheet_extents if e.unidentified]
    return [
        Item(
            section,
            f"{found.target} reachable in the box",
            "yes",
            found.highest,
            None,
            REPRODUCED if found.reachable else INCONSISTENT,
            f"highest predicted response {found.highest:.6f}; the stationary point "
            f"{', '.join(f'{x:.4f}' for x in top.coded)} is a {top.kind} "
            f"{'inside' if inside else 'outside'} the box",
        ),
        judged(
            section,
            "the best combination is unique",
            "yes",
            f"{len(found.sheet_extents) - 1}-dimensional sheet",
            unique,
            f"one equation, {len(found.sheet_extents)} unknowns; coded extents {extents}; "
            f"{100 * found.fraction:.1f} % of the box lies within +-{found.uncertainty} deg of "
            f"{found.target}, {100 * found.fraction_one_percent:.1f} % within 1 %; not identified: "
            f"{', '.join(unidentified) or 'none'}",
        ),
    ]


def _centre(section, target) -> list[Item]:
    """The centre runs of Table 12 beside the target and row 2 of Table 10."""
    from scipy.special import stdtr

    data = designs.surface_table()
    runs = data.response[(data.coded == 0).all(axis=1)]
    mean, sd, n = runs.mean(), runs.std(), len(runs)
    width = sd * np.sqrt(1 + 1 / n)
    statistics = [abs(angle - mean) / width for angle in (target, *implied_angles(2))]
    p = [float(2 * stdtr(n - 1, -t)) for t in statistics]
    low, high = implied_angles(2)
    return [
        judged(
            section,
            "centre of the box and target",
            f"{target}",
            mean,
            p[0] > LEVEL,
            f"centre runs {mean:.3f} +- {sd:.4f}: {100 * abs(mean - target) / target:.3f} % off; the "
            f"verified optimum ({printed_text()['repose_angle_verification_deg']}) is no closer",
            mean - target,
        ),
        judged(
            section,
            "row 2 of Table 10 and the centre runs (same B, C, G)",
            f"{low:.4f} or {high:.4f}",
            mean,
            max(p[1:]) > LEVEL,
            f"t({n - 1}) of one new run {statistics[1]:.3f} (p {p[1]:.3f}) or {statistics[2]:.3f} (p {p[2]:.3f})",
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
        nearest = min(angles, key=lambda angle, y=predicted: abs(angle - y))
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
