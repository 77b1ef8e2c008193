"""The audit of the source paper: every printed number recomputed from the printed rows.

Printed values come from tables.json; recomputed ones and reasons from the fits. One function a section of the
paper, each returning its items in the order they are printed.
"""

from itertools import product

import numpy as np

from pellet_study.doe.linear_model import interval
from pellet_study.doe.optimum import target_set
from pellet_study.doe.plackett_burman import coded_matrix
from pellet_study.doe.steepest_climb import first_order_model
from pellet_study.paper import designs, table, tables
from pellet_study.paper.verdicts import (
    CONSISTENT,
    DATA_MISSING,
    INCONSISTENT,
    NOT_RECOMPUTABLE,
    REPRODUCED,
    Item,
    compare,
    half_last_digit,
)

LEVEL = 0.05
"""Level of every test of the audit."""

LAYOUT = {"3": ("Table 3, Eq. 1", "a1", "b1"), "5": ("Table 5, Eq. 3", "a3", "b3")}


def audit() -> list[Item]:
    """All items, in the order of the paper."""
    sections = (
        bench_test("3", "1"),
        missing_test(),
        bench_test("5", "3"),
        screening_design(),
        effects(),
        screening_anova(),
        climb(),
        surface_design(),
        surface_anova(),
        equation_four(),
        goodness_of_fit(),
        optimum(),
        verification(),
        time_step(),
    )
    return [item for section in sections for item in section]


def counts(items: list[Item]) -> dict[str, int]:
    """{verdict: how many}."""
    found = [item.verdict for item in items]
    return {verdict: found.count(verdict) for verdict in dict.fromkeys(sorted(found))}


def _text() -> dict:
    return tables()["text"]


def _cells(number: int) -> dict[str, dict[str, str]]:
    """{row label: {column: printed cell}} of a table."""
    content = tables()["tables"][str(number)]
    return {row[0]: dict(zip(content["columns"], row, strict=True)) for row in content["printed"]}


def _judged(section, item, published, recomputed, is_consistent, reason, difference=None) -> Item:
    verdict = CONSISTENT if is_consistent else INCONSISTENT
    return Item(section, item, published, recomputed, difference, verdict, reason)


# ------------------------------------------------------------------------------------------------ bench tests
def bench_test(number: str, equation: str) -> list[Item]:
    """Table 3 with Eq. 1, or Table 5 with Eq. 3."""
    section, parameter, observable = LAYOUT[number]
    text, printed = _text(), tables()["equations"][equation]
    model = designs.bench_fit(int(number))
    physical, solution = text[f"{observable}_physical_mm"], text[f"{parameter}_solution"]
    items = [
        compare(section, f"Eq. {equation} {name}", f"{printed[key]:.5f}", model.coefficients[term])
        for name, key, term in (
            ("constant", "const", "1"),
            ("linear", "lin", "a"),
            ("quadratic", "quad", "a2"),
        )
    ]
    items.append(
        compare(
            section,
            f"Eq. {equation} R2",
            f"{printed['R2']:.5f}",
            designs.r_squared(model),
            _r2_reason(model, printed),
        )
    )
    items.append(_root(section, model, parameter, solution, physical))
    verified = text[f"{observable}_verification_mm"]
    error = 100 * abs(verified - physical) / physical
    items.append(
        compare(
            section,
            f"relative error of the verification {verified}, %",
            f"{text[f'{observable}_relative_error_pct']}",
            error,
        )
    )
    predicted = interval(model, [[solution]], LEVEL)
    low, high = predicted.prediction
    items.append(
        _judged(
            section,
            f"fit at {solution} and the verification",
            f"{verified}",
            predicted.predicted,
            low <= verified <= high,
            f"a fitted value beside one simulated run; 95 % prediction interval {low:.2f} to {high:.2f} mm",
            predicted.predicted - verified,
        )
    )
    items.append(_range(section, parameter, _levels(number), text))
    return items


def _levels(number: str) -> np.ndarray:
    return table(int(number)).iloc[:, 1].to_numpy(dtype=float)


