"""What `calibrate` takes from a study: factors, fixed values, the measured angle; and what it refuses. No heap is run."""

import argparse
import re

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.commands import calibrate
from pellet_study.errors import InputError
from pellet_study.paper.designs import screening_factors
from pellet_study.powder.from_study import plan_of
from pellet_study.powder.plan import SYMBOLS, Plan, bond, differences, with_conditions
from pellet_study.rigs import on_yade
from pellet_study.study import load
from tests import ROOT
from tests.helpers.walking import STEP

FULL = ROOT / "results" / "full"
ANGLE = "rig,observable,value,sd\nrepose,repose_angle_deg,41.69,0.79\n"


@pytest.fixture
def plan(tmp_path):
    """The plan of a study with given files."""

    def of(toml: str = "", measurements: str = ANGLE) -> Plan:
        (tmp_path / "study.toml").write_text(toml)
        (tmp_path / "measurements.csv").write_text(measurements)
        return plan_of(load(tmp_path))

    return of


def rows(*lines: str) -> str:
    return "rig,observable,value,sd,n\n" + "".join(f"repose,repose_angle_deg,{line}\n" for line in lines)


def test_what_is_known_of_the_measured_angle_enters_the_heaps(plan):
    known = "rig,observable,value,sd,powder_density_kg_m3\nrepose,repose_angle_deg,40,1,1500\n"
    found = plan("[parameters]\npowder_shear_modulus_pa = 2e7\npowder_density_kg_m3 = 1700\n", known)
    assert found.fixed == {"powder_shear_modulus_pa": 2e7, "powder_density_kg_m3": 1500.0}  # the row's, as in compare
    assert plan("", known).fixed == {"powder_density_kg_m3": 1500.0}
    assert plan().fixed == {}
    case = on_yade.case("repose", parameters=found.fixed)
    assert case["parameters"]["powder_density_kg_m3"] == 1500.0


def test_what_is_known_of_a_to_g_is_not_varied(plan):
    found = plan("", "rig,observable,value,sd,powder_steel_static_friction\nrepose,repose_angle_deg,40,1,0.7\n")
    assert [f.name for f in found.factors] == list("ABCDFG") and found.fixed == {"powder_steel_static_friction": 0.7}
    toml = "[parameters]\npowder_restitution = 0.3\npowder_steel_restitution = 0.4\npowder_static_friction = { min = 0.5, max = 0.6 }\n"
    found = plan(toml)
    assert [f.name for f in found.factors] == list("BCEFG") and found.own == {"B"}
    assert found.fixed == {"powder_restitution": 0.3, "powder_steel_restitution": 0.4}
    assert found.energy({"G": 0.25}) == 0.25
    few = "".join(f"{SYMBOLS[name]} = 0.2\n" for name in "ABDE")
    assert [f.name for f in plan(f"[parameters]\n{few}").factors] == list("CFG")
    with pytest.raises(InputError, match="only C, G of A to G is left to vary.* expected 3 or more"):
        listed = "[effects]\nrolling_resistance = { rolling_friction = 0.0 }\n"
        plan(f"[parameters]\n{few}powder_steel_rolling_friction = 0.2\n{listed}")


def test_rows_that_know_differently_are_refused(plan):
    two = "rig,observable,value,sd,powder_density_kg_m3\nrepose,repose_angle_deg,40,1,1500\nrepose,repose_angle_deg,40,1,{}\n"
    for other in ("1600", ""):
        with pytest.raises(InputError, match="differ in what is known"):
            plan("", two.format(other))
    assert plan("", two.format("1500")).fixed == {"powder_density_kg_m3": 1500.0}


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("cohesion = { surface_energy_j_m2 = 0.1 }", r"surface_energy_j_m2 = 0 .* G \(powder_surface_energy\)"),
        ("rolling_resistance = { rolling_friction = 0.1 }", r"C \(powder_rolling_friction\) and F"),
        ("rolling_resistance = {}", "rolling_friction = 0 "),  # free
        ("cohesion = { surface_energy_j_m2 = { value = 0.0, min = 0.0, max = 0.4 } }", "calibrate varies only"),
        ("size_spread = { added_spread = 0.1 }", "use compare"),
        ("amplification_size = { exponent_error = 1.0 }", "use compare"),
    ],
)
def test_effects_that_are_present_are_refused(plan, line, told):
    with pytest.raises(InputError, match=told):
        plan(f"[effects]\n{line}\n")


