"""Hidden-effect trials at small size, seeds fixed: the rates of the full campaign are in results/hidden_effect."""

import numpy as np
import pytest

from pellet_study.challenge import acceptance, counting, resume, trials, twins
from tests.helpers.make_study import command


def test_strength_is_what_it_says():
    truth = trials.hidden(("air_drag",), 8.0)
    assert trials.strength(truth.effects) == pytest.approx(8.0, abs=0.01)
    assert trials.strength({}) == pytest.approx(0.0, abs=1e-3)


def test_twin_drag_against_its_differential_equation():
    from scipy.integrate import solve_ivp

    from pellet_study.rigs.declared import Acting

    d, height, cd = 2e-3, 0.3, 0.8
    c = 0.75 * twins.AIR * cd / (twins.SEED * d)
    falls = solve_ivp(
        lambda t, y: [y[1], 9.81 - c * y[1] ** 2], (0, 2), [0, 0], events=_at(height), rtol=1e-10, atol=1e-12
    )
    v = 0.4 * falls.y_events[0][0][1]
    rises = solve_ivp(lambda t, y: [y[1], -9.81 - c * y[1] ** 2], (0, 2), [0, v], events=_top, rtol=1e-10, atol=1e-12)
    told = twins.rebound(
        {"seed_powder_restitution": np.array([[0.4]])},
        {"drop_height_mm": np.array([1e3 * height]), "seed_length_mm": np.array([1e3 * d])},
        {"air_drag": Acting(None, {"drag_coefficient": np.array([[cd]])})},
    )["rebound_height_mm"]
    assert told[0, 0] == pytest.approx(1e3 * rises.y_events[0][0][0], rel=1e-6)


def _at(height):
    def reached(t, y):
        return y[0] - height

    reached.terminal = True
    return reached


def _top(t, y):
    return y[1]


def test_hidden_drag_is_found_and_nothing_is_found_where_nothing_is():
    truth = trials.hidden(("air_drag",), 8.0)
    found = [trials.trial(truth, (7, k)) for k in range(12)]
    assert all(f.first != "adequate" for f in found)
    assert sum(f.added == ("air_drag",) for f in found) >= 9
    nothing = [trials.trial(trials.NOTHING, (8, k)) for k in range(40)]
    assert sum(bool(f.added or f.tied) for f in nothing) <= 5


def test_outside_the_candidates_no_name_is_given():
    truth = trials.hidden(("friction_hump",), 8.0)
    found = [trials.trial(truth, (9, k)) for k in range(10)]
    assert sum(f.verdict == "unexplained" for f in found) >= 8
    assert sum(bool(f.added or f.tied) for f in found) <= 1


def test_a_broken_off_campaign_goes_on(tmp_path):
    file = tmp_path / "twins.csv"
    acceptance.run(file, scale=0.001, seconds=0.5)
    half = file.read_text()
    acceptance.run(file, scale=0.001, seconds=3.0)
    assert file.read_text().startswith(half) and len(file.read_text()) > len(half)
    seen = [(r["kind"], r["hidden"], r["lambda"], r["number"]) for r in resume.read(file)]
    assert len(seen) == len(set(seen))


def test_clopper_pearson():
    assert counting.interval(0, 100) == pytest.approx((0, 0.0362), abs=1e-4)  # 1 - 0.025^(1/100)
    assert counting.interval(4, 100) == pytest.approx((0.0110, 0.0993), abs=1e-4)


def test_command(tmp_path):
    status, answer = command(
        "challenge", tmp_path / "c", "--scale", 0.001, "--minutes", 0.05, json_file=tmp_path / "a.json"
    )
    assert status == 0 and {"trials", "identified", "false_alarms"} <= set(answer)
