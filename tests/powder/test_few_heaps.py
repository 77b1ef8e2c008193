"""A powder calibration in few heaps: on synthetic responses whose angles are known, and as a command on a stub for the simulator."""

import json
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.doe.screening_designs import coded_matrix
from pellet_study.errors import SimulationError
from pellet_study.paper.designs import screening_factors
from pellet_study.powder import few_heaps, report
from pellet_study.powder import heaps as heaps_module
from pellet_study.powder.path_line import fit_line
from pellet_study.powder.plan import Plan
from pellet_study.powder.uphill import Uphill, uphill
from tests import ROOT
from tests.powder.test_chain import SLOPES, Formula, powder, work_of  # noqa: F401 (powder: a fixture)

sys.path.insert(0, str(ROOT / "benchmarks"))
import few_heaps as benchmark  # noqa: E402

sys.path.pop(0)


@pytest.fixture
def plan() -> Plan:
    """The paper's factors, an angle of 47.31 deg known within .79."""
    return Plan("cohesive_frictional", screening_factors(), {}, {}, {}, 47.31, 0.79, 1, 0)


def of_two(slopes: list[float]) -> Uphill:
    """The path of a screening without scatter."""
    coded = coded_matrix(7, 8)
    return uphill(screening_factors(), coded, 40 + coded @ np.array(slopes))


def test_the_path_of_exact_effects_is_their_gradient_shrunk():
    path = of_two([0.1, -0.1, 0.1, 0.1, -0.1, 0.1, 3.0])
    assert path.moved == ["G"] and path.direction[-1] == 1  # the others are what Lenth takes for noise
    assert path.level == pytest.approx(40) and path.slope == pytest.approx(3.0)
    assert path.slope_variance == pytest.approx(1 / 8)  # of a coefficient of 8 orthogonal heaps
    noise = 0.15  # 1.5 times the median of the sizes
    both = of_two([0.1, -0.1, 0.1, 0.1, -0.1, 1.0, 3.0])
    shrunk = np.array([1.0 - noise**2, 3.0 - noise**2 / 3])
    assert both.direction[5:] == pytest.approx(shrunk / shrunk[1])
    assert both.slope == pytest.approx(3.0 + both.direction[5])


def test_a_factor_that_the_law_lacks_is_not_moved_and_a_lost_heap_does_without():
    factors, coded = screening_factors(), coded_matrix(7, 8)
    angle = 40 + coded @ np.array([5.0, 0.1, 0.1, 0.1, 0.1, 0.1, 3.0])
    assert uphill(factors, coded, angle, idle=["A"]).moved == ["G"]
    assert uphill(factors, coded[:7], angle[:7]).direction[0] == 1
    flat = uphill(factors, coded, np.full(8, 40.0))
    assert flat.slope == 0 and np.isfinite(flat.direction).all() and flat.moved


def test_the_line_is_least_squares_with_the_slope_of_the_screening_as_one_reading():
    path = replace(of_two([0.0] * 6 + [3.0]), slope=2.0, slope_variance=0.25)
    t, angle = np.array([0.0, 0.5, 1.0, 1.5]), np.array([40.0, 42.0, 43.0, 46.0])
    terms = np.vstack([np.column_stack([np.ones(4), t]), [0, 2]])  # the slope, weighed by 1/sqrt(0.25)
    expected, squares, *_ = np.linalg.lstsq(terms, np.r_[angle, 4.0], rcond=None)
    line = fit_line(path, t, angle)
    assert line.estimates == pytest.approx(expected)
    assert line.scatter == pytest.approx((squares[0] / 3) ** 0.5) and line.freedom == 3
    assert line.covariance == pytest.approx(squares[0] / 3 * np.linalg.inv(terms.T @ terms))
    assert line.at(line.meets(44)) == pytest.approx(44)


def test_the_least_number_is_that_of_the_interval_of_a_mean(plan):
    """t of 98 % with 15 degrees of freedom is 2.249, with 14 2.264: 2.249 * 1.4 / 4 = 0.787 < 0.79 < 2.264 * 1.4 / sqrt(15)."""
    assert few_heaps.needed(1.4, plan) == 16
    assert benchmark.least(0.79, 1.4) == 11  # 1.812 * 1.4 / sqrt(11) = 0.765, 1.833 * 1.4 / sqrt(10) = 0.812
    measured_ten_times = replace(plan, n=10, freedom=9)
    assert few_heaps.needed(1.4, measured_ten_times) > 16  # the measured mean scatters too
    assert few_heaps.needed(1.4, replace(plan, n=2, freedom=1)) == 16  # no number makes up for that: taken as known


