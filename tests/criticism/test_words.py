"""Words that agree with the numbers: what the commands print and answer for small studies of known truth."""

import html
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from pellet_study.criticism import facts, fit_facts
from pellet_study.criticism.compare import HELD_OUT_FAILS
from tests.helpers.make_study import STRESSES_PA, command, folder, incline, slip_angle_deg

HEAD = "rig,observable,value,sd,n,layer_height_mm,split"


def asked(name: str, study: Path, capsys) -> tuple[str, dict]:
    """What a command prints, folded lines as one, and its JSON."""
    capsys.readouterr()
    status, answer = command(name, study, json_file=study.parent / f"{study.name}_{name}.json")
    assert status == 0
    return " ".join(capsys.readouterr().out.split()), answer


def page_of(study: Path, capsys) -> str:
    """The report as text, without its tags."""
    text = Path(asked("report", study, capsys)[1]["path"]).read_text(encoding="utf-8")
    return " ".join(html.unescape(re.sub("<[^>]*>", " ", text)).split())


def layer(height: float, value: float, split: str = "fit", sd: float = 0.5, n: int = 5) -> str:
    return f"layer_on_incline,slip_angle_deg,{value:.4f},{sd},{n},{height},{split}"


def shear(path: Path, residuals, sd: float = 20.0, stresses=STRESSES_PA) -> Path:
    """tau = 0.5 sigma plus given residuals in units of a stated sd, each row a reading."""
    lines = ["rig,observable,value,sd,normal_stress_pa"]
    lines += [
        f"shear_cell,shear_stress_pa,{float(0.5 * s + sd * r)!r},{sd},{float(s)!r}"
        for s, r in zip(stresses, residuals, strict=True)
    ]
    return folder(path, lines)


def extrapolated(path: Path, c: float = 40.0, seed: int = 4) -> Path:
    """Cohesion of c, fitted where it hardly shows (70 to 80 mm), held out where it does (6 and 10 mm)."""
    rng = np.random.default_rng(seed)
    rows = [(h, "fit") for h in (70, 75, 80)] + [(h, "holdout") for h in (6, 10)]
    lines = [layer(h, slip_angle_deg(h, 0.55, c) + 0.15 * rng.standard_normal(), split) for h, split in rows]
    return folder(path, [HEAD, *lines])


@pytest.mark.parametrize("size, grade", [(0.4, "fits"), (1.5, "doubtful"), (4.0, "does not fit")])
def test_a_fit_is_graded_alike_in_text_report_and_json(tmp_path, capsys, size, grade):
    """Residuals that no slope and no drift takes up: p of their chi2 against F(n-1, many) puts them above 5 %, between, below."""
    stresses = np.linspace(1000, 1100, 8)
    study = shear(tmp_path / "study", size * np.array([1, -1, -1, 1, 1, -1, -1, 1]), stresses=stresses)
    page, answer = asked("compare", study, capsys)
    assert answer["lack_of_fit_p"] == pytest.approx(stats.f.sf(8 * size**2 / 7, 7, 1000), rel=0.02)
    fit = answer["fit"]
    assert fit["grade"] == grade and answer["fits"] is (grade != "does not fit")
    words = {"fits": "the model fits", "doubtful": "the fit is doubtful", "does not fit": "the model does not fit"}[
        grade
    ]
    p = "p < 0.001" if fit["p"] < 0.001 else f"p {fit['p']:.3f}"
    report = page_of(study, capsys)
    for text in (page, report, asked("diagnose", study, capsys)[0]):
        least = grade == "fits"
        assert f"{words}: {'of its tests the least p is that of ' * least}{fit['by']}{',' * least} {p}" in " ".join(
            text.split()
        )
        assert (
            "does not fit where lack of fit has p < 0.001" in text
            and "doubtful where one of these has p < 0.05" in text
        )
        assert "within the scatter" not in text
    assert (f"next: pellet-study {'report' if grade == 'fits' else 'diagnose'}") in page


