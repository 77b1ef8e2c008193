"""Steepest climb against a textbook example.

Montgomery, Design and Analysis of Experiments, Wiley, example 11.1 (also Montgomery and Runger, Applied
Statistics and Probability for Engineers, example 14-11): reaction time and temperature, yield; y = 40.44 +
0.775 x1 + 0.325 x2, a step of 5 minutes goes with 2 F, the yield rises to 80.3 at 85 minutes and 175 F and
falls after it.
"""

import numpy as np
import pandas as pd
import pytest

from pellet_study.doe import path_turning, plackett_burman, screening_designs, steepest_climb
from pellet_study.doe.design_table import code_design
from pellet_study.doe.path_text import turning_text
from pellet_study.errors import InputError

YIELDS_ON_THE_PATH = [41.0, 42.9, 47.1, 49.7, 53.8, 59.9, 65.0, 70.4, 77.6, 80.3, 76.2, 75.1]


@pytest.fixture(scope="module")
def screening():
    time, temperature = [30, 30, 40, 40] + [35] * 5, [150, 160, 150, 160] + [155] * 5
    yields = [39.3, 40.0, 40.9, 41.5, 40.3, 40.5, 40.7, 40.2, 40.6]
    frame = pd.DataFrame({"time": time, "temperature": temperature, "yield": yields}, dtype=float)
    return plackett_burman.analyse(code_design(frame), interactions=False)


@pytest.fixture(scope="module")
def model(screening):
    return steepest_climb.first_order_model(screening, ["time", "temperature"])


def test_first_order_model_and_its_error_as_published(screening):
    assert round(screening.table.response.mean(), 2) == 40.44
    assert screening.model.coefficients["time"] == pytest.approx(0.775)
    assert screening.model.coefficients["temperature"] == pytest.approx(0.325)
    rows = {row["source"]: row for row in screening.anova}
    assert round(rows["model"]["sum_of_squares"], 4) == 2.8250
    assert round(rows["curvature"]["sum_of_squares"], 4) == 0.0027
    assert round(rows["lack of fit"]["sum_of_squares"], 4) == 0.0025
    assert (round(rows["pure error"]["sum_of_squares"], 4), rows["pure error"]["df"]) == (0.1720, 4)


def test_path_by_steps_of_five_minutes_as_published(model):
    climb = steepest_climb.path(
        *model, points=13, step=("time", 5), limits={"time": (30, 100), "temperature": (150, 190)}
    )
    assert climb.points["time"].tolist() == [35 + 5 * k for k in range(13)]
    # the book rounds 2.1 F to 2 F a step
    assert climb.points["temperature"].iloc[1] == pytest.approx(155 + 0.325 / 0.775 * 5)
    assert abs(climb.points["temperature"].iloc[1] - 157) < 0.1
    assert climb.angle_to_gradient_deg == pytest.approx(0, abs=1e-5)
    assert np.all(np.diff(climb.predicted) > 0)


def test_the_path_stays_inside_the_limits_and_descends_when_asked(model):
    climb = steepest_climb.path(*model, points=50, step=("time", 5), limits={"time": (30, 62)})
    assert climb.points["time"].max() <= 62 and climb.points["temperature"].max() <= 160
    down = steepest_climb.path(*model, points=4, ascend=False)
    assert down.points["time"].tolist() == pytest.approx([35, 35 - 5 / 3, 35 - 10 / 3, 30])
    assert np.all(np.diff(down.predicted) < 0)


def test_equal_steps_from_the_worst_corner_run_along_the_diagonal(model):
    climb = steepest_climb.path(*model, points=3, equal_steps=True, start="worst")
    assert climb.points.to_numpy().tolist() == [[30, 150], [35, 155], [40, 160]]
    assert climb.angle_to_gradient_deg == pytest.approx(np.degrees(np.arctan2(1, 1) - np.arctan2(0.325, 0.775)))


def test_turning_point_as_published_in_any_row_order():
    runs = pd.DataFrame({"time": [35.0 + 5 * k for k in range(13)], "temperature": [155.0 + 2 * k for k in range(13)]})
    runs["yield"] = [40.44, *YIELDS_ON_THE_PATH]
    mixed = pd.concat([runs.iloc[:1], runs.iloc[1:].sample(frac=1, random_state=1)])
    for frame in (runs, mixed):
        turning = path_turning.turning(frame)
        assert turning.turned
        assert turning.centre == {"time": 85, "temperature": 175}
        assert [(f.low, f.high) for f in turning.next_factors] == [(80, 90), (173, 177)]


def test_a_path_that_still_rises_or_never_rose_is_told():
    rising = pd.DataFrame({"a": [1.0, 2, 3], "b": [1.0, 2, 3], "y": [1.0, 2, 3]})
    assert not path_turning.turning(rising).turned
    falling = rising.assign(y=[3.0, 2, 1])
    assert path_turning.turning(falling).at_start
    assert path_turning.turning(falling, target=2.1).best == 1
    assert path_turning.turning(falling, ascend=False).best == 2


def test_runs_off_the_line_and_impossible_paths_are_refused(model):
    off = pd.DataFrame({"a": [1.0, 2, 3], "b": [1.0, 5, 3], "y": [1.0, 2, 3]})
    with pytest.raises(InputError, match="one line"):
        path_turning.turning(off)
    with pytest.raises(InputError, match="outside its limits"):
        steepest_climb.path(*model, start={"time": 99, "temperature": 155})
    with pytest.raises(InputError, match="factor that moves"):
        steepest_climb.path(*model, step=("pressure", 1))


def test_a_path_has_turned_only_beyond_the_scatter_of_its_runs():
    """Runs 10, 12, 11.9: with a standard deviation of 1 and 3 degrees of freedom a fall of 2.353 * sqrt(2) is needed (t table)."""
    runs = pd.DataFrame({"a": [0.0, 1, 2], "y": [10.0, 12, 11.9]})
    found = path_turning.turning(runs, scatter=(1.0, 3))
    assert not found.turned and found.within_scatter
    assert found.fall == pytest.approx(0.1) and found.needed == pytest.approx(2.353 * 2**0.5, rel=1e-3)
    assert "one run further" in turning_text(found)
    assert path_turning.turning(runs, scatter=(0.01, 3)).turned and path_turning.turning(runs).turned


@pytest.mark.parametrize("interaction, df", [(0.0, 8), (5.0, 2)])
def test_few_replicates_do_not_hide_that_a_path_turned(interaction, df):
    """Two pairs of replicates have t = 2.9, the residual of main effects that lack nothing 1.9; where they lack, the pairs count."""
    coded = np.vstack([screening_designs.coded_matrix(4), screening_designs.coded_matrix(4)[:1]])
    frame = pd.DataFrame(coded, columns=list("ABCD"))
    y = 40 + coded @ [0, 2, 3, 1] + interaction * coded[:, 0] * coded[:, 1]
    frame["y"] = y + 0.5 * np.random.default_rng(3).normal(size=len(y))
    frame.loc[12, "y"] = frame.loc[0, "y"] + 0.8
    screening = plackett_burman.analyse(code_design(frame))
    pairs = frame.groupby(list("ABCD")).y.var().dropna()
    plane = np.column_stack([np.ones(len(y)), coded])
    residual = np.linalg.lstsq(plane, frame.y, rcond=None)[1][0]
    expected = np.sqrt(pairs.mean() if interaction else residual / 8)
    assert path_turning.scatter_of(screening) == (pytest.approx(expected), df)
