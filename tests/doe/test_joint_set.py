"""The settings that meet several goals: sets known in closed form, what to measure next, the plane to draw."""

import numpy as np
import pandas as pd
import pytest

from pellet_study.doe import box_behnken
from pellet_study.doe.design_table import code_design
from pellet_study.doe.factors import Factor
from pellet_study.doe.fitted_response import FittedResponse
from pellet_study.doe.goals import Goal
from pellet_study.doe.joint_set import joint_set
from pellet_study.doe.overlay import overlay
from pellet_study.doe.response_text import joint_text
from pellet_study.errors import InputError


def fitted(name, function, noise=0.0, seed=0, factors=()):
    coded = box_behnken.coded_matrix(3, 4, face_centred=True)
    response = function(coded.T) + noise * np.random.default_rng(seed).normal(size=len(coded))
    frame = pd.DataFrame(coded, columns=list("ABC")).assign(**{name: response})
    return FittedResponse(name, box_behnken.analyse(code_design(frame, factors)))


def test_two_planes_meet_in_a_bar():
    """y1 = 5 x1 in 1.5 to 3.5 and y2 = 10 + x2 in 9.7 to 10.3: a bar of 0.4 by 0.6, its middle the best, C anything."""
    responses = [fitted("first", lambda x: 5 * x[0]), fitted("second", lambda x: 10 + x[1])]
    found = joint_set(responses, [Goal("target", 1.5, 3.5, 2.5), Goal("limits", 9.7, 10.3)])
    assert found.fraction == pytest.approx(0.4 * 0.6 / 4, abs=1e-3)
    ends = [end for extent in found.extents[:2] for end in extent.coded]
    assert ends == pytest.approx([0.3, 0.7, -0.3, 0.3], abs=1e-4)
    assert found.extents[2].unidentified
    assert found.coded == pytest.approx([0.5, 0, 0], abs=1e-4) and found.desirability == pytest.approx(1, abs=1e-5)
    assert [part.fraction for part in found.parts] == pytest.approx([0.2, 0.3], abs=1e-3)
    assert [part.fraction_of_the_others for part in found.parts] == pytest.approx([0.3, 0.2], abs=1e-3)


def test_a_trade_off_is_settled_where_the_product_is_largest():
    """y = 2 x1, d1 = (1 + x1)/2 and d2 = ((1 - x1)/2)^2: their product is largest at x1 = -1/3; the other factors in the middle."""
    responses = [fitted("up", lambda x: 2 * x[0]), fitted("down", lambda x: 2 * x[0])]
    found = joint_set(responses, [Goal("maximise", -2, 2), Goal("minimise", -2, 2, weights=(1, 2))])
    assert found.coded == pytest.approx([-1 / 3, 0, 0], abs=1e-4)
    assert found.desirability == pytest.approx(np.sqrt(1 / 3 * (2 / 3) ** 2), abs=1e-8)


def test_a_ball_within_a_slab():
    """x'x at most 0.49 and x1 at least 0.3: a cap of a ball, volume pi h^2 (3 r - h)/3 with h = 0.4, r = 0.7."""
    responses = [fitted("ball", lambda x: (x**2).sum(axis=0)), fitted("slab", lambda x: 2 * x[0])]
    found = joint_set(responses, [Goal("limits", -np.inf, 0.49), Goal("limits", 0.6, np.inf)])
    assert found.fraction == pytest.approx(np.pi * 0.4**2 * (3 * 0.7 - 0.4) / 3 / 8, abs=1e-3)
    wide = np.sqrt(0.49 - 0.09)
    ends = [end for extent in found.extents for end in extent.coded]
    assert ends == pytest.approx([0.3, 0.7, -wide, wide, -wide, wide], abs=1e-4)
    assert found.coded == pytest.approx([0.3, 0, 0], abs=1e-4)  # of all that will do, the nearest to the centre


def test_a_set_too_thin_for_the_sample_is_found():
    """Three planes each within 1e-4 of its value: no point of a sample of 65536 lies in that cube."""
    responses = [fitted(name, lambda x, i=i: 3 * x[i]) for i, name in enumerate("pqr")]
    values = [0.9, -1.2, 2.1]
    found = joint_set(responses, [Goal("target", y - 1e-4, y + 1e-4, y) for y in values])
    assert found.fraction == 0 and found.met and found.desirability > 0.9
    assert found.coded == pytest.approx(np.array(values) / 3, abs=1e-5)
    assert all(high - low < 1e-4 for low, high in (extent.coded for extent in found.extents))


