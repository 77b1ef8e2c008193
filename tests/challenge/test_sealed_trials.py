"""Sealed trials from the envelope to its opening, a stub with a closed form in YADE's place: this tests the driver. And a
committed reading, made again by YADE."""

import csv
import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from pellet_study.challenge import sealed
from pellet_study.challenge.demonstration import Demonstration
from pellet_study.challenge.seeds import BENCH
from pellet_study.simulation import dispatch, yade
from pellet_study.study.load import load
from tests import ROOT

PLACES = sorted((ROOT / "results" / "hidden_effect").glob("sealed/[0-9]*"))
VERSION = "2023.02a"  # of the YADE that made them
PULL = 300.0  # mm2 per J/m2: tan a = mu (1 + PULL gamma / length2), as a film that pulls on the seed would have it

SLIPS = Demonstration(
    title="Seeds that slip",
    observables={"slope_slip": "slip_angle_deg"},
    conditions=[("slope_slip", {"seed_length_mm": d}) for d in (1.2, 1.5, 1.9, 2.4, 3.0)],
    ranges={"seed_powder_static_friction": (0.6, 0.3, 0.9)},
    truth={"seed_powder_static_friction": (0.5, 0.7)},
    repeats={"slope_slip": 10},
    scatter={},
    instrument_sd={"slope_slip": 0.3},
    other_numerics={"slope_slip": {"stiffness_scale": 0.4}},
    trials={"one": 3, "nothing": 2},
    candidates=("adhesion",),
    hides=("adhesion",),
)


@pytest.fixture
def asked(monkeypatch) -> list[dict]:
    cases_asked = []

    def run(cases, store, **_):
        store.mkdir(parents=True, exist_ok=True)
        cases_asked.extend(cases)
        angles = []
        for case in cases:
            film = PULL * case["effects"]["adhesion"]["surface_energy"] / case["conditions"]["seed_length_mm"] ** 2
            scatter = 1 + 1e-3 * np.random.default_rng(case["seed"]).standard_normal()
            angles.append(
                np.degrees(np.arctan(case["parameters"]["seed_powder_static_friction"] * (1 + film) * scatter))
            )
        return pd.DataFrame({"slip_angle_deg": angles, "status": "ok"})

    monkeypatch.setattr(dispatch, "run", run)
    return cases_asked