def _r2_reason(model, printed) -> str:
    """What was tried to find a printed R2 that does not come out."""
    value = designs.r_squared(model)
    if round(value, 5) == printed["R2"]:
        return ""
    half = np.array([half_last_digit(row[2]) for row in tables()["tables"]["5"]["printed"]])
    perturbed = [
        designs.r_squared(model, model.response + half * signs)
        for signs in product((-1, 1), repeat=len(half))
    ]
    adjusted = 1 - (1 - value) * (len(half) - 1) / model.df_residual
    line = designs.r_squared(designs.bench_fit(5, degree=1))
    uncentred = 1 - model.ss_residual / np.sum(model.response**2)
    return (
        f"the coefficients come out, so the data are right; rounding of the data allows {min(perturbed):.6f} "
        f"to "
        f"{max(perturbed):.6f}; adjusted {adjusted:.6f}, straight line {line:.6f}, uncentred "
        f"{uncentred:.6f}: none is "
        f"{printed['R2']}; a misprint of {value:.5f}"
    )


def _roots(model, value: float) -> np.ndarray:
    """Solutions of the fitted quadratic for a response, the nearest to the middle of the data first."""
    c = model.coefficients
    roots = np.roots([c["a2"], c["a"], c["1"] - value])
    return roots[np.argsort(np.abs(roots - model.coded.mean()))]


def _root(section, model, parameter, solution, physical) -> Item:
    root, other = _roots(model, physical)
    reason = f"other root {other:.6f}"
    half = half_last_digit(f"{physical}")
    ends = sorted(_roots(model, physical + sign * half)[0] for sign in (-1, 1))
    if round(root, 3) != solution:
        nearby = [float(model.predict([[a]])[0]) for a in (round(root, 3), solution)]
        reason = (
            f"{root:.6f} rounds to {root:.3f}; the fit gives {nearby[0]:.3f} mm there and {nearby[1]:.3f} mm "
            f"at {solution}; "
            f"{physical} taken as exact (a reading rounded to it, +-{half:g} mm, gives {ends[0]:.6f} to "
            f"{ends[1]:.6f}); {reason}"
        )
    return compare(section, f"root {parameter} at {physical} mm", f"{solution}", float(root), reason)


def _range(section, parameter, levels, text) -> Item:
    """Whether range, step and number of sets agree; from the levels of the table where it is printed."""
    (low, high), step, sets = text[f"{parameter}_range"], text[f"{parameter}_step"], text[f"{parameter}_sets"]
    count = int(round((high - low) / step)) + 1
    label = f"range {low} to {high}, step {step}: number of sets"
    reason = ""
    if count != sets:
        reason = (
            f"{low} to {high} by {step} are {count} levels, the table has {len(levels)}, to {levels[-1]:g}: "
            f"the range should read {levels[0]:g} to {levels[-1]:g}"
        )
    return compare(section, label, f"{sets}", float(count), reason)


def missing_test() -> list[Item]:
    """Table 4 and Eq. 2 are not in the text."""
    section, text = "Table 4, Eq. 2", _text()
    first = designs.r_squared(designs.bench_fit(3))
    same = round(first, 5) == text["R2_eq2"]
    angle, solution = text["b2_physical_deg"], text["a2_solution"]
    error = 100 * abs(text["b2_verification_deg"] - angle) / angle
    (low, high), sets, step = text["a2_range"], text["a2_sets"], text["a2_step"]
    needed = (high - low) / (sets - 1)
    return [
        Item(
            section, "Eq. 2 coefficients and Table 4", "absent", None, None, DATA_MISSING, "not in the text"
        ),
        Item(
            section,
            "Eq. 2 R2",
            f"{text['R2_eq2']}",
            first,
            first - text["R2_eq2"],
            DATA_MISSING,
            f"{'identical to' if same else 'not'} Eq. 1's R2, which comes out as {first:.7f}: most likely "
            f"copied",
        ),
        Item(
            section,
            f"root a2 at {angle} deg",
            f"{solution}",
            None,
            None,
            DATA_MISSING,
            f"a body that slips at atan(a2) would give tan({angle} deg) = {np.tan(np.radians(angle)):.4f}; "
            f"atan({solution}) = {np.degrees(np.arctan(solution)):.2f} deg",
        ),
        compare(section, "relative error of the verification, %", f"{text['b2_relative_error_pct']}", error),
        compare(
            section,
            f"range {low} to {high}, {sets} sets: step",
            f"{step}",
            needed,
            f"{sets} levels over {high - low:.2f} need {needed:.2f}; {step} would need "
            f"{(high - low) / step + 1:.1f} sets "
            f"(it is the step of the a3 test: {text['a3_step']})",
        ),
    ]


