"""compare: numbers against answers known beforehand, and conclusions no stronger than the data."""

import math

import numpy as np
import pytest

from pellet_study.challenge import trials, twins
from pellet_study.criticism.calibration import EXCESS, fit_study
from pellet_study.criticism.cell_means import CellMeans
from pellet_study.criticism.compare import compare
from pellet_study.criticism.scatter import pooled_sd
from pellet_study.criticism.score_tests import exceedance, largest_null, standardised
from pellet_study.criticism.text import comparison_page
from pellet_study.rigs import Acting, catalogue
from pellet_study.rigs.closed_form import layer_on_incline
from pellet_study.study.load import load
from tests.helpers.make_study import STRESSES_PA, command, folder, incline, slip_angle_deg

KEYS = {
    "parameters",
    "chi2",
    "dof",
    "lack_of_fit_p",
    "rms_error",
    "rms_error_unit",
    "holdout_rms_error",
    "rows",
}


@pytest.mark.parametrize("c", [0.0, 30.0, 120.0])
def test_incline_against_the_explicit_solution(c):
    effect = catalogue.standard().effects["cohesion"]
    conditions = {"layer_height_mm": np.array([10.0, 25.0, 60.0]), "bulk_density_kg_m3": 1400.0}
    acting = {"cohesion": Acting(effect.closed_form["layer_on_incline"], {"cohesive_stress_pa": np.array([[c]])})}
    angle = layer_on_incline.predict({"internal_friction": np.array([[0.4]])}, conditions, acting)["slip_angle_deg"][0]
    assert angle == pytest.approx([slip_angle_deg(h, 0.4, c) for h in (10.0, 25.0, 60.0)], abs=1e-6)


@pytest.mark.parametrize("name", ["cohesion", "finite_thickness", "side_wall_friction", "stress_dependent_friction"])
def test_an_effect_absent_is_not_there_and_grows_from_zero(name):
    standard = catalogue.standard()
    effect = standard.effects[name]
    for rig, act in effect.closed_form.items():
        declared = standard.rigs[rig]
        conditions = {c: np.array([q["default"], 2 * q["default"]]) for c, q in declared.conditions.items()}
        conditions["median_normal_stress_pa"] = 700.0
        parameters = {"internal_friction": np.array([[0.5]])}

        def angles(amount, rig=rig, act=act, conditions=conditions, parameters=parameters):
            values = {**effect.neutral(), effect.amount: np.array([[amount]])}
            return next(iter(standard.rigs[rig].predict(parameters, conditions, {name: Acting(act, values)}).values()))

        bare = next(iter(declared.predict(parameters, conditions, {}).values()))
        assert angles(0.0) == pytest.approx(np.broadcast_to(bare, (1, 2)), rel=1e-9)
        high = effect.parameters[effect.amount]["physical"][1]
        small = np.abs(angles(1e-6 * high) - bare).max()
        assert small < 1e-3 * max(np.abs(bare).max(), 1)


def test_shear_cell_slope_is_weighted_least_squares(tmp_path):
    tau = [260.0, 500.0, 980.0, 2050.0, 4010.0]
    lines = ["rig,observable,value,normal_stress_pa,sd,n"]
    lines += [f"shear_cell,shear_stress_pa,{t},{s},20,4" for s, t in zip(STRESSES_PA, tau, strict=True)]
    found = compare(load(folder(tmp_path, lines)))
    sigma, tau = np.array(STRESSES_PA), np.array(tau)
    mu = (sigma * tau).sum() / (sigma**2).sum()
    assert found.parameters["internal_friction"] == pytest.approx(mu, rel=1e-6)
    assert found.chi2 == pytest.approx((((tau - mu * sigma) / 10) ** 2).sum(), rel=1e-6)
    assert found.dof == 4
    assert found.rows[0].z == pytest.approx((tau[0] - mu * sigma[0]) / 10, rel=1e-6)
    assert found.rms_error == pytest.approx(np.sqrt(np.mean((tau - mu * sigma) ** 2)), rel=1e-6)
    assert found.rms_error_unit == "Pa"