def test_a_drift_counts_too(tmp_path, capsys):
    """A tilt of five standard errors spread over many rows: chi2 alone lets it pass."""
    stresses = np.geomspace(500, 8000, 24)
    wave = np.array([1, -1] * 12) * 0.7
    tilt = np.linspace(1.8, -1.8, 24)
    lines = ["rig,observable,value,sd,normal_stress_pa"]
    lines += [
        f"shear_cell,shear_stress_pa,{float(0.5 * s * (1 + 0.03 * (w + t)))!r},{float(0.015 * s)!r},{float(s)!r}"
        for s, w, t in zip(stresses, wave, tilt, strict=True)
    ]
    page, answer = asked("compare", folder(tmp_path, lines), capsys)
    assert answer["lack_of_fit_p"] > 0.002 and answer["fit"]["grade"] == "does not fit"
    assert "drift of internal_friction with normal_stress_pa p < 0.001 (lack of fit p 0." in page


def test_held_out_rows_that_contradict_are_in_the_answer_the_first_box_and_what_comes_next(tmp_path, capsys):
    study = extrapolated(tmp_path / "study")
    _, compared = asked("compare", study, capsys)
    page, answer = asked("diagnose", study, capsys)
    assert answer["verdict"] == "adequate"
    for told in (compared, answer):
        assert told["holdout_contradicts"] is True and told["holdout_p"] < told["holdout_limit_p"] == HELD_OUT_FAILS
    sentence = page[page.index("ANSWER") : page.index("results:")]
    assert "the rows held out contradict the model (p < 0.001; the limit is 0.001)" in sentence
    too = answer["fitted_too"]
    assert too["effects"] == ["cohesion"] and too["verdict"] == "missing"
    height = too["conditions"][0]["layer_height_mm"]
    assert len(too["conditions"]) == 1 and height in (6, 10)
    assert (
        f"with the rows of layer_on_incline at layer_height_mm {height:g} fitted too, cohesion would be named"
        in sentence
    )
    assert (
        f"next: set split to fit in the rows of layer_on_incline at layer_height_mm {height:g}, then pellet-study"
        in page
    )
    box = page_of(study, capsys).split("In short.")[1].split("1 What was measured")[0]
    assert "rows held out contradict" in box and "cohesion would be named" in box
    file = study / "measurements.csv"  # the advice, followed
    lines = [re.sub(f",{height:g},holdout$", f",{height:g},fit", line) for line in file.read_text().splitlines()]
    file.write_text("\n".join(lines) + "\n")
    assert asked("diagnose", study, capsys)[1]["missing"] == ["cohesion"]


def test_held_out_rows_that_agree_contradict_nothing(tmp_path, capsys):
    study = extrapolated(tmp_path / "study", c=0.0)
    page, answer = asked("refine", study, capsys)
    assert answer["holdout_contradicts"] is False and answer["fitted_too"] is None
    assert (
        "contradict the model (" not in page.replace("they contradict it below", "") and "then pellet-study" not in page
    )
    assert "they agree with the model (they contradict it below 0.001)" in asked("compare", study, capsys)[0]


@pytest.mark.parametrize(
    ("p", "fits", "words"),
    [
        (2e-7, True, "they contradict the model"),
        (0.003, True, "they cast doubt on the model"),
        (0.3, True, "they agree with the model"),
        (0.3, False, "they do not contradict the model"),
    ],
)
def test_rows_held_out_are_graded_as_the_fit_is(p, fits, words):
    """Between 0.001 and 0.05 nothing is sure; and with a model that misses the rows fitted nothing agrees."""
    assert words in fit_facts.held_out_words({"holdout_p": p, "fits": fits})


def test_z_of_a_row_held_out_has_the_uncertainty_of_the_constant_in_it(tmp_path):
    """One constant, a straight line: var(mu) = 1 / sum (x/s)^2, so z = e / sqrt(s^2 + x^2 var(mu)) where the fit has no misfit."""
    lines = ["rig,observable,value,sd,normal_stress_pa,split"]
    lines += [f"shear_cell,shear_stress_pa,{0.5 * s},20,{s},fit" for s in (100, 200, 300)]
    lines += ["shear_cell,shear_stress_pa,4300,20,8000,holdout"]
    status, answer = command("compare", folder(tmp_path / "study", lines), json_file=tmp_path / "a.json")
    variance = 1 / sum((x / 20) ** 2 for x in (100, 200, 300))
    held = answer["rows"][-1]
    assert status == 0 and held["uncertainty"] == pytest.approx(20)
    assert held["z"] == pytest.approx(300 / math.sqrt(20**2 + 8000**2 * variance), rel=1e-3)
    assert answer["holdout_rms_error"] == pytest.approx(300, rel=1e-3) and not answer["holdout_contradicts"]


