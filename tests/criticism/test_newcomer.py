"""What a newcomer's mistakes in a folder are answered: another unit, a missing column, one wrong row, rows changed since."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from pellet_study.criticism import figures, verdict_facts
from tests.criticism.test_words import HEAD, asked, layer, page_of
from tests.helpers.make_study import HEIGHTS_MM, command, folder, slip_angle_deg

BALL = """
RIG = {
    "name": "drop",
    "parameters": {"restitution": {"default": 0.8, "min": 0.1, "max": 1.0, "physical": (0.4, 0.98), "unit": "1", "meaning": "e"}},
    "conditions": {
        "drop_height_mm": {"default": 300.0, "min": 10.0, "max": 3000.0, "unit": "mm", "meaning": "h"},
        "ball_mass_g": {"default": 10.0, "min": 0.5, "max": 100.0, "unit": "g", "meaning": "m"},
        "ball_diameter_mm": {"default": 40.0, "min": 5.0, "max": 250.0, "unit": "mm", "meaning": "d"},
    },
    "observables": {"rebound_mm": {"unit": "mm", "meaning": "rise"}},
}


def predict(parameters, conditions, effects):
    height = conditions["drop_height_mm"]
    return {"rebound_mm": parameters["restitution"] ** 2 * height * (1 - 0.0002 * height / conditions["ball_mass_g"])}