def test_effects_listed_as_absent_are_taken(plan):
    ranges = "[parameters]\npowder_rolling_friction = { min = 0.1, max = 0.2 }\npowder_surface_energy = { min = 0.0, max = 0.2 }\n"
    absent = "[effects]\nrolling_resistance = { rolling_friction = 0.0 }\ncohesion = { surface_energy_j_m2 = 0.0 }\n"
    factors = {f.name: (f.low, f.high) for f in plan(ranges + absent).factors}
    assert factors["C"] == (0.1, 0.2) and factors["G"] == (0.0, 0.2)
    with pytest.raises(InputError, match=r"list rolling_resistance in \[effects\]"):
        plan(ranges)


def test_the_help_gives_the_lines_that_ranges_of_c_f_and_g_need(plan, capsys):
    with pytest.raises(SystemExit):
        main(["calibrate", "--help"])
    text = capsys.readouterr().out
    lines = [line.strip() for line in text.split("[effects]")[1].splitlines()[1:3]]
    names = ("powder_rolling_friction", "powder_steel_rolling_friction", "powder_surface_energy")
    ranges = "[parameters]\n" + "".join(f"{name} = {{ min = 0.1, max = 0.2 }}\n" for name in names)
    found = plan(ranges + "[effects]\n" + "\n".join(lines) + "\n")
    assert {f.name: f.high for f in found.factors}["F"] == 0.2


def test_the_study_of_the_walk_through_is_one_that_calibrate_takes(plan):
    text = (FULL.parents[1] / "docs" / "calibrate_your_own_powder.md").read_text(encoding="utf-8")
    files = {step["file"]: step["content"] for step in STEP.finditer(text) if step["file"]}
    found = plan(files["powder/study.toml"], files["powder/measurements.csv"])
    assert found.own == {"B", "C", "G"} and found.fixed == {"powder_density_kg_m3": 1650.0}
    for symbol, name in SYMBOLS.items():
        printed = next(f for f in screening_factors() if f.name == symbol)
        (row,) = (line for line in text.splitlines() if line.startswith(f"| {symbol} |"))
        assert f"`{name}`" in row and f"{printed.low:g} to {printed.high:g}" in row
    for command in re.findall(r"^    pellet-study calibrate (.*?)(?: +#.*)?$", text, flags=re.MULTILINE):
        parser = argparse.ArgumentParser()
        calibrate.add_arguments(parser)
        parser.parse_args(command.split())  # options that there are


def test_a_free_parameter_that_the_screening_does_not_vary_is_refused(plan):
    toml = "[parameters]\npowder_density_kg_m3 = { value = 1800, min = 1500, max = 2000 }\n"
    with pytest.raises(InputError, match="powder_density_kg_m3 = 1800"):
        plan(toml)
    known = "rig,observable,value,sd,powder_density_kg_m3\nrepose,repose_angle_deg,40,1,1500\n"
    assert plan(toml, known).fixed == {"powder_density_kg_m3": 1500.0}  # known there, so not free there


def test_means_of_several_readings_without_sd_give_that_of_a_reading(plan):
    """Means of 5, 40 and 42: sd of a mean sqrt(2), of a reading sqrt(10); standard error of all ten sqrt(10)/sqrt(10)."""
    found = plan("", rows("40,,5", "42,,5"))
    assert (found.target, found.n) == (41.0, 10)
    assert found.sd == pytest.approx(10**0.5)
    assert found.angle.sample.sd / found.angle.sample.n**0.5 == pytest.approx(1.0)
    assert found.angle.sample.n - 1 == 1  # degrees of freedom: two rows
    single = plan("", rows("40,,", "42,,", "44,,"))
    assert (single.sd, single.angle.sample.sd, single.angle.sample.n) == pytest.approx((2.0, 2.0, 3))
    assert single.remarks == ()
    with pytest.raises(InputError, match="all equal"):
        plan("", rows("40,,", "40,,"))


@pytest.mark.parametrize("angle", ("0", "-12", "90", "1e3"))
def test_an_angle_that_no_heap_has_is_refused(plan, angle):
    with pytest.raises(InputError, match="from 0 to 90 (deg )?only|above 0 and below 90"):
        plan("", rows(f"{angle},1,5"))


