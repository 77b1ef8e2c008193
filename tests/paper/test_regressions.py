"""Every number the audit marks reproduced comes out of the paper's printed rows to every printed digit.

The expected values are typed from the paper (Tables 8, 9, 13, Eq. 1, 3, 4, text), not read from the package's
copy.
"""

import numpy as np
import pytest

from pellet_study.doe import box_behnken, plackett_burman, screening_designs
from pellet_study.doe.intervals import interval
from pellet_study.doe.optimum import target_set
from pellet_study.paper import designs
from pellet_study.paper.printed import table
from pellet_study.paper.verdicts import equal_as_printed

TABLE_8 = {
    "A": ("0.63", "1.20", "0.31"),
    "B": ("-3.23", "31.23", "8.05"),
    "C": ("7.19", "155.09", "39.99"),
    "D": ("-0.72", "1.54", "0.40"),
    "E": ("1.42", "6.05", "1.56"),
    "F": ("0.54", "0.86", "0.22"),
    "G": ("7.48", "168.00", "43.32"),
}
TABLE_9 = {
    "model": (7, "363.98", "13.32", "0.0124"),
    "A": (1, "1.20", "0.31", "0.6084"),
    "B": (1, "31.23", "8.00", "0.0474"),
    "C": (1, "155.09", "39.72", "0.0032"),
    "D": (1, "1.54", "0.39", "0.5640"),
    "E": (1, "6.05", "1.55", "0.2812"),
    "F": (1, "0.86", "0.22", "0.6626"),
    "G": (1, "168.00", "43.03", "0.0028"),
}
TABLE_13 = {
    "model": ("18.85", 9, "169.61", "<0.0001"),
    "B": ("3.45", 1, "3.45", "0.0244"),
    "C": ("60.67", 1, "60.67", "<0.0001"),
    "G": ("26.57", 1, "26.57", "<0.0001"),
    "BC": ("0.0552", 1, "0.0552", "0.7281"),
    "BG": ("7.78", 1, "7.78", "0.0036"),
    "CG": ("7.08", 1, "7.08", "0.0046"),
    "B2": ("2.05", 1, "2.05", "0.0634"),
    "C2": ("4.80", 1, "4.80", "0.0119"),
    "G2": ("53.51", 1, "53.51", "<0.0001"),
    "residual": ("0.4218", 7, "2.95", None),
    "lack of fit": ("0.7238", 3, "2.17", "0.1190"),
    "pure error": ("0.1952", 4, "0.7809", None),
    "total": (None, 16, "172.56", None),
}
EQUATION_4 = {
    "1": "41.25",
    "B": "0.6563",
    "C": "2.75",
    "G": "1.82",
    "BC": "-0.1175",
    "BG": "-1.40",
    "CG": "-1.33",
    "B2": "-0.6973",
    "C2": "-1.07",
    "G2": "-3.56",
}


@pytest.fixture(scope="module")
def screening():
    return plackett_burman.analyse(designs.screening_table())


@pytest.fixture(scope="module")
def surface():
    return box_behnken.analyse(designs.surface_table())


@pytest.mark.parametrize(
    ("number", "constant", "linear", "quadratic"),
    [(3, 0.22856, 20.01479, 47.52143), (5, 377.47571, -1721.80714, 2005.35714)],
)
def test_equations_1_and_3(number, constant, linear, quadratic):
    found = designs.bench_fit(number).coefficients
    assert [round(value, 5) for value in found.values()] == [constant, linear, quadratic]


def test_r2_of_equation_1_and_the_verification_errors():
    assert round(designs.r_squared(designs.bench_fit(3)), 5) == 0.98904
    errors = [100 * abs(a - b) / b for a, b in ((8.07, 8.01), (32.06, 31.85), (68.74, 69.2))]
    assert [round(error, 2) for error in errors] == [0.75, 0.66, 0.66]


def test_root_of_equation_1():
    fit = designs.bench_fit(3)
    assert round(float(fit.predict([[0.24558499]])[0]), 4) == 8.01


@pytest.mark.parametrize("name", TABLE_8)
def test_table_8(screening, name):
    effect, sum_of_squares, contribution = TABLE_8[name]
    assert equal_as_printed(effect, screening.effects[name])
    assert equal_as_printed(sum_of_squares, screening.sums_of_squares[name])
    assert equal_as_printed(contribution, screening.contributions[name])


