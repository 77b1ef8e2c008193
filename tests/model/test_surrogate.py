"""Predictions by YADE through response surfaces: against closed forms, stored, with effects and rigs of one's own."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pellet_study.challenge.seeds import BENCH
from pellet_study.criticism.calibration import fit_study
from pellet_study.criticism.diagnose import diagnose
from pellet_study.criticism.refine import refine
from pellet_study.errors import SimulationError
from pellet_study.model import sites
from pellet_study.model.effect_surface import EffectRuns, fitted_effects
from pellet_study.model.engine import Request
from pellet_study.model.means import Means
from pellet_study.model.model import Model
from pellet_study.model.response_surface import LogSurface, pooled
from pellet_study.model.surrogate import Surrogate
from pellet_study.model.terms import Link, Range, effect_terms, quadratic_terms
from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch
from pellet_study.simulation.local import TOOK_LONGER
from pellet_study.study.edit import write_effect
from pellet_study.study.load import load
from pellet_study.study.study import Setting
from tests.helpers.make_study import command

pytestmark = pytest.mark.yade

FRICTION = "seed_powder_static_friction = { value = 0.6, min = 0.4, max = 0.8 }"


def study_in(folder: Path, rows: str, parameters: str = FRICTION, more: str = "") -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "study.toml").write_text(f'title = "t"\n{more}\n[parameters]\n{parameters}\n', encoding="utf-8")
    (folder / "measurements.csv").write_text(rows, encoding="utf-8")
    return folder


SLIPS = "rig,observable,value,sd,n,seed_length_mm,added_mass_mg\n" + "\n".join(
    f"slope_slip,slip_angle_deg,31,0.5,10,{d},{m}" for d, m in ((2.0, 0), (3.0, 6))
)


def test_a_surface_finds_the_coefficients_it_was_made_from():
    rng = np.random.default_rng(1)
    x = sites.spread(200, 2, seed=3)
    true = np.array([1.0, 0.5, -0.3, 0.2, 0.1, -0.15])
    means = np.exp(quadratic_terms(x) @ true) * rng.gamma(100, 1 / 100, 200)
    surface = LogSurface.fitted(quadratic_terms(x), means)
    assert np.abs(surface.coefficients - true).max() < 4 * np.sqrt(np.diag(surface.covariance)).max()
    assert surface.scatter == pytest.approx(0.01, rel=0.35)  # relative variance of a gamma of shape 100


def test_an_effect_is_nothing_at_zero_and_goes_on_along_its_tangent():
    x, s = np.zeros((4, 1)), np.zeros((4, 0))
    terms = effect_terms(np.array([0.0, 1.0, 1.0 + 1e-6, 3.0]), s, x)
    assert (terms[0] == 0).all()
    slope = (terms[2] - terms[1]) / 1e-6
    assert terms[3] == pytest.approx(terms[1] + 2 * slope, rel=1e-4)
    assert slope == pytest.approx([1, 2, 3, 0], rel=1e-4)


def test_runs_with_the_same_seeds_tell_an_effect_more_closely():
    """Known shifts of two sites, scatter of 10 % that runs with and without the effect share but for a fifth."""
    rng = np.random.default_rng(3)
    x, scatter, true = sites.spread(8, 2, seed=5), 0.01, np.array([-0.4, 0.1, 0.0, 0.05, 0.0])
    u = rng.permutation(sites.amounts(8, 1))
    terms, there = effect_terms(u, np.zeros((8, 0)), x), quadratic_terms(x)
    known = 0.3 * scatter * there @ np.linalg.inv(there.T @ there + np.eye(6)) @ there.T
    runs = []
    for _ in range(2):
        shared = 0.1 * rng.standard_normal(8)
        with_it = np.exp(1 + terms @ true + shared + 0.02 * rng.standard_normal(8))
        own = (with_it, np.exp(1 + shared), np.ones(8), known, np.full(8, scatter))
        runs.append(EffectRuns(u, np.zeros((8, 0)), x, *own))
    alone = fitted_effects([replace(run, without=None) for run in runs])
    both = fitted_effects(runs)
    for one, other in zip(alone, both, strict=True):
        shift, closer = terms[-1] @ one.coefficients, terms[-1] @ other.coefficients
        own, less = (np.sqrt(terms[-1] @ s.covariance @ terms[-1]) for s in (one, other))
        assert less < 0.5 * own
        assert abs(shift - terms[-1] @ true) < 3.5 * own and abs(closer - terms[-1] @ true) < 3.5 * less


def test_a_point_whose_simulations_failed_tells_nothing():
    u, factors = np.array([0.3, 0.6, 1.0]), np.zeros((3, 0))
    rest = (np.zeros(3), np.zeros((3, 3)), np.full(3, 1e-4))
    run = EffectRuns(u, factors, factors, np.array([1.1, 1.2, np.nan]), None, *rest)
    with_all = fitted_effects([run])[0]
    two = (u[:2], factors[:2], factors[:2], run.with_it[:2], None, np.zeros(2), np.zeros((2, 2)), np.full(2, 1e-4))
    without = fitted_effects([EffectRuns(*two)])[0]
    assert with_all.coefficients == pytest.approx(without.coefficients, rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("saturates", [True, False])
def test_an_effect_that_saturates_early_is_bent_and_another_is_not(saturates):
    """Shifts known at amounts that were not simulated: -ln(1 + 10 u)/2, or -u."""

    def shift(u):
        return -0.5 * np.log1p(10 * u) if saturates else -u

    rng, runs = np.random.default_rng(6), []
    for site in range(10):
        u, x = rng.permutation(sites.amounts(8, 1)), sites.spread(8, 2, seed=site)
        with_it = np.exp(shift(u) + 0.03 * rng.standard_normal(8))
        none = (None, np.zeros(8), np.zeros((8, 8)), np.full(8, 0.03**2))
        runs.append(EffectRuns(u, np.zeros((8, 0)), x, with_it, *none))
    surfaces = fitted_effects(runs)
    assert {s.bend > 0 for s in surfaces} == {saturates}
    u = np.array([0.05, 0.3, 0.8])
    terms = effect_terms(u, np.zeros((3, 0)), np.zeros((3, 2)), surfaces[0].bend)
    assert np.mean([terms @ s.coefficients for s in surfaces], axis=0) == pytest.approx(shift(u), abs=0.03)


def test_a_bent_effect_is_nothing_at_zero_whole_at_its_limit_and_odd():
    u, none = np.array([0.0, 1.0, -1.0, 1.0 + 1e-6, 3.0]), np.zeros((5, 0))
    terms = effect_terms(u, none, none, bend=10.0)
    assert (terms[0] == 0).all() and terms[1] == pytest.approx([1, 1, 1]) and terms[2] == pytest.approx([-1, 1, -1])
    slope = 10 / (11 * np.log(11))
    assert (terms[3] - terms[1]) / 1e-6 == pytest.approx([slope, 2 * slope, 3 * slope], rel=1e-3)
    assert terms[4] == pytest.approx(terms[1] + 2 * slope * np.array([1, 2, 3]))


def test_an_angle_goes_by_its_tangent():
    link = Link.of("slip_angle_deg")
    assert link.mu(45.0) == pytest.approx(1) and link.observable(link.mu(31.0)) == pytest.approx(31)
    step = 1e-6
    assert link.slope(0.6) == pytest.approx((link.observable(0.6 * (1 + step)) - link.observable(0.6)) / step, rel=1e-4)
    height = Link.of("rebound_height_mm")
    assert height.mu(7.0) == height.observable(7.0) == height.slope(7.0) == 7.0


def test_cases_of_a_paired_rig_have_seeds_and_places_of_their_own(tmp_path):
    model = Model(load(study_in(tmp_path / "s", SLIPS)))
    engine = model.engines["slope_slip"]
    parameters = {name: np.array([[0.5]]) for name in on_yade.rig("slope_slip").parameters}
    conditions = {"seed_length_mm": np.array([2.0, 3.0]), "added_mass_mg": np.array([0.0, 6.0])}
    cases = engine.plan.sites(Request("slope_slip", "slip_angle_deg", conditions, parameters, {}))
    first, second = (engine.plan.base_points(site) for site in cases)
    assert not {p.first_seed for p in first} & {p.first_seed for p in second}
    assert not {p.factors for p in first} & {p.factors for p in second}
    with_it = engine.plan.effect_points(cases[0], "adhesion")
    places = {(p.factors, p.first_seed) for p in first}
    assert len(with_it) == 8 and all((p.factors, p.first_seed) in places for p in with_it)
    assert len({p.effects for p in with_it}) == 8


def test_factors_go_there_and_back():
    for factor in (Range(0.1, 0.4), Range(-2.0, 3.0), Range(5.0, 6.0)):
        assert factor.scaled(factor.low) == pytest.approx(-1) and factor.scaled(factor.high) == pytest.approx(1)
        assert factor.value(factor.scaled(5.3 if factor.low == 5 else 0.3)) == pytest.approx(
            5.3 if factor.low == 5 else 0.3
        )


def test_slip_angles_follow_the_closed_form_and_are_simulated_once(tmp_path):
    study = load(study_in(tmp_path / "s", SLIPS))
    model = Model(study)
    points = np.repeat(model.base[None], 3, axis=0)
    points[:, model.column["seed_powder_static_friction"]] = 0.45, 0.6, 0.75
    found = model.predict(points)
    assert found.mean == pytest.approx(np.degrees(np.arctan([[0.45], [0.6], [0.75]])) + [[0, 0]], abs=0.35)
    offset = model.column["reading_offset.offset"]
    moved = points.copy()
    moved[:, offset] = 1.5  # acts on the reading alone: exact, and nothing to simulate for it
    before = model.engines["slope_slip"].simulated
    assert model.predict(moved).mean == pytest.approx(found.mean + 1.5, abs=1e-12)
    assert model.engines["slope_slip"].simulated == before > 0
    again = Model(study)
    assert (again.predict(points).mean == found.mean).all()
    assert again.engines["slope_slip"].simulated == 0
    direct = again.engines["slope_slip"]
    with_plate = points[1:2].copy()
    with_plate[:, model.column["plate_tilt.tilt_deg"]] = 1.0  # the scale reads one degree less
    tilted = again.predict(with_plate).mean - found.mean[1]
    assert tilted == pytest.approx(-np.ones((1, 2)), abs=0.3)
    assert direct.simulated > 0


def test_a_failing_rig_is_said_and_a_dead_one_ends_the_answer(tmp_path):
    heavy = "rig,observable,value,sd,n,seed_length_mm,added_mass_mg\nslope_slip,slip_angle_deg,31,0.5,10,1.0,50\n"
    study = load(study_in(tmp_path / "s", heavy))
    with pytest.raises(SimulationError, match="times the seed's mass.*leave this row out"):
        fit_study(study)


def stubbed(monkeypatch, fails):
    """A stub in place of YADE: a seed slips at atan(mu) less the plate's tilt; some cases fail, all are counted."""
    asked = []

    def run(cases, store, **_):
        store.mkdir(exist_ok=True)
        asked.extend(cases)
        rng = np.random.default_rng(len(asked))
        rows = []
        for case in cases:
            mu = case["parameters"]["seed_powder_static_friction"] * (1 + 1e-3 * rng.standard_normal())
            angle = np.degrees(np.arctan(mu)) - case["effects"]["plate_tilt"]["tilt_deg"]
            reason = fails(case)
            rows.append({"slip_angle_deg": np.nan if reason else angle, "status": reason or "ok"})
        return pd.DataFrame(rows)

    monkeypatch.setattr(dispatch, "run", run)
    return asked