def one_row_off(path: Path) -> Path:
    """Constant friction, and the middle height 4 deg too high: no effect of the catalogue does that."""
    angles = {h: 26.57 + (4.0 if h == 18 else 0.0) for h in (8, 12, 18, 27, 40, 60)}
    lines = [layer(h, a + d, sd=0.5, n=1) for h, a in angles.items() for d in (-0.3, 0.0, 0.3)]
    return folder(path, [HEAD, *lines])


def test_unexplained_names_the_nearest_miss_and_the_worst_row(tmp_path, capsys):
    study = one_row_off(tmp_path / "study")
    page, answer = asked("diagnose", study, capsys)
    assert answer["verdict"] == "unexplained" and answer["rivals"] == []
    miss = answer["nearest_miss"]
    fitted = [answer["present"]["chi2"] - s["chi2_drop"] for s in answer["ranking"]]
    assert miss["chi2"] <= min(fitted) + 1e-6 and miss["refused"]
    assert miss["worst_row"]["conditions"]["layer_height_mm"] == 18 and abs(miss["worst_row"]["z"]) > 3
    before = answer["present"]["chi2"]
    assert (
        f"nearest: {' + '.join(miss['effects'])} takes chi2 from {before:.3g} to {miss['chi2']:.3g}, but is refused:"
        in page
    )
    assert miss["refused"] in page and re.search(
        r"with it the worst row is line \d+, layer_on_incline at layer_height_mm 18", page
    )
    assert miss["refused"] in page_of(study, capsys)


def test_where_it_fails_never_stops_at_no_drift_while_a_row_is_far_off(tmp_path, capsys):
    study = one_row_off(tmp_path / "study")
    page, answer = asked("compare", study, capsys)
    worst = max(answer["rows"], key=lambda row: abs(row["z"]))
    where = page[page.index("WHERE") : page.index("constant value")]
    assert abs(worst["z"]) > 5 and "no calibrated constant drifts" not in where
    assert f"layer_height_mm {worst['conditions']['layer_height_mm']:g}" in where
    assert f"{abs(worst['z']):.1f} standard errors off" in where
    assert f"{abs(worst['z']):.1f} standard errors off" in page_of(study, capsys)
    calm = asked("compare", incline(tmp_path / "calm", seed=5), capsys)[0]
    assert "no row is far off: the worst is" in calm and "the worst of 18 rows is beyond" in calm


def test_a_tie_shows_what_each_candidate_does_to_the_error(tmp_path, capsys):
    """The numbers are those of the model with each of them added."""
    rng = np.random.default_rng(3)
    rows = [(h, "fit") for h in (12, 18, 27, 40, 60)] + [(8, "holdout")]
    lines = [
        layer(h, slip_angle_deg(h, 0.5, 12) + 0.5 * rng.standard_normal(), split, n=1)
        for h, split in rows
        for _ in "123"
    ]
    study = folder(tmp_path / "study", [HEAD, *lines])
    page, answer = asked("diagnose", study, capsys)
    assert answer["verdict"] == "tied" and len(answer["rivals"]) == len(answer["tied"]) >= 2
    report = page_of(study, capsys)
    for rival in answer["rivals"]:
        (name,) = rival["effects"]
        assert name in answer["tied"]
        copy = folder(tmp_path / name, [HEAD, *lines])
        status, added = command("add", copy, name, json_file=tmp_path / "added.json")
        assert status == 0
        for key in ("chi2", "rms_error", "holdout_rms_error"):
            assert rival[key] == pytest.approx(added[key], rel=0.03)
        for text in (page, report):
            assert f"{name} {rival['chi2']:.4g} " in text and f"{rival['holdout_rms_error']:.3g}" in text
    present = answer["present"]
    assert f"nothing {present['chi2']:.4g} {present['rms_error']:.3g} {present['holdout_rms_error']:.3g}" in page