# -------------------------------------------------------------------------------------------------- screening
def screening_design() -> list[Item]:
    """Table 7 as a design."""
    section, matrix = "Table 7, design", designs.screening_table().coded.to_numpy()
    corners = matrix[(matrix != 0).all(axis=1)]
    runs, n_factors = corners.shape
    orthogonal = np.allclose(corners.T @ corners, runs * np.eye(n_factors)) and not corners.sum(axis=0).any()
    standard = np.array_equal(corners, coded_matrix(n_factors, runs))
    match = _library_match(corners)
    return [
        Item(
            section,
            "12 runs orthogonal and balanced",
            "Plackett-Burman",
            str(orthogonal),
            None,
            REPRODUCED if orthogonal else INCONSISTENT,
            f"D'D = {runs} I; in order the first {n_factors} columns of the standard cyclic design: "
            f"{standard}",
        ),
        Item(
            section,
            "equivalent to pyDOE3.pbdesign(11)",
            "",
            str(match is not None),
            None,
            REPRODUCED if match else INCONSISTENT,
            f"columns {match[0]} with signs {match[1]}; pbdesign({n_factors}) itself has "
            f"{_library_runs(n_factors)} runs"
            if match
            else "no choice of columns, signs and rows maps one to the other",
        ),
    ]


def _library_runs(n_factors: int) -> int:
    import pyDOE3

    return len(pyDOE3.pbdesign(n_factors))


def _library_match(corners: np.ndarray) -> tuple[list[int], list[int]] | None:
    """Columns and signs of pyDOE3.pbdesign(11) that give the same set of rows; None where there are none."""
    import pyDOE3

    library = pyDOE3.pbdesign(len(corners) - 1)
    wanted = [sorted(map(tuple, corners[:, : k + 1])) for k in range(corners.shape[1])]
    for image in library:  # the library row that becomes the row of all -1
        flipped = -library * image
        stack = [[]]
        while stack:
            chosen = stack.pop()
            if len(chosen) == corners.shape[1]:
                return chosen, [int(-image[i]) for i in chosen]
            for column in set(range(library.shape[1])) - set(chosen):
                candidate = [*chosen, column]
                if sorted(map(tuple, flipped[:, candidate])) == wanted[len(chosen)]:
                    stack.append(candidate)
    return None


def effects() -> list[Item]:
    """Table 8."""
    section, screening, cells = "Table 8", designs.screening(), _cells(8)
    items = []
    for name, cell in cells.items():
        items += [
            compare(section, f"{name} effect", cell["Stdized effects"], screening.effects[name]),
            compare(
                section, f"{name} sum of squares", cell["Sum of squares"], screening.sums_of_squares[name]
            ),
            compare(
                section, f"{name} contribution, %", cell["Contribution degree"], screening.contributions[name]
            ),
        ]
    positive = {name for name, effect in screening.effects.items() if effect > 0}
    claimed = set("ACEFG")
    items.append(
        Item(
            section,
            "signs: A, C, E, F, G positive, B, D negative",
            "yes",
            "yes" if positive == claimed else "no",
            None,
            REPRODUCED if positive == claimed else INCONSISTENT,
        )
    )
    error = np.sqrt(screening.model.mean_square_error * 4 / 12)
    standardised = {name: effect / error for name, effect in screening.effects.items()}
    raw = all(abs(float(cells[n]["Stdized effects"]) - screening.effects[n]) < 0.0051 for n in cells)
    items.append(
        _judged(
            section,
            "column headed 'Stdized effects'",
            "standardised",
            "raw effects" if raw else "unknown",
            not raw,
            f"the values are mean(+) - mean(-) in degrees; standardised (t) B would be "
            f"{standardised['B']:.3f}",
        )
    )
    return items


