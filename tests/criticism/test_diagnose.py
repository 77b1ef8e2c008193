"""diagnose: what was put in is what is named; what the data cannot show is not claimed."""

from dataclasses import replace

import numpy as np
import pytest

from pellet_study.challenge import trials, twins
from pellet_study.criticism.calibration import fit_study
from pellet_study.criticism.constancy import constancy_tests
from pellet_study.criticism.diagnose import diagnose
from pellet_study.criticism.least_squares import fit_many
from pellet_study.criticism.rivals import LEFT_DRIFT, judge, rival_problem
from pellet_study.criticism.ways import columns_of
from pellet_study.study.load import load
from pellet_study.study.measurements import Measurement
from tests.helpers.make_study import STRESSES_PA, command, folder, incline, slip_angle_deg


def test_cohesion_is_named_with_its_size(tmp_path):
    status, answer = command("diagnose", incline(tmp_path, c=40.0), json_file=tmp_path / "a.json")
    assert status == 0 and answer["verdict"] in ("missing", "tied")
    assert {"verdict", "ranking", "tied", "next_measurement"} <= set(answer)
    best = answer["ranking"][0]
    assert {"effect", "score", "p", "p_adjusted", "chi2_drop", "value"} <= set(best)
    assert best["effect"] == "cohesion" and best["p_adjusted"] < 0.001
    assert best["value"]["cohesive_stress_pa"] == pytest.approx(40.0, rel=0.2)
    assert not (tmp_path / "study.toml").read_text().count("cohesion")


def test_nothing_missing(tmp_path):
    found = diagnose(load(incline(tmp_path)))
    assert found.verdict == "adequate" and found.tied == () and found.next_measurement is None


def test_ties_are_ties_and_the_next_measurement_separates_them(tmp_path):
    study = incline(tmp_path, mu=0.45, c=0.0, sd=0.4, heights=(12.0, 16.0, 22.0))
    lines = ["rig,observable,value,layer_height_mm"]
    rng = np.random.default_rng(5)
    for h in (12.0, 16.0, 22.0):
        lines += [
            f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.45, 20.0) + 0.4 * e:.4f},{h}"
            for e in rng.standard_normal(4)
        ]
    (study / "measurements.csv").write_text("\n".join(lines) + "\n")
    found = diagnose(load(study))
    assert found.verdict == "tied" and ("cohesion",) in found.tied and len(found.tied) > 1
    proposal = found.next_measurement
    assert set(proposal.predictions) == {" + ".join(t) for t in found.tied}
    values = list(proposal.predictions.values())
    spread = max(proposal.uncertainties.values())
    assert max(values) - min(values) > 2 * spread


def test_only_candidates_are_considered(tmp_path):
    study = incline(tmp_path, c=40.0)
    toml = study / "study.toml"
    toml.write_text('candidates = ["side_wall_friction"]\n' + toml.read_text())
    found = diagnose(load(study))
    assert found.verdict == "unexplained" and [s.effect for s in found.ranking] == ["side_wall_friction"]
    assert found.ranking[0].note == "wrong sign"


def test_without_sd_the_residual_scatter_is_the_scale(tmp_path):
    lines = ["rig,observable,value,normal_stress_pa"]
    for k, s in enumerate((*STRESSES_PA, 300.0, 3000.0, 6000.0)):
        lines.append(f"shear_cell,shear_stress_pa,{0.5 * s + 400 + 8 * (-1) ** k},{s}")
    found = diagnose(load(folder(tmp_path, lines)))
    assert found.comparison.chi2 is None
    assert found.ranking[0].effect == "cohesion" and found.ranking[0].p_adjusted < 0.01
    assert found.ranking[0].value["cohesive_stress_pa"] == pytest.approx(400, rel=0.05)


def test_as_many_constants_as_cases_can_show_nothing(tmp_path):
    lines = ["rig,observable,value,layer_height_mm,sd", "layer_on_incline,slip_angle_deg,30,20,1"]
    found = diagnose(load(folder(tmp_path, lines)))
    assert not found.missing and all(s.score is None for s in found.ranking)
    assert any("no missing effect" in w for w in found.warnings)