def test_every_column_that_the_fit_uses_is_shown(tmp_path, capsys):
    head = "rig,observable,value,sd,n,layer_height_mm,setup,setup_sd,internal_friction"
    lines = [
        f"layer_on_incline,slip_angle_deg,{27 + 0.1 * k},0.5,3,{h},day {k % 2},{0.35 if k else 0.2},{0.51 if k == 3 else ''}"
        for k, h in enumerate((8, 12, 18, 27, 40, 60))
    ]
    study = folder(tmp_path / "study", [head, *lines])
    page, answer = asked("compare", study, capsys)
    assert "layer_height_mm 12, sd 0.5, n 3, setup day 1, setup_sd 0.35" in page and "internal_friction 0.51" in page
    assert answer["rows"][0]["setup_sd"] == 0.2 and answer["rows"][0]["sd"] == 0.5 and answer["rows"][0]["n"] == 3
    report = page_of(study, capsys)
    assert "setup setup_sd" in report and "0.35" in report and "day 1" in report
    same = folder(tmp_path / "same", ["rig,observable,value,sd,setup_sd,layer_height_mm"] + [
        f"layer_on_incline,slip_angle_deg,27,0.5,0.35,{h}" for h in (8, 12, 18)
    ])  # fmt: skip
    assert "in every row: sd 0.5, setup_sd 0.35" in asked("compare", same, capsys)[0]
    assert "setup_sd" in page_of(same, capsys)


def test_not_identified_says_by_which_rule_in_which_range(tmp_path, capsys):
    lines = ["rig,observable,value,sd,normal_stress_pa"]
    lines += [f"shear_cell,shear_stress_pa,{0.5 * s},60,{s}" for s in (100, 200, 300)]
    study = folder(tmp_path / "study", lines)
    (study / "study.toml").write_text("[parameters]\ninternal_friction = { value = 0.5, min = 0.2, max = 1.2 }\n")
    page, answer = asked("compare", study, capsys)
    se = 60 / math.sqrt(100**2 + 200**2 + 300**2)
    share = 2 * 1.96 * se / (1.2 - 0.2)
    assert answer["not_identified"] == ["internal_friction"]
    assert answer["range_shares"]["internal_friction"] == pytest.approx(share, rel=0.01)
    assert answer["ranges"]["internal_friction"] == [0.2, 1.2] and answer["intervals"]["internal_friction"][0] > 0
    words = f"takes {100 * share:.0f} % of its range 0.2 to 1.2; a constant is identified where it takes less than 50 %"
    assert words in page and words in page_of(study, capsys)


def scattered(path: Path, seed: int, setup: float, c: float = 0.0, declared: float = 0.0) -> Path:
    """Means of 5 readings of a layer at six heights, each with an error of setting up in standard errors of the mean."""
    rng, se = np.random.default_rng(seed), 0.5 / math.sqrt(5)
    lines = [f"{HEAD},setup_sd"]
    for h in (8, 12, 18, 27, 40, 60):
        value = slip_angle_deg(h, 0.5, c) + se * math.hypot(1, setup) * rng.standard_normal()
        lines.append(f"{layer(h, value)},{declared!r}")
    return folder(path, lines)


def test_set_up_scatter_that_would_undo_a_verdict_is_said_and_does_undo_it(tmp_path, capsys):
    """Where nothing is hidden but set-ups scatter by one standard error, what is named carries the warning."""
    named, warned = [], []
    for seed in range(60):
        answer = asked("diagnose", scattered(tmp_path / str(seed), seed, 1.0), capsys)[1]
        if answer["verdict"] in ("missing", "tied", "unexplained"):
            named.append(seed)
            warned += [seed] if answer["undone"] else []
    assert len(named) >= 2 and len(warned) >= 0.7 * len(named)
    page, answer = asked("diagnose", tmp_path / str(warned[0]), capsys)
    undone, se = answer["undone"], 0.5 / math.sqrt(5)
    size = undone["by_rig"]["layer_on_incline"]["slip_angle_deg"]
    assert (
        0 < undone["standard_errors"] <= 1
        and undone["standard_errors"] * se <= size < 1.01 * undone["standard_errors"] * se
    )
    assert "set-up scatter that replicates do not see" in page and "would undo this" in page
    declared = asked("diagnose", scattered(tmp_path / "declared", warned[0], 1.0, declared=size), capsys)[1]
    assert declared["verdict"] == undone["verdict"] != answer["verdict"]
    less = asked("diagnose", scattered(tmp_path / "less", warned[0], 1.0, declared=size - se / 8), capsys)[1]
    assert less["verdict"] == answer["verdict"]


