"""A whole column in another unit, an sd in another unit, and what was used instead: what an answer says of them."""

import math

import numpy as np
import pytest

from pellet_study.__main__ import main
from pellet_study.rigs import standard
from tests.criticism.test_newcomer import ball, rises
from tests.criticism.test_words import asked, page_of
from tests.helpers.make_study import STRESSES_PA, command, folder, slip_angle_deg

HEIGHTS = (10, 20, 40, 80)


def layers(path, value, head="sd,layer_height_mm", cells=lambda h: f"0.5,{h}", toml="min = 0.05, max = 1.2"):
    lines = [f"rig,observable,value,{head}"]
    lines += [f"layer_on_incline,slip_angle_deg,{value(h)},{cells(h)}" for h in HEIGHTS]
    study = folder(path, lines)
    (study / "study.toml").write_text(f"[parameters]\ninternal_friction = {{ {toml} }}\n")
    return study


def warnings_of(name, study, capsys):
    page, answer = asked(name, study, capsys)
    assert all(" ".join(words.split()) in page for words in answer["warnings"])
    return answer["warnings"]


@pytest.mark.parametrize("rig", standard().rigs.values(), ids=standard().rigs)
def test_every_quantity_of_the_package_has_a_unit_and_ranges_with_a_source(rig):
    for name in rig.observables:
        low, high = rig.readable[name]
        usual = rig.usual[name]
        assert rig.units[name] and low <= usual[0] < usual[1] and math.isfinite(usual[1]), name
        assert usual[1] <= high or name == "slip_angle_deg", name
    for name, quantity in rig.parameters.items():
        low, high = quantity["physical"]
        assert quantity["unit"] and quantity["source"] and quantity["min"] <= low < high <= quantity["max"], name
        assert low <= quantity["default"] <= high, name
    for name, quantity in rig.conditions.items():
        assert quantity["source"], name
        assert "options" in quantity or (quantity["unit"] and quantity["min"] < quantity["max"]), name


def test_slip_angles_in_radians_are_told(tmp_path, capsys):
    study = layers(tmp_path / "s", lambda h: f"{math.radians(28):.3f}", cells=lambda h: f"0.01,{h}")
    said = asked("check", study, capsys)[1]["warnings"]
    assert any("usual 3 to 85 deg" in w and "0.489 rad would be 28.02 deg: is it given in rad?" in w for w in said), (
        said
    )


def test_shear_stresses_in_kilopascal_are_told(tmp_path, capsys):
    lines = ["rig,observable,value,sd,normal_stress_pa"]
    lines += [f"shear_cell,shear_stress_pa,{0.0005 * s},0.01,{s}" for s in STRESSES_PA]
    said = asked("check", folder(tmp_path / "s", lines), capsys)[1]["warnings"]
    assert any("0.25 kPa would be 250 Pa: is it given in kPa?" in w for w in said), said


def test_a_reading_that_nobody_can_have_read_is_refused_with_the_unit(tmp_path, capsys):
    study = layers(tmp_path / "s", lambda h: 120)
    assert command("check", study)[0] == 2
    assert "can be read from 0 to 80 deg only" in capsys.readouterr().err


@pytest.mark.parametrize(
    "toml, said, silly",
    [
        ("value = 30, min = 20, max = 40", "20 deg would be tan 20 = 0.364: is it given as an angle?", "percent"),
        ("value = 50000, min = 40000, max = 60000", "lies outside 0 to 3", "is it given"),
    ],
)
def test_only_units_that_people_write_are_hinted_at(tmp_path, capsys, toml, said, silly):
    assert command("check", layers(tmp_path / "s", lambda h: 28, toml=toml))[0] == 2
    words = capsys.readouterr().err
    assert said in words and silly not in words


def test_no_micrometres_of_a_drop_height(tmp_path, capsys):
    study = ball(tmp_path / "s", lambda h, v: f"{v},{0.01 * v},{h * 1000}")
    assert command("check", study)[0] == 2
    words = capsys.readouterr().err
    assert "the rig can simulate" in words and "um" not in words.split("(usual")[1]


def test_a_column_in_another_unit_within_the_usual_range_is_the_likely_cause(tmp_path, capsys):
    """Heights in cm: 10 to 250, as usual in mm. No restitution gives such rebounds, and read in cm every row fits."""
    study = ball(tmp_path / "s", lambda h, v: f"{v:.3f},{0.01 * v:.4f},{h / 10:g}")
    for name in ("compare", "diagnose"):
        said = warnings_of(name, study, capsys)
        assert any("drop_height_mm given in cm instead of mm is the likely cause" in w for w in said), said
        assert not any("farther out" in w or "is sd too small" in w for w in said), said


