"""The report page: its order, what it is made of, what it escapes, and how it behaves in a browser."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pellet_study.doe import box_behnken
from pellet_study.doe.factors import Factor
from pellet_study.errors import InputError
from pellet_study.paper import printed as paper
from pellet_study.paper import results as paper_results
from pellet_study.powder.decisions import Attempt, Climb, Screening, Surface, Validation
from pellet_study.powder.from_study import plan_of
from pellet_study.powder.results import Results
from pellet_study.powder.tables import table_of
from pellet_study.report import page
from pellet_study.study import history, load
from tests import ROOT
from tests.helpers.browser import WIDTHS, chromium, inspect
from tests.helpers.make_study import command, folder, incline

ORDER = [
    "1 What was measured",
    "2 What the model says",
    "3 Where it fails",
    "4 What is missing",
    "5 What adding it did to the error",
    "6 What to measure next",
    "7 How to repeat each number",
]

CALIBRATED = [ORDER[0], "2 The calibration stage by stage", "3 How to repeat each number"]


@pytest.fixture(scope="module")
def refined(tmp_path_factory):
    """A study whose cohesion was hidden and found."""
    study = incline(tmp_path_factory.mktemp("refined") / "study", c=60.0, repeats=4)
    assert command("refine", study)[0] == 0
    return study


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """The committed bench calibration, copied."""
    study = tmp_path_factory.mktemp("bench") / "study"
    shutil.copytree(ROOT / "results" / "bench", study, ignore=shutil.ignore_patterns(".store"))
    return study


def text_of(study: Path) -> str:
    status, answer = command("report", study, json_file=study.parent / "answer.json")
    assert status == 0 and Path(answer["path"]).is_absolute()
    return Path(answer["path"]).read_text(encoding="utf-8")


def test_the_order_in_which_a_reader_asks(refined):
    headings = re.findall(r"<h2[^>]*>(.*?)</h2>", text_of(refined))
    assert headings == ORDER


def test_it_tells_what_was_found(refined):
    text = text_of(refined)
    answer = json.loads((refined / "refine.json").read_text())
    assert "Missing: cohesion (model base)." in text
    for step in answer["steps"]:
        assert f"{step['rms_error']:.3g}" in text
    assert text.count("<img") >= 5


def test_the_first_picture_is_of_the_readings_and_captions_speak_of_what_is_drawn(refined, tmp_path):
    text = text_of(refined)
    assert re.findall(r'<img [^>]*alt="([^"]*)"', text)[0].startswith("readings against the condition")
    captions = re.findall(r"<figcaption[^>]*>(.*?)</figcaption>", text, re.DOTALL)
    assert "those of one level stand side by side" in captions[0] and "held out" not in captions[0]
    (ladder,) = [caption for caption in captions if caption.startswith("The error of each model")]
    assert "tied" not in ladder and "median uncertainty" in ladder
    (ranked,) = [caption for caption in captions if caption.startswith("How much each candidate")][:1]
    told = json.loads((refined / "refine.json").read_text())["diagnoses"][0]["ranking"]
    assert ("no material has" in ranked) == any(s["note"] == "implausible size" for s in told)
    older = tmp_path / "older"
    shutil.copytree(refined, older)
    for file in ("compare", "refine", "history"):
        answer = json.loads((older / f"{file}.json").read_text())
        for part in (answer, *answer.get("steps", []), *answer.get("diagnoses", [])):
            part.pop("curves", None)
        (older / f"{file}.json").write_text(json.dumps(answer))
    assert "readings against the condition" not in text_of(older)


def test_nothing_is_loaded_from_elsewhere(refined, bench):
    for study in (refined, bench):
        for target in re.findall(r'(?:src|href)="([^"]*)"', text_of(study)):
            assert target.startswith(("data:", "#"))


def test_made_twice_it_is_the_same_to_the_byte(refined):
    assert text_of(refined) == text_of(refined)


def test_what_is_not_there_yet_is_named_with_its_command(tmp_path):
    study = incline(tmp_path)
    text = text_of(study)
    for name in ("compare", "diagnose", "refine"):
        assert f"pellet-study {name} {study.as_posix()}" in text


def test_stages_of_the_source_paper_are_on_the_page_of_their_studies_only(tmp_path, bench):
    own = text_of(incline(tmp_path / "own"))
    for absent in ("pellet-study bench", "pellet-study calibrate", "stage by stage", "seed bench", "source paper"):
        assert absent not in own
    assert "2 The calibration stage by stage" in text_of(bench)
    plain = folder(tmp_path / "seed", ["rig,observable,value,sd", "slope_slip,slip_angle_deg,31,1"])
    (plain / "study.toml").write_text("")
    assert f"pellet-study bench {plain.as_posix()}" in text_of(plain)
    several = ["rig,observable,value,added_mass_mg", *(f"slope_slip,slip_angle_deg,31,{m}" for m in (0, 5))]
    loaded = folder(tmp_path / "loaded", several)
    (loaded / "study.toml").write_text("")
    assert "pellet-study bench" not in text_of(loaded)


def test_the_bench_stages_are_drawn_from_their_files(bench):
    text = text_of(bench)
    assert text.count("data:image/svg+xml") == 3 and text.count("data:image/png") == 1
    for value in ("0.2275", "0.62079", "0.24885"):
        assert value in text


def test_readings_are_shown_with_their_uncertainty_even_where_it_never_changes(tmp_path):
    lines = [
        "rig,observable,value,sd,n,normal_stress_pa",
        *(f"shear_cell,shear_stress_pa,{s // 2},8,5,{s}" for s in (500, 900)),
    ]
    text = text_of(folder(tmp_path / "study", lines))
    heads = re.findall(r"<th[^>]*>(.*?)</th>", text)
    assert heads[heads.index("value") :][:3] == ["value", "sd", "n"]


def test_a_note_with_html_stays_text(tmp_path):
    lines = [
        "rig,observable,value,layer_height_mm,note",
        'layer_on_incline,slip_angle_deg,40,20,"<script>alert(1)</script>"',
    ]
    lines += [f"layer_on_incline,slip_angle_deg,{38 - h / 10},{h}," for h in (10, 30, 40)]
    text = text_of(folder(tmp_path, lines))
    assert "<script>" not in text and "&lt;script&gt;" in text


def test_results_older_than_the_measurements_are_pointed_out(tmp_path):
    study = incline(tmp_path, c=0.0)
    assert command("compare", study)[0] == 0
    assert "is of other rows of measurements.csv" not in text_of(study)
    file = study / "measurements.csv"
    lines = file.read_text().splitlines()
    file.write_text("\n".join(lines[:-1]) + "\n")
    assert "is of other rows of measurements.csv" in text_of(study)


@pytest.mark.parametrize("name", ("compare.json", "diagnose.json", "refine.json", history.HISTORY))
def test_a_damaged_answer_is_refused(name, tmp_path):
    study = incline(tmp_path)
    for damage in ('{"steps": [', "[]", '{"steps": [{}], "effects": [1], "diagnoses": [{}]}'):
        (study / name).write_text(damage)
        with pytest.raises(InputError, match="again|anew"):
            page.page(study)


def test_in_a_browser(refined, bench, tmp_path):
    with chromium() as browser:
        for study in (refined, bench, incline(tmp_path / "bare")):
            text_of(study)
            for width in WIDTHS:
                seen = inspect(browser, study / page.FILE, width)
                assert seen["messages"] == [] and seen["requests"] == []
                assert seen["wide"] <= width and seen["overflow"] == []
                assert seen["headings"] == (CALIBRATED if study is bench else ORDER)
                for image in seen["images"]:
                    assert image["alt"] and image["shown"] > 100
                    assert image["lightest"] - image["darkest"] > 60, image["alt"]


def chain_folder(study: Path) -> Path:
    """The source paper's own tables in the files `calibrate` writes, in place of simulated heaps."""
    study.mkdir()
    (study / "study.toml").write_text('title = "Powder"\n')
    (study / "measurements.csv").write_text("rig,observable,value,sd,n\nrepose,repose_angle_deg,41.69,0.79,3\n")

    def leave(stage, runs, decision):
        (study / stage).mkdir()
        runs.assign(stage=stage, direction_error_deg=0.3, verdict="ok").to_csv(study / stage / "runs.csv", index=False)
        results.write_decision(stage, decision)

    plan = plan_of(load(study))
    results = Results(plan, study)
    printed = paper.table(7).drop(columns="No.")
    runs = pd.DataFrame({f.name: f.physical(printed[f.name]) for f in plan.factors})
    screened = Screening(factors=["B", "C", "G"], clear=["C"], coefficients={}, heaps=len(runs), lost=0)
    leave("screening", runs.assign(repose_angle_deg=printed.iloc[:, -1]), screened)
    path = paper_results.climb()[0]
    box = {"B": [0.9, 0.82], "C": [0.25, 0.33], "G": [0.1, 0.18]}
    centre = {"B": 0.86, "C": 0.29, "G": 0.14}
    climbed = Climb(
        factors=["B", "C", "G"], centre=centre, reached=True, box=box, heaps=len(path.points), lost=0, moves=0
    )
    leave("climb", path.points.assign(repose_angle_deg=path.predicted), climbed)
    printed = paper.table(12).drop(columns="No.")
    runs = pd.DataFrame({n: (a + b) / 2 + printed[n] * (b - a) / 2 for n, (a, b) in box.items()})
    runs = runs.assign(box=0, repose_angle_deg=printed.iloc[:, -1])
    fitted = box_behnken.analyse(table_of(runs, [Factor(n, *levels) for n, levels in box.items()]))
    surface = Surface(
        box=box, boxes=[box], chosen_box=0, coefficients=fitted.model.coefficients,
        standard_errors=fitted.model.standard_errors, r2=fitted.r2, r2_adjusted=fitted.r2_adjusted,
        r2_predicted=fitted.r2_predicted, lack_of_fit_p=fitted.lack_of_fit_p, reachable=True,
        heaps=len(runs), lost=0, box_runs=len(runs),
    )  # fmt: skip
    leave("surface", runs, surface)
    attempt = {
        "mean_deg": 41.3, "sd_deg": 0.3, "standard_error_deg": 0.2, "interval_deg": [40.8, 41.8], "measured_deg": 41.69,
        "error_percent": 0.94, "error_interval_percent": [-2.1, 0.3], "margin_deg": 0.79, "p_tost": 0.03,
        "equivalent": True, "p_difference": 0.1, "heaps": 3, "lost": 0, "point": centre, "factors": ["B", "C", "G"],
        "bond_number": 3.0,
    }  # fmt: skip
    decision = Validation(**attempt, attempts=[Attempt(**attempt)])
    leave("validation", pd.DataFrame({"repose_angle_deg": [41.0, 41.3, 41.6]}), decision)
    rng = np.random.default_rng(0)
    place = rng.uniform((-1, -1, 0), (1, 1, 0.9), (9000, 3))
    place = 0.05 * place[place[:, 2] < 0.9 * (1 - np.hypot(place[:, 0], place[:, 1]))]
    grains = pd.DataFrame(place, columns=["x_m", "y_m", "z_m"]).assign(radius_m=0.0012)
    grains.to_csv(study / "heap_grains.csv", index=False)
    return study


