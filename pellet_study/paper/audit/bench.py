"""The three bench tests: Tables 3 to 5, Eq. 1 to 3."""

from itertools import product

import numpy as np

from pellet_study.doe.intervals import interval
from pellet_study.paper import designs
from pellet_study.paper.printed import printed_text, table, tables
from pellet_study.paper.verdicts import DATA_MISSING, LEVEL, Item, compare, half_last_digit, judged

LAYOUT = {"3": ("Table 3, Eq. 1", "a1", "b1"), "5": ("Table 5, Eq. 3", "a3", "b3")}
"""{table: (section, parameter, observable)}."""


def bench_test(number: str, equation: str) -> list[Item]:
    """Table 3 with Eq. 1, or Table 5 with Eq. 3."""
    section, parameter, observable = LAYOUT[number]
    text, printed = printed_text(), tables()["equations"][equation]
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
        judged(
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
        designs.r_squared(model, model.response + half * signs) for signs in product((-1, 1), repeat=len(half))
    ]
    adjusted = 1 - (1 - value) * (len(half) - 1) / model.df_residual
    line = designs.r_squared(designs.bench_fit(5, degree=1))
    uncentred = 1 - model.ss_residual / np.sum(model.response**2)
    return (
        f"the coefficients come out, so the data are right; rounding of the data allows {min(perturbed):.6f} "
        f"to {max(perturbed):.6f}; adjusted {adjusted:.6f}, straight line {line:.6f}, uncentred "
        f"{uncentred:.6f}: none is {printed['R2']}; a misprint of {value:.5f}"
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
            f"at {solution}; {physical} taken as exact (a reading rounded to it, +-{half:g} mm, gives "
            f"{ends[0]:.6f} to {ends[1]:.6f}); {reason}"
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
    section, text = "Table 4, Eq. 2", printed_text()
    first = designs.r_squared(designs.bench_fit(3))
    same = round(first, 5) == text["R2_eq2"]
    angle, solution = text["b2_physical_deg"], text["a2_solution"]
    error = 100 * abs(text["b2_verification_deg"] - angle) / angle
    (low, high), sets, step = text["a2_range"], text["a2_sets"], text["a2_step"]
    needed = (high - low) / (sets - 1)
    return [
        Item(section, "Eq. 2 coefficients and Table 4", "absent", None, None, DATA_MISSING, "not in the text"),
        Item(
            section,
            "Eq. 2 R2",
            f"{text['R2_eq2']}",
            first,
            first - text["R2_eq2"],
            DATA_MISSING,
            f"{'identical to' if same else 'not'} Eq. 1's R2, which comes out as {first:.7f}: most likely copied",
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
            f"{(high - low) / step + 1:.1f} sets (it is the step of the a3 test: {text['a3_step']})",
        ),
    ]