def test_a_verdict_that_stands_says_so(tmp_path, capsys):
    page, answer = asked("diagnose", scattered(tmp_path / "study", 1, 0.0, c=30.0), capsys)
    assert answer["verdict"] in ("missing", "tied") and answer["undone"] is None and answer["undone_tested"]
    assert "it stands with one standard error of undeclared set-up scatter too" in page


RIG = """
import numpy as np

RIG = {
    "name": "drop",
    "parameters": {"slowness_s_m": {"default": 0.2, "min": 0.0, "max": 1.0, "unit": "s/m", "meaning": "time per length"}},
    "conditions": {"length_m": {"default": 1.0, "min": 0.1, "max": 10.0, "unit": "m", "meaning": "length"}},
    "observables": {"restitution": OBSERVABLE},
}


def predict(parameters, conditions, effects):
    return {"restitution": 0.9 * np.exp(-parameters["slowness_s_m"] * conditions["length_m"])}
"""


def dropping(path: Path, observable: str) -> Path:
    lines = ["rig,observable,value,sd,length_m"]
    lines += [
        f"drop,restitution,{0.9 * math.exp(-0.178 * x) + d:.4f},0.01,{x}" for x, d in ((1, 0.01), (2, -0.01), (4, 0))
    ]
    study = folder(path, lines)
    (study / "study.toml").write_text("[parameters]\nslowness_s_m = { value = 0.2, min = 0.01, max = 0.9 }\n")
    (study / "rigs").mkdir()
    (study / "rigs" / "drop.py").write_text(RIG.replace("OBSERVABLE", observable))
    return study


@pytest.mark.parametrize(
    "observable, unit, printed",
    [
        ('{"unit": "1", "meaning": "speed after over before"}', "1", ""),
        ('{"unit": "N s", "meaning": "an impulse"}', "N s", " N s"),
        ('"speed after over before"', "unit of restitution", " unit of restitution"),
    ],
)
def test_units_are_declared_and_never_read_off_names(tmp_path, capsys, observable, unit, printed):
    study = dropping(tmp_path / "study", observable)
    page, answer = asked("compare", study, capsys)
    assert answer["rms_error_unit"] == unit
    error = f"rms error {answer['rms_error']:.3g}"
    assert f"{error}{printed} rows" not in page and f"{error}{printed} WHERE" in page
    report = page_of(study, capsys)
    assert "slowness s/m " in report  # the constant and its unit, not metres
    assert answer["units"]["slowness_s_m"] == "s/m" and " m slowness" not in report


def test_an_unknown_column_is_answered_with_those_of_the_rig_nearest_first(tmp_path, capsys):
    lines = ["rig,observable,value,layer_hieght_mm", "layer_on_incline,slip_angle_deg,30,20"]
    assert command("compare", folder(tmp_path, lines))[0] == 2
    said = capsys.readouterr().err
    names = said.split("accepted are ")[1].split(";")[0].split(", ")
    assert (
        names[0] == "layer_height_mm"
        and "channel_width_mm" in names
        and {"setup_sd", "split", "order"} < set(names)
        and " more" not in said
    )
    assert "drop_height_mm" not in names and "normal_stress_pa" not in names and len(names) < 20


def test_an_unknown_parameter_is_answered_with_those_of_the_rigs_used(tmp_path, capsys):
    study = incline(tmp_path)
    (study / "study.toml").write_text("[parameters]\ninternal_frction = 0.5\n")
    assert command("compare", study)[0] == 2
    said = capsys.readouterr().err
    assert "unknown in layer_on_incline; accepted are internal_friction; did you mean 'internal_friction'?" in said


@pytest.mark.parametrize("name", ["compare", "refine", "report"])
def test_a_file_in_place_of_the_folder_is_said(tmp_path, capsys, name):
    study = incline(tmp_path / "study")
    assert command(name, study / "measurements.csv")[0] == 2
    said = capsys.readouterr().err
    assert (
        "is a file; a study is a folder" in said
        and f"give the folder it is in, {study}" in said
        and "Errno" not in said
    )
    lone = tmp_path / "lone.csv"
    lone.write_text("rig\n")
    assert command(name, lone)[0] == 2
    assert "is a file; a study is a folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    "before, after", [("30\r,20", "2"), ("30,\r20", "2"), ("30,20\nlayer_on_incline,slip\r_angle_deg,3,2", "3")]
)
def test_a_stray_carriage_return_is_said(tmp_path, capsys, before, after):
    study = incline(tmp_path)
    text = f"rig,observable,value,layer_height_mm\nlayer_on_incline,slip_angle_deg,{before}\n"
    (study / "measurements.csv").write_bytes(text.encode())
    assert command("compare", study)[0] == 2
    said = capsys.readouterr().err
    assert f"line {after}: holds a stray carriage return" in said and "cells" not in said