def test_the_powder_chain_is_drawn_from_its_files(tmp_path):
    study = chain_folder(tmp_path / "study")
    text = text_of(study)
    stages = re.findall(r"<h3>(Powder: .*?)</h3>", text)
    assert [s.split(": ")[1] for s in stages] == [
        "screening", "the climb", "the surface and what meets the angle", "validation"
    ]  # fmt: skip
    effects = pd.read_csv(ROOT / "results" / "paper" / "table08_effects.csv")
    for value in effects["effect_deg"]:
        assert f"{value:+.2f} ±" in text
    assert text.count("data:image/png") == 1  # the heap
    assert "What is missing" not in text and 'class="todo"' not in text  # nothing was asked of this study
    with chromium() as browser:
        for width in WIDTHS:
            seen = inspect(browser, study / page.FILE, width)
            assert seen["messages"] == [] and seen["wide"] <= width and seen["overflow"] == []
            assert len(seen["images"]) == 10
            for image in seen["images"]:
                assert image["lightest"] - image["darkest"] > 60, image["alt"]


@pytest.mark.parametrize("stage", ("screening", "climb", "surface", "validation"))
def test_a_damaged_stage_is_named(stage, tmp_path):
    study = chain_folder(tmp_path / "study")
    (study / stage / "runs.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match=stage):
        page.page(study)


@pytest.fixture
def whole(tmp_path):
    """What `make study` leaves: the bench calibration, in its folder the powder's stages and a study with a hidden effect."""
    study = tmp_path / "quick"
    shutil.copytree(
        ROOT / "results" / "quick", study, ignore=shutil.ignore_patterns(".store", "powder", "loaded_seeds")
    )
    for stage in ("screening", "validation"):
        shutil.copytree(ROOT / "results" / "full" / stage, study / "powder" / stage)
    hidden = incline(study / "hidden", c=60.0, repeats=4)
    assert command("refine", hidden)[0] == 0
    return study


def test_the_page_of_the_main_job_is_whole_and_its_first_box_has_the_numbers(whole):
    text = text_of(whole)
    short = re.sub(r"<[^>]*>", "", re.search(r'<div class="lead">(.*?)</div>', text, re.DOTALL)[1])
    bench = pd.read_csv(whole / "calibration.csv")
    powder = json.loads((whole / "powder" / "validation" / "decision.json").read_text())
    steps = json.loads((whole / "hidden" / "refine.json").read_text())["steps"]
    told = [f"{value:.3g}" for value in bench["value"]]
    told += [
        f"{powder['mean_deg']:.2f} ± {powder['standard_error_deg']:.2f} deg",
        f"error {powder['error_percent']:.2f} %",
    ]
    told += [f"{step['rms_error']:.3g}" for step in steps] + ["Adequate", "cohesion"]
    places = [short.index(words) for words in told[: len(bench) + 2]]
    assert places == sorted(places) and all(words in short for words in told)
    assert short.index("Missing effect") > places[-1]
    assert " yet" not in text and 'class="todo"' not in text
    assert re.findall(r"<h2[^>]*>\d (.*?)</h2>", text)[:3] == [
        "What was measured", "The calibration stage by stage", "What the model says"
    ]  # fmt: skip


def test_a_study_beside_is_shown_only_where_stages_were_calibrated(tmp_path):
    outer = incline(tmp_path / "outer")
    inner = incline(outer / "inner", c=60.0, repeats=4)
    assert command("refine", inner)[0] == 0
    assert "cohesion" not in text_of(outer)
