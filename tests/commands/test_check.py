"""`pellet-study check`: what was understood of a study; nothing is simulated or written."""

import json

import numpy as np
import pytest

import pellet_study as ps
from pellet_study.__main__ import main
from tests import ROOT
from tests.helpers.make_study import command, folder, incline, slip_angle_deg


def checked(path):
    before = {file: file.stat().st_mtime_ns for file in path.rglob("*")}
    status, answer = command("check", path, json_file=path.parent / "check.json")
    assert status == 0
    assert {file: file.stat().st_mtime_ns for file in path.rglob("*")} == before
    return answer


def test_it_says_what_the_files_say(tmp_path, capsys):
    answer = checked(incline(tmp_path / "s", c=40.0))
    rig = answer["rigs"][0]
    assert (rig["rig"], rig["engine"], rig["rows"]) == (
        "layer_on_incline",
        "a formula",
        {"fit": 18, "holdout": 0, "leave_out": 0},
    )
    height = next(c for c in rig["conditions"] if c["condition"] == "layer_height_mm")
    assert height["levels"] == [8, 12, 18, 27, 40, 60] and not height["assumed"]
    assert (height["usual"], height["can_simulate"], height["default"]) == ([2, 100], [0.2, 1000], 20)
    assert [c["condition"] for c in rig["conditions"] if c["assumed"]] == [
        "particle_diameter_mm",
        "bulk_density_kg_m3",
        "channel_width_mm",
    ]
    assert answer["parameters"][0]["state"] == "free" and answer["parameters"][0]["range"] == [0.05, 2.0]
    said = capsys.readouterr().out
    for words in (
        "18 rows fitted",
        "8, 12, 18, 27, 40, 60 mm",
        "usual 2 to 100",
        "ASSUMED",
        "free, 0.05 to 2",
        "cohesion",
    ):
        assert words in said


def test_an_effect_is_noticed_from_the_amount_it_says_on(tmp_path):
    """Data sets made with that much cohesion: about 80 of 100 show it, an eighth of it hardly any."""
    answer = checked(incline(tmp_path / "s", sd=0.5, seed=3, state_sd=True))
    cohesion = next(c for c in answer["candidates"] if c["effect"] == "cohesion")
    assert cohesion["noticed_from"] > 0 and "80 of 100" in cohesion["needs"]
    found = {}
    for share in (1.0, 0.125):
        amount = share * cohesion["noticed_from"]
        studies = [incline(tmp_path / f"{share}_{k}", c=amount, sd=0.5, seed=100 + k, state_sd=True) for k in range(20)]
        ranked = [ps.diagnose(ps.load_study(path)).ranking for path in studies]
        found[share] = np.mean([min(r["p_adjusted"] or 1 for r in ranking) < 0.05 for ranking in ranked])
    assert found[1.0] >= 0.5 and found[0.125] <= 0.3


def test_without_an_order_it_says_randomise_the_order(tmp_path, capsys):
    answer = checked(incline(tmp_path / "s"))
    assert any("randomise the order" in words and "`order`" in words for words in answer["advice"])
    assert "randomise the order" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    "order, words", [((1, 2, 3, 4, 5, 6), "in the order of layer_height_mm"), ((3, 1, 6, 2, 5, 4), "")]
)
def test_an_order_along_a_condition_is_told(tmp_path, order, words):
    heights = (8, 12, 18, 27, 40, 60)
    rows = [
        f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.5, 0):.3f},0.5,{h},{k}"
        for h, k in zip(heights, order, strict=True)
    ]
    answer = checked(folder(tmp_path / "s", ["rig,observable,value,sd,layer_height_mm,order", *rows]))
    said = " ".join(answer["advice"])
    assert (words in said and "randomise the order" in said) if words else "order" not in said


def test_what_stands_against_an_answer_is_said(tmp_path):
    rows = [f"layer_on_incline,slip_angle_deg,{a},{h}" for a, h in ((31, 10), (30, 20))]
    more = "[effects]\ncohesion = {}\nfinite_thickness = {}\n"
    answer = checked(folder(tmp_path / "s", ["rig,observable,value,layer_height_mm", *rows], more))
    said = " ".join(answer["advice"])
    assert "free parameters, but only 2 different cases" in said and "neither sd nor replicates" in said