def test_from_the_envelope_to_its_opening(tmp_path, asked):
    file = sealed.run(SLIPS, tmp_path / "sealed", tmp_path / ".store", 4)
    rows = list(csv.DictReader(file.open(encoding="utf-8")))
    truths = [json.loads((tmp_path / f"sealed/{k:02d}/sealed.json").read_text()) for k in range(4)]
    assert [row["kind"] for row in rows] == [truth["kind"] for truth in truths] == SLIPS.kinds()[:4]
    for row, truth in zip(rows, truths, strict=True):
        if truth["kind"] == "nothing":
            assert (row["hidden"], row["verdict"], row["added"]) == ("", "adequate", "")
            assert float(row["lambda"]) < 0.1
        else:
            assert (row["hidden"], row["verdict"], row["added"]) == ("adhesion", "adequate", "adhesion")
            assert float(row["lambda"]) == pytest.approx(truth["lambda"], abs=0.01) and float(row["lambda"]) > 5
            assert float(row["size_ratio"]) == pytest.approx(1, abs=0.5)
    end = sealed.FIRST_SEED + 4 * len(SLIPS.conditions) * sealed.SEEDS_A_TRIAL
    readings = [case for case in asked if sealed.FIRST_SEED <= case["seed"] < end]
    assert len(readings) == 4 * len(SLIPS.conditions)
    for case in readings:
        truth = truths[(case["seed"] - sealed.FIRST_SEED) // sealed.SEEDS_A_TRIAL // len(SLIPS.conditions)]
        assert case["parameters"]["seed_powder_static_friction"] == truth["parameters"]["seed_powder_static_friction"]
        assert case["effects"]["adhesion"]["surface_energy"] == truth["effects"].get("adhesion", 0.0)
        assert (case["numerics"]["stiffness_scale"] == 0.4) == (truth["numerics"] == "other")
    assert {truth["numerics"] for truth in truths} == {"other", "the model's"}


def test_what_refine_is_given_does_not_hold_the_truth_and_is_not_made_twice(tmp_path, asked):
    sealed.run(SLIPS, tmp_path / "sealed", tmp_path / ".store", 1)
    place = tmp_path / "sealed/00"
    given = (place / "study.toml").read_text() + (place / "measurements.csv").read_text()
    truth = json.loads((place / "sealed.json").read_text())
    assert f"{truth['parameters']['seed_powder_static_friction']:.4f}" not in given
    kept, before = {f.name: f.read_bytes() for f in place.iterdir()}, len(asked)
    sealed.run(SLIPS, tmp_path / "sealed", tmp_path / ".store", 1)
    assert {f.name: f.read_bytes() for f in place.iterdir()} == kept and len(asked) == before


def test_the_answer_does_not_look_into_the_envelope(tmp_path, asked):
    """Another truth in the envelope after the readings: the answer stays, the row says what is in the envelope."""
    sealed.run(SLIPS, tmp_path / "sealed", tmp_path / ".store", 1)
    place = tmp_path / "sealed/00"
    answer = (place / "answer.json").read_text()
    truth = json.loads((place / "sealed.json").read_text()) | {"kind": "nothing", "effects": {}}
    (place / "sealed.json").write_text(json.dumps(truth))
    file = sealed.run(SLIPS, tmp_path / "sealed", tmp_path / ".store", 1)
    row = next(csv.DictReader(file.open(encoding="utf-8")))
    assert (place / "answer.json").read_text() == answer
    assert row["hidden"] == "" and row["added"] == "adhesion"


def test_a_strength_is_measured_by_pairs_and_is_that_of_the_closed_form(tmp_path, asked):
    """By 40 pairs a row; lambda from the closed form itself: the misfit that one friction for all lengths leaves."""
    weighed = replace(SLIPS, trials={"one": 1}, later={4.0: 1}, strength_seeds={"slope_slip": 40})
    rows = list(csv.DictReader(sealed.run(weighed, tmp_path / "sealed", tmp_path / ".store", 2).open(encoding="utf-8")))
    lengths = np.array([given["seed_length_mm"] for _, given in SLIPS.conditions])
    for row in rows:
        truth = json.loads((tmp_path / f"sealed/{int(row['number']):02d}/sealed.json").read_text())
        film = PULL * truth["effects"]["adhesion"] / lengths**2
        angles = np.degrees(np.arctan(truth["parameters"]["seed_powder_static_friction"] * (1 + film)))
        expected = np.sqrt(np.square(angles - angles.mean()).sum()) / (0.3 / np.sqrt(10))
        assert float(row["lambda"]) == pytest.approx(expected, rel=0.1)
    assert float(rows[1]["lambda"]) == pytest.approx(4, rel=0.15), "hidden at lambda 4"
    pairs = [case for case in asked if case["seed"] >= sealed.FIRST_OF_STRENGTHS]
    assert sum(case["effects"]["adhesion"]["surface_energy"] == 0 for case in pairs) >= 2 * 5 * 40


@pytest.mark.skipif(not PLACES or yade.version() != VERSION, reason=f"the trials are those of YADE {VERSION}")
def test_a_committed_reading_repeats_to_its_last_digit(tmp_path):
    """The first row of a trial, sixty rebounds from its envelope on."""
    place, truth = next(
        (place, truth)
        for place in PLACES[len(PLACES) // 2 :]
        if (truth := json.loads((place / "sealed.json").read_text(encoding="utf-8")))["kind"] == "one"
    )
    cases = sealed.cases_of(BENCH, int(place.name), truth)[: BENCH.simulated("rebound")]
    found = dispatch.run(cases, tmp_path / ".store", workers=1, quiet=True)["rebound_height_mm"]
    committed = load(place).rows[0]
    assert committed.rig == "rebound" and len(found) == committed.n == 60
    assert found.mean() == pytest.approx(committed.value, rel=1e-5)
    assert found.std(ddof=1) == pytest.approx(committed.sd, rel=1e-5)
