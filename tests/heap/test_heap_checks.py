"""The measurements of the heap rig: what they ask for exists, the committed tables follow from the committed heaps."""

import io
import sys

import numpy as np
import pandas as pd
import pytest
from scipy.special import stdtrit

from tests import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))

import published_heaps  # noqa: E402
import repose_checks  # noqa: E402

from pellet_study.rigs import on_yade  # noqa: E402

CHECKS = ROOT / "results" / "checks"
DOC = (ROOT / "docs" / "heap_checks.md").read_text(encoding="utf-8")


KNOWN = on_yade.rig("repose")
QUANTITIES = KNOWN.parameters | KNOWN.conditions | KNOWN.numerics


@pytest.mark.parametrize("name", repose_checks.TABLES)
def test_every_row_changes_something_within_its_range(name):
    default = {key: quantity["default"] for key, quantity in QUANTITIES.items()} | repose_checks.MIDDLE
    for row in repose_checks.TABLES[name]():
        assert row.base is None or default | row.changes != default | row.base, row
        for key, value in (row.changes | (row.base or {})).items():
            declared = QUANTITIES[key]
            assert (
                value in declared["options"] if "options" in declared else declared["min"] <= value <= declared["max"]
            ), key


@pytest.fixture(scope="module")
def heaps():
    kept = repose_checks.Heaps(anew=False, workers=1)
    kept.version = "2023.02a"
    return kept


@pytest.mark.parametrize("name", repose_checks.TABLES)
def test_the_tables_follow_from_their_heaps(name, heaps):
    table = repose_checks.table_of(repose_checks.TABLES[name](), heaps)
    if table.empty:  # no heap of it has been made
        assert not (CHECKS / f"{name}.csv").exists()
        return
    made = io.StringIO(table.to_csv(index=False))
    pd.testing.assert_frame_equal(pd.read_csv(made), pd.read_csv(CHECKS / f"{name}.csv"))


def test_the_table_of_versions_follows_from_its_heaps(heaps):
    made = io.StringIO(repose_checks.versions(heaps).to_csv(index=False))
    pd.testing.assert_frame_equal(pd.read_csv(made), pd.read_csv(CHECKS / "versions.csv"))


def test_the_page_has_the_lines_of_the_tables():
    """Every line of a table of the default heap stands on its page."""
    page = (ROOT / "docs" / "heap_physics.md").read_text(encoding="utf-8")
    for name in (*repose_checks.TABLES, "versions"):
        if (CHECKS / f"{name}.csv").exists():
            for line in repose_checks.page(pd.read_csv(CHECKS / f"{name}.csv")):
                assert line in page, line
    table = pd.read_csv(CHECKS / "invariance.csv")
    assert f"at G = 0.2, is {repose_checks.scatter(table, 0.2):.1f} deg" in " ".join(page.split())
    overlaps = table[table["surface_energy_j_m2"] == 0.2].set_index("setting")["largest_overlap"]
    softer, stiffer = (overlaps[f"stiffness_scale {scale}"] for scale in ("0.00033", "0.003"))
    assert f"the stiffness ({stiffer:.2f}) and a third of it ({softer:.2f})" in " ".join(page.split())


def test_the_difference_of_known_heaps_has_welchs_interval():
    """Means 46 and 41, their variances 4 and 1 on one degree of freedom each: t on (4 + 1)^2 / (4^2 + 1^2) degrees."""
    found = repose_checks.difference(np.array([44.0, 48.0]), np.array([40.0, 42.0]), 1.0)
    half = stdtrit(25 / 17, 0.975) * np.sqrt(5)
    assert (found["change_deg"], found["standard_error_deg"]) == (5.0, 2.24)
    assert (found["low_deg"], found["high_deg"]) == pytest.approx((5 - half, 5 + half), abs=0.01)
    assert found["aim_is"] == "open"
    sure = np.array([0.0, 1e-3])
    assert repose_checks.difference(40 + sure, 42 + sure, 1.0)["aim_is"] == "missed"
    assert repose_checks.difference(41.5 + sure, 42 + sure, 1.0)["aim_is"] == "met"


