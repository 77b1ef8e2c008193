"""Box-Behnken against two published analyses, and what is read off the fit against its definition.

resin viscosity: Myers and Montgomery, Response Surface Methodology, 2nd ed., Wiley 2002, example 7.5, ANOVA
and equation as reprinted by ReliaWiki, "Box Behnken RSM" (its F of BC, 1.22, does not follow from its own
sums, 12.25/10.25). odour: John, Statistical Design and Analysis of Experiments, Macmillan 1971; results as
printed in the SAS/STAT User's Guide, The RSREG Procedure, "A Response Surface with a Simple Optimum".
"""

import numpy as np
import pandas as pd
import pytest

from pellet_study.doe import anova, box_behnken, reduction
from pellet_study.doe.design_table import code_design
from pellet_study.doe.factors import Factor
from pellet_study.doe.intervals import interval
from pellet_study.errors import InputError

EDGES = [
    (-1, -1, 0),
    (1, -1, 0),
    (-1, 1, 0),
    (1, 1, 0),
    (-1, 0, -1),
    (1, 0, -1),
    (-1, 0, 1),
    (1, 0, 1),
    (0, -1, -1),
    (0, 1, -1),
    (0, -1, 1),
    (0, 1, 1),
    (0, 0, 0),
    (0, 0, 0),
    (0, 0, 0),
]
VISCOSITY = [53, 58, 59, 56, 64, 45, 35, 60, 59, 64, 53, 65, 65, 59, 62]
ODOUR = """66 40 .3 4; 39 120 .3 4; 43 40 .7 4; 49 120 .7 4; 58 40 .5 2; 17 120 .5 2; -5 40 .5 6; -40 120 .5
6;
65 80 .3 2; 7 80 .7 2; 43 80 .3 6; -22 80 .7 6; -31 80 .5 4; -35 80 .5 4; -26 80 .5 4"""


def viscosity() -> pd.DataFrame:
    return pd.DataFrame(EDGES, columns=list("ABC"), dtype=float).assign(viscosity=np.array(VISCOSITY, float))


@pytest.fixture(scope="module")
def resin():
    factors = [Factor("A", 150, 200, "C"), Factor("B", 5, 10), Factor("C", 15, 25)]
    return box_behnken.analyse(code_design(viscosity(), factors))


@pytest.fixture(scope="module")
def odour():
    rows = [[float(cell) for cell in row.split()] for row in ODOUR.split(";")]
    return box_behnken.analyse(code_design(pd.DataFrame(rows, columns=list("YTRH"))[list("TRHY")]))


@pytest.mark.parametrize(
    ("source", "sum_of_squares", "df", "p"),
    [
        ("model", 882.48, 9, 0.0114),
        ("A", 8.00, 1, 0.4174),
        ("B", 55.12, 1, 0.0681),
        ("C", 45.13, 1, 0.0900),
        ("A2", 200.83, 1, 0.0069),
        ("B2", 12.98, 1, 0.3115),
        ("C2", 48.52, 1, 0.0816),
        ("AB", 16.00, 1, 0.2668),
        ("AC", 484.00, 1, 0.0010),
        ("BC", 12.25, 1, 0.3241),
        ("residual", 51.25, 5, None),
        ("lack of fit", 33.25, 3, 0.4774),
        ("pure error", 18.00, 2, None),
        ("total", 933.73, 14, None),
    ],
)
def test_resin_anova_as_published(resin, source, sum_of_squares, df, p):
    row = next(row for row in resin.anova if row["source"] == source)
    assert row["sum_of_squares"] == pytest.approx(sum_of_squares, abs=0.00501)
    assert row["df"] == df
    assert row["p"] is None if p is None else round(row["p"], 4) == p


def test_resin_equation_in_physical_units_as_published(resin):
    published = {
        "1": -58.875,
        "A": 2.65,
        "B": -0.65,
        "C": -11.125,
        "A2": -0.0118,
        "B2": 0.3,
        "C2": -0.145,
        "AB": -0.032,
        "AC": 0.088,
        "BC": 0.14,
    }
    assert resin.physical_coefficients == pytest.approx(published)


def test_odour_summary_and_lack_of_fit_as_published(odour):
    rows = {row["source"]: row for row in odour.anova}
    assert np.sqrt(odour.model.mean_square_error) == pytest.approx(22.478508, abs=5e-7)
    assert round(odour.r2, 4) == 0.8820
    assert odour.cv_percent == pytest.approx(147.8849, abs=5e-5)
    assert rows["lack of fit"]["sum_of_squares"] == pytest.approx(2485.75)
    assert rows["pure error"]["sum_of_squares"] == pytest.approx(40.666667, abs=1e-6)
    assert round(rows["lack of fit"]["f"], 2) == 40.75
    assert round(odour.lack_of_fit_p, 4) == 0.0240