def test_a_stray_carriage_return_in_study_toml_is_said(tmp_path, capsys):
    study = incline(tmp_path)
    (study / "study.toml").write_bytes(b'title = "a"\n[parameters]\ninternal_friction = \r 0.5\n')
    assert command("compare", study)[0] == 2
    assert "study.toml: line 3: holds a stray carriage return" in capsys.readouterr().err


@pytest.mark.parametrize("ends", ["\r\n", "\r", "\n"])
def test_line_ends_of_every_system_are_read(tmp_path, ends):
    study = incline(tmp_path)
    for name in ("measurements.csv", "study.toml"):
        text = (study / name).read_text()
        (study / name).write_bytes(text.replace("\n", ends).encode())
    assert command("compare", study)[0] == 0


def test_a_rig_whose_file_is_missing_is_said(tmp_path, capsys):
    lines = ["rig,observable,value,drop_mm", "ball_drop,bounce_mm,30,20"]
    assert command("compare", folder(tmp_path / "none", lines))[0] == 2
    said = capsys.readouterr().err
    assert "line 2: rig 'ball_drop' is unknown" in said and "rigs/" in said and "column" not in said
    broken = incline(tmp_path / "broken")
    (broken / "rigs").mkdir()
    (broken / "rigs" / "ball.py").symlink_to(tmp_path / "gone.py")
    assert command("compare", broken)[0] == 2
    said = capsys.readouterr().err
    assert "ball.py: is a link to" in said and "where there is no file" in said and "call again" not in said


@pytest.mark.parametrize(
    "low, high, words",
    [
        (0.05, 0.3, "set its max farther out first (1.5 at most)"),
        (0.0, 3.0, "beyond which there is none"),
    ],
)
def test_to_widen_a_bound_is_advised_only_where_it_can_be_done(tmp_path, capsys, low, high, words):
    """Angles of 76 deg need tan = 4, beyond what the parameter may be; of 27 deg 0.5, beyond what this study allows."""
    angle = 76 if high == 3.0 else 27
    study = folder(tmp_path / "study", [HEAD, *(layer(h, angle) for h in (10, 20, 40))])
    (study / "study.toml").write_text(f"[parameters]\ninternal_friction = {{ min = {low}, max = {high} }}\n")
    page, answer = asked("compare", study, capsys)
    assert answer["at_bound"] == ["internal_friction"] and words in page
    assert ("farther out" in page) == (high < 3.0)
    if high < 3.0:
        (study / "study.toml").write_text("[parameters]\ninternal_friction = { min = 0.05, max = 3 }\n")
        assert asked("compare", study, capsys)[1]["at_bound"] == []


def test_a_row_left_out_is_shown_with_its_reason(tmp_path, capsys):
    lines = [
        f"{HEAD},reason",
        *(f"{layer(h, 27)}," for h in (10, 20, 40)),
        f"{layer(30, 70, 'leave_out')},the tray was knocked",
    ]
    study = folder(tmp_path / "study", lines)
    page, answer = asked("compare", study, capsys)
    assert "3 rows fitted, 0 held out, 1 left out" in page and "the tray was knocked" in page
    assert [(row["value"], row["reason"]) for row in answer["left_out"]] == [(70.0, "the tray was knocked")]
    report = page_of(study, capsys)
    assert "1 more left out" in report and "Left out (split leave_out): used for nothing" in report
    assert "the tray was knocked" in report


def test_answers_of_an_older_version_are_still_reported(tmp_path, capsys):
    """What this version added to compare.json is not needed to lay an old one out."""
    study = incline(tmp_path / "study", c=20.0)
    asked("compare", study, capsys)
    file = study / "compare.json"
    old = json.loads(file.read_text())
    for key in (
        "fit",
        "ranges",
        "range_shares",
        "units",
        "rig_lack_of_fit_p",
        "left_out",
        "holdout_p",
        "holdout_contradicts",
    ):
        del old[key]
    file.write_text(json.dumps(old))
    assert "the model does not fit" in page_of(study, capsys)