RESPONSE = benchmark.Response(
    46.8, np.array([-1.15, -0.7, 0.55, 0.75, 0.15, 0.0, 3.0])
)  # about what our screening measured


def test_the_draws_of_the_benchmark_are_those_of_the_command(plan):
    noise = np.random.default_rng(3).normal(size=(12, few_heaps.MOST))
    drawn = benchmark.computed(plan, RESPONSE, 1.4, np.full(12, plan.target), noise)
    coded = coded_matrix(7, few_heaps.SCREENED)
    for k in range(12):
        path = uphill(plan.factors, coded, RESPONSE.at(coded) + 1.4 * noise[k, :8])
        angles: list[float] = []

        def pour(places: list[float], path=path, angles=angles, k=k) -> np.ndarray:
            new = np.outer(places[len(angles) :], path.direction)
            begun = 8 + len(angles)
            angles.extend(RESPONSE.at(new) + 1.4 * noise[k, begun : begun + len(new)])
            return np.array(angles)

        found = few_heaps.search(path, plan, pour)
        assert found.place == pytest.approx(drawn.place[k])
        assert drawn.heaps[k] == (8 + len(found.places) if drawn.called[k] else few_heaps.MOST)
        assert drawn.called[k] == (
            few_heaps.half_width(found, plan) < plan.margin and path.low < found.place < path.high
        )


@pytest.mark.parametrize(("scatter", "beyond"), [(1.4, None), (1.7, None), (2.0, None), (1.4, 0.79)])
def test_a_setting_off_by_the_margin_is_called_equivalent_in_less_than_five_percent(plan, scatter, beyond):
    """10,000 draws, of which 5 % are 500 with a standard deviation of 22; the edge: the path ends a margin before the target."""
    noise = np.random.default_rng(20).normal(size=(10_000, few_heaps.MOST))
    drawn = benchmark.computed(plan, RESPONSE, scatter, np.full(10_000, plan.target), noise, beyond)
    assert drawn.false_equivalence(plan.margin) < 0.05
    if beyond is None:
        assert drawn.called.mean() > 0.85  # at 2.0 some scatter too much in their first eight heaps
        off = drawn.off[drawn.called]
        assert abs(off.mean()) < 0.03 and 0.3 < off.std() < 0.42  # 0.79 / 2.25 = 0.35
    if scatter == 1.4 and beyond is None:
        assert np.median(drawn.heaps) <= 25


def test_calibrate_few_finds_and_tests_a_setting(powder, monkeypatch, capsys):  # noqa: F811
    stub = Formula(noise=1.0)
    monkeypatch.setattr(heaps_module, "dispatch", stub)
    assert main(["calibrate", str(powder), "--few", "--json", str(powder / "few.json")]) == 0
    told = capsys.readouterr().out
    assert "screening: 8 heaps" in told and "  8 heaps on the path: " in told  # while it works
    answer = json.loads((powder / "few.json").read_text())
    found, tested = answer["optimum"], answer["validation"]
    assert tested["equivalent"] and found["enough"] and found["met"]
    assert "Few heaps: shown equivalent to 41.69 deg within 0.79 deg, by the heaps that placed the setting." in told
    assert found["heaps"] == len(set(stub.asked)) == 8 + found["path_heaps"] <= 30
    factors = {f.name: f for f in screening_factors()}
    true = stub.level + sum(k * factors[n].coded(found["point"][n]) for n, k in SLOPES.items())
    assert true == pytest.approx(41.69, abs=0.79)
    assert tested["heaps"] == found["path_heaps"] and tested["mean_deg"] == pytest.approx(41.69)
    assert (powder / "path" / "summary.txt").read_text().strip() in told
    assert json.loads((powder / "path" / "margin.json").read_text())["margin"] == 0.79
    runs = pd.read_csv(powder / "path" / "runs.csv")
    assert set(runs["stage"]) == {"screening", "path"} and runs["seed"].is_unique
    assert (powder / "path" / "path.png").stat().st_size > 5000
    assert main(["calibrate", str(powder), "--few", "--until", "climb"]) == 2


