"""The contact laws on real YADE, against closed forms: what must hold holds, what cannot is reported as such."""

import csv
import json
import math
import subprocess

import pandas as pd
import pytest

from pellet_study.rigs import on_yade
from pellet_study.rigs.scripts import SCRIPTS
from pellet_study.simulation import dispatch, law_cases, law_checks, yade
from pellet_study.simulation.law_cases import DISSIPATING, LOCAL_DAMPING, MINDLIN
from yade_scripts import contacts, layered
from yade_scripts.checks import sphere_scene

pytestmark = pytest.mark.yade


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """All checks on YADE, about 20 s of one core."""
    rows = dispatch.run(law_cases.cases(), tmp_path_factory.mktemp("store"), quiet=True)
    assert (rows["status"] == "ok").all(), rows.loc[rows["status"] != "ok", ["rig", "status"]].to_string()
    return law_checks.table(rows)


def of(table: pd.DataFrame, check: str, observable: str = "", law: str = "", setting: str = "") -> pd.DataFrame:
    """Rows that compare with the request (not with what the law gives in its place)."""
    chosen = (table["check"] == check) & ~table["remark"].str.startswith("instead")
    chosen &= table["setting"].str.startswith(observable) & table["setting"].str.contains(setting)
    return table[chosen & table["contact_law"].str.startswith(law)]


def assert_within(rows: pd.DataFrame, at_least: int) -> None:
    """All rows are within tolerance, and there are enough of them to say so."""
    assert len(rows) >= at_least
    bad = rows[~rows["within"]]
    assert bad.empty, bad.to_string()


def test_restitution_is_the_one_requested(table):
    rows = of(table, "restitution", law=MINDLIN)
    rows = rows[~rows["setting"].str.contains("time_step_fraction|surface_energy")]
    assert rows["requested"].min() == 0.05 and rows["requested"].max() == 0.9
    assert_within(rows, 50)
    assert rows["setting"].str.contains("speed_m_s 0.1$").any() and rows["setting"].str.contains("speed_m_s 4$").any()


def test_too_long_a_time_step_is_reported(table):
    rows = of(table, "restitution", law=MINDLIN, setting="restitution 0.05, .*time_step_fraction 0.05")
    assert len(rows) == 1 and not rows["within"].item()
    assert "time step" in rows["remark"].item() and "off by -" in rows["remark"].item()


def test_contacts_are_as_stiff_as_the_closed_form(table):
    for law in (MINDLIN, LOCAL_DAMPING):
        assert_within(of(table, "hertz", "force_n", law), 6)
        assert_within(of(table, "hertz", "contact_time_s", law), 6)


def test_sliding_starts_at_atan_mu(table):
    assert_within(of(table, "sliding", "slip_angle_deg", MINDLIN), 12)
    assert_within(of(table, "sliding", "slip_angle_deg", LOCAL_DAMPING), 8)
    assert_within(of(table, "clump_sliding", "slip_angle_deg"), 9)


def test_sliding_friction_is_mu_without_local_damping(table):
    assert_within(of(table, "sliding", "effective_friction", MINDLIN), 12)
    assert_within(of(table, "sliding", "effective_friction", LOCAL_DAMPING, "cohesive_frictional_damping 0$"), 4)


def test_rolling_friction_whatever_the_spring(table):
    assert_within(of(table, "rolling", law=MINDLIN, setting="impact_m_s 0,|impact_m_s 0$"), 36)
    assert_within(of(table, "rolling", law=LOCAL_DAMPING, setting="cohesive_frictional_damping 0$"), 6)


def test_a_bounce_does_not_brake(table):
    rows = of(table, "rolling", law=MINDLIN, setting="impact_m_s 0.05")
    assert len(rows) == 27
    assert (rows["measured"] < 1.02 * rows["requested"]).all(), rows.to_string()
    assert_within(rows[rows["setting"].str.contains("rolling_spring 0.2$")], 9)
    tiny = rows[rows["requested"] == 0.005]
    assert_within(tiny, 9)


def test_pull_off(table):
    assert_within(of(table, "pull_off", law=MINDLIN), 11)
    rows = of(table, "pull_off", law=LOCAL_DAMPING)
    unequal = rows["setting"].str.contains("other_radius_mm 0.13")
    assert_within(rows[~unequal], 6)
    assert unequal.sum() == 3 and not rows[unequal]["within"].any()


