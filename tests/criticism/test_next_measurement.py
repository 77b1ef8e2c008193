"""The next measurement where simulations must tell, a stub with a closed form in YADE's place: this tests the driver."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from pellet_study.criticism.calibration import covariance, fit_study, reduced_chi2
from pellet_study.criticism.explanations import TIE, tied
from pellet_study.criticism.least_squares import fit_many
from pellet_study.criticism.next_measurement import next_measurement
from pellet_study.criticism.predictions import nearest_case, predictions
from pellet_study.criticism.rivals import Rival, rival_problem
from pellet_study.model.model import Case, Model
from pellet_study.simulation import dispatch
from pellet_study.study.load import load

LENGTHS = (1.5, 1.8, 2.2, 2.6, 3.0)


def tangent(mu: float, gamma: float, exponent: float, length: float, added: float) -> float:
    """mu (1 + F/N) with adhesion F, mu N^-n with load-dependent friction; N one for the plain seed of 2.2 mm."""
    load = (length / 2.2) ** 3 + added / 2.0
    return mu * (1 + 5e3 * gamma * (length / 2.2) / load) * load**-exponent


@pytest.fixture
def asked(monkeypatch) -> list[dict]:
    found = []

    def run(cases, store, **_):
        store.mkdir(parents=True, exist_ok=True)
        found.extend(cases)
        angles = []
        for case in cases:
            true = tangent(
                case["parameters"]["seed_powder_static_friction"],
                case["effects"]["adhesion"]["surface_energy"],
                case["effects"]["load_dependent_friction"]["load_exponent"],
                case["conditions"]["seed_length_mm"],
                case["conditions"]["added_mass_mg"],
            )
            scatter = 1 + 1e-3 * np.random.default_rng(case["seed"]).standard_normal()
            angles.append(np.degrees(np.arctan(true * scatter)))
        return pd.DataFrame({"slip_angle_deg": angles, "status": "ok"})

    monkeypatch.setattr(dispatch, "run", run)
    return found


def rivals_of(folder):
    """A study of plain seeds, whose slip angles adhesion or load-dependent friction explain alike, and both fits."""
    lines = ["rig,observable,value,sd,n,seed_length_mm"]
    for d in LENGTHS:
        lines.append(
            f"slope_slip,slip_angle_deg,{np.degrees(np.arctan(tangent(0.6, 4e-5, 0.0, d, 0.0))):.3f},0.3,10,{d}"
        )
    (folder / "measurements.csv").write_text("\n".join(lines) + "\n")
    (folder / "study.toml").write_text(
        'candidates = ["adhesion", "load_dependent_friction"]\n'
        "[parameters]\nseed_powder_static_friction = { value = 0.6, min = 0.3, max = 0.9 }\n"
    )
    study = load(folder)
    state = fit_study(study, Model(study))
    starts = {"adhesion": 2e-5, "load_dependent_friction": 0.05}
    problems = [
        rival_problem(state, [name], [{state.model.column[f"{name}.{study.catalogue.effects[name].amount}"]: start}])
        for name, start in starts.items()
    ]
    fits = fit_many(state.model, state.cells, problems)
    return state, {(name,): fit for name, fit in zip(starts, fits, strict=True)}


def test_rivals_are_simulated_themselves_and_what_tells_them_apart_is_proposed(tmp_path, asked):
    state, rivals = rivals_of(tmp_path)
    before = len(asked)
    found = next_measurement(state, rivals)
    new = asked[before:]
    used = {
        (
            case["parameters"]["seed_powder_static_friction"],
            case["effects"]["adhesion"]["surface_energy"],
            case["effects"]["load_dependent_friction"]["load_exponent"],
        )
        for case in new
    }
    assert len(used) == 2, "no surfaces over the ranges, the two rivals only"
    assert found.rig == "slope_slip" and found.conditions["added_mass_mg"] > 0
    for name, fit in rivals.items():
        mu, amount = (fit.values[0], fit.values[1])
        given = {"adhesion": (amount, 0.0), "load_dependent_friction": (0.0, amount)}[name[0]]
        angle = np.degrees(
            np.arctan(tangent(mu, *given, found.conditions["seed_length_mm"], found.conditions["added_mass_mg"]))
        )
        assert found.predictions[name[0]] == pytest.approx(angle, rel=0.005)
    assert found.separation > 3


def test_the_variance_of_a_simulated_prediction_is_that_of_the_nearest_measured_case(tmp_path, asked):
    """At a measured case itself: what the surface's own slopes and the fit's covariance give, by finite differences."""
    state, rivals = rivals_of(tmp_path)
    case = state.model.cases[1]
    fit = rivals[("adhesion",)]
    means, variances = predictions(state, [Case(case.rig, case.observable, case.conditions, case.parameters)], [fit])
    moved = []
    for column, low, high in zip(fit.problem.free, fit.problem.low, fit.problem.high, strict=True):
        point = fit.point.copy()
        point[column] += 1e-3 * (high - low)
        moved.append(
            (state.model.predict(point).mean[0, 1] - state.model.predict(fit.point).mean[0, 1]) / (1e-3 * (high - low))
        )
    expected = np.array(moved) @ (covariance(fit) * reduced_chi2(state, fit)) @ np.array(moved)
    own = 1e-3 * means[0, 0]  # scatter of the simulations, half as much in degrees
    assert expected < variances[0, 0] < expected + own**2
    assert variances[0, 0] == pytest.approx(expected, rel=0.15)


def test_the_nearest_case_is_one_of_the_same_rig(tmp_path, asked):
    state, _ = rivals_of(tmp_path)
    conditions = {**state.model.cases[0].conditions, "seed_length_mm": 2.5, "added_mass_mg": 10.0}
    places = nearest_case(state, [Case("slope_slip", "slip_angle_deg", conditions, {})])
    assert [state.model.cases[k].conditions["seed_length_mm"] for k in places] == [2.6]


def test_a_closed_form_beside_a_simulated_rig_keeps_its_uncertainty(tmp_path, asked):
    """Cohesion of a powder sheared at high stress is uncertain at low stress, whether seeds were measured too or not."""
    sheared = [f"shear_cell,shear_stress_pa,{0.5 * s + 200:.0f},20,5,{s}," for s in (2000, 4000, 8000)]
    seeds = [f"slope_slip,slip_angle_deg,{np.degrees(np.arctan(0.6)):.2f},0.3,10,,{d}" for d in LENGTHS]
    found = []
    for name, rows in (("alone", sheared), ("both", sheared + seeds)):
        folder = tmp_path / name
        folder.mkdir()
        head = "rig,observable,value,sd,n,normal_stress_pa,seed_length_mm"
        (folder / "measurements.csv").write_text("\n".join([head, *rows]) + "\n")
        free = ["internal_friction = { value = 0.5, min = 0.1, max = 1.5 }"]
        if name == "both":
            free.append("seed_powder_static_friction = { value = 0.6, min = 0.3, max = 0.9 }")
        lines = ['candidates = ["cohesion"]', "[parameters]", *free]
        (folder / "study.toml").write_text("\n".join(lines) + "\n")
        study = load(folder)
        state = fit_study(study, Model(study))
        problem = rival_problem(state, ["cohesion"], [{state.model.column["cohesion.cohesive_stress_pa"]: 100.0}])
        (fit,) = fit_many(state.model, state.cells, [problem])
        means, variances = predictions(
            state, [Case("shear_cell", "shear_stress_pa", {"normal_stress_pa": 100.0}, {})], [fit]
        )
        found.append((means[0, 0], variances[0, 0]))
    assert found[1] == pytest.approx(found[0], rel=0.02)
    assert found[0][1] > 8.0**2, "the intercept of three points far from it"


def test_a_rival_whose_simulations_scatter_is_tied_farther_off(tmp_path, asked):
    """Twice TIE behind the best: apart where predictions are certain, tied where their scatter may have done it."""
    state, rivals = rivals_of(tmp_path)
    first, second = (Rival(names, fit, True) for names, fit in rivals.items())
    apart = TIE * reduced_chi2(state, first.fit)
    far = replace(second, fit=replace(second.fit, chi2=first.fit.chi2 + 2 * apart))
    assert tied(state, [first, far], first) == [first]
    noisy = replace(far, noise=1.5 * apart)
    assert tied(state, [first, noisy], first) == [first, noisy]
