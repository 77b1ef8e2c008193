"""The heap trials: what refine is given, and that committed envelopes hold what their readings were simulated from."""

import json

import numpy as np
import pandas as pd
import pytest

from pellet_study.challenge import resume, sealed
from pellet_study.challenge.heaps import HEAPS
from pellet_study.model.model import Model
from pellet_study.model.surrogate import Surrogate
from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch, yade
from pellet_study.study.load import load
from tests import ROOT

RESULTS = ROOT / "results" / "hidden_heaps"
VERSION = "2023.02a"  # of the YADE that made them
PLACES = sorted(RESULTS.glob("sealed/[0-9]*"))


def test_a_trials_study_is_read_back_as_it_was_meant(tmp_path):
    readings = [20.0 + k + np.arange(HEAPS.repeats["repose"]) for k in range(len(HEAPS.conditions))]
    HEAPS.write(tmp_path, HEAPS.rows(readings))
    study, meant = load(tmp_path), HEAPS.study(HEAPS.rows(readings))
    assert [row.conditions for row in study.rows] == [row.conditions for row in meant.rows]
    assert {row.parameters["powder_steel_rolling_friction"] for row in study.rows} == {0.3}
    assert [k for k, row in enumerate(study.rows) if row.split == "holdout"] == sorted(HEAPS.held_out)
    assert (study.parameters, study.effort, study.absent()) == (meant.parameters, meant.effort, meant.absent())
    assert study.catalogue.effects["cohesion"].amount == "surface_energy_j_m2"
    assert "cohesion" in study.absent() and not study.effects


def test_truths_use_seeds_and_numerics_that_the_model_does_not():
    truth = {"effects": {"cohesion": 0.05}, "parameters": {"powder_static_friction": 0.5}, "numerics": "other"}
    cases = sealed.cases_of(HEAPS, 3, truth)
    assert len(cases) == HEAPS.repeats["repose"] * len(HEAPS.conditions) and len(
        {case["seed"] for case in cases}
    ) == len(cases)
    assert min(case["seed"] for case in cases) >= sealed.FIRST_SEED
    for case in cases:
        assert case["effects"]["cohesion"]["surface_energy_j_m2"] == 0.05
        assert case["numerics"]["stiffness_scale"] == 4e-4 and case["parameters"]["powder_static_friction"] == 0.5
    default = on_yade.case("repose", contact_law=HEAPS.contact_law)["numerics"]
    assert (
        default["stiffness_scale"] == 1e-3
        and default["time_step_fraction"] > cases[0]["numerics"]["time_step_fraction"]
    )


@pytest.mark.parametrize(("words", "exponent"), [("", 2.0), ('surface_energy_scaling = "none"', 0.0)])
def test_the_scaling_of_the_surface_energy_reaches_the_simulations(tmp_path, monkeypatch, words, exponent):
    """A stub in place of the simulator keeps the cases it is asked for."""
    asked = []

    def run(cases, store, **_):
        asked.extend(cases)
        return pd.DataFrame({"repose_angle_deg": np.linspace(20.0, 30.0, len(cases)), "status": "ok"})

    monkeypatch.setattr(dispatch, "run", run)
    (tmp_path / "study.toml").write_text(words, encoding="utf-8")
    (tmp_path / "measurements.csv").write_text("rig,observable,value\nrepose,repose_angle_deg,25\n", encoding="utf-8")
    (tmp_path / ".store").mkdir()
    model = Model(load(tmp_path))
    model.predict(model.base)
    assert {case["numerics"]["surface_energy_exponent"] for case in asked} == {exponent}


def test_a_surface_of_heaps_knows_cohesion_by_its_surface_energy(tmp_path):
    """Friction known, one condition, heaps of 133 grains: the surface against heaps of other seeds at one of its points."""
    (tmp_path / "study.toml").write_text(
        'effort = 0.5\ncandidates = ["cohesion"]\n[parameters]\npowder_static_friction = 0.8\n',
        encoding="utf-8",
    )
    header = "rig,observable,value,sd,n,protocol,particle_diameter_um,amplification,powder_mass_g,outlet_height_mm"
    (tmp_path / "measurements.csv").write_text(
        f"{header},powder_steel_rolling_friction\nrepose,repose_angle_deg,20,1,4,funnel,420,11.9,16,30,0.3\n",
        encoding="utf-8",
    )
    study = load(tmp_path)
    model = Model(study, engines={"repose": Surrogate(study, tmp_path / ".store", workers=1, quiet=True)})
    sticky = model.base.copy()
    sticky[model.column["cohesion.surface_energy_j_m2"]] = 0.4
    found, direct = model.predict(np.array([model.base, sticky])), model.directly(sticky)
    error = np.sqrt(found.variance[:, 0])
    assert found.mean[1, 0] - found.mean[0, 0] > 3 * error[1]
    assert direct.mean[0, 0] == pytest.approx(
        found.mean[1, 0], abs=3 * np.hypot(error[1], direct.variance[0, 0] ** 0.5)
    )


@pytest.mark.skipif(not PLACES or yade.version() != VERSION, reason=f"the trials are those of YADE {VERSION}")
def test_a_committed_reading_repeats(tmp_path):
    """One row of a trial, simulated again from its envelope: the same heaps, within what another kind of processor does."""
    place = PLACES[len(PLACES) // 2]
    number, truth = int(place.name), json.loads((place / "sealed.json").read_text(encoding="utf-8"))
    repeats, row = HEAPS.repeats["repose"], 1
    cases = sealed.cases_of(HEAPS, number, truth)[row * repeats : (row + 1) * repeats]
    found = dispatch.run(cases, tmp_path / ".store", workers=1, quiet=True)["repose_height_deg"]
    committed = load(place).rows[row]
    assert found.mean() == pytest.approx(committed.value, abs=2)


@pytest.mark.skipif(not PLACES, reason="no trials in this checkout")
def test_committed_trials_hold_what_they_say():
    table = {int(row["number"]): row for row in resume.read(RESULTS / "sealed" / "sealed.csv")}
    assert sorted(table) == [int(place.name) for place in PLACES]
    kinds = HEAPS.kinds()
    for place in PLACES:
        number, truth = int(place.name), json.loads((place / "sealed.json").read_text(encoding="utf-8"))
        answer = json.loads((place / "answer.json").read_text(encoding="utf-8"))
        assert truth["kind"] == kinds[number] == table[number]["kind"]
        assert bool(truth["effects"]) == (truth["kind"] == "one")
        assert answer["verdict"] == table[number]["verdict"]
        assert load(place).absent() == list(HEAPS.candidates)
