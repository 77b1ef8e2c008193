"""What a study's files do not say is said: defaults, blank cells, ranges, equal rows; a command line on a folder each."""

import json

import pandas as pd
import pytest

import pellet_study as ps
from pellet_study.__main__ import main
from pellet_study.study.load import load
from pellet_study.study.ranges import unusual
from tests.helpers.make_study import command, folder

RIG = """
import numpy as np

RIG = {
    "name": "ball_drop",
    "parameters": {
        "restitution": {"default": 0.9, "min": 0.0, "max": 1.0, "physical": (0.3, 0.98), "unit": "1", "meaning": "e"},
        "air_density_kg_m3": {"default": 1.2, "min": 0.0, "max": 5.0, "unit": "kg/m3", "meaning": "rho"},
    },
    "conditions": {
        "drop_height_mm": {"default": 300.0, "min": 10.0, "max": 3000.0, "unit": "mm", "meaning": "fall"},
        "ball_mass_g": {"default": 10.0, "min": 0.5, "max": 100.0, "positive": True, "unit": "g", "meaning": "mass"},
        "plate_tilt_deg": {"default": 0.0, "min": 0.0, "max": 45.0, "unit": "deg", "meaning": "tilt of the plate"},
        "slope_deg": {"default": 30.0, "min": 20.0, "max": 60.0, "unit": "deg", "meaning": "an angle that cannot be 0"},
        "gas_pressure_pa": {"default": 1e5, "min": 1e4, "max": 1e6, "positive": True, "unit": "Pa", "meaning": "p"},
    },
    "observables": {"rebound_height_mm": "h"},
}


def predict(parameters, conditions, effects):
    height = conditions["drop_height_mm"]
    drag = 0.02 * parameters["air_density_kg_m3"] * height / conditions["ball_mass_g"] * conditions["gas_pressure_pa"] / 1e5
    return {"rebound_height_mm": parameters["restitution"] ** 2 * height * np.exp(-1e-2 * drag)}
"""
HEIGHTS = (100, 200, 400, 800)


def ball(path, head="drop_height_mm,ball_mass_g", cells=lambda h: f"{h},2.7", toml="", rig=RIG, more=()):
    """A study of a ball of 2.7 g; `cells` are those of a height."""
    (path / "rigs").mkdir(parents=True)
    (path / "rigs" / "ball_drop.py").write_text(rig)
    (path / "study.toml").write_text(toml or "[parameters]\nrestitution = { value = 0.85, min = 0.5, max = 0.95 }\n")
    rows = [f"ball_drop,rebound_height_mm,{0.8 * h},{0.01 * h},{cells(h)}" for h in HEIGHTS]
    (path / "measurements.csv").write_text("\n".join([f"rig,observable,value,sd,{head}", *rows, *more]) + "\n")
    return path


def refused(path, capsys, words, command="compare"):
    assert main([command, str(path)]) == 2
    said = capsys.readouterr()
    assert said.out == "" and all(word in said.err for word in words), said.err


def answered(path, capsys, name="compare"):
    status, found = command(name, path, json_file=path.parent / "answer.json")
    said = capsys.readouterr()
    assert status == 0, said.err
    return found, said


@pytest.mark.parametrize("name", ["compare", "diagnose", "refine"])
def test_a_column_that_is_missing_is_said_to_be_assumed(tmp_path, capsys, name):
    found, said = answered(ball(tmp_path / "s", "drop_height_mm", str), capsys, name)
    others = {"plate_tilt_deg": 0.0, "slope_deg": 30.0, "gas_pressure_pa": 1e5, "air_density_kg_m3": 1.2}
    assert found["assumed"] == {"ball_mass_g": 10.0, **others}
    first = " ".join(said.out.splitlines()[:5])
    assert "assumed: " in first and "ball_mass_g 10" in first and "air_density_kg_m3 1.2" in first


def test_what_is_given_is_not_assumed(tmp_path, capsys):
    toml = "[parameters]\nrestitution = { min = 0.5, max = 0.95 }\nair_density_kg_m3 = 1.2\n"
    path = ball(
        tmp_path / "s",
        "drop_height_mm,ball_mass_g,plate_tilt_deg,slope_deg,gas_pressure_pa",
        lambda h: f"{h},2.7,0,30,100000",
        toml,
    )
    found, said = answered(path, capsys)
    assert found["assumed"] == {} and "assumed" not in said.out


