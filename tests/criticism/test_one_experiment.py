"""Readings of one simulated experiment scatter together, and count as what they tell together; a formula in YADE's place."""

import numpy as np
import pandas as pd
import pytest

from pellet_study.criticism import cell_means as cell_means_module
from pellet_study.criticism.calibration import covariance, fit_study, with_simulator_noise
from pellet_study.criticism.cell_means import cell_means, positive
from pellet_study.criticism.compare import compare
from pellet_study.model.model import Model
from pellet_study.simulation import dispatch
from pellet_study.study import load

MASSES = (20.0, 25.0, 30.0, 40.0)
CONDITIONS = "powder_mass_g"


def angle(friction: float, mass: float) -> float:
    return 20 + 20 * friction + 0.1 * (mass - 25)


@pytest.fixture
def simulated(monkeypatch):
    """{"together": correlation of the triangle and the height of a heap, from seed to seed, "sd": of each, deg}."""
    state = {"together": 0.9, "sd": 2.0}

    def run(cases, store, **_):
        store.mkdir(parents=True, exist_ok=True)
        rho, sd, found = state["together"], state["sd"], []
        for case in cases:
            mean = angle(case["parameters"]["powder_static_friction"], case["conditions"]["powder_mass_g"])
            one, other = np.random.default_rng([case["seed"], int(case["conditions"][CONDITIONS])]).standard_normal(2)
            found.append((mean + sd * one, mean + 4 + sd * (rho * one + np.sqrt(1 - rho**2) * other)))
        return pd.DataFrame(found, columns=["repose_triangle_deg", "repose_height_deg"]).assign(status="ok")

    monkeypatch.setattr(dispatch, "run", run)
    return state


def study(path, readings=("repose_triangle_deg", "repose_height_deg"), noise=None, split=("fit",) * 4):
    """Heaps of four masses at a friction of 0.8, n = 4, sd 2; `noise` (4, 2) of the means in standard errors."""
    path.mkdir()
    noise = np.zeros((4, 2)) if noise is None else noise
    lines = [f"rig,observable,value,sd,n,split,{CONDITIONS}"]
    for k, mass in enumerate(MASSES):
        for j, name in enumerate(("repose_triangle_deg", "repose_height_deg")):
            if name in readings:
                lines.append(f"repose,{name},{angle(0.8, mass) + 4 * j + noise[k, j]:.4f},2,4,{split[k]},{mass}")
    (path / "measurements.csv").write_text("\n".join(lines) + "\n")
    (path / "study.toml").write_text(
        "candidates = []\neffort = 3\n[parameters]\npowder_static_friction = { value = 0.7, min = 0.4, max = 1.2 }\n"
    )
    return load(path)


def test_the_correlation_of_readings_is_that_of_the_simulations(tmp_path, simulated):
    both = study(tmp_path / "s")
    model = Model(both)
    model.predict(model.base)
    case = {(c.observable, c.conditions["powder_mass_g"]): c for c in model.cases}
    one, other = case["repose_triangle_deg", 20.0], case["repose_height_deg", 20.0]
    assert model.alike(one, other) == pytest.approx(0.9, abs=0.06)
    assert model.alike(one, one) == 0 == model.alike(one, case["repose_height_deg", 40.0])  # of other heaps
    cells = cell_means(model, both.rows)
    found = np.linalg.inv(cells.whiten.T @ cells.whiten)
    rho = model.alike(one, other)
    assert np.diag(found) == pytest.approx(1.0)  # sd 2 of four readings
    assert found[0, 1] == pytest.approx(rho) and found[0, 2] == pytest.approx(0, abs=1e-9)
    noisy = with_simulator_noise(cells, model, model.base)
    wider = np.linalg.inv(noisy.whiten.T @ noisy.whiten)
    assert np.sqrt(np.diag(wider)) == pytest.approx(noisy.sd)
    assert wider[0, 1] / np.sqrt(wider[0, 0] * wider[1, 1]) == pytest.approx(rho, abs=0.01)


def test_a_second_reading_of_the_same_heap_adds_only_what_is_new_in_it(tmp_path, simulated):
    simulated["together"] = 0.95
    error = {}
    for name, readings in (
        ("one", ("repose_triangle_deg",)),
        ("both", ("repose_triangle_deg", "repose_height_deg")),
    ):
        state = fit_study(study(tmp_path / name, readings))
        error[name] = float(np.sqrt(covariance(state.fit)[0, 0]))
    assert 0.9 < error["both"] / error["one"] < 1.02
    simulated["together"] = 0.0
    state = fit_study(study(tmp_path / "apart"))
    assert float(np.sqrt(covariance(state.fit)[0, 0])) / error["one"] == pytest.approx(2**-0.5, abs=0.08)


@pytest.mark.parametrize(("known", "fewest", "most"), [(True, 0, 13), (False, 14, 40)])
def test_the_interval_of_a_constant_is_as_wide_as_readings_that_scatter_together_make_it(
    tmp_path, simulated, monkeypatch, known, fewest, most
):
    """120 null studies: the truth beyond 1.96 standard errors in 6 expected, 13 at three more; in 20 were the readings taken as apart."""
    if not known:
        monkeypatch.setattr(cell_means_module, "alike_of", lambda *_: None)
    random, rho = np.random.default_rng(5), 0.9
    simulated["sd"] = 0.1  # of the simulations, so that their surfaces are exact
    beyond = 0
    for k in range(120):
        one, other = random.standard_normal((2, 4))
        noise = np.column_stack([one, rho * one + np.sqrt(1 - rho**2) * other])
        state = fit_study(study(tmp_path / str(k), noise=noise))
        beyond += abs(state.fit.values[0] - 0.8) > 1.96 * np.sqrt(covariance(state.fit)[0, 0])
    assert fewest <= beyond <= most


def test_rows_held_out_of_one_heap_count_together(tmp_path, simulated):
    """Both readings of a heap off by 2.2 standard errors to the same side are one heap off, not two."""
    off = np.zeros((4, 2))
    off[3] = 2.2
    split = ("fit", "fit", "fit", "holdout")
    together = compare(study(tmp_path / "s", noise=off, split=split)).holdout_p
    simulated["together"] = 0.0
    apart = compare(study(tmp_path / "t", noise=off, split=split)).holdout_p
    assert together > apart


def test_correlations_that_do_not_fit_together_are_mended():
    bad = np.array([[1, 0.95, -0.95], [0.95, 1, 0.95], [-0.95, 0.95, 1]])
    found = positive(bad)
    assert np.linalg.eigvalsh(found).min() > 0 and np.diag(found) == pytest.approx(1)
    good = np.array([[1, 0.5], [0.5, 1]])
    assert positive(good) is good