def screening_anova() -> list[Item]:
    """Table 9: the centre point split off as curvature, 4 residual degrees of freedom."""
    section, screening, cells = "Table 9", designs.screening(), _cells(9)
    rows = {row["source"]: row for row in screening.anova}
    pooled_df = rows["residual"]["df"] + 1
    pooled = (rows["residual"]["sum_of_squares"] + rows["curvature"]["sum_of_squares"]) / pooled_df
    items = []
    for name, cell in cells.items():
        row = rows["model" if name == "Model" else name]
        items += [
            compare(section, f"{name} sum of squares", cell["Sum of squares"], row["sum_of_squares"]),
            compare(
                section,
                f"{name} F",
                cell["F-value"],
                row["f"],
                f"with the centre point pooled into the residual {row['mean_square'] / pooled:.4f}"
                if name == "Model"
                else "",
            ),
            compare(section, f"{name} P", cell["P-value"], row["p"]),
        ]
    residual, curvature = rows["residual"], rows["curvature"]
    items.append(
        Item(
            section,
            "residual sum of squares and df",
            "absent",
            residual["sum_of_squares"],
            None,
            DATA_MISSING,
            f"df {residual['df']}, mean square {residual['mean_square']:.6f}; curvature "
            f"{curvature['sum_of_squares']:.4f} "
            f"on 1 df, F = {curvature['f']:.4f}, p = {curvature['p']:.4f}",
        )
    )
    highly = [name for name, p in screening.p.items() if p < 0.01]
    items.append(
        _judged(
            section,
            "text: G highly significant, C and B significant",
            "G",
            ", ".join(highly),
            highly == ["G"],
            f"p of C is {screening.p['C']:.4f}, below 0.01 and printed {cells['C']['P-value']}: by the "
            f"paper's own rule C is "
            "extremely significant too",
        )
    )
    return items


# ------------------------------------------------------------------------------------------------------ climb
def _implied(row: int) -> tuple[float, float]:
    """The two repose angles a relative error of Table 10 leaves open (row counted from 1)."""
    target = _text()["repose_angle_physical_deg"]
    error = float(table(10)["Relative error"].iloc[row - 1]) / 100
    return target * (1 - error), target * (1 + error)


def _climb_model():
    """Main effects B, C, G of Table 7, and the rows of Table 10 in its coded units."""
    model, factors = first_order_model(designs.screening(), ["B", "C", "G"])
    points = np.column_stack([factor.coded(table(10)[factor.name]) for factor in factors])
    return model, factors, points


def climb() -> list[Item]:
    """Table 10: relative errors only, no angles."""
    section, target = "Table 10", _text()["repose_angle_physical_deg"]
    model, factors, points = _climb_model()
    items = []
    for i, point in enumerate(points):
        low, high = _implied(i + 1)
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
                f"{predicted.predicted:.3f} "
                f"({predicted.prediction[0]:.2f} to {predicted.prediction[1]:.2f}), an error of "
                f"{100 * abs(predicted.predicted - target) / target:.2f} %",
            )
        )
    return [
        *items,
        _climb_steps(section, model, factors, points),
        _climb_monotone(section),
        *_climb_repeats(section, model, points),
    ]