def test_nothing_jumps_where_adhesion_begins(table):
    assert_within(of(table, "adhesion_jump"), 16)


def test_each_pair_keeps_its_own_contact_parameters(table):
    for pair in ("powder_powder", "powder_steel"):
        for what in ("static_friction", "rolling_friction", "pull_off_n"):
            assert_within(of(table, "two_pairs", f"{pair}_{what}"), 7)
    undamped = of(table, "two_pairs", "powder_steel_restitution", LOCAL_DAMPING, "cohesive_frictional_damping 0$")
    assert_within(undamped, 3)
    rows = of(table, "two_pairs", law=MINDLIN)
    rows = rows[rows["setting"].str.contains("^powder_[a-z]*_restitution") & ~rows["setting"].str.contains("energy")]
    assert set(rows["requested"]) == {0.3, 0.6}
    assert_within(rows, 4)


def test_the_clump_as_a_body(table):
    rows = of(table, "clump_inertia")
    assert len(rows) == 12
    assert (rows["difference"].abs() <= 0.01 * rows["requested"]).all(), rows.to_string()


def test_a_clump_on_one_member_has_the_restitution_requested(table):
    rows = of(table, "clump_restitution", "restitution", MINDLIN, "members_touching 1")
    assert_within(rows[~rows["setting"].str.contains("time_step_fraction")], 18)
    counts = of(table, "clump_restitution", "contacts")
    assert_within(counts[~counts["setting"].str.contains("time_step_fraction")], 56)


def test_grains_rebound_and_stick_as_restitution_and_adhesion_say(table):
    """Within .03 of sqrt(e^2 (v^2 + w) - w)/v, but within a fifth of the sticking speed; that itself within 15 %."""
    rows = of(table, "grain_impact")
    assert rows["setting"].str.contains("restitution 0.05, speed_m_s 0.05").any() and (rows["requested"] > 0.85).any()
    assert (rows["requested"] == 0).any()
    assert_within(rows[~rows["remark"].str.contains("decides whether they part")], 34)
    assert_within(of(table, "grain_sticking", setting="restitution 0.[0135]"), 7)


def test_no_damper_pulls(table):
    rows = of(table, "grain_pull_off")
    assert rows["setting"].str.contains("apart_mm_s 50").sum() >= 4
    assert_within(rows, 12)


def test_cohesion_raises_both_limits_as_its_source_says(table):
    rows = of(table, "grain_limits")
    assert_within(rows, 26)
    assert (rows["setting"].str.contains("load_n -0.0001")).sum() == 4  # in tension


def test_grains_gain_no_energy(table):
    assert_within(of(table, "grain_energy"), 18)


def test_grains_and_walls_keep_their_own_constants(table):
    assert_within(of(table, "grain_and_wall"), 32)


def test_the_damper_of_a_time_step_is_that_of_a_contact_in_small_steps():
    """A linear spring whose damper may not pull (Schwager & Poeschel 2007, doi:10.1007/s10035-007-0065-z)."""
    ratio = 0.3
    root = (1 - ratio**2) ** 0.5
    exact = math.exp(-ratio / root * (math.pi - math.atan2(2 * ratio * root, 1 - 2 * ratio**2)))
    assert layered.rebound(ratio, 1.0, 1e-3).mean() == pytest.approx(exact, abs=1e-3)
    for step in (0.01, 0.1, 0.3):
        assert layered.rebound(layered.damping_ratio(0.4, 0.5, step), 0.5, step).mean() == pytest.approx(0.4, abs=1e-6)
    with pytest.raises(ValueError, match="a smaller time_step_fraction"):
        layered.damping_ratio(0.05, 0.5, 0.3)