def test_goals_that_exclude_each_other_leave_the_fairest_setting():
    """x1 wanted below -0.5 and above 0.5: halfway, 0, misses both by as much."""
    responses = [fitted("low", lambda x: 5 * x[0]), fitted("high", lambda x: 2 * x[0])]
    found = joint_set(responses, [Goal("limits", -np.inf, -2.5), Goal("limits", 1.0, np.inf)])
    assert found.fraction == 0 and not found.met and found.desirability == 0 and not found.extents
    assert found.coded[0] == pytest.approx(0, abs=1e-6)


def test_the_noisy_response_is_the_one_to_measure_next():
    responses = [fitted("sharp", lambda x: 5 * x[0], 0.01, 1), fitted("noisy", lambda x: 5 * x[1], 2.0, 2)]
    found = joint_set(responses, [Goal("target", -1, 1, 0), Goal("target", -1, 1, 0)])
    assert found.next_response.response.name == "noisy"
    assert found.parts[1].after_replicate < found.parts[0].after_replicate <= found.fraction_not_excluded
    assert found.fraction_assured <= found.fraction <= found.fraction_not_excluded


def test_replicates_of_all_runs_do_what_was_promised():
    """Twice the same table halves the leverage; the promise differs by the residual's degrees of freedom only."""
    single = fitted("y", lambda x: 5 * x[0], 1.0, 3)
    table = single.surface.table
    frame = pd.concat([table.coded.assign(y=table.response)] * 2, ignore_index=True)
    double = FittedResponse("y", box_behnken.analyse(code_design(frame)))
    points = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    assert double.surface.model.leverage(points) == pytest.approx(single.surface.model.leverage(points) / 2)


def test_the_range_of_a_paraboloid():
    response = fitted("y", lambda x: (x[0] - 0.3) ** 2 + x[1] ** 2 + x[2] ** 2)
    assert response.predicted_range() == pytest.approx((0, 1.3**2 + 2), abs=1e-6)


def test_responses_of_different_levels_are_refused():
    responses = [fitted("p", lambda x: 2 * x[0]), fitted("q", lambda x: 2 * x[0], factors=[Factor("A", 10, 20)])]
    with pytest.raises(InputError, match="--factor NAME=LOW,HIGH"):
        joint_set(responses, [Goal("maximise", -1, 1)] * 2)


def test_the_overlay_of_two_regions():
    """The ball and the slab cut at C = 0: arrays over the plane, in physical levels, the held factor said."""
    factors = [Factor("A", 10, 20), Factor("B", 5, 1), Factor("C", 0, 4)]
    responses = [
        fitted("ball", lambda x: (x**2).sum(axis=0), factors=factors),
        fitted("slab", lambda x: 2 * x[0], factors=factors),
    ]
    found = joint_set(responses, [Goal("limits", -np.inf, 0.49), Goal("limits", 0.6, np.inf)])
    drawn = overlay(found, "B", "A", points=41)
    assert drawn.x[[0, -1]] == pytest.approx([5, 1]) and drawn.y[[0, -1]] == pytest.approx([10, 20])
    assert drawn.rest == {"C": pytest.approx(2, abs=1e-3)}
    x1, x2 = (drawn.y - 15) / 5, (drawn.x - 3) / -2  # A down the rows, B along the columns
    expected = (x1[:, None] ** 2 + x2[None, :] ** 2 <= 0.49) & (x1[:, None] >= 0.3)
    clear = np.abs(x1[:, None] ** 2 + x2[None, :] ** 2 - 0.49) > 1e-6  # off the edge, where rounding decides
    clear &= np.abs(x1[:, None] - 0.3) > 1e-6
    assert (drawn.all_met == expected)[clear].all()
    assert drawn.predicted["slab"][:, 7] == pytest.approx(2 * x1)
    assert drawn.accepted == {"ball": (-np.inf, 0.49), "slab": (0.6, np.inf)}
    with pytest.raises(InputError, match="A, B, C"):
        overlay(found, "A", "D")


def test_a_set_in_two_pieces_has_a_box_for_each():
    """x1^2 at least 0.25 with x2 up to 0.5: left and right of the middle, each half of the width by 0.75 of the height."""
    responses = [fitted("ridge", lambda x: x[0] ** 2 + 1e-5 * x[1]), fitted("slope", lambda x: 3 * x[1])]
    found = joint_set(responses, [Goal("limits", 0.25, np.inf), Goal("limits", -np.inf, 1.5)])
    ends = sorted(piece.extents[0].coded for piece in found.pieces)
    assert np.ravel(ends) == pytest.approx([-1, -0.5, 0.5, 1], abs=1e-4)
    for piece in found.pieces:
        assert piece.fraction == pytest.approx(0.25 * 0.75, abs=1e-3)
        assert piece.extents[1].coded == pytest.approx((-1, 0.5), abs=1e-4)
    assert "in 2 pieces" in joint_text(found)