def test_an_effect_that_cannot_be_simulated_silences_no_other(tmp_path, monkeypatch):
    stubbed(monkeypatch, lambda case: "jammed" if case["effects"]["adhesion"]["surface_energy"] else None)
    model = Model(load(study_in(tmp_path / "s", SLIPS)))
    points = np.repeat(model.base[None], 3, axis=0)
    points[1, model.column["adhesion.surface_energy"]] = 0.1
    points[2, model.column["plate_tilt.tilt_deg"]] = 1.0
    mean = model.predict(points).mean
    assert np.isnan(mean[1]).all() and {name for _, name in model.engines["slope_slip"].failed} == {"adhesion"}
    assert mean[2] == pytest.approx(mean[0] - 1, abs=0.1)
    assert any("jammed: what adhesion would do" in text for text in model.warnings)
    found = diagnose(load(tmp_path / "s"))
    assert {s.effect for s in found.ranking if "simulations failed" in s.note} == {"adhesion"}
    assert any("what adhesion would do" in text for text in found.warnings)
    write_effect(tmp_path / "s" / "study.toml", "adhesion", {"surface_energy": Setting(0.001, 0.0, 0.002)})
    with pytest.raises(SimulationError, match="jammed"):
        fit_study(load(tmp_path / "s"))


def test_what_ran_out_of_time_is_asked_for_again(tmp_path, monkeypatch):
    asked = stubbed(monkeypatch, lambda case: f"{TOOK_LONGER} 9 s" if case["seed"] % 7 == 0 else None)
    for _ in range(2):
        model = Model(load(study_in(tmp_path / "s", SLIPS)))
        model.predict(model.base)
        asked.append(None)
    first = asked.index(None)
    again = asked[first + 1 : -1]
    assert 0 < len(again) < first and any(case["seed"] % 7 == 0 for case in again)