def _climb_steps(section, model, factors, points) -> Item:
    steps = points[1] - points[0]
    slopes = np.array([model.coefficients[factor.name] for factor in factors])
    angle = np.degrees(np.arccos(steps @ slopes / np.linalg.norm(steps) / np.linalg.norm(slopes)))
    physical = steps * [factor.half_range for factor in factors]
    gradient = physical[1] * slopes / slopes[1]
    moves = ", ".join(f"{factor.name} {move:+.2f}" for factor, move in zip(factors, physical, strict=True))
    wanted = ", ".join(f"{factor.name} {move:+.5f}" for factor, move in zip(factors, gradient, strict=True))
    return _judged(
        section,
        f"steps {moves} as the steepest climb",
        "gradient",
        f"{angle:.2f} deg off",
        angle < 1,
        f"all ranges are equal, so the fitted gradient asks for {wanted}; signs agree, lengths do not: the "
        f"path is the diagonal "
        "of the box from its corner of lowest prediction",
    )


def _climb_monotone(section) -> Item:
    errors = table(10)["Relative error"].to_numpy(dtype=float)
    turns = int(np.sum(np.diff(np.sign(np.diff(errors))) != 0))
    angles = []
    for row in range(1, len(errors) + 1):
        angles.append(next((a for a in _implied(row) if not angles or a > angles[-1]), np.nan))
    rising = np.isfinite(angles).all()
    centre = float(designs.screening_table().response.iloc[-1])
    return _judged(
        section,
        "a monotone path",
        "",
        "error falls then rises once" if turns == 1 else f"{turns} turns",
        turns == 1 and rising,
        f"a rising angle fits ({', '.join(f'{a:.2f}' for a in angles)}), its last step "
        f"{angles[-1] - angles[-2]:+.1f} deg after "
        f"{angles[-2] - angles[-3]:+.1f}; the falling branch contradicts the centre run {centre} of Table 7",
    )