def test_shared_setup_is_generalised_least_squares(tmp_path):
    lines = ["rig,observable,value,normal_stress_pa,sd,setup,setup_sd"]
    tau, groups = [260.0, 500.0, 980.0, 2050.0, 4010.0], "aabbb"
    lines += [f"shear_cell,shear_stress_pa,{t},{s},20,{g},50" for s, t, g in zip(STRESSES_PA, tau, groups, strict=True)]
    found = compare(load(folder(tmp_path, lines)))
    same = np.array([[a == b for b in groups] for a in groups])
    inverse = np.linalg.inv(400 * np.eye(5) + 2500 * same)
    x, y = np.array(STRESSES_PA), np.array(tau)
    mu = (x @ inverse @ y) / (x @ inverse @ x)
    assert found.parameters["internal_friction"] == pytest.approx(mu, rel=1e-5)


def test_where_it_fails_is_said_in_words(tmp_path):
    status, answer = command("compare", incline(tmp_path, c=60.0), json_file=tmp_path / "answer.json")
    assert status == 0 and set(answer) >= KEYS
    assert answer["lack_of_fit_p"] < 0.001 and not answer["fits"]
    worst = answer["where"][0]
    assert (worst["parameter"], worst["condition"]) == ("internal_friction", "layer_height_mm")
    assert worst["z"] < -5 and "would have to fall with layer_height_mm" in worst["words"]
    assert set(answer["rows"][0]) >= {
        "rig",
        "observable",
        "conditions",
        "value",
        "predicted",
        "residual",
        "z",
        "split",
    }


def test_coulomb_alone_fits_coulomb(tmp_path):
    found = compare(load(incline(tmp_path)))
    assert found.fits and found.lack_of_fit_p > 0.05
    low, high = found.intervals["internal_friction"]
    assert low < 0.5 < high and high - low < 0.02


def test_without_sd_and_replicates_fit_quality_is_unknown(tmp_path):
    found = compare(load(incline(tmp_path, repeats=1)))
    assert found.chi2 is None and found.lack_of_fit_p is None
    assert all(r.z is None for r in found.rows)
    assert any("cannot be judged" in w for w in found.warnings)


def test_contradictory_replicates_are_told(tmp_path):
    lines = ["rig,observable,value,layer_height_mm,sd"]
    lines += [f"layer_on_incline,slip_angle_deg,{26 + d},{h},0.1" for h in (10, 20, 40) for d in (-3, 0, 3)]
    found = compare(load(folder(tmp_path, lines)))
    assert any("contradict" in w for w in found.warnings)
    assert found.lack_of_fit_p > 0.5


def test_stuck_and_loose_parameters_are_named(tmp_path):
    study = incline(tmp_path, mu=0.5)
    (study / "study.toml").write_text("[parameters]\ninternal_friction = { value = 0.3, min = 0.1, max = 0.4 }\n")
    found = compare(load(study))
    assert found.at_bound == ("internal_friction",) and any("bound" in w for w in found.warnings)
    lines = ["rig,observable,value,layer_height_mm,sd"] + [f"layer_on_incline,slip_angle_deg,30,20,{s}" for s in (1, 1)]
    loose = compare(load(folder(tmp_path / "b", lines, "[effects]\ncohesion = {}\n")))
    assert set(loose.not_identified) == {"internal_friction", "cohesion.cohesive_stress_pa"}


@pytest.mark.parametrize(
    "rows, word",
    [
        (["layer_on_incline,slip_angle_deg,30,20,holdout"] * 3, "held out"),
        (["layer_on_incline,slip_angle_deg,30,20,fit"], "free parameters"),
    ],
)
def test_too_little_to_fit(tmp_path, rows, word, capsys):
    study = folder(tmp_path, ["rig,observable,value,layer_height_mm,split", *rows], "[effects]\ncohesion = {}\n")
    status, _ = command("compare", study)
    assert status == 2 and word in capsys.readouterr().err


def test_held_out_rows_are_predicted_only(tmp_path):
    lines = ["rig,observable,value,layer_height_mm,sd,split"]
    lines += [f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.5, 0):.4f},{h},0.5,fit" for h in (10, 20, 30)]
    lines += ["layer_on_incline,slip_angle_deg,40,5,0.5,holdout"]
    found = compare(load(folder(tmp_path, lines)))
    assert found.dof == 2 and found.rms_error < 1e-3
    assert found.holdout_rms_error == pytest.approx(40 - math.degrees(math.atan(0.5)), abs=1e-3)