def test_means_stand_beside_the_store_and_a_torn_line_is_made_again(tmp_path, monkeypatch):
    asked = stubbed(monkeypatch, lambda case: "jammed" if case["seed"] % 2 else None)
    study = load(study_in(tmp_path / "s", SLIPS))
    site = sites.Site(
        "slope_slip", "slip_angle_deg", (("seed_length_mm", 2.0),), (("seed_powder_static_friction", 1.0),)
    )
    points = [sites.Point(site, (), (), first, 4) for first in (0, 10)]
    found = Means(study, tmp_path / "store").of(points)
    assert [(mean.n, mean.lost, mean.reason) for mean in found] == [(2, 2, "jammed")] * 2
    assert found[0].mean == pytest.approx(45, abs=0.2) and len(asked) == 8
    assert Means(study, tmp_path / "store").of(points) == found and len(asked) == 8
    file = tmp_path / "store" / "means.csv"
    file.write_text(file.read_text()[:-9])
    Means(study, tmp_path / "store").of(points)
    assert [case["seed"] for case in asked[8:]] == [10, 11, 12, 13]


def test_a_surface_through_as_few_points_as_terms_tells_no_scatter():
    rng = np.random.default_rng(4)
    x = np.linspace(-1, 1, 12)[:, None]
    noisy = LogSurface.fitted(quadratic_terms(x), np.exp(0.1 * rng.standard_normal(12)))
    saturated = LogSurface.fitted(quadratic_terms(x[::5]), np.array([1.0, 1.3, 0.9]))
    assert noisy.free == 9 and saturated.free == 0
    both = pooled([noisy, saturated])
    assert both[0].scatter == both[1].scatter == pytest.approx(noisy.scatter)