@pytest.mark.parametrize("name", TABLE_9)
def test_table_9(screening, name):
    df, sum_of_squares, f, p = TABLE_9[name]
    row = next(row for row in screening.anova if row["source"] == name)
    assert row["df"] == df
    assert equal_as_printed(sum_of_squares, row["sum_of_squares"])
    assert equal_as_printed(f, row["f"])
    assert equal_as_printed(p, row["p"])


@pytest.mark.parametrize("name", TABLE_13)
def test_table_13(surface, name):
    mean_square, df, sum_of_squares, p = TABLE_13[name]
    row = next(row for row in surface.anova if row["source"] == name)
    assert row["df"] == df
    assert equal_as_printed(sum_of_squares, row["sum_of_squares"])
    assert mean_square is None or equal_as_printed(mean_square, row["mean_square"])
    assert row["p"] is None if p is None else equal_as_printed(p, row["p"])


def test_equation_4(surface):
    assert list(surface.coefficients) == list(EQUATION_4)
    for name, printed in EQUATION_4.items():
        assert equal_as_printed(printed, surface.coefficients[name]), name


def test_summary_of_the_surface(surface):
    assert equal_as_printed("0.9829", surface.r2)
    assert equal_as_printed("0.9609", surface.r2_adjusted)
    assert equal_as_printed("1.68", surface.cv_percent)


def test_the_papers_twelve_runs_and_climb_come_out_of_the_package(screening):
    assert np.array_equal(screening_designs.coded_matrix(7, 12), designs.screening_table().coded.to_numpy()[:12])
    from pellet_study.paper.results import climb

    path, turning = climb()
    assert path.points.to_numpy() == pytest.approx(table(10).to_numpy()[:, 1:4])
    assert turning.turned and turning.centre == {"B": 0.86, "C": 0.29, "G": 0.14}
    levels = [(f.name, f.low, f.high) for f in turning.next_factors]
    assert levels == [("B", 0.9, 0.82), ("C", 0.25, 0.33), ("G", 0.1, 0.18)]


def test_the_published_optimum_under_both_codings_of_b(surface):
    """The audit's two predictions, 41.90 (Table 11's coding) and 41.63 deg (B's coding the other way)."""
    for b_reversed, expected in ((True, 41.90), (False, 41.63)):
        factors = designs.surface_table(b_reversed).factors
        point = [float(f.coded(x)) for f, x in zip(factors, (0.887, 0.319, 0.162), strict=True)]
        assert round(interval(surface.model, [point]).predicted, 2) == expected


def test_the_target_is_met_on_a_sheet(surface):
    """Shares of the box and extents as in the audit."""
    found = target_set(surface, 41.69, 0.79)
    assert round(100 * found.fraction) == 27
    assert round(100 * found.fraction_one_percent, 1) == 14.7
    extents = {e.name: [round(x, 3) for x in e.coded] for e in found.sheet_extents}
    assert extents == {"B": [-1, 1], "C": [0.069, 1], "G": [-0.694, 0.683]}
    assert found.unidentified == ["B"]
    assert found.coded == pytest.approx([0.0275, 0.12764, 0.06235], abs=1e-4)
    assert found.highest == pytest.approx(43.042758, abs=1e-6)


def test_what_the_paper_should_have_had(screening, surface):
    """The audit's own numbers beyond the printed ones, to its digits."""
    assert round(screening.detectable_effects["B"], 4) == 4.2907
    assert [round(screening.p_adjusted[n], 4) for n in "BCG"] == [0.2371, 0.0196, 0.0196]
    assert round(screening.lenth.margin_of_error, 4) == 3.0948
    assert (round(screening.curvature.estimate, 2), round(screening.curvature.p, 4)) == (2.99, 0.2197)
    assert round(screening.r2_predicted, 4) == 0.6297
    assert round(surface.r2_predicted, 6) == 0.791591
    assert round(surface.adequate_precision, 4) == 24.2249
    assert round(surface.runs.cooks_distance.max(), 4) == 1.1699
    assert round(np.abs(surface.runs.studentized).max(), 4) == 2.7473
    assert round(surface.normality[1], 4) == 0.4754
    assert round(surface.box_cox.power, 2) == 1.78
    # the audit's interval is the range of a grid of 0.01 that lies inside
    assert (surface.box_cox.low, surface.box_cox.high) == pytest.approx((0.02, 3.89), abs=0.011)