def test_pooled_sd_finds_proportional_noise():
    rng = np.random.default_rng(3)
    means = np.geomspace(1, 100, 40)
    readings = means[:, None] * (1 + 0.05 * rng.standard_normal((40, 5)))
    sd = pooled_sd(means, readings.std(axis=1, ddof=1), np.full(40, 4.0))
    assert sd[means > 4] == pytest.approx(0.05 * means[means > 4], rel=0.15)


def test_scatter_of_few_readings_is_pooled_unless_it_truly_differs(tmp_path):
    lines = ["rig,observable,value,normal_stress_pa,sd,n"]
    for k, stress in enumerate((1000.0, 1100.0, 1200.0, 1300.0, 1400.0, 1500.0)):
        lines.append(f"shear_cell,shear_stress_pa,{0.5 * stress},{stress},{(8, 14)[k % 2]},5")
    pooled = fit_study(load(folder(tmp_path, lines))).cells
    assert pooled.sd == pytest.approx(np.sqrt((8**2 + 14**2) / 2 / 5), rel=1e-6)
    lines = [line.replace(",14,5", ",80,5") for line in lines]
    apart = fit_study(load(folder(tmp_path, lines))).cells
    assert apart.sd == pytest.approx(np.array([8, 80, 8, 80, 8, 80]) / np.sqrt(5), rel=1e-6)


def of_rigs(group: tuple[int, ...], group_dof: tuple[int, ...]) -> CellMeans:
    n = len(group)
    return CellMeans(np.arange(n), np.ones(n), np.ones(n), np.ones(n), sum(group_dof), 0.0, (), group, group_dof)


def test_a_score_is_in_errors_that_readings_and_residuals_tell_together():
    """By hand: 8 cells of two rigs, a direction in the first, nothing absorbed."""
    cells, unit, nothing = of_rigs((0,) * 4 + (1,) * 4, (16, 20)), np.eye(8)[:1], np.zeros((8, 0))
    left = np.array([[3.0, 0.5, -0.5, 0.5, 1.0, -1.0, 1.0, -1.0]])
    expected = 3.0 / np.sqrt((16 + 0.75) / (16 + 4 - 1))  # residuals of the rig without the direction: 0.75
    assert standardised(left, unit, nothing, cells, two_sided=False)[0, 0] == pytest.approx(expected)
    assert standardised(left, unit, nothing, cells, two_sided=False, birge=False)[0, 0] == pytest.approx(3.0)
    left[0, 4:] *= 4  # misfit in the other rig: chi2 less the direction's is 64.75 on 7
    expected = 3.0 / np.sqrt(64.75 / 7 / EXCESS)
    assert standardised(left, unit, nothing, cells, two_sided=False)[0, 0] == pytest.approx(expected)


def test_the_largest_score_passes_its_critical_value_as_often_as_stated():
    rng = np.random.default_rng(3)
    group, group_dof = (0,) * 12 + (1,) * 5, (48, 20)
    basis = np.linalg.qr(rng.standard_normal((17, 2)))[0]
    unit = rng.standard_normal((6, 17))
    unit -= (unit @ basis) @ basis.T
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    cells, noise = of_rigs(group, group_dof), rng.standard_normal((4000, 17))
    for g, dof in enumerate(group_dof):
        noise[:, np.array(group) == g] /= np.sqrt(rng.chisquare(dof, (4000, 1)) / dof)
    left = noise - (noise @ basis) @ basis.T
    largest = standardised(left, unit, basis, cells, two_sided=False).max(axis=1)
    null = largest_null(unit, basis, cells, two_sided=False)
    opened = np.mean([exceedance(null, z) < 0.05 for z in largest])
    assert 0.04 < opened < 0.06  # 0.05 +- 0.0034, and as much for the draws of the null


@pytest.mark.parametrize("stated, known", [(False, (56, 20, 36, 48)), (True, (160, 160, 160, 160))])
def test_an_sd_by_a_rule_is_known_as_well_as_all_the_readings_behind_it(stated, known):
    rows = trials.noisy_rows(trials.NOTHING.readings, np.random.default_rng(1), stated=stated)
    assert fit_study(twins.study(rows)).cells.group_dof == known


def holdout_of(path, lines) -> float | None:
    more = "side_wall_friction = { wall_friction = { value = 0.1, min = 0.0, max = 1.0 } }"
    study = folder(path, lines, f"[effects]\n{more}\n" if "channel_width_mm" in lines[0] else "")
    return compare(load(study)).holdout_p


