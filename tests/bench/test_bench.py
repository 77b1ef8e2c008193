"""The bench calibration: its parabola on the paper's printed rows, its means, and small runs on real YADE."""

import json
import shutil

import numpy as np
import pytest

from pellet_study.__main__ import main
from pellet_study.bench.chain import calibrate
from pellet_study.bench.parabola import fit_parabola
from pellet_study.bench.readings import Reading
from pellet_study.bench.seeds import Mean, Seeds, mean_over_seeds
from pellet_study.paper import printed as paper
from tests.helpers.json_keys import not_there, without_meaning

pytestmark = pytest.mark.yade


@pytest.mark.parametrize(
    ("table", "printed"),
    [(3, ("0.22856", "20.01479", "47.52143")), (5, ("377.47571", "-1721.80714", "2005.35714"))],
)
def test_the_papers_coefficients_come_out_to_every_printed_digit(table, printed):
    rows = paper.table(table)
    curve = fit_parabola(rows.iloc[:, 1], rows.iloc[:, 2])
    assert tuple(f"{c:.5f}" for c in curve.coefficients) == printed


def test_the_papers_r2_and_root():
    rows = paper.table(3)
    curve = fit_parabola(rows["a1"], rows["b1"])
    assert f"{curve.r2:.5f}" == "0.98904"
    assert f"{curve.root(8.01):.3f}" == "0.246"


def test_the_root_inside_the_sweep_is_taken_and_none_where_there_is_none():
    x = np.linspace(0, 3, 7)
    falling = fit_parabola(x, (x - 4) ** 2)  # meets 4 at 2 and at 6, of which only 2 lies in the sweep
    assert falling.root(4.0) == pytest.approx(2.0)
    assert falling.root(20.0) is None
    bent = fit_parabola(x, (x - 1) ** 2)  # meets 0.25 at 0.5 and 1.5; the sweep rises from 1 to 4
    assert bent.root(0.25) == pytest.approx(1.5)


def test_the_interval_holds_the_truth_as_often_as_it_says():
    """Inverse prediction at 95 %: covered 95 % of 2000 simulated sweeps, within 3 binomial standard errors."""
    random = np.random.default_rng(5)
    x, sd, truth = np.linspace(0.1, 0.35, 6), 0.2, 0.25
    curve = lambda a: 1 + 20 * a + 40 * a * a  # noqa: E731
    held = 0
    for _ in range(2000):
        fit = fit_parabola(x, curve(x) + random.normal(0, sd, 6))
        low, high = fit.interval(curve(truth))
        held += low <= truth <= high
    assert abs(held / 2000 - 0.95) < 3 * np.sqrt(0.95 * 0.05 / 2000) + 0.005