def test_adequate_says_in_its_name_that_held_out_rows_contradict_and_why_nothing_is_proposed(tmp_path, capsys):
    study = extrapolated(tmp_path / "study")
    page, answer = asked("diagnose", study, capsys)
    name = "adequate, but contradicted by the rows held out"
    assert f"ANSWER {name}:" in page and answer["verdict"] == "adequate"
    report = page_of(study, capsys)
    assert name.capitalize() in report and "nothing has to be told apart" not in report
    page, _ = asked("refine", study, capsys)
    assert f"verdict {name}" in " ".join(page.split("step ")[0].split())  # the first sentence says so
    (study / "diagnose.json").unlink()
    ranking = page_of(study, capsys).split("ranking, next measurement")[1][:80]
    assert "refine.json" in ranking and "not there yet" not in ranking


def test_adequate_where_no_candidate_could_show_says_that_first(tmp_path, capsys):
    """All layers of one height: what cohesion would do, the friction takes wholly."""
    lines = [layer(20, 26.5 + d, sd=0.5, n=1) for d in (-0.3, 0.1, 0.2)] + [layer(20.01, 26.6, sd=0.5, n=1)]
    page, answer = asked("diagnose", folder(tmp_path / "study", [HEAD, *lines]), capsys)
    assert answer["verdict"] == "adequate" and all(s["note"] == "these data cannot show it" for s in answer["ranking"])
    assert "ANSWER adequate: these data can show none of the candidates" in page


def test_how_far_apart_explanations_lie_names_which():
    """Three predictions: the two farthest apart are told, and that one reading leaves the two closest alike."""
    proposal = {
        "rig": "cup", "observable": "temperature_c", "conditions": {"time_min": 30.0},
        "predictions": {"a": 40.0, "b": 41.0, "c": 44.0}, "uncertainties": {"a": 1.0, "b": 1.0, "c": 1.0},
        "separation": 4.1, "farthest": ["a", "c"], "least_separation": 1.2, "closest": ["a", "b"],
    }  # fmt: skip
    words = facts.apart_words(facts.proposal({"next_measurement": proposal}))
    assert (
        words
        == "a and c differ by 4.1 standard uncertainties, but a and b by 1.2 only: one such reading leaves these alike"
    )
    proposal["least_separation"] = 2.5
    assert "no two by less than 2.5" in facts.apart_words(facts.proposal({"next_measurement": proposal}))


def test_where_there_is_no_candidate_why_is_said(tmp_path, capsys):
    study = incline(tmp_path / "study", c=60.0)
    file = study / "study.toml"
    file.write_text("candidates = []\n" + file.read_text())
    page = " ".join(asked("diagnose", study, capsys)[0].split())
    assert "there is no candidate that could repair it" in page and "plausible size" not in page
    assert (
        "`candidates` in study.toml leaves out every effect that could be asked for: " in page
        and "chi2 drop" not in page
    )
    assert "next: pellet-study report" in asked("compare", study, capsys)[0]
    with_one = file.read_text().replace("candidates = []", 'candidates = ["cohesio"]')
    file.write_text(with_one)
    assert command("compare", study)[0] == 2
    said = capsys.readouterr().err
    assert "did you mean 'cohesion'" in said and "size_spread" not in said  # which acts in heaps only


def test_a_page_whose_rows_held_out_contradict_says_so_in_its_title_and_shows_the_order(tmp_path, capsys):
    study = extrapolated(tmp_path / "study")
    file = study / "measurements.csv"
    lines = file.read_text().splitlines()
    file.write_text("\n".join([f"{lines[0]},order", *(f"{line},{k}" for k, line in enumerate(lines[1:], 1))]) + "\n")
    asked("compare", study, capsys)
    assert command("report", study)[0] == 0
    page = (study / "report.html").read_text()
    assert page.split("<title>")[1].split("</title>")[0].endswith(": contradicted by the rows held out")
    assert page.split("<h1>")[1].split("</h1>")[0].endswith(": contradicted by the rows held out")
    assert ">order</th>" in page