def test_rows_held_out_that_contradict_the_model_are_said(tmp_path):
    """mu = tan 30 deg at 60 to 80 mm; 48 deg at 10 mm is held out. Off by 0.3 deg instead, nothing is said."""
    head = "rig,observable,value,sd,n,layer_height_mm,split"
    fitted = [f"layer_on_incline,slip_angle_deg,{v},0.5,3,{h},fit" for v, h in ((30, 60), (29.9, 70), (30.1, 80))]
    for value, contradicts in ((48, True), (30.3, False)):
        held = f"layer_on_incline,slip_angle_deg,{value},0.5,3,10,holdout"
        found = compare(load(folder(tmp_path / str(value), [head, *fitted, held])))
        assert found.fits and any("held out contradict" in w for w in found.warnings) == contradicts
        assert (found.holdout_p < 1e-6) == contradicts
        page = comparison_page(load(tmp_path / str(value)), found)
        assert ("not those held out" in " ".join(page.split())) == contradicts


def test_what_is_held_out_may_be_as_far_off_as_the_constant_is_uncertain(tmp_path):
    """p of rows held out is uniform over repeated data: constants from three rows are part of its covariance."""
    head = "rig,observable,value,sd,n,layer_height_mm,split"
    rng, small = np.random.default_rng(3), 0
    for k in range(60):
        lines = [
            f"layer_on_incline,slip_angle_deg,{30 + 0.5 * rng.standard_normal():.4f},0.5,1,{h},{split}"
            for h, split in ((60, "fit"), (70, "fit"), *((x, "holdout") for x in (20, 25, 30, 35, 40)))
        ]
        small += compare(load(folder(tmp_path / str(k), [head, *lines]))).holdout_p < 0.2
    assert 4 <= small <= 22  # 12 expected; 30 without the constant's share


def test_replicates_that_contradict_the_sd_give_chi2_and_z_their_own_scatter(tmp_path):
    head = "rig,observable,value,sd,layer_height_mm"
    pairs = ((30, 60), (33, 60), (28, 70), (31, 70), (29, 80), (34, 80))
    lines = [f"layer_on_incline,slip_angle_deg,{v},0.05,{h}" for v, h in pairs]
    found = compare(load(folder(tmp_path, [head, *lines])))
    assert any("contradict the stated sd" in w for w in found.warnings)
    assert found.chi2 < 3 * found.dof and max(abs(r.z) for r in found.rows) < 3
    assert found.lack_of_fit_p > 0.05 and found.judged


def test_as_many_parameters_as_cases_is_no_fit(tmp_path):
    head = "rig,observable,value,sd,n,layer_height_mm"
    study = load(folder(tmp_path, [head, "layer_on_incline,slip_angle_deg,30,0.5,3,60"]))
    found = compare(study)
    assert found.judged is None and "the fit says nothing" in " ".join(comparison_page(study, found).split())


def test_rows_held_out_that_the_fitted_ones_do_not_speak_of_are_not_judged(tmp_path):
    """side_wall_friction is free, but in a wide channel the fitted rows do not feel it; the row held out is in a narrow one."""
    head = "rig,observable,value,sd,n,layer_height_mm,channel_width_mm,split"
    lines = [f"layer_on_incline,slip_angle_deg,{v},0.5,3,{h},1e9,fit" for v, h in ((30, 60), (29.9, 70), (30.1, 80))]
    assert (
        holdout_of(tmp_path / "blind", [head, *lines, "layer_on_incline,slip_angle_deg,45,0.5,3,60,10,holdout"]) is None
    )


def test_rows_held_out_of_one_set_up_share_its_error(tmp_path):
    """Five rows of one set-up, all 2 deg too high where its sd is 1.5 deg: one error, not five."""
    head = "rig,observable,value,sd,n,layer_height_mm,setup,setup_sd,split"
    lines = [f"layer_on_incline,slip_angle_deg,{v},0.3,50,{h},,0,fit" for v, h in ((30, 60), (29.98, 70), (30.02, 80))]
    shared, apart = (
        holdout_of(
            tmp_path / name,
            [
                head,
                *lines,
                *(
                    f"layer_on_incline,slip_angle_deg,32,0.3,50,{20 + k},{name}{k if name == 'own' else ''},1.5,holdout"
                    for k in range(5)
                ),
            ],
        )
        for name in ("one", "own")
    )
    assert shared > 0.5 and apart < 0.2