def test_a_missing_effect_is_not_called_a_unit(tmp_path, capsys):
    study = layers(tmp_path / "s", lambda h: f"{slip_angle_deg(h, 0.5, 60):.3f}")
    assert not any("likely cause" in w for w in warnings_of("compare", study, capsys))


def test_a_bound_is_not_advised_where_the_constant_would_end_there_too(tmp_path, capsys):
    rig = __import__("tests.criticism.test_newcomer", fromlist=["BALL"]).BALL.replace('"physical": (0.4, 0.98), ', "")
    study = ball(tmp_path / "s", lambda h, v: f"{3 * v:.3f},{0.01 * v:.4f},{h}", rig=rig)
    said = warnings_of("compare", study, capsys)
    assert any("ends at 0.98" in w and "would end at 1 too" in w for w in said), said
    assert not any("farther out" in w for w in said)


@pytest.mark.parametrize("times, words", [(0.1, "or in cm where mm is declared"), (10.0, "off by a factor of 10")])
def test_an_sd_a_power_of_ten_off_is_told(tmp_path, capsys, times, words):
    study = ball(tmp_path / "s", lambda h, v: f"{v:.3f},{0.01 * v * times:.6f},{h}")
    said = warnings_of("compare", study, capsys)
    assert any(words in w and "is sd too" in w for w in said), said


def repeated(path, sd):
    """Five readings a height that scatter by 1 %."""
    rng = np.random.default_rng(3)
    lines = ["rig,observable,value,sd,drop_height_mm"]
    for h, v in rises().items():
        lines += [f"drop,rebound_mm,{v * (1 + 0.01 * z):.3f},{sd(v)},{h}" for z in rng.standard_normal(5)]
    study = ball(path, lambda h, v: f"{v},{sd(v)},{h}")
    (study / "measurements.csv").write_text("\n".join(lines) + "\n")
    return study


def test_the_sd_that_replicates_overrule_is_shown_with_the_one_used(tmp_path, capsys):
    study = repeated(tmp_path / "s", lambda v: f"{0.001 * v:.5f}")
    page, answer = asked("compare", study, capsys)
    row = answer["rows"][0]
    assert row["sd_used"] == pytest.approx(row["sd"] * answer["replicates_over_sd"]["drop"]["rebound_mm"])
    assert "replicates scatter" in row["sd_from"] and f"sd used {row['sd_used']:.3g}: replicates scatter" in page
    assert any("in cm where mm is declared" in w for w in answer["warnings"])
    assert "sd used" in page_of(study, capsys)


def test_a_stated_sd_that_is_used_is_said_to_be(tmp_path, capsys):
    page, answer = asked("compare", repeated(tmp_path / "s", lambda v: f"{0.01 * v:.5f}"), capsys)
    assert {row["sd_from"] for row in answer["rows"]} == {"as stated"} and "sd used" not in page
    assert all(row["sd_used"] == pytest.approx(row["sd"]) for row in answer["rows"])


def test_blank_sds_come_from_the_replicates(tmp_path, capsys):
    answer = asked("compare", repeated(tmp_path / "s", lambda v: ""), capsys)[1]
    assert {row["sd_from"] for row in answer["rows"]} == {"of the replicates"}


@pytest.mark.parametrize("order, told", [((1, 2, 3, 4), True), ((3, 1, 4, 2), False)])
def test_readings_in_the_order_of_a_condition_are_told_where_the_model_fails_along_it(tmp_path, capsys, order, told):
    rank = dict(zip(HEIGHTS, order, strict=True))
    study = layers(
        tmp_path / "s",
        lambda h: f"{slip_angle_deg(h, 0.5, 60):.3f}",
        head="sd,layer_height_mm,order",
        cells=lambda h: f"0.5,{h},{rank[h]}",
    )
    for name in ("compare", "diagnose"):
        said = warnings_of(name, study, capsys)
        assert any("was read in the order of layer_height_mm" in w for w in said) == told, said


def test_readings_in_another_unit_than_their_sd_are_not_both_blamed(tmp_path, capsys):
    """Metres beside sds in mm: read both in m, chi2 is a millionth of what scatter makes, which is no fit."""
    study = tmp_path / "s"
    assert main(["init", str(study), "--rig", "cup"]) == 0
    file = study / "measurements.csv"
    header, *lines = file.read_text().splitlines()
    cells = [line.split(",") for line in lines]
    place, value = header.split(",").index("setting_mm"), header.split(",").index("value")
    noise = (0.8, -0.7, 0.4, -0.9, 0.6, -0.3)
    for row, e in zip(cells, noise, strict=True):
        row[value] = f"{(2 * float(row[place]) + e) / 1000:.6g}"
    file.write_text("\n".join([header, *(",".join(row) for row in cells)]) + "\n")
    capsys.readouterr()
    assert main(["compare", str(study)]) == 0
    assert "and their sd given in m" not in " ".join(capsys.readouterr().out.split())