def test_adding_and_the_report_say_what_is_assumed_too(tmp_path, capsys):
    path = tmp_path / "s"
    path.mkdir()
    (path / "study.toml").write_text("[parameters]\ninternal_friction = { min = 0.1, max = 1.5 }\n")
    rows = [f"layer_on_incline,slip_angle_deg,{a},1,{h}" for h, a in ((8, 42), (16, 37), (32, 34), (60, 32))]
    (path / "measurements.csv").write_text("\n".join(["rig,observable,value,sd,layer_height_mm", *rows]) + "\n")
    assert main(["add", str(path), "cohesion", "--json", str(tmp_path / "a.json")]) == 0
    assumed = {"particle_diameter_mm": 1.0, "bulk_density_kg_m3": 1400.0, "channel_width_mm": 100.0}
    assert json.loads((tmp_path / "a.json").read_text())["assumed"] == assumed
    assert json.loads((path / "compare.json").read_text())["assumed"] == assumed
    assert main(["report", str(path)]) == 0
    assert "bulk_density_kg_m3 1400" in (path / "report.html").read_text()


def test_a_condition_that_a_rig_requires_is_not_assumed(tmp_path, capsys):
    rig = RIG.replace('"unit": "g", ', '"unit": "g", "required": True, ')
    refused(
        ball(tmp_path / "s", "drop_height_mm", str, rig=rig),
        capsys,
        ["measurements.csv: line 2: column ball_mass_g is missing", "ball_drop requires it"],
    )
    refused(
        ball(tmp_path / "t", cells=lambda h: f"{h},{2.7 if h < 800 else ''}", rig=rig),
        capsys,
        ["line 5: column ball_mass_g", "blank", "ball_drop requires it"],
    )
    answered(ball(tmp_path / "u", rig=rig), capsys)


def test_a_blank_condition_that_other_rows_give_is_refused(tmp_path, capsys):
    path = ball(tmp_path / "s", cells=lambda h: f"{'' if h == 400 else h},2.7")
    refused(path, capsys, ["measurements.csv: line 4: column drop_height_mm is blank", "line 2", "gives 100", "300"])


def test_a_blank_condition_of_another_rig_is_none(tmp_path, capsys):
    cell = "shear_cell,shear_stress_pa,500,5,,,1000"
    path = ball(tmp_path / "s", "drop_height_mm,ball_mass_g,normal_stress_pa", lambda h: f"{h},2.7,", more=[cell])
    assert load(path).rows[-1].conditions == {"normal_stress_pa": 1000.0}


def test_a_row_left_out_may_lack_a_condition(tmp_path, capsys):
    path = ball(
        tmp_path / "s",
        "drop_height_mm,ball_mass_g,split,reason",
        lambda h: f"{h},2.7,,",
        more=["ball_drop,rebound_height_mm,50,1,,2.7,leave_out,height not noted"],
    )
    answered(path, capsys)


def test_a_blank_parameter_is_fitted_there(tmp_path, capsys):
    path = ball(
        tmp_path / "s", "drop_height_mm,ball_mass_g,restitution", lambda h: f"{h},2.7,{0.9 if h == 400 else ''}"
    )
    found, said = answered(path, capsys)
    assert [row.parameters for row in load(path).rows] == [{}, {}, {"restitution": 0.9}, {}]
    assert 0.85 < found["parameters"]["restitution"] < 0.95


@pytest.mark.parametrize(
    "column, cells, words",
    [
        ("drop_height_mm", lambda h: h / 1000, ["line 2: drop_height_mm 0.1", "10 to 3000 mm", "0.1 m would be 100 mm"]),
        ("gas_pressure_pa", lambda h: h / 10, ["line 2: gas_pressure_pa 10", "10 kPa would be 1e+04 Pa", "given in kPa?"]),
        ("ball_mass_g", lambda h: 2.7e-3, ["ball_mass_g 0.0027", "0.0027 kg would be 2.7 g"]),
        ("ball_mass_g", lambda h: 2700, ["ball_mass_g 2700", "2700 mg would be 2.7 g"]),
        ("slope_deg", lambda h: 0.5 + h / 4000, ["slope_deg 0.525", "0.525 rad would be 30.08 deg"]),
        ("slope_deg", lambda h: 91, ["slope_deg 91", "the rig can simulate 2 to 90 deg"]),
    ],
)  # fmt: skip
def test_beyond_what_a_rig_can_simulate_is_refused_and_the_unit_named(tmp_path, capsys, column, cells, words):
    path = ball(tmp_path / "s", f"other,{column}".replace("other", "drop_height_mm" if column != "drop_height_mm" else "ball_mass_g"),
                lambda h: f"{h if column != 'drop_height_mm' else 2.7},{cells(h)}")  # fmt: skip
    refused(path, capsys, words)


