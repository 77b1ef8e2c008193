"""Readings that are coarse, equal or mistyped: said, and never silently believed or dropped."""

import numpy as np
import pytest

from pellet_study.api.criticism import compare, diagnose, refine
from pellet_study.criticism import outlying
from pellet_study.criticism.scatter import last_digit
from pellet_study.errors import InputError
from pellet_study.study.load import load
from tests.helpers.make_study import folder, incline, slip_angle_deg

HEIGHTS = (10, 15, 20, 30, 45)


def study_of(path, readings: dict[float, list[float]], more: str = "", head: str = ""):
    lines = ["rig,observable,value,layer_height_mm" + head]
    lines += [
        f"layer_on_incline,slip_angle_deg,{float(v)!r},{h}{more}" for h, values in readings.items() for v in values
    ]
    return load(folder(path, lines))


def whole_degrees(path, more: str = "", head: str = ""):
    """Three equal readings at each height of a layer without cohesion, to the whole degree."""
    return study_of(path, {h: [float(round(slip_angle_deg(h, 0.593, 4.0)))] * 3 for h in HEIGHTS}, more, head)


def test_equal_readings_have_the_sd_of_their_last_digit_and_it_is_said(tmp_path):
    answer = compare(whole_degrees(tmp_path / "s"))
    residuals = [row["residual"] for row in answer.rows]
    assert max(map(abs, residuals)) < 1  # all within the instrument's step, so that nothing can be missing
    assert answer.chi2 == pytest.approx(np.square(residuals).sum())  # an sd of 1 deg
    assert [row["z"] for row in answer.rows] == pytest.approx(residuals)
    assert answer.fits and "assumed to be the last digit written, 1" in answer.warnings[0]
    found = diagnose(whole_degrees(tmp_path / "t"))
    assert found.verdict == "adequate" and max(len(line) for line in found.page.splitlines()) < 200


def test_a_resolution_that_is_given_is_the_least_sd_and_nothing_is_assumed(tmp_path):
    answer = compare(whole_degrees(tmp_path / "s", ",0.5", ",resolution"))
    assert answer.chi2 == pytest.approx(np.square([row["residual"] / 0.5 for row in answer.rows]).sum())
    assert not any("assumed" in warning for warning in answer.warnings)
    stated = compare(whole_degrees(tmp_path / "t", ",0.001,0.5", ",sd,resolution"))
    assert stated.chi2 == pytest.approx(answer.chi2, rel=1e-6)
    larger = load(incline(tmp_path / "scattering", sd=2.0, repeats=4))
    with_step = tmp_path / "scattering" / "measurements.csv"
    text = with_step.read_text().splitlines()
    with_step.write_text("\n".join([text[0] + ",resolution", *(line + ",0.01" for line in text[1:])]) + "\n")
    assert compare(load(tmp_path / "scattering")).chi2 == pytest.approx(compare(larger).chi2)


@pytest.mark.parametrize("resolution", ["-1", "nan", "a degree"])
def test_a_resolution_that_is_none_is_refused(tmp_path, resolution):
    with pytest.raises(InputError, match="line 2: resolution"):
        whole_degrees(tmp_path / "s", f",{resolution}", ",resolution")


@pytest.mark.parametrize("values, digit", [([31, 30], 1), ([31.2, 30], 0.1), ([1e-12, 3e-12], 1e-12), ([3100.0], 1)])
def test_the_last_digit_that_is_written(values, digit):
    assert last_digit(values) == pytest.approx(digit)


def test_a_reading_typed_wrong_is_named_with_the_answer_without_it(tmp_path):
    rng = np.random.default_rng(11)
    right = {
        h: [round(slip_angle_deg(h, 0.45, 40.0) + 0.6 * rng.standard_normal(), 1) for _ in range(3)] for h in HEIGHTS
    }
    wrong = {h: list(values) for h, values in right.items()}
    wrong[45][1] = round(wrong[45][1] / 10, 2)
    del right[45][1]
    without = compare(study_of(tmp_path / "without", right))
    answer = compare(study_of(tmp_path / "typed", wrong))
    note = answer.warnings[-1]
    assert "line 15:" in note and f"{wrong[45][1]:g}" in note and "layer_height_mm 45" in note and "Mistyped?" in note
    assert f"chi2 = {without.chi2:.4g} on {without.dof}" in note
    assert len(answer.rows) == 15 and answer.dof == 14  # it is used all the same
    assert "NOTE   line 15:" in answer.page
    expected = diagnose(study_of(tmp_path / "without", right)).verdict
    assert f"without it: {expected}" in diagnose(study_of(tmp_path / "typed", wrong)).warnings[-1]
    assert "without it: adequate, added cohesion" in refine(study_of(tmp_path / "typed", wrong)).warnings[-1]


def test_honest_readings_are_not_named(tmp_path):
    """One set in a thousand may be; noise that grows with the reading, and pairs, included."""
    named = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        for k, repeats in enumerate((2, 3, 5)):
            values = {
                h: [v * (1 + 0.03 * e) if k % 2 else v + 0.5 * e for e in rng.standard_normal(repeats)]
                for h, v in zip(HEIGHTS, (4.0, 9.0, 20.0, 40.0, 70.0), strict=True)
            }
            named += len(outlying.outlying(study_of(tmp_path / f"{seed}_{repeats}", values).rows))
    assert named <= 1


def test_two_slips_do_not_hide_each_other(tmp_path):
    rng = np.random.default_rng(3)
    values = {h: [31 + 0.5 * e for e in rng.standard_normal(4)] for h in HEIGHTS}
    values[15][2], values[30][0] = 3.1, 310.0 / 4
    found = outlying.outlying(study_of(tmp_path / "s", values).rows)
    assert {one.row.value for one in found} == {3.1, 77.5}