def test_levels_outside_the_screening_are_named_with_whose_range_it_is(plan):
    found = plan("[parameters]\npowder_static_friction = { min = 0.5, max = 0.8 }\n")
    middle = {f.name: f.centre for f in found.factors}
    assert found.outside(middle) == {}
    assert found.outside(middle | {"B": 0.8, "C": 0.25}) == {}  # the ends belong to it
    told = found.outside(middle | {"B": 0.81, "C": 0.2})
    assert told == {
        "B": "outside the range 0.5 to 0.8 of study.toml",
        "C": "outside the range 0.25 to 0.45 of the source paper's Table 6",
    }


def test_stated_sds_are_pooled_and_stand_for_a_blank_one(plan):
    found = plan("", rows("40,0.6,4", "40.2,0.8,4", "40.1,,4"))
    assert found.sd == pytest.approx(0.5**0.5) and found.n == 12  # mean of 0.36 and 0.64
    assert found.target == pytest.approx(40.1)
    assert found.remarks == ()
    assert (plan("", rows("40,0.6,9", "40,0.8,1")).sd) == pytest.approx((0.9 * 0.36 + 0.1 * 0.64) ** 0.5)


def test_rows_that_contradict_their_sd_widen_it_and_it_is_said(plan):
    found = plan("", rows("38,0.5,", "45,0.5,"))
    assert found.sd == found.margin == pytest.approx(7 / 2**0.5)
    assert len(found.remarks) == 1 and "0.5 deg" in found.remarks[0] and "4.9 deg" in found.remarks[0]


def test_rows_that_agree_with_their_sd_are_seldom_doubted(plan):
    draw = np.random.default_rng(3)
    doubted = sum(bool(plan("", rows(*(f"{x},1.0," for x in draw.normal(40, 1, 4)))).remarks) for _ in range(60))
    assert doubted <= 1  # 0.06 expected


def test_the_bond_number_is_the_rigs(plan):
    found = plan()
    other = "rig,observable,value,sd,amplification\nrepose,repose_angle_deg,40,1,12\n"
    keeps, lets = plan("", other), plan('surface_energy_scaling = "none"\n', other)
    six = bond(found, 0.2)
    assert six == pytest.approx(3.74, abs=0.01)  # 1.87 at 0.1 J/m2 and R = 1.294 mm
    assert bond(keeps, 0.2) == pytest.approx(six, rel=1e-12)
    assert bond(lets, 0.2) == pytest.approx(six / 4, rel=1e-12)  # 1/R2
    lighter = plan("[parameters]\npowder_density_kg_m3 = 916.5\n")
    assert bond(lighter, 0.2) == pytest.approx(2 * six, rel=1e-12)


@pytest.mark.skipif(not (FULL / "runs.csv").exists(), reason="no heap of results/full is committed yet")
def test_the_bond_number_is_that_of_the_committed_heaps():
    found = plan_of(load(FULL))
    runs = pd.read_csv(FULL / "runs.csv")
    for row in runs[runs["verdict"] == "ok"].itertuples():
        assert bond(found, row.G) == pytest.approx(row.bond_number, rel=1e-9)


def test_the_reading_is_the_one_that_was_measured(plan):
    flank = plan("", ANGLE.replace("repose_angle_deg", "repose_flank_deg"))
    assert (flank.observable, flank.target) == ("repose_flank_deg", 41.69)
    assert plan("", ANGLE).observable == "repose_angle_deg"
    both = plan("", ANGLE + "repose,repose_flank_deg,43.1,0.9\n")
    assert (both.observable, both.target) == ("repose_angle_deg", 41.69)  # the first angle steers
    assert [(one.observable, one.value, one.sd) for one in both.others] == [("repose_flank_deg", 43.1, 0.9)]


def test_a_record_without_the_conditions_that_were_fixed_is_of_the_same_plan_and_one_of_release_0_1_is_not(tmp_path):
    (tmp_path / "study.toml").write_text("")
    (tmp_path / "measurements.csv").write_text("rig,observable,value,sd\nrepose,repose_angle_deg,41.69,0.79\n")
    record = plan_of(load(tmp_path)).record
    given = record["plan"]["conditions"]
    before = {k: v for k, v in given.items() if k not in ("outlet_diameter_mm", "lift_speed_mm_s")}
    older = {k: v for k, v in before.items() if k not in ("protocol", "base", "base_diameter_mm")}
    assert differences(with_conditions({**record, "plan": {**record["plan"], "conditions": before}}), record) == []
    found = differences(with_conditions({**record, "plan": {**record["plan"], "conditions": older}}), record)
    assert any(words.startswith("protocol not given there") for words in found)