def _climb_repeats(section, model, points) -> list[Item]:
    """Rows of Table 10 whose B, C, G were run in Table 7 as well."""
    screening = designs.screening()
    coded, response = screening.table.coded[["B", "C", "G"]].to_numpy(), screening.table.response.to_numpy()
    reach = sum(abs(screening.effects[name]) for name in "ADEF") / 2
    items = []
    for row in (1, 6):
        same = np.flatnonzero((coded == np.round(points[row - 1])).all(axis=1))
        mean, angles = response[same].mean(), _implied(row)
        low, high = interval(model, [points[row - 1]], LEVEL).prediction
        nearest = min(angles, key=lambda angle: abs(angle - mean))
        inside = any(low <= angle <= high for angle in angles)
        runs = ", ".join(f"run {i + 1} = {response[i]}" for i in same)
        error = 100 * abs(mean - _text()["repose_angle_physical_deg"]) / _text()["repose_angle_physical_deg"]
        reason = f"{runs}; 95 % prediction interval {low:.2f} to {high:.2f}"
        if not inside:
            reason += (
                f" excludes both {angles[0]:.2f} and {angles[1]:.2f}; that run is {error:.2f} % off the "
                f"target, and A, D, E, F "
                f"together move the angle by at most {reach:.3f} deg: a misprint or another setting of them"
            )
        items.append(
            _judged(
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


# ---------------------------------------------------------------------------------------------------- surface
def surface_design() -> list[Item]:
    """Tables 11 and 12 as a design."""
    import pyDOE3

    matrix = designs.surface_table().coded.to_numpy()
    library = pyDOE3.bbdesign(3, center=int((matrix == 0).all(axis=1).sum()))
    same = sorted(map(tuple, matrix)) == sorted(map(tuple, library + 0.0))
    return [
        Item(
            "Tables 11 and 12, design",
            "Box-Behnken, 3 factors, 12 edges and 5 centre points",
            "Box-Behnken",
            str(same),
            None,
            REPRODUCED if same else INCONSISTENT,
            f"the {len(library)} runs of pyDOE3.bbdesign(3), in Design-Expert's standard order, not "
            f"randomised",
        )
    ]


def surface_anova() -> list[Item]:
    """Table 13: partial sums of squares in coded units."""
    section, rows = "Table 13", {row["source"]: row for row in designs.surface().anova}
    keys = {
        "Model": "model",
        "Residual": "residual",
        "Lack of fit": "lack of fit",
        "Pure error": "pure error",
        "Sum": "total",
    }
    items = []
    for name, cell in _cells(13).items():
        row = rows[keys.get(name, name.replace("²", "2"))]
        for label, column, key in (
            ("mean square", "Mean square", "mean_square"),
            ("sum of squares", "Sum of square", "sum_of_squares"),
            ("P", "P-value", "p"),
        ):
            if cell[column]:
                reason = f"F = {row['f']:.4f}" if key == "p" else ""
                items.append(compare(section, f"{name} {label}", cell[column], row[key], reason))
    cell, row = _cells(13)["BC"], rows["BC"]
    items.append(
        compare(
            section,
            f"{cell['Mean square']} printed as mean square and as sum of squares of BC",
            cell["Sum of square"],
            row["sum_of_squares"],
            f"mean square = sum of squares on {row['df']} degree of freedom",
        )
    )
    return items


def equation_four() -> list[Item]:
    """Eq. 4 in coded units."""
    printed = tables()["equations"]["4"]
    coefficients = designs.surface().coefficients
    items = []
    for term, text in zip(printed["terms"], printed["printed_coefs"], strict=True):
        reason = "printed without its exponent" if term == "B2" else ""
        items.append(compare("Eq. 4", term, text, coefficients[term], reason))
    return items


def goodness_of_fit() -> list[Item]:
    """R2 and its kin."""
    section, surface, text = "R2, C.V.", designs.surface(), _text()
    gap = surface.r2_adjusted - surface.r2_predicted
    return [
        compare(section, "R2", f"{text['R2_BB']}", surface.r2),
        compare(section, "adjusted R2", f"{text['R2_adj_BB']}", surface.r2_adjusted),
        compare(section, "C.V., %", f"{text['CV_BB_pct']}", surface.cv_percent),
        Item(
            section,
            "predicted R2",
            "absent",
            surface.r2_predicted,
            None,
            DATA_MISSING,
            f"PRESS {surface.press:.6f}; {gap:.4f} below the adjusted R2 (0.2 is the usual limit)",
        ),
        Item(
            section,
            "adequate precision",
            "absent",
            surface.adequate_precision,
            None,
            DATA_MISSING,
            "above 4 is wanted",
        ),
    ]


# ---------------------------------------------------------------------------------------------------- optimum
def _at_optimum(b_reversed: bool):
    """Prediction at the published optimum and its span over the rounding of the three levels."""
    surface, point = designs.surface(b_reversed), _text()["optimum"]
    half = 0.0005
    corners = [
        [
            float(f.coded(point[f.name] + sign * half))
            for f, sign in zip(surface.table.factors, signs, strict=True)
        ]
        for signs in product((-1, 1), repeat=3)
    ]
    coded = [float(f.coded(point[f.name])) for f in surface.table.factors]
    span = surface.model.predict(corners)
    return coded, interval(surface.model, [coded], LEVEL), (float(span.min()), float(span.max()))


def optimum() -> list[Item]:
    """The published optimum, and Table 11's coding of B."""
    section, text = "Optimum", _text()
    target = text["repose_angle_physical_deg"]
    items = []
    for label, b_reversed in (
        ("coding of Table 11 (-1 = 0.90)", True),
        ("B coded the other way (-1 = 0.82)", False),
    ):
        coded, predicted, span = _at_optimum(b_reversed)
        reason = (
            f"coded {', '.join(f'{x:.3f}' for x in coded)}; 95 % confidence {predicted.confidence[0]:.4f} to "
            f"{predicted.confidence[1]:.4f}, prediction {predicted.prediction[0]:.4f} to "
            f"{predicted.prediction[1]:.4f}; rounding of "
            f"the optimum spans {span[0]:.4f} to {span[1]:.4f}"
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
    extents = "; ".join(f"{e.name} {e.coded[0]:.3f} to {e.coded[1]:.3f}" for e in found.extents)
    unique = not found.extents or all(e.coded[1] - e.coded[0] < 1e-3 for e in found.extents)
    return [
        Item(
            section,
            f"{found.target} reachable in the box",
            "yes",
            found.highest,
            None,
            REPRODUCED if found.reachable else INCONSISTENT,
            f"highest predicted response {found.highest:.6f}; the stationary point "
            f"{', '.join(f'{x:.4f}' for x in top.coded)} is a "
            f"{top.kind} {'inside' if inside else 'outside'} the box",
        ),
        _judged(
            section,
            "the best combination is unique",
            "yes",
            f"{len(found.extents) - 1}-dimensional sheet",
            unique,
            f"one equation, {len(found.extents)} unknowns; coded extents {extents}; "
            f"{100 * found.fraction:.1f} % of the box lies within "
            f"+-{found.uncertainty} deg of {found.target}, {100 * found.fraction_one_percent:.1f} % within 1 "
            f"%; not identified: "
            f"{', '.join(found.unidentified) or 'none'}",
        ),
    ]


def _centre(section, target) -> list[Item]:
    """The centre runs of Table 12 beside the target and row 2 of Table 10."""
    from scipy.special import stdtr

    data = designs.surface_table()
    runs = data.response[(data.coded == 0).all(axis=1)]
    mean, sd, n = runs.mean(), runs.std(), len(runs)
    width = sd * np.sqrt(1 + 1 / n)
    statistics = [abs(angle - mean) / width for angle in (target, *_implied(2))]
    p = [float(2 * stdtr(n - 1, -t)) for t in statistics]
    low, high = _implied(2)
    return [
        _judged(
            section,
            "centre of the box and target",
            f"{target}",
            mean,
            p[0] > LEVEL,
            f"centre runs {mean:.3f} +- {sd:.4f}: {100 * abs(mean - target) / target:.3f} % off; the "
            f"verified optimum "
            f"({_text()['repose_angle_verification_deg']}) is no closer",
            mean - target,
        ),
        _judged(
            section,
            "row 2 of Table 10 and the centre runs (same B, C, G)",
            f"{low:.4f} or {high:.4f}",
            mean,
            max(p[1:]) > LEVEL,
            f"t({n - 1}) of one new run {statistics[1]:.3f} (p {p[1]:.3f}) or {statistics[2]:.3f} (p "
            f"{p[2]:.3f})",
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
        for angle in _implied(row)
    ]
    return found.predicted, found.prediction, p


def _coding(section) -> list[Item]:
    """Which coding of the factors the other tables support."""
    misfits = {}
    for signs in product((1, -1), repeat=3):
        predictions = [_row_test(row, signs)[0] for row in (1, 3)]
        misfits[signs] = sum(
            min((a - y) ** 2 for a in _implied(row)) for row, y in zip((1, 3), predictions, strict=True)
        )
    best = min(misfits, key=misfits.get)
    ranking = "; ".join(f"{signs} {misfits[signs]:.2f}" for signs in sorted(misfits, key=misfits.get)[:4])
    printed = (-1, 1, 1)
    items = [
        _judged(
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
        angles = _implied(row)
        nearest = min(angles, key=lambda angle, y=predicted: abs(angle - y))
        items.append(
            _judged(
                section,
                f"Table 11's coding of B and row {row} of Table 10",
                f"{nearest:.4f}",
                predicted,
                max(p) > LEVEL,
                f"95 % prediction interval {low:.2f} to {high:.2f}, p {max(p):.4f}; B coded the other way "
                f"gives {other:.3f}, "
                f"p {max(p_other):.3f}",
                predicted - nearest,
            )
        )
    return items


# ----------------------------------------------------------------------------------------------- verification
def verification() -> list[Item]:
    """The verification run against the target, and its t test."""
    section, text = "Verification", _text()
    target, mean, sd = (
        text["repose_angle_physical_deg"],
        text["repose_angle_verification_deg"],
        text["repose_angle_physical_pm"],
    )
    errors = [
        100 * abs(mean + i * 0.005 - (target + j * 0.005)) / (target + j * 0.005)
        for i, j in product((-1, 0, 1), repeat=2)
    ]
    error = 100 * abs(mean - target) / target
    low, high = target - sd, target + sd
    predictions = [_at_optimum(b_reversed)[1].prediction for b_reversed in (True, False)]
    bounds = " and ".join(f"{a:.4f} to {b:.4f}" for a, b in predictions)
    return [
        compare(
            section,
            "relative error, %",
            f"{text['repose_relative_error_pct']}",
            error,
            f"rounding of both means allows {min(errors):.4f} to {max(errors):.4f} %",
            (min(errors), max(errors)),
        ),
        _judged(
            section,
            "abstract: less than 1 %",
            "<1",
            error,
            error < 1,
            f"{error:.3f} % from the printed means; below 1 % only if the unrounded means give "
            f"{text['repose_relative_error_pct']} %",
        ),
        _t_test(section, target - mean, sd, text["t_test_P"]),
        _judged(
            section,
            f"{target} +- {sd} and the 95 % prediction interval at the optimum",
            f"{low:.2f} to {high:.2f}",
            _at_optimum(True)[1].predicted,
            all(a <= low and high <= b for a, b in predictions),
            f"inside {bounds}; an interval {predictions[0][1] - predictions[0][0]:.2f} deg wide "
            f"({100 * (predictions[0][1] - predictions[0][0]) / target:.1f} %): a check with little power",
        ),
    ]


def _t_test(section, difference: float, sd: float, printed: float) -> Item:
    """Every n that the printed means and sd leave open."""
    from scipy.optimize import brentq
    from scipy.special import ndtri, stdtr, stdtrit
    from scipy.stats import ttest_ind_from_stats

    one = {n: float(2 * stdtr(n - 1, -difference / (sd / np.sqrt(n)))) for n in range(2, 31)}
    two = {n: float(2 * stdtr(2 * n - 2, -difference / (sd * np.sqrt(2 / n)))) for n in range(2, 31)}
    needed_n = (-ndtri(printed / 2) * sd / difference) ** 2
    n = 5
    needed_difference = -stdtrit(2 * n - 2, printed / 2) * sd * np.sqrt(2 / n)
    needed_sd = brentq(
        lambda other: ttest_ind_from_stats(difference, sd, n, 0, other, n, equal_var=False).pvalue - printed,
        sd,
        1000,
    )
    reverse = min(one, key=lambda k: abs(1 - one[k] - printed))
    possible = max(max(one.values()), max(two.values())) >= printed
    return _judged(
        section,
        "P of the t test",
        f"{printed}",
        max(one.values()),
        possible,
        f"cannot come from the printed means and sd: the largest P of any n >= 2 is {max(one.values()):.4f} "
        f"(one sample) or "
        f"{max(two.values()):.4f} (two samples); {printed} needs n = {needed_n:.3f} (normal limit), a "
        f"simulation sd of "
        f"{needed_sd:.1f} deg or a difference of {needed_difference:.4f} deg (n = {n} each); 1 - P comes "
        f"near at n = {reverse} "
        f"({1 - one[reverse]:.4f}), so 1 - P may have been printed; n and sd of the simulation are not given",
        max(one.values()) - printed,
    )


def time_step() -> list[Item]:
    r"""The radius behind the printed Rayleigh step :math:`\pi R \sqrt{\rho/G} / (0.1631\nu + 0.8766)`."""
    text = _text()
    poisson, shear_modulus, density = tables()["tables"]["1"]["values"][3:6]
    per_metre = np.pi * np.sqrt(density / shear_modulus) / (0.1631 * poisson + 0.8766)
    radius = 1e3 * text["rayleigh_time_step_s"] / per_metre
    amplification = text["particle_size_amplification"]
    return [
        Item(
            "Time step",
            f"radius of the powder spheres behind {text['rayleigh_time_step_s']:g} s, mm",
            "absent",
            radius,
            None,
            DATA_MISSING,
            f"diameter {2 * radius:.4f} mm amplified, {2000 * radius / amplification:.1f} um before; grid 3 "
            f"R = {3 * radius:.4f} mm; "
            f"if the step were 20 % of Rayleigh's, the radius would be {radius / 0.2:.3f} mm",
        )
    ]