def test_a_thin_slanting_set_is_one_piece():
    """A plane within 1e-3 of 0.3, thinner than the step of any grid, hangs together."""
    found = joint_set([fitted("plane", lambda x: x[0] - 0.7 * x[1] + 0.4 * x[2])], [Goal("target", 0.299, 0.301, 0.3)])
    assert found.fraction > 0 and not found.pieces


def test_a_setting_on_a_limit_is_said_with_one_that_is_assured():
    """up = 2 x1 with down = 2 x1 at most 1: the best is x1 = 0.5, on the limit; the assured one pays in `up` for its safety."""
    responses = [fitted("up", lambda x: 2 * x[0], 0.02, 1), fitted("down", lambda x: 2 * x[0], 0.1, 2)]
    found = joint_set(responses, [Goal("maximise", -2, 2), Goal("limits", -np.inf, 1)])
    assert [part.limit for part in found.parts] == [None, 1]
    low, high = responses[1].bounds(found.assured.coded[None, :])
    assert high[0] <= 1 and found.assured.predicted["up"] < found.parts[0].prediction.predicted
    text = joint_text(found)
    assert "down lies on its limit 1" in text and "half of single runs" in text and "assured inside" in text


def test_a_setting_inside_its_limits_is_given_without_a_caution():
    found = joint_set([fitted("first", lambda x: 5 * x[0], 0.1)], [Goal("target", 1.5, 3.5, 2.5)])
    assert found.parts[0].limit is None and found.assured is None and "limit" not in joint_text(found)


def test_a_recommendation_says_that_it_rests_on_a_fit_worse_than_the_mean():
    """A response of pure noise beside a plane: its predicted R2 is negative, the plane's is not."""
    plane, noise = fitted("plane", lambda x: 5 * x[0], 0.1), fitted("noise", lambda x: 0 * x[0], 1.0, 4)
    assert noise.surface.r2_predicted < 0
    goals = [Goal("target", 1.5, 3.5, 2.5), Goal("limits", -3, 3)]
    assert "rest on noise (predicted R2" in joint_text(joint_set([plane, noise], goals))
    assert "rest on" not in joint_text(joint_set([plane], goals[:1]))


def test_the_overlay_is_light_where_all_goals_are_met():
    """The bar of two planes, 0.3 to 0.7 by -0.3 to 0.3, read back from the figure."""
    from matplotlib.colors import to_hex

    from pellet_study.doe import figures
    from pellet_study.doe.figures.regions import ALL_MET
    from tests.helpers.pictures import assert_readable

    responses = [fitted("first", lambda x: 5 * x[0], 0.01), fitted("second", lambda x: 10 + x[1], 0.01)]
    found = joint_set(responses, [Goal("target", 1.5, 3.5, 2.5), Goal("limits", 9.7, 10.3)])
    figure = figures.overlaid_regions(found, {"first": "deg"})
    axes = next(a for a in figure.axes if {a.get_xlabel(), a.get_ylabel()} == {"A", "B"})
    light = [
        c
        for c in axes.collections
        if to_hex(c.get_facecolor()[0] if len(c.get_facecolor()) else "k") == ALL_MET.lower()
    ]
    turned = axes.get_xlabel() == "B"

    def inside(a, b):
        return any(path.contains_point((b, a) if turned else (a, b)) for c in light for path in c.get_paths())

    assert all(inside(a, b) for a in (0.33, 0.5, 0.67) for b in (-0.27, 0, 0.27))
    assert not any(inside(a, b) for a, b in ((0.27, 0), (0.73, 0), (0.5, 0.33), (0.5, -0.33), (-0.9, 0.9)))
    star = axes.lines[-1].get_xydata()[0]
    assert sorted(star) == pytest.approx(sorted(found.coded[:2]), abs=1e-6)
    said = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "first 1.5 to 3.5 deg" in said and "second 9.7 to 10.3" in said and "all goals met" in said
    assert "(most desirable)" in axes.get_title(loc="left")
    assert_readable(figure)


def test_an_overlay_without_a_common_region_says_so():
    from pellet_study.doe import figures

    responses = [fitted("first", lambda x: 5 * x[0], 0.01), fitted("second", lambda x: 5 * x[0], 0.01)]
    found = joint_set(responses, [Goal("target", 3, 4, 3.5), Goal("target", -4, -3, -3.5)])
    figure = figures.overlaid_regions(found)
    assert all("no setting" in axes.get_title(loc="left") for axes in figure.axes)
    assert "some goal missed" in [text.get_text() for text in figure.legends[0].get_texts()]