def test_odour_stationary_point_as_published(odour):
    assert odour.stationary.kind == "minimum"
    assert odour.stationary.coded == pytest.approx([0.121913, 0.199575, 1.770525], abs=5e-7)
    assert odour.stationary.predicted == pytest.approx(-52.024631, abs=5e-7)
    assert sorted(odour.stationary.eigenvalues) == pytest.approx([6.037732, 31.103461, 48.858807], abs=5e-7)
    physical = [f.physical(x) for f, x in zip(odour.table.factors, odour.stationary.coded, strict=True)]
    assert physical == pytest.approx([84.876502, 0.539915, 7.541050], abs=5e-7)


def test_no_box_cox_where_a_response_is_not_positive(odour, resin):
    assert odour.box_cox is None
    assert resin.box_cox.power == pytest.approx(_box_cox_by_grid(resin), abs=0.01)


def _box_cox_by_grid(surface) -> float:
    y, x = surface.model.response, surface.model.matrix
    mean = np.exp(np.log(y).mean())
    powers = np.round(np.arange(-5, 5, 0.01), 2)
    powers = powers[powers != 0]
    sse = []
    for power in powers:
        z = (y**power - 1) / (power * mean ** (power - 1))
        sse.append(np.sum((z - x @ np.linalg.lstsq(x, z, rcond=None)[0]) ** 2))
    return float(powers[np.argmin(sse)])


def test_predicted_r2_and_cooks_distance_by_leaving_each_run_out(resin):
    x, y = resin.model.matrix, resin.model.response
    left_out, moved = [], []
    for i in range(len(y)):
        keep = np.arange(len(y)) != i
        coefficients = np.linalg.lstsq(x[keep], y[keep], rcond=None)[0]
        left_out.append(y[i] - x[i] @ coefficients)
        shift = x @ coefficients - resin.runs.fitted
        moved.append(shift @ shift / (x.shape[1] * resin.model.mean_square_error))
    assert resin.press == pytest.approx(np.sum(np.square(left_out)))
    assert resin.r2_predicted == pytest.approx(1 - resin.press / np.sum((y - y.mean()) ** 2))
    assert resin.runs.cooks_distance == pytest.approx(moved)


def test_the_fit_follows_the_table_with_a_run_missing():
    """A known quadratic is recovered exactly from what was run."""
    frame = viscosity()
    x = frame[list("ABC")].to_numpy()
    frame["viscosity"] = 50 + 3 * x[:, 0] - 2 * x[:, 1] * x[:, 2] + 4 * x[:, 2] ** 2
    found = box_behnken.analyse(code_design(frame.drop(index=5))).coefficients
    expected = {"1": 50, "A": 3, "BC": -2, "C2": 4}
    assert found == pytest.approx({name: expected.get(name, 0) for name in found}, abs=1e-9)


def test_a_factor_whose_low_level_is_the_larger_number_gives_the_same_surface():
    frame = viscosity()
    physical = frame.assign(A=175 + 25 * frame.A)
    up = box_behnken.analyse(code_design(physical))
    down = box_behnken.analyse(code_design(physical, [Factor("A", 200, 150)]))
    assert down.coefficients["A"] == pytest.approx(-up.coefficients["A"])
    assert down.coefficients["AC"] == pytest.approx(-up.coefficients["AC"])
    assert down.physical_coefficients == pytest.approx(up.physical_coefficients)


def test_no_replicates_means_no_lack_of_fit_test():
    surface = box_behnken.analyse(code_design(viscosity().drop(index=[13, 14])))
    assert surface.lack_of_fit_p is None and surface.pure_error_df == 0
    assert surface.p["AC"] is not None


def test_a_saturated_fit_has_lenth_and_no_p_values():
    frame = pd.DataFrame(box_behnken.coded_matrix(2, 1, face_centred=True), columns=["A", "B"])
    frame = frame.drop(index=[0, 1, 2]).assign(y=[1.0, 4, 2, 8, 5, 7])
    surface = box_behnken.analyse(code_design(frame))
    assert surface.saturated and set(surface.p.values()) == {None}
    assert (surface.r2_adjusted, surface.r2_predicted, surface.cv_percent) == (None, None, None)
    assert surface.lenth.contrasts == 5
    with pytest.raises(InputError, match="no p values"):
        reduction.reduce_backward(surface)


