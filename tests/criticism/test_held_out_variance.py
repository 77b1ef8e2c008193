"""Variances that rest on constants of very different sizes, and on set-ups far less certain than the readings."""

from types import SimpleNamespace

import numpy as np
import pytest

from pellet_study.criticism import facts
from pellet_study.criticism.calibration import covariance
from pellet_study.criticism.fit_facts import HELD_OUT_FAILS, adequacy
from pellet_study.criticism.holdout import distance


def test_a_modulus_in_pa_beside_a_friction_keeps_its_variance():
    """The covariance of a fit in other units is that of the fit, in those units."""
    jacobian = np.random.default_rng(3).normal(size=(12, 2))
    units = np.array([1.0, 1e10])
    low, high = np.array([0.0, 1e8]), np.array([1.0, 1e11])
    fitted = SimpleNamespace(jacobian=jacobian / units, problem=SimpleNamespace(low=low, high=high))
    expected = np.linalg.inv(jacobian.T @ jacobian) * np.outer(units, units)
    assert covariance(fitted) == pytest.approx(expected, rel=1e-9)


def test_the_distance_of_rows_with_shared_errors_is_that_of_their_whole_covariance():
    draw = np.random.default_rng(5)
    own, shared, error = draw.uniform(0.1, 2, 9), draw.normal(size=(9, 3)), draw.normal(size=9)
    whole = np.diag(own) + shared @ shared.T
    assert distance(error, own, shared) == pytest.approx(error @ np.linalg.solve(whole, error), rel=1e-12)
    assert distance(error, own, np.zeros((9, 0))) == pytest.approx((error**2 / own).sum(), rel=1e-12)


@pytest.mark.parametrize("own_sd", [1e-3, 1e-6, 1e-9])
def test_readings_far_more_certain_than_what_they_share_are_not_lost_in_rounding(own_sd):
    """Two readings 1 +- d of one set-up with sd 1: half their difference is 2 d^2/own beside (sum)^2/2/(own + 2)."""
    d = 42 * own_sd
    found = distance(np.array([1 + d, 1 - d]), np.full(2, own_sd**2), np.ones((2, 1)))
    assert found == pytest.approx(2 * 42**2 + 2 / (own_sd**2 + 2), rel=1e-6)


def test_rows_of_known_uncertainty_are_told_before_raw_residuals():
    rows = [{"z": None, "residual": 250.0}, {"z": 11.3, "residual": 3.4}, {"z": -0.5, "residual": 0.1}]
    assert [row["residual"] for row in sorted(rows, key=facts.misfit, reverse=True)] == [3.4, 0.1, 250.0]


def test_a_fit_that_says_nothing_is_still_told_what_the_held_out_rows_say():
    answer = {"chi2": 0.0, "fits": None, "holdout_p": 3e-12, "holdout_contradicts": True}
    assert "contradict the model" in adequacy(answer) and f"{HELD_OUT_FAILS:g}" in adequacy(answer)
    assert "which could show none" in adequacy(answer | {"holdout_p": None, "holdout_contradicts": False})