def test_a_scatter_that_leaves_no_hope_is_said_after_eight_heaps_or_before_any(powder, monkeypatch, capsys):  # noqa: F811
    monkeypatch.setattr(heaps_module, "dispatch", Formula(noise=8.0))
    assert main(["calibrate", str(powder), "--few"]) == 0
    told = capsys.readouterr().out
    decision = json.loads((powder / "path" / "decision.json").read_text())
    assert decision["path_heaps"] == few_heaps.FEWEST and not decision["validation"]["equivalent"]
    assert f"takes {decision['needed_heaps']} heaps or more, and --few has 60 at most" in told
    assert main(["calibrate", str(powder), "--until", "screening"]) == 0  # its repeats tell the scatter
    stub = Formula(noise=8.0)
    monkeypatch.setattr(heaps_module, "dispatch", stub)
    capsys.readouterr()
    assert main(["calibrate", str(powder), "--few"]) == 2
    assert "heaps at one point differ by" in capsys.readouterr().err and not stub.asked


def test_heaps_without_an_angle_are_left_out_and_counted(powder, monkeypatch):  # noqa: F811
    heaps, results = work_of(powder, Formula(jammed={10_003, 20_001}), monkeypatch)
    found = few_heaps.calibrate(heaps, results)
    assert (found.lost, found.path_lost, found.validation.lost) == (2, 1, 1)
    assert "2 of them gave no angle" in report.text_of_path(heaps.plan, found)
    with pytest.raises(SimulationError, match="only 1 of 8"):
        few_heaps.calibrate(*work_of(powder, Formula(jammed=range(20_001, 20_060)), monkeypatch))


def test_a_path_that_ends_before_the_target_is_not_called_equivalent(powder, monkeypatch):  # noqa: F811
    heaps, results = work_of(powder, Formula(level=5.0), monkeypatch)
    found = few_heaps.calibrate(heaps, results)
    assert not found.met and not found.validation.equivalent and found.predicted_deg < 41.69 - 5
    assert "not shown equivalent" in (first := report.text_of_path(heaps.plan, found).splitlines()[0])
    assert "ends before it meets the target" in first


def test_too_few_measured_readings_are_said_whatever_the_heaps(powder, monkeypatch):  # noqa: F811
    rows = "".join(f"repose,repose_angle_deg,{value},\n" for value in (41.0, 41.7, 42.4))
    (powder / "measurements.csv").write_text("rig,observable,value,sd\n" + rows)
    heaps, results = work_of(powder, Formula(noise=0.3), monkeypatch)
    found = few_heaps.calibrate(heaps, results)
    assert found.enough and not found.validation.equivalent and not found.validation.attainable
    assert "so few readings that no number of heaps" in report.text_of_path(heaps.plan, found)


def test_only_the_angle_that_steers_counts_and_the_summary_says_so(powder, monkeypatch, capsys):  # noqa: F811
    (powder / "measurements.csv").write_text(
        "rig,observable,value,sd\nrepose,repose_angle_deg,41.69,0.79\nrepose,repose_height_deg,46.7,0.8\n"
    )
    monkeypatch.setattr(heaps_module, "dispatch", Formula())
    assert main(["calibrate", str(powder), "--few"]) == 0
    assert "repose_height_deg was measured too and is not used here" in capsys.readouterr().out


def test_another_margin_beside_the_declared_one_is_refused(powder, monkeypatch, capsys):  # noqa: F811
    monkeypatch.setattr(heaps_module, "dispatch", Formula())
    assert main(["calibrate", str(powder), "--few"]) == 0
    (powder / "measurements.csv").write_text("rig,observable,value,sd\nrepose,repose_angle_deg,41.69,2\n")
    assert main(["calibrate", str(powder), "--few"]) == 2
    assert "margin 0.79 deg, not 2" in capsys.readouterr().err


def test_a_second_call_gives_the_same_answer(powder, monkeypatch):  # noqa: F811
    found = [few_heaps.calibrate(*work_of(powder, Formula(), monkeypatch)) for _ in range(2)]
    assert found[0] == found[1]