def test_heaps_of_one_seed_are_compared_pair_by_pair():
    """Differences 1 and 3: mean 2, standard error 1 on one degree of freedom, however far the pairs are apart."""
    found = repose_checks.difference(np.array([11.0, 53.0]), np.array([10.0, 50.0]), None, paired=True)
    assert (found["change_deg"], found["standard_error_deg"]) == (2.0, 1.0)
    assert found["high_deg"] == pytest.approx(2 + stdtrit(1, 0.975), abs=0.01)


def test_rigs_of_another_number_of_grains_are_of_one_shape():
    small, large = (repose_checks.case(1, repose_checks.shaped(grains)) for grains in (500, 4000))
    assert large["conditions"]["powder_mass_g"] == pytest.approx(8 * small["conditions"]["powder_mass_g"], rel=1e-4)
    for name in repose_checks.LENGTHS:
        group = "conditions" if name in small["conditions"] else "numerics"
        assert large[group][name] == pytest.approx(2 * small[group][name], rel=1e-3)


def test_the_figures_the_page_states_are_those_of_the_tables():
    """Every row of the tables of release 0.1, `| setting | angle +- error | ... |`, stands so in its CSV file."""
    stated = 0
    for name in ("repose", "repose_amplification", "repose_time_steps"):
        for row in pd.read_csv(CHECKS / f"{name}.csv").itertuples():
            if row.lost < row.heaps:
                line = f"| {row.what} | {row.setting} | {row.heaps} | {row.angle_deg:.1f} +- {row.standard_error_deg:.1f} |"
                assert line in DOC, line
                stated += 1
    assert stated > 20


def test_the_published_heaps_are_those_of_their_formulas_and_stand_on_the_page():
    """Zhou et al. 2002: 29.6 d^-0.206 measured, 68.61 mu^... d^-0.2 simulated; at 10 mm 18.4 and 19.2 deg."""
    table = pd.read_csv(CHECKS / "published_heaps.csv")
    page = (ROOT / "docs" / "heap_physics.md").read_text(encoding="utf-8")
    assert all(line in page for line in published_heaps.page(table)) and len(published_heaps.page(table)) == 3
    assert published_heaps.measured_deg(10.0) == pytest.approx(18.42, abs=0.01)
    assert published_heaps.correlation_deg(10.0) == pytest.approx(19.15, abs=0.01)
    for row in table.itertuples():
        assert row.correlation_deg == pytest.approx(published_heaps.correlation_deg(row.diameter_mm), abs=0.01)
    case = published_heaps.case(10.0, "lifted_cylinder", 1)
    assert case["parameters"]["powder_rolling_friction"] == pytest.approx(0.01)
    assert case["parameters"]["powder_surface_energy"] == 0.0


def test_the_table_of_readings_follows_from_its_heaps_and_stands_on_the_page(heaps):
    table = repose_checks.readings(heaps)
    made = io.StringIO(table.to_csv(index=False))
    pd.testing.assert_frame_equal(pd.read_csv(made), pd.read_csv(CHECKS / "readings.csv"))
    page = (ROOT / "docs" / "heap_physics.md").read_text(encoding="utf-8")
    assert all(line in page for line in repose_checks.readings_page(table)) and len(table) == 16


def test_a_case_keeps_its_name_wherever_its_rig_declares_a_quantity():
    case = repose_checks.case(1, {})
    moved = {**case, "numerics": {**case["numerics"], "outlet_diameter_mm": 24.0}}
    moved["conditions"] = {k: v for k, v in case["conditions"].items() if k != "outlet_diameter_mm"}
    assert repose_checks.name_of(moved) == repose_checks.name_of(case)
    assert repose_checks.name_of(repose_checks.case(1, {"outlet_diameter_mm": 30.0})) != repose_checks.name_of(case)
