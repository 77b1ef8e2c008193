"""refine, add, drop, history: the error falls where an effect is missing, and nothing is added where none is."""

from pathlib import Path
from shutil import copytree

import pytest

from pellet_study.challenge import trials, twins
from pellet_study.criticism.calibration import fit_study
from pellet_study.criticism.refine import swap
from pellet_study.study.load import load
from pellet_study.study.measurements import Measurement
from tests import ROOT
from tests.helpers.make_study import command, incline

RESULTS = ROOT / "results"
STEP = {"effects", "parameters", "chi2", "dof", "lack_of_fit_p", "rms_error", "holdout_rms_error"}


def bare(name: str, to: Path) -> Path:
    """A committed study as it was before refine."""
    copytree(RESULTS / name, to, ignore=lambda *_: ["history.json"])
    text = (to / "study.toml").read_text()
    (to / "study.toml").write_text(text.split("\n[effects]")[0] + "\n")
    return to


def test_wet_beads_lack_cohesion(tmp_path):
    study = bare("wet_beads", tmp_path / "wet")
    status, answer = command("refine", study, json_file=tmp_path / "a.json")
    assert status == 0 and answer["verdict"] == "adequate"
    assert answer["added"] == ["cohesion"] and answer["tied"] == []
    assert all(set(s) >= STEP for s in answer["steps"])
    first, last = answer["steps"][0], answer["steps"][-1]
    assert first["effects"] == [] and first["rms_error"] == pytest.approx(4.65, abs=0.01)
    assert last["rms_error"] == pytest.approx(1.67, abs=0.02)
    assert last["parameters"]["internal_friction"] == pytest.approx(0.33, abs=0.01)
    assert 100 < last["parameters"]["cohesion.cohesive_stress_pa"] < 125
    key = "layer_on_incline.layer_height_mm"
    assert first["level_out_rms_error"][key] == pytest.approx(5.7, abs=0.05)
    assert last["level_out_rms_error"][key] == pytest.approx(2.0, abs=0.05)
    assert "cohesion" in load(study).effects
    status, again = command("refine", study, json_file=tmp_path / "b.json")
    assert again["added"] == [] and again["verdict"] == "adequate"


def test_calcium_carbonate_lacks_nothing(tmp_path):
    study = bare("caco3", tmp_path / "caco3")
    status, answer = command("refine", study, json_file=tmp_path / "a.json")
    assert status == 0 and answer["added"] == [] and answer["verdict"] == "adequate"
    assert answer["steps"][0]["chi2"] is None


def test_add_drop_and_history(tmp_path):
    study = incline(tmp_path / "s", c=40.0)
    text = (study / "study.toml").read_text()
    status, added = command("add", study, "cohesion", json_file=tmp_path / "a.json")
    assert status == 0 and added["rms_error"] < 0.6 * added["before"]["rms_error"]
    status, dropped = command("drop", study, "cohesion", json_file=tmp_path / "d.json")
    assert dropped["rms_error"] == pytest.approx(added["before"]["rms_error"])
    assert (study / "study.toml").read_text().split("[effects]")[0].strip() == text.strip()
    status, told = command("history", study, json_file=tmp_path / "h.json")
    assert [s["effects"] for s in told["steps"]] == [[], ["cohesion"], []]
    assert (study / "figures" / "ladder.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    "words, message",
    [
        (("add", "cohesoin"), "did you mean 'cohesion'"),
        (("add", "air_drag_"), "accepted are"),
        (("drop", "cohesion"), "not in [effects]"),
    ],
)
def test_refused(tmp_path, words, message, capsys):
    status, _ = command(words[0], incline(tmp_path), words[1])
    assert status == 2 and message in capsys.readouterr().err


@pytest.mark.parametrize("first", ["plastic_restitution", "reading_offset"])
def test_an_effect_that_a_rival_beats_is_swapped(first):
    """Without noise: plastic restitution and load-dependent friction are hidden, the first was added or something else."""
    truth = trials.hidden(("plastic_restitution", "load_dependent_friction"), 8.0)
    rows = [
        Measurement(rig, observable, float(y), float(sd), 5, given, {}, "", 0.0, "fit", "", 0)
        for (rig, observable, given), y, sd in zip(
            twins.conditions(), truth.readings, trials.true_sd(truth.readings), strict=True
        )
    ]
    added = [first, "load_dependent_friction"]
    study = twins.study(rows)
    for name in added:
        study = study.with_effect(name, {study.catalogue.effects[name].amount: 0.01})
    found = swap(study, fit_study(study), added)
    if first == "plastic_restitution":
        assert found is None
    else:
        old, new, values = found
        assert (old, new) == (first, "plastic_restitution")
        assert values["inverse_yield_speed"] == pytest.approx(truth.effects["plastic_restitution"], rel=0.05)


def test_history_of_nothing(tmp_path, capsys):
    status, _ = command("history", incline(tmp_path))
    assert status == 2 and "nothing was done" in capsys.readouterr().err


def test_a_rig_and_an_effect_of_ones_own(tmp_path):
    study = incline(tmp_path / "s")
    (study / "rigs").mkdir()
    (study / "effects").mkdir()
    (study / "rigs" / "spring.py").write_text(
        "RIG = {'name': 'spring', 'observables': {'force_n': 'pull'},\n"
        " 'parameters': {'stiffness_n_m': {'default': 1.0, 'min': 0.0, 'max': 100.0, 'unit': 'N/m', 'meaning': 'k'}},\n"
        " 'conditions': {'stretch_m': {'default': 1.0, 'min': 0.1, 'max': 5.0, 'unit': 'm', 'meaning': 'x'}}}\n"
        "def predict(parameters, conditions, effects):\n"
        "    force = parameters['stiffness_n_m'] * conditions['stretch_m']\n"
        "    for act, values in effects.values():\n"
        "        force = act(force, conditions, values)\n"
        "    return {'force_n': force}\n".replace("RIG = {'name'", "RIG = {\n 'name'")
    )
    (study / "effects" / "hardening.py").write_text(
        "EFFECT = {\n 'name': 'hardening', 'means': 'stiffer when stretched', 'formula': 'k x + b x^3', 'sides': 1,\n"
        " 'parameters': {'cubic': {'absent': 0.0, 'min': 0.0, 'max': 10.0, 'unit': 'N/m3', 'meaning': 'b'}},\n"
        " 'rigs': {'spring': 'at large stretch'}, 'signature': 'bends up', 'source': 'this test'}\n"
        "CLOSED_FORM = {'spring': lambda force, c, v: force + v['cubic'] * c['stretch_m'] ** 3}\n"
    )
    rows = [f"spring,force_n,{2 * x + 0.3 * x**3 + e},{x},0.05" for x in (0.5, 1, 2, 3, 4) for e in (-0.03, 0.01)]
    (study / "measurements.csv").write_text("\n".join(["rig,observable,value,stretch_m,sd", *rows]) + "\n")
    (study / "study.toml").write_text("[parameters]\nstiffness_n_m = { value = 1, min = 0.1, max = 50 }\n")
    status, answer = command("refine", study, json_file=tmp_path / "a.json")
    assert status == 0 and answer["added"] == ["hardening"]
    assert answer["steps"][-1]["parameters"]["hardening.cubic"] == pytest.approx(0.3, abs=0.01)