def test_corners_are_an_extrapolation_of_box_behnken_and_not_of_face_centred(resin):
    assert interval(resin.model, [[1, 1, 1]]).extrapolation
    assert not interval(resin.model, [[1, 1, 0]]).extrapolation
    frame = pd.DataFrame(box_behnken.coded_matrix(3, 5, face_centred=True), columns=list("ABC"))
    surface = box_behnken.analyse(code_design(frame.assign(y=np.arange(len(frame)) % 7.0)))
    assert not interval(surface.model, [[1, 1, 1]]).extrapolation


def test_reduced_models_keep_hierarchy(resin):
    reduced, dropped = reduction.reduce_backward(resin, 0.1)
    assert "AC" in reduced.coefficients and "A" in reduced.coefficients and "A" not in dropped
    assert all(p <= 0.1 for name, p in reduced.p.items() if name not in ("A", "B", "C"))
    with pytest.raises(InputError, match="cannot be left out while"):
        reduction.without(resin, ["A"])
    assert list(reduction.without(resin, ["BC"]).coefficients) == [n for n in resin.coefficients if n != "BC"]


def test_prediction_intervals_cover_as_they_should():
    """Coverage of the 95 % intervals of the mean and of a run, 2000 simulated tables."""
    rng = np.random.default_rng(11)
    x = box_behnken.coded_matrix(3, 5)
    frame = pd.DataFrame(x, columns=list("ABC")).assign(y=rng.normal(size=len(x)))
    model = box_behnken.analyse(code_design(frame)).model
    found = interval(model, [[0.4, -0.3, 0.6]])
    half_widths = [
        (high - low) / 2 / np.sqrt(model.mean_square_error) for low, high in (found.confidence, found.prediction)
    ]
    y = rng.normal(size=(len(x), 2000))
    coefficients = np.linalg.lstsq(model.matrix, y, rcond=None)[0]
    sigma = np.sqrt(np.sum((y - model.matrix @ coefficients) ** 2, axis=0) / model.df_residual)
    point = np.array([1, 0.4, -0.3, 0.6, 0.4 * -0.3, 0.4 * 0.6, -0.3 * 0.6, 0.16, 0.09, 0.36])
    predicted = point @ coefficients
    assert np.mean(np.abs(predicted) < half_widths[0] * sigma) == pytest.approx(0.95, abs=0.015)
    assert np.mean(np.abs(predicted - rng.normal(size=2000)) < half_widths[1] * sigma) == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize(("n_factors", "runs"), [(3, 12), (4, 24), (5, 40)])
def test_box_behnken_has_only_edges_and_centre(n_factors, runs):
    matrix = box_behnken.coded_matrix(n_factors, 3)
    assert len(matrix) == runs + 3
    assert set(np.abs(matrix).sum(axis=1)) == {0, 2}


def test_face_centred_has_corners_faces_and_centre():
    counts = np.unique(np.abs(box_behnken.coded_matrix(3, 4, face_centred=True)).sum(axis=1), return_counts=True)
    assert dict(zip(*counts, strict=True)) == {0: 4, 1: 6, 3: 8}


@pytest.mark.parametrize("arguments", [(2,), (13,), (3, 0), (1, 5, True)])
def test_impossible_designs_are_refused(arguments):
    with pytest.raises(InputError, match="expected"):
        box_behnken.coded_matrix(*arguments)


@pytest.mark.parametrize("names", [["A", "B", "AB"], ["x", "2", "x2"], ["A", "B", "time"]])
def test_terms_keep_apart_whatever_the_factors_are_called(resin, names):
    frame = viscosity()
    frame.columns = [*names, "viscosity"]
    coefficients = box_behnken.analyse(code_design(frame)).coefficients
    assert list(coefficients.values()) == pytest.approx(list(resin.coefficients.values()))


def test_the_ceiling_of_the_predicted_r2_is_what_the_scatter_of_replicates_leaves():
    """Two pairs, 1 and 3, 5 and 7: a variance of 2 within, 20 in all; four new runs miss their means by 4 x 2."""
    squares, df = anova.pure_error([[-1.0], [-1.0], [1.0], [1.0]], [1.0, 3.0, 5.0, 7.0])
    assert anova.predicted_ceiling(squares, df, [1.0, 3.0, 5.0, 7.0]) == pytest.approx(1 - 4 * 2 / 20)
    assert anova.predicted_ceiling(0.0, 0, [1.0, 5.0]) is None