@pytest.mark.parametrize(
    "cells, words",
    [
        (lambda h: f"{6 * h},2.7", ["drop_height_mm 4800 lies beyond the usual 10 to 3000 mm"]),
        (lambda h: f"{h / 100},2.7", ["drop_height_mm 1, 2, 4, ...", "usual 10 to 3000 mm", "1 cm would be 10 mm"]),
        (lambda h: f"{h},2.7,{0.3 + h / 4000}", ["plate_tilt_deg is at most 0.5", "rad would be"]),
    ],
)
def test_beyond_the_usual_is_warned_of(tmp_path, capsys, cells, words):
    head = "drop_height_mm,ball_mass_g" + (",plate_tilt_deg" if cells(1).count(",") == 2 else "")
    found, said = answered(ball(tmp_path / "s", head, cells), capsys)
    warning = next(words for words in found["warnings"] if "usual" in words)
    assert warning.startswith("ball_drop: ") and all(word in warning for word in words), warning
    assert all(word in said.err for word in words)


@pytest.mark.parametrize(
    "unit, high, values, said",
    [
        ("mg", 50.0, [0.0, 0.9], ""),  # in micrograms it would be less still
        ("mg", 50.0, [0.0, 0.02], "0.02 g would be 20 mg"),
        ("Pa", 1e4, [0.0, 8.0], "8 kPa would be 8000 Pa"),
        ("rpm", 100.0, [0.0, 0.5], ""),  # no other unit is known
        ("deg", 45.0, [1.0, 20.0], ""),
    ],
)
def test_values_next_to_nothing_are_told_where_a_larger_unit_fits(unit, high, values, said):
    quantity = {"default": 0.0, "min": 0.0, "max": high, "unit": unit}
    found = unusual("condition", quantity, values)
    assert said in found if said else found == ""


def test_the_usual_is_not_warned_of(tmp_path, capsys):
    found, said = answered(ball(tmp_path / "s"), capsys)
    assert found["warnings"] == [] and said.err.count("warning") == 0


@pytest.mark.parametrize(
    "toml, words",
    [
        ("restitution = 85.0\n", ["restitution", "85 lies outside 0 to 1", "85 percent would be 0.85"]),
        ("restitution = { min = 50, max = 95 }\n", ["lies outside 0 to 1", "percent"]),
        ("air_density_kg_m3 = 1200.0\n", ["1200 lies outside 0 to 5"]),
        ("air_density_kg_m3 = 0.0012\nrestitution = 2\n", ["restitution: 2 lies outside 0 to 1"]),
    ],
)
def test_parameters_beyond_what_is_possible_are_refused_and_the_unit_named(tmp_path, capsys, toml, words):
    refused(ball(tmp_path / "s", toml=f"[parameters]\n{toml}"), capsys, words)


def test_a_parameter_of_a_row_beyond_what_is_possible_is_refused_and_the_unit_named(tmp_path, capsys):
    path = ball(tmp_path / "s", "drop_height_mm,ball_mass_g,restitution", lambda h: f"{h},2.7,90")
    refused(path, capsys, ["line 2: restitution '90'", "from 0 to 1", "90 percent would be 0.9"])


def test_parameters_beyond_the_usual_are_warned_of(tmp_path, capsys):
    toml = "[parameters]\nrestitution = 0.2\nair_density_kg_m3 = { min = 0.5, max = 2 }\n"
    found, _ = answered(ball(tmp_path / "s", toml=toml), capsys)
    assert "ball_drop: restitution 0.2 lies beyond the usual 0.3 to 0.98" in found["warnings"]


def test_an_effects_value_beyond_its_physical_range_is_warned_of(tmp_path, capsys):
    path = tmp_path / "s"
    path.mkdir()
    toml = "[parameters]\ninternal_friction = { min = 0.1, max = 1.5 }\n[effects]\ncohesion = { cohesive_stress_pa = 9000 }\n"
    (path / "study.toml").write_text(toml)
    rows = [f"layer_on_incline,slip_angle_deg,{a},1,{h}" for h, a in ((8, 78), (16, 77), (32, 74), (60, 70))]
    (path / "measurements.csv").write_text("\n".join(["rig,observable,value,sd,layer_height_mm", *rows]) + "\n")
    found, _ = answered(path, capsys)
    assert any(w.startswith("cohesion: cohesive_stress_pa 9000 lies beyond the usual") for w in found["warnings"])


