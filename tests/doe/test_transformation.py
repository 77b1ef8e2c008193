"""The response on another scale: the worsted yarn of Box and Cox 1964, the way back, levels said."""

import json

import numpy as np
import pandas as pd
import pytest
from statsmodels.regression.linear_model import OLS

from pellet_study.__main__ import main
from pellet_study.doe import box_behnken, reduction
from pellet_study.doe.box_cox import BoxCox
from pellet_study.doe.design_table import code_design
from pellet_study.doe.terms import columns_of
from pellet_study.doe.transformation import Transformation, advised, parse_transformation
from pellet_study.errors import InputError
from tests.helpers.published_designs import worsted_yarn


@pytest.fixture
def yarn_csv(tmp_path):
    path = tmp_path / "worsted.csv"
    worsted_yarn().to_csv(path, index=False)
    return path


def bbd(path, *words, status=0):
    out = path.parent / "answer.json"
    assert main(["bbd", str(path), *map(str, words), "--json", str(out)]) == status
    return json.loads(out.read_text()) if status == 0 else None


def test_what_is_advised_is_applied(tmp_path, capsys):
    """y = exp(quadratic + noise): the logarithm lies in the interval, and its coefficients are the quadratic's."""
    coded = np.vstack([box_behnken.coded_matrix(3, 5)] * 2)
    a, b, c = coded.T
    z = 3 + 1.2 * a - 0.8 * b + 0.5 * a * c + 0.6 * c**2 + 0.05 * np.random.default_rng(4).normal(size=len(a))
    path = tmp_path / "growth.csv"
    pd.DataFrame(coded, columns=list("ABC")).assign(growth=np.exp(z)).to_csv(path, index=False)
    answer = bbd(path, "--transform")
    assert answer["transformation"]["power"] == 0 and answer["transformation"]["advised"] == "log"
    assert answer["response"] == "ln(growth)"
    found = [answer["coefficients"][name] for name in ("1", "A", "B", "AC", "C2", "BC")]
    assert found == pytest.approx([3, 1.2, -0.8, 0.5, 0.6, 0], abs=0.06)
    assert "growth is analysed as ln(growth), as advised" in capsys.readouterr().out


def test_where_none_is_advised_none_is_applied(tmp_path, capsys):
    """y = 50 + plane + noise: 1 lies in the interval, and the answer is the one without --transform."""
    coded = np.vstack([box_behnken.coded_matrix(3, 5)] * 2)
    y = 50 + 5 * coded[:, 0] - 3 * coded[:, 1] + np.random.default_rng(4).normal(size=len(coded))
    path = tmp_path / "plain.csv"
    pd.DataFrame(coded, columns=list("ABC")).assign(y=y).to_csv(path, index=False)
    answer = bbd(path, "--transform")
    assert "so y is analysed as it is" in capsys.readouterr().out
    plain = bbd(path)
    assert answer.pop("transformation") is None and answer == plain


def test_the_logarithm_is_advised_for_the_main_effects_of_the_yarn(yarn_csv):
    """Box and Cox 1964: cycles are a product of powers; in a full factorial a main effect is half a difference of means."""
    surface = box_behnken.analyse(code_design(worsted_yarn()))
    plane = reduction.without(surface, [name for name, indices in surface.model.terms.items() if len(indices) == 2])
    assert advised(plane.box_cox) == "log"
    answer = bbd(yarn_csv, "--transform", "log")
    frame = worsted_yarn().assign(z=lambda f: np.log(f.cycles))
    for name in ("length", "amplitude", "load"):
        means = frame.groupby(name).z.mean()
        assert answer["coefficients"][name] == pytest.approx((means.iloc[-1] - means.iloc[0]) / 2)
    assert answer["response"] == "ln(cycles)"


def test_intervals_go_back_with_the_level_said(yarn_csv, capsys):
    answer = bbd(yarn_csv, "--transform", "log", "--alpha", "0.1", "--predict", "length=300,amplitude=9,load=45")
    frame = worsted_yarn()
    coded = (frame[["length", "amplitude", "load"]] - [300, 9, 45]) / [50, 1, 5]
    terms = box_behnken.analyse(code_design(frame)).model.terms
    theirs = OLS(np.log(frame.cycles.to_numpy()), columns_of(coded, terms)).fit()
    expected = np.exp(theirs.get_prediction(columns_of([[0, 0, 0]], terms)).summary_frame(alpha=0.1).iloc[0])
    found = answer["prediction"]
    assert found["predicted"] == pytest.approx(expected["mean"])
    assert found["confidence"] == pytest.approx([expected["mean_ci_lower"], expected["mean_ci_upper"]])
    assert found["prediction"] == pytest.approx([expected["obs_ci_lower"], expected["obs_ci_upper"]])
    text = capsys.readouterr().out
    assert "90 % confidence interval of the median" in text and "90 % prediction interval" in text


@pytest.mark.parametrize("how", ["log", "inverse", "sqrt", "0.25"])
def test_a_target_is_met_in_the_responses_own_unit(yarn_csv, how):
    words = ["--select", "--target", 800, "--uncertainty", 50]
    answer = bbd(yarn_csv, "--transform", how, *words)["joint"]["responses"]["cycles"]
    assert answer["prediction"]["predicted"] == pytest.approx(800, rel=1e-4)
    low, high = answer["prediction"]["confidence"]
    assert low < 800 < high


@pytest.mark.parametrize("power", [-2.0, -1.0, -0.5, 0.0, 0.25, 0.5, 2.0])
def test_there_and_back(power):
    y = np.array([0.2, 1.0, 7.5])
    scale = Transformation(power)
    assert scale.back(scale.forward(y)) == pytest.approx(y)
    step = 1e-6
    z = scale.forward(y)
    assert scale.slope_back(z) == pytest.approx((scale.back(z + step) - scale.back(z - step)) / (2 * step), rel=1e-4)


@pytest.mark.parametrize(
    "box_cox, word",
    [
        (BoxCox(-0.06, -0.18, 0.06), "log"), (BoxCox(0.45, 0.3, 0.7), "sqrt"), (BoxCox(-1.2, -3, -0.4), "inverse"),
        (BoxCox(0.27, 0.2, 0.35), "0.27"),
        (BoxCox(1.202, 1.2003, 1.2044), "1.202"), (BoxCox(0.9984, 0.9981, 0.9987), "0.9984"), (BoxCox(0.9, 0.2, 1.4), None), (BoxCox(4.0, 1.5, None), "2"), (None, None),
        (BoxCox(-0.6, -1.43, 0.23), "log"),
        (BoxCox(None, None, None, 5.0), None),
    ],
)  # fmt: skip
def test_what_is_advised(box_cox, word):
    assert advised(box_cox) == word


def test_what_no_power_takes_is_named_with_its_row(tmp_path, capsys):
    frame = worsted_yarn()
    frame.loc[4, "cycles"] = -1
    path = tmp_path / "negative.csv"
    frame.to_csv(path, index=False)
    bbd(path, "--transform", "log", status=2)
    assert "row 6: the response 'cycles' is -1" in capsys.readouterr().err
    with pytest.raises(InputError, match="log, sqrt, inverse or a power"):
        parse_transformation("cube")