def test_holding_out_the_only_telling_level_weakens_the_answer(tmp_path):
    lines = ["rig,observable,value,layer_height_mm,sd,split"]
    for h, split in ((3.0, "holdout"), (60.0, "fit"), (70.0, "fit"), (80.0, "fit")):
        lines += [f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.5, 15.0):.4f},{h},0.5,{split}"] * 2
    found = diagnose(load(folder(tmp_path, lines)))
    assert found.verdict == "adequate"
    cohesion = next(s for s in found.ranking if s.effect == "cohesion")
    assert cohesion.smallest_visible is None or cohesion.smallest_visible > 15.0


@pytest.mark.parametrize("hidden, explains", [("reading_offset", True), ("wet_film", False)])
def test_a_look_alike_must_be_one_number(hidden, explains):
    """Without noise: an offset is the same for both seeds; what a film takes is more for the small one."""
    truth = trials.hidden((hidden,), 8.0)
    sds = trials.true_sd(truth.readings)
    rows = [
        Measurement(rig, observable, float(y), float(sd), 5, given, {}, "", 0.0, "fit", "", 0)
        for (rig, observable, given), y, sd in zip(twins.conditions(), truth.readings, sds, strict=True)
    ]
    state = fit_study(twins.study(rows))
    column = columns_of(state.model, "reading_offset")[0]
    fitted = fit_many(state.model, state.cells, [rival_problem(state, ["reading_offset"], [{column: 0.1}])])[0]
    found = constancy_tests(replace(state, fit=fitted), frozenset({"rebound"}), birge=False)
    assert judge(state, [fitted])[0].explains == explains
    if not explains:
        assert found[0].condition == "seed_length_mm" and found[0].p < LEFT_DRIFT


ROUGHER = """
EFFECT = {
    "name": "rougher", "means": "the angle is higher everywhere", "formula": "tau (1 + k)", "sides": 1,
    "parameters": {"k": {"absent": 0.0, "min": 0.0, "max": 1.0, "unit": "1", "meaning": "k"}},
    "rigs": {"layer_on_incline": "everywhere"}, "signature": "as more friction would", "source": "this test",
}


def act(shear, normal, conditions, values):
    return shear * (1 + values["k"])


CLOSED_FORM = {"layer_on_incline": act}
"""


def test_what_a_constant_at_its_bound_cannot_reach_is_not_taken_as_explained_by_it(tmp_path):
    """mu up to 0.45 against readings of 0.55: an effect just like more friction is what explains them, by k = 0.222."""
    study = incline(tmp_path, mu=0.55)
    (study / "effects").mkdir()
    (study / "effects" / "rougher.py").write_text(ROUGHER)
    toml = (study / "study.toml").read_text()
    (study / "study.toml").write_text(
        toml.replace("value = 0.5, min = 0.05, max = 2.0", "value = 0.4, min = 0.2, max = 0.45")
    )
    found = diagnose(load(study))
    assert (found.verdict, found.missing) == ("missing", ("rougher",))
    assert found.ranking[0].value["k"] == pytest.approx(0.55 / 0.45 - 1, rel=0.15)
    (study / "study.toml").write_text(toml)  # where friction is free to reach them, nothing is missing
    assert diagnose(load(study)).verdict == "adequate"


def test_a_fit_that_did_not_end_decides_nothing(tmp_path, monkeypatch, capsys):
    """Cohesion of 40 Pa, and one round where the fits need several: no effect is named, nothing is added, and it is said."""
    study = incline(tmp_path, mu=0.9, c=40.0)
    before = (tmp_path / "study.toml").read_text()
    monkeypatch.setattr("pellet_study.criticism.least_squares.ROUNDS", 1)
    status, answer = command("refine", study, json_file=tmp_path / "a.json")
    assert status == 0 and answer["verdict"] == "undecided" and answer["added"] == [] and answer["tied"] == []
    assert answer["steps"][0]["fits"] is None
    assert any("did not end" in warning and "narrow min and max" in warning for warning in answer["warnings"])
    assert "ANSWER undecided" in capsys.readouterr().out
    assert (tmp_path / "study.toml").read_text() == before
    assert command("compare", study)[0] == 0
    assert "whether the model fits cannot be said" in " ".join(capsys.readouterr().out.split())
    assert command("report", study)[0] == 0
    monkeypatch.undo()
    assert command("refine", study, json_file=tmp_path / "a.json")[1]["added"] == ["cohesion"]
