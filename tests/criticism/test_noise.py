"""Simulations that are too few for a verdict: more are run within a budget, else it is undecided; a closed form in YADE's place."""

import numpy as np
import pandas as pd
import pytest

from pellet_study.simulation import dispatch
from tests.helpers.make_study import command

LENGTHS = (50.0, 90.0, 160.0, 280.0, 400.0, 550.0)
FRICTION, SLOPE = 0.25, 0.12  # true rolling friction, and how it grows with the speed (s/m)


def distance(length: float, friction: float, slope: float) -> float:
    """Run-out, mm, over a level plate from the speed at the foot, sqrt(2 g L sin 33 deg/3)."""
    speed = np.sqrt(2 * 9.81 * 1e-3 * length * 0.545 / 3)
    return 1e3 * speed**2 / (2 * 9.81 * (friction + slope * speed))


@pytest.fixture
def simulated(monkeypatch):
    """{"scatter": of one simulation, "cases": how many were asked for}."""
    state = {"scatter": 0.0, "cases": 0}

    def run(cases, store, **_):
        store.mkdir(parents=True, exist_ok=True)
        state["cases"] += len(cases)
        found = []
        for case in cases:
            mean = distance(
                case["conditions"]["release_distance_mm"],
                case["parameters"]["seed_powder_rolling_friction"],
                case["effects"]["speed_dependent_rolling"]["slope"],
            )
            found.append(mean * np.exp(state["scatter"] * np.random.default_rng(case["seed"]).standard_normal()))
        return pd.DataFrame({"roll_distance_mm": found, "status": "ok"})

    monkeypatch.setattr(dispatch, "run", run)
    return state


def study(path, slope: float):
    path.mkdir()
    rng, lines = np.random.default_rng(4), ["rig,observable,value,sd,n,release_distance_mm"]
    for length in LENGTHS:
        sd = 0.09 * distance(length, FRICTION, slope)
        value = distance(length, FRICTION, slope) + sd / np.sqrt(5) * rng.standard_normal()
        lines.append(f"inclined_roll,roll_distance_mm,{value:.3f},{sd:.3f},5,{length}")
    (path / "measurements.csv").write_text("\n".join(lines) + "\n")
    (path / "study.toml").write_text(
        'candidates = ["speed_dependent_rolling"]\n[parameters]\n'
        "seed_powder_rolling_friction = { value = 0.3, min = 0.1, max = 0.6 }\n"
    )
    return path


def refined(path, budget, capsys):
    status, answer = command("refine", path, "--budget", budget, json_file=path.parent / "answer.json")
    assert status == 0
    return answer, " ".join(capsys.readouterr().out.split())


def test_adequate_by_noise_alone_is_undecided_and_says_what_it_would_take(tmp_path, simulated, capsys):
    simulated["scatter"] = 0.8
    answer, said = refined(study(tmp_path / "s", SLOPE), 0, capsys)
    assert (answer["verdict"], answer["added"]) == ("undecided", [])
    limit = answer["limited"]
    assert limit["rig"] == "inclined_roll" and limit["noise_share"] > limit["most"] == 0.5
    assert limit["noise_share"] == pytest.approx(answer["noise_share"]["inclined_roll"])
    assert limit["simulations"] > 0 and limit["cpu_minutes"] > 0
    assert "the simulations of inclined_roll scatter too much" in said and "a larger --budget" in said
    assert "from readings" in said and "from simulations (noise share" in said
    again, _ = refined(tmp_path / "s", 0, capsys)
    assert again["verdict"] == "undecided"
    assert command("report", tmp_path / "s")[0] == 0
    page = (tmp_path / "s" / "report.html").read_text()
    assert "scatter too much" in page and "(noise share" in page
    status, diagnosed = command("diagnose", tmp_path / "s", json_file=tmp_path / "d.json")
    assert status == 0 and diagnosed["verdict"] == "undecided"
    assert diagnosed["limited"]["simulations"] == limit["simulations"]


def test_more_simulations_within_the_budget_name_the_effect(tmp_path, simulated, capsys):
    simulated["scatter"] = 0.8
    answer, _ = refined(study(tmp_path / "s", SLOPE), 0, capsys)
    first = simulated["cases"]
    again, _ = refined(tmp_path / "s", 60, capsys)
    assert again["verdict"] in ("adequate", "missing") and again["added"] == ["speed_dependent_rolling"]
    assert again["diagnoses"][0]["noise_share"]["inclined_roll"] < answer["noise_share"]["inclined_roll"]
    assert simulated["cases"] >= 2 * first  # what was simulated before stands beside the store
    value = again["steps"][-1]["parameters"]["speed_dependent_rolling.slope"]
    assert value == pytest.approx(SLOPE, abs=0.08)


@pytest.mark.parametrize(("slope", "added"), [(SLOPE, ["speed_dependent_rolling"]), (0.0, [])])
def test_quiet_simulations_are_not_run_again(tmp_path, simulated, capsys, slope, added):
    simulated["scatter"] = 0.02
    answer, said = refined(study(tmp_path / "s", slope), 0, capsys)
    asked = simulated["cases"]
    assert (answer["verdict"], answer["added"], answer["limited"]) == ("adequate", added, None)
    assert answer["noise_share"]["inclined_roll"] < 0.1 and "(noise share 0.0" in said
    other = study(tmp_path / "t", slope)
    again, _ = refined(other, 60, capsys)
    assert again["added"] == added and simulated["cases"] == 2 * asked


def test_rows_say_what_of_their_error_is_simulated(tmp_path, simulated):
    simulated["scatter"] = 0.4
    status, answer = command("compare", study(tmp_path / "s", 0.0), json_file=tmp_path / "a.json")
    assert status == 0
    for row in answer["rows"]:
        assert row["uncertainty_readings"] == pytest.approx(row["sd"] / np.sqrt(5))
        parts = np.hypot(row["uncertainty_readings"], row["uncertainty_simulations"])
        assert row["uncertainty"] == pytest.approx(parts) and row["uncertainty_simulations"] > 0


@pytest.mark.parametrize("budget", ["-1", "much", "inf"])
def test_a_budget_that_is_none_is_refused(tmp_path, simulated, capsys, budget):
    with pytest.raises(SystemExit) as ended:
        command("refine", study(tmp_path / "s", 0.0), f"--budget={budget}")
    assert ended.value.code == 2 and "expected minutes" in capsys.readouterr().err