def test_what_could_be_measured_next_must_be_possible_too(tmp_path, capsys):
    toml = "[parameters]\nrestitution = { min = 0.5, max = 0.95 }\n[possible.ball_drop]\ndrop_height_mm = { min = 0.1, max = 1 }\n"
    refused(
        ball(tmp_path / "s", toml=toml), capsys, ["possible.ball_drop: drop_height_mm 0.1", "0.1 m would be 100 mm"]
    )


def test_equal_rows_are_said(tmp_path, capsys):
    again = "ball_drop,rebound_height_mm,80.0,1.0,100,2.7"
    found, said = answered(ball(tmp_path / "s", more=[again]), capsys)
    assert any("equal in every column: lines 2 and 6" in words for words in found["warnings"])
    assert "lines 2 and 6" in said.err
    path = ball(
        tmp_path / "t", "drop_height_mm,ball_mass_g,order", lambda h: f"{h},2.7,{7 * h % 1000}", more=[f"{again},9"]
    )
    assert answered(path, capsys)[0]["warnings"] == []


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('"unit": "g", ', '"unit": "g", "limits": (1.0, 50.0), ', ["ball_mass_g: limits 1 to 50", "0.5 to 100"]),
        ('"unit": "g", ', '"unit": "g", "limits": 5, ', ["ball_mass_g: limits: expected (low, high)"]),
        ("(0.3, 0.98)", "(0.3, 1.98)", ["restitution: physical 0.3 to 1.98", "0 to 1"]),
    ],
)
def test_ranges_that_a_rig_declares_are_checked(tmp_path, capsys, old, new, words):
    refused(ball(tmp_path / "s", rig=RIG.replace(old, new)), capsys, ["ball_drop.py", *words])


def test_a_rig_that_declares_its_limits_is_believed(tmp_path, capsys):
    rig = RIG.replace('"unit": "g", ', '"unit": "g", "limits": (1e-3, 1e5), ')
    answered(ball(tmp_path / "s", cells=lambda h: f"{h},50000", rig=rig), capsys)


def test_a_data_frame_is_held_to_the_same():
    stress = [500.0, 1000.0, float("nan"), 4000.0]
    frame = {"rig": "shear_cell", "observable": "shear_stress_pa", "sd": 10.0, "value": [300.0, 600.0, 1200.0, 2400.0]}
    free = {"internal_friction": (0.1, 1.5)}
    with pytest.raises(ps.InputError, match="measurements: line 4: column normal_stress_pa is blank"):
        ps.study_of(pd.DataFrame({**frame, "normal_stress_pa": stress}), parameters=free)
    with pytest.raises(ps.InputError, match="measurements: line 2: normal_stress_pa 0.5.*given in kPa"):
        ps.study_of(pd.DataFrame({**frame, "normal_stress_pa": [0.5, 1.0, 2.0, 4.0]}), parameters=free)
    study = ps.study_of(pd.DataFrame({**frame, "normal_stress_pa": [500, 1000, 2000, 4000]}), parameters=free)
    assert ps.compare(study).assumed == {} and study.remarks == ()


def test_a_condition_that_is_a_word_is_assumed_or_given_like_any_other(tmp_path, capsys):
    word = '"plate": {"default": "steel", "options": ("steel", "glass"), "unit": "", "meaning": "what it falls on"},'
    rig = RIG.replace('"conditions": {', f'"conditions": {{\n        {word}', 1)
    found, said = answered(ball(tmp_path / "s", rig=rig), capsys)
    assert found["assumed"]["plate"] == "steel" and "plate steel" in " ".join(said.out.split())
    head = "drop_height_mm,ball_mass_g,plate"
    given = ball(tmp_path / "t", head, lambda h: f"{h},2.7,glass", rig=rig)
    assert "plate" not in answered(given, capsys)[0]["assumed"]
    assert "plate: glass (can be steel, glass, default steel)" in answered(given, capsys, "check")[1].out
    blank = ball(tmp_path / "u", head, lambda h: f"{h},2.7,{'' if h == 400 else 'glass'}", rig=rig)
    refused(blank, capsys, ["line 4: column plate is blank", "gives glass", "default, steel"])


@pytest.mark.parametrize("law", ("cohesive_frictional", "cohesive_frictional_local_damping"))
def test_a_parameter_that_only_another_law_has_is_not_assumed(tmp_path, law):
    made = folder(tmp_path / "s", ["rig,observable,value,sd", "repose,repose_angle_deg,35,1"])
    (made / "study.toml").write_text(f'contact_law = "{law}"\n')
    assert ("cohesive_frictional_damping" in load(made).assumed) is (law == "cohesive_frictional_local_damping")