"""
DROPS = (100, 200, 400, 800, 1500, 2500)


def rises(seed=1, e=0.8, mass=10.0):
    rng = np.random.default_rng(seed)
    return {h: e**2 * h * (1 - 0.0002 * h / mass) * (1 + 0.01 * rng.standard_normal()) for h in DROPS}


def ball(path: Path, cells, head="sd,drop_height_mm", rig=BALL, low=0.5) -> Path:
    """A ball dropped from six heights; `cells` are those of a height and its reading, after the observable."""
    lines = [f"rig,observable,value,{head}"]
    lines += [f"drop,rebound_mm,{cells(h, v)}" for h, v in rises().items()]
    study = folder(path, lines)
    (study / "study.toml").write_text(f"[parameters]\nrestitution = {{ value = 0.8, min = {low}, max = 0.98 }}\n")
    (study / "rigs").mkdir(exist_ok=True)
    (study / "rigs" / "drop.py").write_text(rig)
    return study


@pytest.mark.parametrize(
    "times, words",
    [
        (1.0, []),
        (
            100.0,
            [
                r"drop: sd is 1 of the reading \(median of 6 rows\): is sd in another unit",
                r"closer to the model than their sd says",
            ],
        ),
        (10.0, [r"times closer to the model than their sd says; is sd too large"]),
        (0.01, [r"farther from the model than their sd says; .*is sd too small"]),
        (0.001, [r"sd is 1e-05 of the reading", r"or in m where mm is declared"]),
    ],
)
def test_a_standard_deviation_in_another_unit_is_hinted_at(tmp_path, capsys, times, words):
    study = ball(tmp_path / "s", lambda h, v: f"{v:.3f},{0.01 * v * times:.6f},{h}")
    page, answer = asked("compare", study, capsys)
    hints = " ".join(w for w in answer["warnings"] if "sd" in w.split())
    assert all(re.search(word, hints) for word in words) and bool(hints) == bool(words), hints
    assert all(" ".join(w.split()) in page for w in answer["warnings"])


def test_an_sd_of_one_row_in_another_unit_is_named_with_its_line(tmp_path, capsys):
    study = ball(tmp_path / "s", lambda h, v: f"{v:.3f},{0.01 * v * (100 if h == 400 else 1):.4f},{h}")
    said = asked("check", study, capsys)[1]["warnings"]
    assert len(said) == 1 and re.search(
        r"line 4: sd 2\d+\.\d+ is [\d.]+ times that of the other rows: is it in another unit", said[0]
    )


@pytest.mark.parametrize("times, name", [(0.1, "cm"), (0.001, "m")])
def test_readings_in_another_unit_are_hinted_at(tmp_path, capsys, times, name):
    study = ball(tmp_path / "s", lambda h, v: f"{v * times:.6f},{0.01 * v * times:.7f},{h}")
    answer = asked("diagnose", study, capsys)[1]
    said = f"rebound_mm and their sd given in {name} instead of mm is the likely cause"
    assert any(said in w for w in answer["warnings"]), answer["warnings"]


def test_a_fitted_constant_beyond_its_usual_range_is_warned_of(tmp_path, capsys):
    """Readings in cm are met by a restitution of 0.25, which the study allows and no ball has."""
    study = ball(tmp_path / "s", lambda h, v: f"{v / 10:.4f},{0.001 * v:.5f},{h}", low=0.1)
    answer = asked("compare", study, capsys)[1]
    assert any("fitted: restitution 0.2" in w and "lies beyond the usual 0.4 to 0.98" in w for w in answer["warnings"])


def test_one_reading_in_another_unit_or_mistyped_is_named_with_its_line_and_left_out(tmp_path, capsys):
    """The advice is followed: without the row the model fits, as was said."""
    for wrong, unit in ((0.1, "cm would be"), (1.3, "")):
        study = ball(
            tmp_path / f"s{wrong}", lambda h, v, w=wrong: f"{v * (w if h == 800 else 1):.3f},{0.01 * v:.4f},{h}"
        )
        for name in ("compare", "diagnose"):
            page, answer = asked(name, study, capsys)
            lone = answer["lone_row"]
            assert lone["line"] == 5 and lone["predicted"] == pytest.approx(rises()[800], rel=0.05)
            assert (unit in lone["unit"]) and "it is line 5 alone: without it the model fits" in page
            assert "check that row, or give it the split leave_out with a reason" in page
        assert "it is line 5 alone" in page_of(study, capsys).lower()
        file = study / "measurements.csv"
        lines = file.read_text().splitlines()
        lines = [
            f"{lines[0]},split,reason",
            *(f"{one},{'leave_out,typed wrong' if k == 3 else ','}" for k, one in enumerate(lines[1:])),
        ]
        file.write_text("\n".join(lines) + "\n")
        answer = asked("compare", study, capsys)[1]
        assert answer["fit"]["grade"] == "fits" and answer["lone_row"] is None


def test_a_condition_left_out_is_linked_with_the_replicates_that_disagree(tmp_path, capsys):
    """Two masses; without their column the same heights rebound differently."""
    lines = ["rig,observable,value,sd,drop_height_mm"]
    for mass in (2.7, 40.0):
        lines += [f"drop,rebound_mm,{v:.3f},{0.005 * v:.4f},{h}" for h, v in rises(int(mass), mass=mass).items()]
    study = ball(tmp_path / "s", lambda h, v: "")
    (study / "measurements.csv").write_text("\n".join(lines) + "\n")
    page, answer = asked("diagnose", study, capsys)
    times = answer["replicates_over_sd"]["drop"]["rebound_mm"]
    assert times > 3
    first = page[: page.index("FIT")]
    assert "assumed: drop: ball_mass_g 10" in first
    assert (
        f"equal rows of drop differ {times:.2g} times as much as their sd says: was one of these conditions changed"
        in first
    )
    assert f"of which equal rows of drop differ {times:.2g} times" in page[page.index("ANSWER") :]
    given = [f"{lines[0]},ball_mass_g", *(f"{one},{2.7 if k < 6 else 40}" for k, one in enumerate(lines[1:]))]
    (study / "measurements.csv").write_text("\n".join(given) + "\n")
    page, answer = asked("diagnose", study, capsys)
    assert answer["replicates_over_sd"] == {} and "equal rows" not in page


def cohesive(path: Path, seed=1, heights=HEIGHTS_MM) -> Path:
    rng = np.random.default_rng(seed)
    return folder(path, [HEAD, *(layer(h, slip_angle_deg(h, 0.5, 40) + 0.2 * rng.standard_normal()) for h in heights)])


@pytest.mark.parametrize("changed", ["row", "rig"])
def test_a_history_begins_anew_when_rows_or_the_rig_change(tmp_path, capsys, changed):
    study = ball(tmp_path / "s", lambda h, v: f"{v:.3f},{0.01 * v:.4f},{h}")
    asked("refine", study, capsys)
    before = json.loads((study / "history.json").read_text())["steps"]
    asked("refine", study, capsys)
    assert json.loads((study / "history.json").read_text())["steps"] == before
    if changed == "row":
        text = (study / "measurements.csv").read_text()
        (study / "measurements.csv").write_text(text.replace("drop,rebound_mm,", "drop,rebound_mm,1", 1))
    else:
        for file in (study / "rigs" / "drop.py", study / "measurements.csv"):
            file.write_text(file.read_text().replace("drop_height_mm", "setting_mm"))
    report = page_of(study, capsys)
    assert (
        "is of other rows of measurements.csv, or of another rig, and is not shown: run `pellet-study refine" in report
    )
    assert command("history", study)[0] == 0 and "are of other rows, or of another rig" in capsys.readouterr().err
    status, answer = command("refine", study, json_file=tmp_path / "a.json")
    said = capsys.readouterr().err
    assert status == 0 and "a new one begins" in said and "history_before.json" in said
    assert json.loads((study / "history_before.json").read_text())["steps"] == before
    assert len(json.loads((study / "history.json").read_text())["steps"]) == len(answer["steps"])
    assert "is not shown" not in page_of(study, capsys)


def test_a_comment_in_a_rig_begins_no_new_history(tmp_path, capsys):
    study = ball(tmp_path / "s", lambda h, v: f"{v:.3f},{0.01 * v:.4f},{h}")
    first = asked("refine", study, capsys)[1]["basis"]
    (study / "rigs" / "drop.py").write_text(f"# a word\n{BALL}")
    assert asked("refine", study, capsys)[1]["basis"] == first and not (study / "history_before.json").exists()


def test_no_size_is_said_to_be_noticed_where_the_model_fails_or_a_larger_one_is_fitted(tmp_path, capsys):
    page, answer = asked("diagnose", cohesive(tmp_path / "fails"), capsys)
    assert answer["fit"]["grade"] == "does not fit" and "it would be noticed" not in page
    rng = np.random.default_rng(5)
    calm = folder(tmp_path / "calm", [HEAD, *(layer(h, 26.6 + 0.2 * rng.standard_normal()) for h in HEIGHTS_MM)])
    page, answer = asked("diagnose", calm, capsys)
    said = dict(
        re.findall(r"(\w+) = ([-\d.e+]+) \(physical [^)]*\)[^)]*?from ([-\d.e+]+) on it would be noticed", page) and []
    )
    for suspect in answer["ranking"]:
        larger = (
            suspect["smallest_visible"] is not None
            and abs(next(iter(suspect["value"].values()))) >= suspect["smallest_visible"]
        )
        if larger:
            assert f"from {suspect['smallest_visible']:.3g} on it" not in page
    assert "on it would be noticed" in page and said == {}


def test_the_worst_row_is_named_by_a_limit_that_grows_with_the_number_of_rows(tmp_path, capsys):
    """Bonferroni: t of p 0.05/(2 n); 200 rows hold one beyond 3 standard errors in four of ten good data sets."""
    rng = np.random.default_rng(6)
    limits = {}
    for n in (6, 200):
        z = rng.standard_normal(n)
        z[0] = 3.2
        lines = ["rig,observable,value,sd,normal_stress_pa"]
        stresses = np.linspace(2000, 4000, n)
        lines += [
            f"shear_cell,shear_stress_pa,{0.5 * s + 20 * x:.3f},20,{s:.2f}" for s, x in zip(stresses, z, strict=True)
        ]
        page, answer = asked("compare", folder(tmp_path / str(n), lines), capsys)
        limits[n] = answer["far_off_limit"]
        worst = max(abs(row["z"]) for row in answer["rows"])
        assert ("the worst row is line" in page) == (worst > limits[n])
        rule = f"the worst of {n} rows is beyond {limits[n]:.1f} in 5 of 100 data sets"
        assert (rule in page) == (worst > limits[n] or "no row is far off" in page)
    assert limits[6] == pytest.approx(2.64, abs=0.02) and limits[200] == pytest.approx(3.67, abs=0.03)


def test_a_bystander_of_a_drift_is_not_named_as_another(tmp_path, capsys):
    """Cohesion by height; the density was changed along with it, more or less."""
    rng = np.random.default_rng(2)
    lines = ["rig,observable,value,sd,layer_height_mm,particle_diameter_mm"]
    grains = {8: 0.5, 12: 0.9, 18: 0.8, 27: 1.4, 40: 1.3, 60: 2.0}
    for h in HEIGHTS_MM:
        for d in (1.0, 1.25):
            angle = slip_angle_deg(h, 0.5, 40) + 0.3 * rng.standard_normal()
            lines.append(f"layer_on_incline,slip_angle_deg,{angle:.3f},0.3,{h},{grains[int(h)] * d}")
    page, answer = asked("compare", folder(tmp_path / "s", lines), capsys)
    found = {drift["condition"]: drift for drift in answer["where"] if drift["shape"] == "rises"}
    assert found["layer_height_mm"]["alone"] and not found["particle_diameter_mm"]["alone"]
    assert found["particle_diameter_mm"]["p"] < 0.05  # it would be named by its own p
    where = page[page.index("WHERE") : page.index("constant value")]
    assert "would have to fall with layer_height_mm" in where and "fall with particle_diameter_mm" not in where
    same = [one.rsplit(",", 1)[0] + f",{float(one.split(',')[4]) / 20}" for one in lines[1:]]
    page, answer = asked("compare", folder(tmp_path / "t", [lines[0], *same]), capsys)
    where = page[page.index("WHERE") : page.index("constant value")]
    assert (
        "fall with layer_height_mm (layer_on_incline) (or with particle_diameter_mm, changed along with it)" in where
        or (
            "fall with particle_diameter_mm (layer_on_incline) (or with layer_height_mm, changed along with it)"
            in where
        )
    )


def test_without_sd_no_grade_is_given_even_where_a_constant_drifts(tmp_path, capsys):
    lines = ["rig,observable,value,layer_height_mm", *(
        f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.5, 40):.3f},{h}" for h in np.geomspace(8, 60, 12)
    )]  # fmt: skip
    study = folder(tmp_path / "s", lines)
    page, answer = asked("compare", study, capsys)
    assert answer["chi2"] is None and answer["fits"] is None and answer["fit"]["grade"] is None
    assert (
        "does not fit:" not in page and "cannot be judged" in page and "would have to fall with layer_height_mm" in page
    )
    assert "next: pellet-study diagnose" in page and "does not fit:" not in page_of(study, capsys)


def test_units_belong_to_the_rig_and_not_to_a_name(tmp_path, capsys):
    """Two rigs call what they read `time`, in seconds and in minutes."""
    study = folder(tmp_path / "s", ["rig,observable,value,sd,length_m", *(
        f"{rig},time,{value},0.1,{x}" for rig, k in (("fast", 1), ("slow", 2)) for x, value in ((1, k), (2, 2 * k), (4, 4 * k))
    )])  # fmt: skip
    (study / "study.toml").write_text("[parameters]\npace = { value = 1.0, min = 0.1, max = 5.0 }\n")
    (study / "rigs").mkdir()
    for rig, unit, k in (("fast", "s", 1), ("slow", "min", 2)):
        (study / "rigs" / f"{rig}.py").write_text(
            f'RIG = {{"name": "{rig}", "parameters": {{"pace": {{"default": 1.0, "min": 0.1, "max": 5.0, "unit": "s/m", "meaning": "p"}}}},\n'
            '"conditions": {"length_m": {"default": 1.0, "min": 0.1, "max": 10.0, "unit": "m", "meaning": "l"}},\n'
            f'"observables": {{"time": {{"unit": "{unit}", "meaning": "t"}}}}}}\n\n\n'
            f'def predict(parameters, conditions, effects):\n    return {{"time": {k} * parameters["pace"] * conditions["length_m"]}}\n'
        )
    page, answer = asked("compare", study, capsys)
    assert {row["rig"]: row["units"]["time"] for row in answer["rows"]} == {"fast": "s", "slow": "min"}
    assert {p["rig"]: p["units"]["time"] for c in answer["curves"] for p in c["panels"]} == {"fast": "s", "slow": "min"}
    assert answer["rms_error_unit"] == "standard uncertainties"
    text = page_of(study, capsys)
    assert "time (min)" in text and "time (s)" in text


def test_columns_never_run_together(tmp_path, capsys):
    name = "restitution_of_a_ball_on_a_plate_of_polished_granite"
    rig = BALL.replace('"restitution"', f'"{name}"').replace('"name": "drop"', '"name": "ball_dropped_on_a_plate"')
    study = ball(tmp_path / "s", lambda h, v: f"{v:.3f},{0.01 * v:.4f},{h}", rig=rig)
    for file in ("study.toml", "measurements.csv"):
        text = (
            (study / file)
            .read_text()
            .replace("restitution =", f"{name} =")
            .replace("drop,", "ball_dropped_on_a_plate,")
        )
        (study / file).write_text(text)
    capsys.readouterr()
    for command_name in ("check", "compare"):
        assert command(command_name, study)[0] == 0
        out = capsys.readouterr().out
        assert re.search(rf"^{name}  +0\.", out, re.MULTILINE)
    assert re.search(r"^ball_dropped_on_a_plate +\d", out, re.MULTILINE)


def pair_told(**more) -> dict:
    suspect = {"effect": "a", "note": "", "explains": False}
    told = {"verdict": "tied", "missing": [], "tied": [["a", "b"], ["a", "c"]], "effects": [], "ranking": [suspect]}
    rivals = [{"effects": ["a", "b"], "holdout_contradicts": True, "holdout_p": 1e-6},
              {"effects": ["a", "c"], "holdout_contradicts": False, "holdout_p": 0.4}]  # fmt: skip
    held = {
        "holdout_contradicts": True,
        "holdout_p": 1e-5,
        "holdout_limit_p": 0.001,
        "fitted_too": None,
        "rivals": rivals,
    }
    return {**told, **held, **more}


def test_tied_pairs_and_what_the_rows_held_out_say_of_them():
    told = pair_told()
    words = verdict_facts.verdict(told)
    assert words.startswith(
        "a + b or a + c each explain it; these data cannot tell them apart; the rows held out contradict"
    )
    assert "they contradict it too with a + b" in words and "they agree with it with a + c" in words
    assert verdict_facts.fit_too(told) == "set split to fit in some of the rows held out"
    assert verdict_facts.standing(told, told["ranking"][0]) == verdict_facts.PAIRED
    agreeing = pair_told(rivals=[{**r, "holdout_contradicts": False} for r in told["rivals"]])
    assert verdict_facts.fit_too(agreeing) == ""


def test_text_and_report_say_a_verdict_in_the_same_words(tmp_path, capsys):
    for study in (cohesive(tmp_path / "one"), cohesive(tmp_path / "two", heights=(40, 50, 60))):
        page, answer = asked("diagnose", study, capsys)
        words = verdict_facts.verdict(answer)
        report = page_of(study, capsys)
        assert words in page and f"{answer['verdict'].capitalize()}: {words} (model base)" in report
        assert all(" ".join(line.split()) in page for line in verdict_facts.beside(answer))


def test_refine_says_too_whether_scatter_of_the_set_up_was_tried(tmp_path, capsys):
    answer = asked("refine", cohesive(tmp_path / "s"), capsys)[1]
    assert answer["undone_tested"] == answer["diagnoses"][-1]["undone_tested"]


def test_a_set_up_is_shared_by_fitted_and_held_out_rows_of_one_rig_alike(tmp_path):
    """Rows of two rigs whose set-ups have one name do not share its error: chi2 is that of separate set-ups."""
    found = []
    for name in ("day", "other"):
        lines = ["rig,observable,value,sd,setup,setup_sd,normal_stress_pa,layer_height_mm"]
        lines += [f"shear_cell,shear_stress_pa,{0.5 * s + 30},20,day,20,{s}," for s in (1000, 2000)]
        lines += [f"layer_on_incline,slip_angle_deg,{26 + k},0.5,{name},0.5,,{h}" for k, h in enumerate((20, 40))]
        found.append(command("compare", folder(tmp_path / name, lines), json_file=tmp_path / f"{name}.json")[1]["chi2"])
    assert found[0] == pytest.approx(found[1]) and math.isfinite(found[0])


def test_readings_of_crossed_conditions_stand_in_a_panel_a_setting(tmp_path, capsys):
    """Six heights by six densities: six panels; three conditions crossed: one, each model's value beside its reading."""
    lines = ["rig,observable,value,sd,layer_height_mm,bulk_density_kg_m3,channel_width_mm"]
    lines += [
        f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.5, 30, d):.3f},0.4,{h},{d},{w}"
        for h in HEIGHTS_MM for d in (800, 1000, 1200, 1400, 1600, 1800) for w in (50, 100)
    ]  # fmt: skip
    crossed = folder(tmp_path / "s", [one for one in lines if not one.endswith(",50")])
    answer = asked("compare", crossed, capsys)[1]
    panels = answer["curves"][0]["panels"]
    assert [len(panel["rows"]) for panel in panels] == [6] * 6 and {panel["drawn"] for panel in panels} == {"curve"}
    answer = asked("compare", folder(tmp_path / "t", lines), capsys)[1]
    (axes,) = figures.readings(answer["rows"], answer["curves"]).axes
    model, *_ = [line for line in axes.lines if line.get_marker() == "_" and len(line.get_xdata()) == 72]
    assert len(set(model.get_xdata())) == 72  # each beside its own reading