def test_rows_left_out_are_counted(tmp_path, capsys):
    rows = [f"layer_on_incline,slip_angle_deg,{30 + k},0.5,{h},," for k, h in enumerate((60, 30, 15))]
    lost = "layer_on_incline,slip_angle_deg,80,0.5,12,leave_out,spilt"
    answer = checked(folder(tmp_path / "s", ["rig,observable,value,sd,layer_height_mm,split,reason", *rows, lost]))
    assert answer["rigs"][0]["rows"] == {"fit": 3, "holdout": 0, "leave_out": 1}
    assert "1 left out" in capsys.readouterr().out


def test_rigs_on_yade_are_not_simulated(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PELLET_STUDY_YADE", str(tmp_path / "no_yade"))
    status, answer = command("check", ROOT / "results" / "loaded_seeds", json_file=tmp_path / "check.json")
    assert status == 0 and answer["rigs"][0]["engine"] == "YADE"
    assert answer["assumed"]["seed_density_kg_m3"] == 1250.0
    load = next(c for c in answer["candidates"] if c["effect"] == "load_dependent_friction")
    assert load["noticed_from"] is None and "takes simulations (slope_slip)" in load["needs"]
    assert "loaded and large seeds slip earlier" in " ".join(capsys.readouterr().out.split())


def test_a_study_that_cannot_be_read_is_refused(tmp_path, capsys):
    assert main(["check", str(tmp_path / "nowhere")]) == 2
    assert "nowhere" in capsys.readouterr().err


def test_one_repose_angle_goes_on_to_calibrate_and_has_no_order(tmp_path, capsys):
    (tmp_path / "study.toml").write_text(
        "[parameters]\npowder_surface_energy = { min = 0.05, max = 0.25 }\n[effects]\ncohesion = { surface_energy_j_m2 = 0.0 }\n"
    )
    (tmp_path / "measurements.csv").write_text("rig,observable,value,sd,n\nrepose,repose_angle_deg,41.7,0.74,10\n")
    assert main(["check", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert f"next: pellet-study calibrate {tmp_path}" in said and "randomise" not in said
    first = (tmp_path / "measurements.csv").read_text()
    for row, then in (
        ("repose,discharge_time_s,0.5,0.1,3", "calibrate"),  # of the same pouring
        ("repose,heap_height_mm,20,1,3", "compare"),  # calibrate does not take it
        ("rebound,rebound_height_mm,5.0,0.5,3", "compare"),
    ):
        (tmp_path / "measurements.csv").write_text(f"{first}{row}\n")
        assert main(["check", str(tmp_path)]) == 0
        said = capsys.readouterr().out
        assert f"next: pellet-study {then} {tmp_path}" in said
        assert ("randomise" in said) == row.startswith("rebound")


@pytest.mark.parametrize(
    ("protocol", "without"),
    [
        ("defined_base", {"lift_speed_mm_s"}),
        ("lifted_cylinder", {"outlet_height_mm", "outlet_diameter_mm"}),
        ("funnel", {"base", "base_diameter_mm", "lift_speed_mm_s"}),
    ],
)
def test_nothing_is_assumed_that_means_nothing_under_a_protocol(tmp_path, capsys, protocol, without):
    (tmp_path / "study.toml").write_text("[parameters]\npowder_static_friction = { min = 0.5, max = 0.8 }\n")
    (tmp_path / "measurements.csv").write_text(
        f"rig,observable,value,sd,protocol\nrepose,repose_angle_deg,30.0,0.7,{protocol}\n"
    )
    assert main(["check", str(tmp_path), "--json", str(tmp_path / "answer.json")]) == 0
    answer = json.loads((tmp_path / "answer.json").read_text())
    every = {"base", "base_diameter_mm", "outlet_height_mm", "outlet_diameter_mm", "lift_speed_mm_s"}
    assert every & set(answer["assumed"]) == every - without
    assert not without & {one["condition"] for rig in answer["rigs"] for one in rig["conditions"]}