EFFECT = """
EFFECT = {
    "name": "glue",
    "means": "a film holds the seed",
    "formula": "mu + a",
    "parameters": {"extra": {"absent": 0.0, "min": 0.0, "max": 0.4, "physical": (0.0, 0.2), "unit": "1", "meaning": "a"}},
    "sides": 1,
    "rigs": {"slope_slip": "steeper angles"},
    "signature": "all angles alike",
    "source": "made up for this test",
}


def friction(mu, load, values):
    return mu + values["extra"]


SEED_SCENE = {"friction": friction}
"""


def test_an_effect_of_ones_own_acts_in_yade(tmp_path, monkeypatch):
    folder = study_in(tmp_path / "s", SLIPS)
    (folder / "effects").mkdir()
    (folder / "effects" / "glue.py").write_text(EFFECT, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    model = Model(load(Path("s")))  # YADE runs elsewhere, and finds it all the same
    assert "glue" in model.effects
    stuck = model.base.copy()
    stuck[model.column["glue.extra"]] = 0.1
    wanted = np.degrees(np.arctan([0.7, 0.7]))
    assert model.predict(stuck).mean[0] == pytest.approx(wanted, abs=0.4)


RIG = """
from yade_scripts.case import quantity

EFFECTS = ()
RIG = {
    "name": "free_fall",
    "contact_laws": ("hertz_mindlin",),
    "parameters": {"gravity_m_s2": quantity(9.81, 1.0, 20.0, "m/s2", "acceleration")},
    "conditions": {"height_mm": quantity(100.0, 1.0, 1000.0, "mm", "fall")},
    "effects": {},
    "numerics": {},
    "observables": {"time_ms": "duration of the fall"},
    "random": False,
    "time_limit_s": 20.0,
}


def simulate(case):
    from yade import NewtonIntegrator, O, utils

    O.reset()
    body = O.bodies.append(utils.sphere((0, 0, 0), 1e-3, color=(1, 1, 1)))
    O.engines = [NewtonIntegrator(damping=0, gravity=(0, 0, -case["parameters"]["gravity_m_s2"]))]
    O.dt = 1e-5
    while O.bodies[body].state.pos[2] > -1e-3 * case["conditions"]["height_mm"]:
        O.step()
    return {"time_ms": 1e3 * O.time}
"""


def test_a_rig_of_ones_own_is_calibrated(tmp_path, capsys, monkeypatch):
    rows = "rig,observable,value,sd,n,height_mm\n" + "\n".join(
        f"free_fall,time_ms,{1e3 * np.sqrt(2e-3 * h / 8.0):.3f},0.5,10,{h}" for h in (20, 50, 120)
    )
    folder = study_in(tmp_path / "s", rows, "gravity_m_s2 = { value = 9.0, min = 6.0, max = 12.0 }")
    (folder / "rigs").mkdir()
    (folder / "rigs" / "free_fall.py").write_text(RIG, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    status, answer = command("compare", "s", json_file=tmp_path / "answer.json")
    assert status == 0
    assert answer["parameters"]["gravity_m_s2"] == pytest.approx(8.0, rel=0.02)


def test_the_study_a_trial_writes_is_the_one_it_means(tmp_path):
    """Its rows, conditions, starting values and numbers of trials; the readings are drawn here."""
    truth = dict(zip(BENCH.truth, (0.35, 0.6, 0.25), strict=True))
    rng = np.random.default_rng(2)
    readings = []
    for rig, _ in BENCH.conditions:
        mean = np.degrees(np.arctan(0.6)) if rig == "slope_slip" else 10.0
        readings.append(mean + BENCH.reading_sd(rig, mean) * rng.standard_normal(BENCH.repeats[rig]))
    BENCH.write(tmp_path / "00", BENCH.rows(readings))
    study = load(tmp_path / "00")
    assert len(study.rows) == 28 and study.rigs == ("rebound", "slope_slip", "inclined_roll")
    for row, (rig, given) in zip(study.rows, BENCH.conditions, strict=True):
        defaults = {name: quantity["default"] for name, quantity in study.catalogue.rigs[rig].conditions.items()}
        assert row.conditions == defaults | given
    assert {name: s.value for name, s in study.parameters.items()} == pytest.approx(truth, abs=0.02)
    kinds = BENCH.kinds()
    assert kinds.count("one") == 40 and kinds.count("nothing") == 15 and len(kinds) == 102
    assert kinds[60:] == ["lambda 4"] * 30 + ["lambda 8"] * 12


def test_slip_alone_is_refined_on_yade(tmp_path):
    """Readings made with load-dependent friction by its closed form; refine finds it on YADE."""
    n, g, mu0 = 0.1, 9.81, 0.6
    lines = ["rig,observable,value,sd,n,seed_length_mm,added_mass_mg"]
    rng = np.random.default_rng(4)
    from yade_scripts.effects.load_dependent_friction import REFERENCE_LOAD
    from yade_scripts.particles import seed_mass_properties

    for d, m in ((2.0, 0), (2.0, 3), (2.0, 12), (3.0, 0), (3.0, 10), (3.0, 40)):
        mass = seed_mass_properties(d, 1250.0)[0] + 1e-6 * m
        angle = np.arctan(mu0)
        for _ in range(50):
            angle = np.arctan(mu0 * (mass * g * np.cos(angle) / REFERENCE_LOAD) ** -n)
        readings = np.degrees(angle) + 0.5 * rng.standard_normal(10)
        lines.append(f"slope_slip,slip_angle_deg,{readings.mean()},{readings.std(ddof=1)},10,{d},{m}")
    folder = study_in(tmp_path / "s", "\n".join(lines), more='candidates = ["load_dependent_friction", "adhesion"]')
    study = load(folder)
    found = refine(study, propose=False)
    assert found.added == ("load_dependent_friction",)
    fitted = found.steps[-1].parameters["load_dependent_friction.load_exponent"]
    assert fitted == pytest.approx(n, abs=0.03)
    assert found.steps[-1].rms_error < 0.5 * found.steps[0].rms_error
    assert isinstance(found.state.model.engines["slope_slip"], Surrogate)
    assert replace(study, effort=2.0).effort == 2.0
    assert on_yade.rig("slope_slip").seeds == 1


ZERO_OFF = """
EFFECT = {
    "name": "ratio_off", "means": "the ratio is read too high", "formula": "reading = value + k", "sides": 2,
    "parameters": {"k": {"absent": 0.0, "min": -1.0, "max": 1.0, "unit": "1", "meaning": "k"}},
    "rigs": {"rebound": "the ratio alone"}, "reads": READS, "signature": "-", "source": "made up for this test",
}


def reading(value, values):
    return value + values["k"]


SEED_SCENE = {"reading": reading}
"""
TILTED = "rig,observable,value,sd,n,plate_tilt_deg\n" + "\n".join(
    f"rebound,{observable},{value},0.1,5,{tilt}"
    for observable, value in (("rebound_height_mm", 7.0), ("tangential_restitution", 0.7))
    for tilt in (10, 20)
)
E0 = "seed_powder_restitution = { value = 0.3, min = 0.2, max = 0.5 }"


@pytest.mark.parametrize(
    ("effect", "moves"),
    [
        ("reading_offset = { offset = 1.5 }", "rebound_height_mm"),
        ("ratio_off = { k = 0.25 }", "tangential_restitution"),
    ],
)
def test_an_effect_on_readings_acts_on_the_surfaces_as_in_the_rig(tmp_path, monkeypatch, effect, moves):
    """Heights and ratios without the effect come from a stub; the command line adds it to the observable it reads alone."""

    def run(cases, store, **_):
        store.mkdir(parents=True, exist_ok=True)
        e = np.array([case["parameters"]["seed_powder_restitution"] for case in cases])
        return pd.DataFrame({"rebound_height_mm": 80 * e**2, "tangential_restitution": 0.7 + 0 * e, "status": "ok"})

    monkeypatch.setattr(dispatch, "run", run)
    found = {}
    for name, more in (("without", ""), ("with", f"\n[effects]\n{effect}")):
        folder = study_in(tmp_path / name, TILTED, E0.replace("{ value = 0.3, min = 0.2, max = 0.5 }", "0.3") + more)
        (folder / "effects").mkdir()
        text = ZERO_OFF.replace("READS", '("tangential_restitution",)')
        (folder / "effects" / "ratio_off.py").write_text(text, encoding="utf-8")
        status, answer = command("compare", folder, json_file=tmp_path / "answer.json")
        assert status == 0
        found[name] = {row["observable"]: row["predicted"] for row in answer["rows"]}
    shift = {name: found["with"][name] - found["without"][name] for name in found["with"]}
    amount = 1.5 if moves == "rebound_height_mm" else 0.25
    assert shift == pytest.approx({name: amount if name == moves else 0.0 for name in shift}, abs=1e-9)


def test_an_effect_that_reads_what_no_rig_gives_is_refused(tmp_path, capsys):
    folder = study_in(tmp_path / "s", TILTED, E0)
    (folder / "effects").mkdir()
    (folder / "effects" / "off.py").write_text(ZERO_OFF.replace("READS", '("rebound_hight_mm",)'), encoding="utf-8")
    assert command("compare", folder)[0] == 2
    assert "'rebound_hight_mm' is no observable of rebound" in capsys.readouterr().err