def test_the_standard_error_comes_from_whole_blocks():
    """64 values that fill a range evenly have a mean far sharper than independent draws would."""
    shifts = (-0.01, 0.01, 0.0, 0.02, -0.02, 0.015, -0.015, 0.0)
    blocks = [np.linspace(0, 1, 64) + shift for shift in shifts]
    mean = mean_over_seeds(np.concatenate(blocks))
    assert mean.value == pytest.approx(0.5)
    assert mean.standard_error == pytest.approx(np.std(shifts, ddof=1) / np.sqrt(8))


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A study with the slope test alone, calibrated at a small effort on real YADE."""
    folder = tmp_path_factory.mktemp("studies") / "slope"
    assert main(["init", str(folder)]) == 0
    lines = (folder / "measurements.csv").read_text().splitlines()
    (folder / "measurements.csv").write_text(
        "\n".join(line for line in lines if line.startswith(("rig", "slope"))) + "\n"
    )
    assert main(["bench", str(folder), "--effort", "0.25", "--json", str(folder / "answer.json")]) == 0
    return folder


def test_a_sliding_seed_gives_the_tangent_of_the_measured_angle(study):
    answer = json.loads((study / "answer.json").read_text())
    assert answer["assumed"]["seed_length_mm"] == 2.2 and answer["assumed"]["added_mass_mg"] == 0.0
    stage = answer["stages"][0]
    assert stage["parameter"] == "seed_powder_static_friction"
    assert stage["value"] == pytest.approx(np.tan(np.radians(31.85)), rel=0.003)
    assert stage["verification_error_percent"] < 1
    low, high = stage["interval"]
    assert low < np.tan(np.radians(31.85)) < high
    assert stage["r2"] > 0.999 and len(stage["coefficients"]) == 3


def test_each_key_of_the_answer_has_its_meaning(study):
    answer = json.loads((study / "answer.json").read_text())
    assert without_meaning("bench", answer) == set() and not_there("bench", [answer]) == set()


def test_results_are_files_that_a_second_call_leaves_as_they_are(study, monkeypatch):
    files = [*study.glob("*.csv"), study / "summary.txt", *study.glob("figures/*.png")]
    assert len(files) == 6
    runs = (study / "runs.csv").read_text().splitlines()
    assert len(runs) == 1 + 6 * 4 + 4 + 4  # a sweep of six levels, verification, joint prediction
    assert runs[1:] == sorted(runs[1:])
    before = {file: file.read_bytes() for file in files}
    monkeypatch.setattr(
        "pellet_study.simulation.local.subprocess.Popen", lambda *a, **k: pytest.fail("simulated again")
    )
    assert main(["bench", str(study), "--effort", "0.25"]) == 0
    assert {file: file.read_bytes() for file in files} == before


def test_a_reading_the_sweep_cannot_reach_is_a_null_with_a_warning(study, tmp_path, capsys):
    far = tmp_path / "far"
    shutil.copytree(study, far)
    (far / "measurements.csv").write_text((study / "measurements.csv").read_text().replace("31.85", "55"))
    assert main(["bench", str(far), "--effort", "0.25", "--json", str(far / "answer.json")]) == 0
    assert "does not reach 55 between 0.6 and 0.85" in capsys.readouterr().err
    assert json.loads((far / "answer.json").read_text())["stages"][0]["value"] is None


def test_rows_at_several_settings_are_refused(tmp_path, capsys):
    folder = tmp_path / "s"
    main(["init", str(folder)])
    (folder / "measurements.csv").write_text(
        "rig,observable,value,drop_height_mm\nrebound,rebound_height_mm,8,100\nrebound,rebound_height_mm,9,120\n"
    )
    assert main(["bench", str(folder)]) == 2
    assert "differ in their conditions" in capsys.readouterr().err


def test_a_stage_without_a_reading_takes_its_parameter_from_the_study(monkeypatch, tmp_path):
    asked = []

    def remember(self, stage, reading, settings, number, first):
        asked.extend(settings)
        return [Mean(100 - 40 * k, 0.1, 4, 0) for k in range(len(settings))]

    monkeypatch.setattr(Seeds, "means", remember)  # a stand-in: only what is asked for is looked at
    known = {"seed_powder_static_friction": 0.5, "seed_powder_restitution": 0.4, "internal_friction": 0.3}
    calibrate(Seeds("hertz_mindlin", known, tmp_path), {"inclined_roll": Reading(50.0, None, 1, {})})
    assert all(s["seed_powder_static_friction"] == 0.5 and s["seed_powder_restitution"] == 0.4 for s in asked)


def test_a_smooth_tilted_plate_takes_no_tangential_speed(tmp_path):
    from pellet_study.rigs import on_yade
    from pellet_study.simulation import dispatch

    tilted = [on_yade.case("rebound", seed=k, conditions={"plate_tilt_deg": 30.0}) for k in range(6)]
    rows = dispatch.run(tilted, tmp_path / ".store", quiet=True)
    assert rows["tangential_restitution"].to_numpy(float) == pytest.approx(1.0, abs=1e-6)


def test_init_does_not_overwrite(tmp_path, capsys):
    (tmp_path / "mine").write_text("x")
    assert main(["init", str(tmp_path)]) == 2
    assert "not an empty folder" in capsys.readouterr().err


def test_the_rebound_falls_when_friction_and_rolling_friction_are_on(tmp_path):
    """The paper says they do not matter; for a seed that is no sphere they do (energy goes into friction)."""
    from pellet_study.bench import sensitivity

    means = sensitivity.means(
        [("rebound", sensitivity.CALIBRATED | change, {}, {}, 64) for change in (sensitivity.NO_FRICTION, {})],
        tmp_path / ".store",
        quiet=True,
    )
    assert means[1].value < means[0].value - 5 * np.hypot(means[0].standard_error, means[1].standard_error)
