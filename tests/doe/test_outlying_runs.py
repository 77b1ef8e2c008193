"""R-student where the readings are rounded and few degrees of freedom are left; the worst term of a design that is not orthogonal."""

import json

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.doe import box_behnken
from pellet_study.doe.composite import composite_matrix
from pellet_study.doe.design_table import code_design
from pellet_study.doe.rounding import rounding_variance
from pellet_study.doe.surface_text import surface_warnings
from pellet_study.doe.transformation import parse_transformation


@pytest.mark.parametrize(
    ("readings", "step"),
    [([1.2, 3.0, 4.5], 0.1), ([12, 30, 45], 1), ([1200, 500], 100), ([0.25, 0.5], 0.01), ([3, 0], 1)],
)
def test_the_step_of_readings(readings, step):
    assert rounding_variance(readings) == pytest.approx(step**2 / 12)


def test_readings_that_are_not_rounded_have_no_step():
    assert rounding_variance(np.random.default_rng(1).normal(size=8)) < 1e-18
    assert rounding_variance([0.0, 0.0]) == 0


ROUNDED = "A,B,y\n-1,-1,3.9\n1,-1,2.6\n-1,1,2.9\n1,1,1.7\n0,0,2.7\n0,0,2.7\n0,0,2.7\n0,0,2.8\n"


def analysed(tmp_path, text: str, *options: str, command: str = "pb") -> dict:
    (tmp_path / "t.csv").write_text(text)
    assert main([command, str(tmp_path / "t.csv"), *options, "--json", str(tmp_path / "a.json")]) == 0
    return json.loads((tmp_path / "a.json").read_text())


def test_a_rounded_reading_beside_equal_ones_is_no_outlier(tmp_path, capsys):
    """Three centre runs read 2.7 and one 2.8: without that one the scatter is 0, which no instrument of one decimal has.

    With the floor of 0.1^2/12: e = 0.075, h = 1/4, R-student 0.075 / (0.1/sqrt(12) sqrt(3/4)) = 3.
    """
    assert analysed(tmp_path, ROUNDED)["suspect_runs"] == []
    assert "R-student" not in capsys.readouterr().err
    from pellet_study.doe import plackett_burman
    from pellet_study.doe.design_table import read_design

    studentized = plackett_burman.analyse(read_design(tmp_path / "t.csv")).model.studentized
    assert studentized[7] == pytest.approx(3.0)


def test_a_slip_of_the_pen_is_found_all_the_same(tmp_path):
    found = analysed(tmp_path, ROUNDED.replace("0,0,2.8", "0,0,28.0") + "0,0,2.7\n0,0,2.6\n")
    assert [suspect["row"] for suspect in found["suspect_runs"]] == [9]


def test_rounding_is_carried_to_the_scale_of_the_analysis():
    """z = ln y: a step of 0.1 at y = 2 and 4 has dz = 0.05 and 0.025, of mean square 0.0015625."""
    frame = pd.DataFrame({"A": [-1.0, 1.0, -1.0, 1.0], "B": [-1.0, -1.0, 1.0, 1.0], "y": [2.0, 4.0, 2.0, 4.0]})
    table = code_design(frame.assign(y=[2.0, 4.0, 2.0, 4.0]))
    stepped = code_design(frame.assign(y=[2.1, 4.1, 2.1, 4.1]))
    assert table.rounding_variance == pytest.approx(1 / 12)
    expected = 0.01 / 12 * np.mean([1 / 2.1**2, 1 / 4.1**2])
    assert parse_transformation("log").applied(stepped).rounding_variance == pytest.approx(expected)


def test_the_term_that_is_named_as_worst_may_be_a_square():
    """A rotatable composite with one centre run, an axial run lost: the squares share most with one another."""
    coded = composite_matrix(3, "rotatable", 1)[0]
    frame = pd.DataFrame(coded, columns=list("ABC")).assign(y=np.random.default_rng(3).normal(10, 1, len(coded)))
    surface = box_behnken.analyse(code_design(frame.drop(index=8), max_levels=5))
    worst = max(surface.vif, key=surface.vif.get)
    assert worst in ("A2", "B2", "C2")
    said = next(text for text in surface_warnings(surface) if "not orthogonal" in text)
    assert f"standard error of {worst} is {100 * (surface.vif[worst] ** 0.5 - 1):.1f} % larger" in said
