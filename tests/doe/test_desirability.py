"""Desirabilities by hand, and the most desirable setting: published optima, and no worse than a search over a grid."""

import numpy as np
import pandas as pd
import pytest

from pellet_study.doe import box_behnken
from pellet_study.doe.design_table import code_design
from pellet_study.doe.desirability import most_desirable, overall_desirability
from pellet_study.doe.factors import Factor
from pellet_study.doe.fitted_response import FittedResponse
from pellet_study.doe.goals import Goal, overall
from pellet_study.doe.joint_set import joint_set
from pellet_study.errors import InputError
from tests.helpers.published_designs import TREAD_FACTORS, TREAD_RESPONSES, tyre_tread

TREAD_GOALS = [
    Goal("maximise", 120, 170),
    Goal("maximise", 1000, 1300),
    Goal("target", 400, 600, 500),
    Goal("target", 60, 75, 67.5),
]


@pytest.fixture(scope="module")
def tread():
    frame, factors = tyre_tread(), [Factor(name) for name in TREAD_FACTORS]
    return [
        FittedResponse(name, box_behnken.analyse(code_design(frame[[*TREAD_FACTORS, name]], factors, max_levels=5)))
        for name in TREAD_RESPONSES
    ]


def test_the_published_optimum_of_the_tyre_tread(tread):
    """Derringer and Suich 1980, as the vignette of qualityTools (R) prints it: D 0.583 at (-0.0533, 0.144, -0.872).

    There 129.333, 1300, 466.397 and 67.997, with the desirabilities 0.187, 1, 0.664 and 0.934.
    """
    theirs = [-0.0533, 0.144, -0.872]
    found = joint_set(tread, TREAD_GOALS)
    predicted = [float(response.predict(theirs)[0]) for response in tread]
    assert predicted == pytest.approx([129.333, 1300, 466.397, 67.997], rel=5e-4)
    assert found.desirability == pytest.approx(0.583, abs=5e-4)
    assert found.desirability >= overall_desirability(found.wanted, theirs)[0]
    assert found.coded == pytest.approx(theirs, abs=5e-3)
    assert [part.prediction.predicted for part in found.parts] == pytest.approx(predicted, rel=2e-3)
    assert [part.desirability for part in found.parts] == pytest.approx([0.187, 1, 0.664, 0.934], abs=5e-3)
    assert found.met


def test_an_optimum_on_a_limit_is_not_lost_to_rounding(tread):
    """Abrasion is largest where hardness meets its limit: no worse than 10^5 random settings within it, and met."""
    responses = [tread[0], tread[3]]
    found = joint_set(responses, [Goal("maximise", 120, 170), Goal("limits", -np.inf, 69)])
    points = np.random.default_rng(0).uniform(-1, 1, (100_000, 3))
    within = points[responses[1].predict(points) <= 69]
    best = ((responses[0].predict(within) - 120) / 50).clip(0, 1).max()
    assert found.met
    assert found.desirability >= best > 0.6
    assert found.parts[1].prediction.predicted == pytest.approx(69, abs=1e-6)


def test_the_optimum_of_the_r_package_desirability():
    """Conversion and activity of Myers and Montgomery in the vignette of desirability (R): D 0.9425094 within +-1.682."""

    def conversion(x, y, z):
        return (
            81.09 + 1.0284 * x + 4.043 * y + 6.2037 * z - 1.8366 * x**2 + 2.9382 * y**2 - 5.1915 * z**2
            + 2.2150 * x * y + 11.375 * x * z - 3.875 * y * z
        )  # fmt: skip

    def activity(x, y, z):
        return (
            59.85 + 3.583 * x + 0.2546 * y + 2.2298 * z + 0.83479 * x**2 + 0.07484 * y**2 + 0.05716 * z**2
            - 0.3875 * x * y - 0.375 * x * z + 0.3125 * y * z
        )  # fmt: skip

    names = ["time", "temperature", "catalyst"]
    levels = 1.682 * np.array(np.meshgrid(*[[-1, 0, 1]] * 3)).reshape(3, -1).T
    frame = pd.DataFrame(levels, columns=names)
    responses = [
        FittedResponse(f.__name__, box_behnken.analyse(code_design(frame.assign(y=f(*levels.T)))))
        for f in (conversion, activity)
    ]
    found = joint_set(responses, [Goal("maximise", 80, 97), Goal("target", 55, 60, 57.5)])
    assert found.desirability == pytest.approx(0.9425094, abs=1e-6)
    assert list(found.physical.values()) == pytest.approx([-0.5117132, 1.6820000, -0.5863863], abs=2e-3)


def test_the_optimum_is_no_worse_than_a_search_over_a_grid(tread):
    goals = [
        Goal("maximise", 120, 170, weights=(2, 1), importance=3), TREAD_GOALS[1],
        Goal("target", 350, 600, 480, weights=(0.5, 3)), Goal("limits", -np.inf, 69),
    ]  # fmt: skip
    wanted = list(zip(tread, goals, strict=True))
    axis = np.linspace(-1, 1, 61)
    grid = overall_desirability(wanted, np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3))
    best = most_desirable(wanted)
    value = overall_desirability(wanted, best)[0]
    assert value >= grid.max() - 1e-9 and value == pytest.approx(grid.max(), abs=0.02)
    assert tread[3].predict(best)[0] <= 69 + 1e-9


@pytest.mark.parametrize(
    "goal, values, expected",
    [
        (Goal("maximise", 0, 10, weights=(2, 1)), [-1, 0, 5, 10, 99], [0, 0, 0.25, 1, 1]),
        (Goal("minimise", 0, 10, weights=(1, 3)), [-1, 0, 5, 10, 99], [1, 1, 0.125, 0, 0]),
        (Goal("target", 0, 10, 4, weights=(1, 2)), [-1, 1, 4, 7, 10], [0, 0.25, 1, 0.25, 0]),
        (Goal("limits", 2, np.inf), [1, 2, 1e9], [0, 1, 1]),
    ],
)
def test_desirabilities_by_hand(goal, values, expected):
    assert goal.desirability(values) == pytest.approx(expected)


def test_importances_are_exponents_and_limits_are_not_weighed():
    assert overall([0.5, 0.125], [3, 1]) == pytest.approx((0.5**3 * 0.125) ** 0.25)
    limit = Goal("limits", 0, 1)
    assert overall([0.5, 1.0], [1, limit.exponent]) == pytest.approx(0.5)
    assert overall([0.5, 0.0], [1, limit.exponent]) == 0


def test_goals_out_of_order_are_refused():
    for words in [("target", 5, 7, 8), ("maximise", 7, 5), ("limits", -np.inf, np.inf), ("maximise", 0, np.inf)]:
        with pytest.raises(InputError, match="expected the lower one first"):
            Goal(*words)
    with pytest.raises(InputError, match="positive"):
        Goal("limits", 0, 1, importance=0)