@pytest.mark.parametrize(
    ("check", "observable", "law", "setting", "words"),
    [
        ("restitution", "restitution", LOCAL_DAMPING, "restitution 0.25, ", "no damper in the law"),
        ("restitution", "restitution", MINDLIN, "surface_energy_j_m2 0.5$", "the damper may pull"),
        ("sliding", "effective_friction", LOCAL_DAMPING, "damping 0.3$", "local damping d slows"),
        ("rolling", "rolling_friction", LOCAL_DAMPING, "friction 0.05, .*damping 0.3$", "local damping d brakes"),
        ("clump_restitution", "restitution", LOCAL_DAMPING, "", "no damper in the law"),
        ("clump_restitution", "restitution", MINDLIN, "members_touching [26], speed_m_s 2$", "n members at once"),
        ("two_pairs", "powder_powder_restitution", LOCAL_DAMPING, "", "no damper in the law"),
        ("two_pairs", "powder_steel_restitution", LOCAL_DAMPING, "damping 0.3$", "local damping acts on this pair"),
        ("two_pairs", "powder_steel_hertz_share", MINDLIN, "", "R* on a box"),
        ("pull_off", "pull_off_n", LOCAL_DAMPING, "other_radius_mm 0.13", "Rmin^2"),
    ],
)
def test_what_cannot_hold_is_reported(table, check, observable, law, setting, words):
    rows = of(table, check, observable, law, setting)
    rows = rows[~rows["within"]]
    assert not rows.empty
    assert rows["remark"].str.startswith("cannot: ").all()
    assert rows["remark"].str.contains(words, regex=False).all(), rows["remark"].tolist()
    assert rows["remark"].str.contains(r"; off by [+-][\d.e+-]+ \([+-][\d.]+%\)$").all(), rows["remark"].tolist()


def test_what_the_law_gives_instead_has_its_own_closed_form(table):
    # e.g. local damping sqrt((1-d)/(1+d)), n members sqrt(n) beta, sliding mu + d (tan(tilt) - mu)
    cannot = table[~table["within"] & table["remark"].str.startswith("cannot")]
    assert not cannot["remark"].str.contains("no limit of the law is known").any(), cannot.to_string()
    failed = table[~table["within"] & table["remark"].str.startswith("instead")]
    assert failed.empty, failed.to_string()


def test_damping_ratio_against_another_integration():
    for restitution in (0.05, 0.07, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 0.95):
        ratio = contacts.damping_ratio(restitution)
        assert sphere_scene.damped_restitution(ratio) == pytest.approx(restitution, abs=1e-3)
    assert sphere_scene.damped_restitution(0.0) == pytest.approx(1.0, abs=1e-4)


def test_quick_is_part_of_the_whole():
    everything, quick = law_cases.cases(), law_cases.cases(quick=True)
    assert all(case in everything for case in quick)
    assert {case["rig"] for case in quick} == set(law_cases.CHECKS)
    assert {case["contact_law"] for case in quick} == {MINDLIN, LOCAL_DAMPING, DISSIPATING}
    assert len(quick) < len(everything) / 3


def row(measured: float, restitution: float, status: str = "ok", **more) -> pd.DataFrame:
    """A row as dispatch gives it."""
    case = on_yade.case("restitution", parameters={"restitution": restitution})
    values = {**case["parameters"], **case["conditions"], **case["numerics"], "measured_restitution": measured}
    head = {"rig": "restitution", "contact_law": MINDLIN, "status": status}
    return pd.DataFrame([head | values | more])


@pytest.mark.parametrize(
    ("requested", "measured", "within"),
    [(0.05, 0.0549, True), (0.05, 0.0551, False), (0.05, 0.0449, False), (0.9, 0.917, True), (0.9, 0.881, False)],
)
def test_tolerance_is_2_percent_or_0_005(requested, measured, within):
    found = law_checks.table(row(measured, requested))
    assert list(found.columns) == law_checks.COLUMNS
    assert found["within"].tolist() == [within]
    assert found["difference"].item() == pytest.approx(measured - requested)
    assert found["tolerance"].item() == pytest.approx(max(0.005, 0.02 * requested))
    assert bool(found["remark"].item()) is not within


def test_a_failed_simulation_is_not_within():
    found = law_checks.table(row(float("nan"), 0.5, status="crashed YADE (SIGSEGV)"))
    assert found["within"].tolist() == [False] and found["remark"].tolist() == ["crashed YADE (SIGSEGV)"]


def test_a_check_runs_by_hand(tmp_path):
    check = SCRIPTS / "checks" / "hertz.py"
    for arguments in (("--example", "cases.json"), ("cases.json", "observables.csv")):
        subprocess.run(
            yade.command(check, *arguments),
            cwd=tmp_path,
            env=yade.environment(str(tmp_path)),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            check=True,
            timeout=60,
        )
    case = json.loads((tmp_path / "cases.json").read_text())[0]
    with open(tmp_path / "observables.csv", newline="") as file:
        (found,) = csv.DictReader(file)
    assert found["status"] == "ok"
    from yade_scripts.checks import hertz

    assert float(found["force_n"]) == pytest.approx(hertz.expected(case)["force_n"], rel=0.02)
