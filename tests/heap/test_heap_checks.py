"""The measurements of the heap rig: what they ask for exists, the committed tables follow from the committed heaps."""

import sys

import numpy as np
import pandas as pd
import pytest

from tests import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))

import heap_cost  # noqa: E402
import heap_liggghts  # noqa: E402
import repose_checks  # noqa: E402

from pellet_study.rigs import on_yade  # noqa: E402
from pellet_study.simulation import dispatch  # noqa: E402

CHECKS = ROOT / "results" / "checks"
DOC = (ROOT / "docs" / "heap_checks.md").read_text(encoding="utf-8")


KNOWN = on_yade.rig("repose")
QUANTITIES = KNOWN.parameters | KNOWN.conditions | KNOWN.numerics


def test_every_setting_changes_one_value():
    base = {key: quantity["default"] for key, quantity in QUANTITIES.items()} | repose_checks.MIDDLE
    base |= on_yade.case("repose", contact_law=repose_checks.LAW)["numerics"] | repose_checks.FUNNEL
    for _, start, changes, _ in repose_checks.SETTINGS:
        for key, value in changes.items():
            assert value != (base | start)[key], key
        assert len(changes) <= 1


@pytest.mark.parametrize("name", repose_checks.TABLES)
def test_every_setting_is_in_its_range(name):
    for _, start, changes, _ in repose_checks.TABLES[name]:
        for key, value in (start | changes).items():
            assert QUANTITIES[key]["min"] <= value <= QUANTITIES[key]["max"], key


@pytest.mark.parametrize("name", repose_checks.TABLES)
def test_committed_tables_follow_from_their_heaps(name):
    heaps = pd.read_csv(CHECKS / f"{name}_heaps.csv")
    committed = pd.read_csv(CHECKS / f"{name}.csv", dtype={"first_loss": str})
    found = repose_checks.summary(heaps)
    assert list(found["setting"]) == list(committed["setting"])
    for column in ("angle_deg", "standard_error_deg", "change_deg", "change_error_deg", "heaps", "lost"):
        np.testing.assert_allclose(
            found[column].astype(float), committed[column].astype(float), atol=0.011, err_msg=column
        )


def test_summary_of_known_heaps():
    heaps = pd.DataFrame({"what": list("aabb"), "setting": list("aabb"), "repose_angle_deg": [40.0, 42.0, 44.0, 48.0]})
    heaps = heaps.assign(status="ok", contact_law="hertz_mindlin", of_rayleigh_step=0.18, grains=100)
    rest = set(on_yade.rig("repose").observables) - set(heaps) | {"million_grain_steps"}
    heaps = heaps.assign(**dict.fromkeys(rest, 1.0))
    first, second = repose_checks.summary(heaps).to_dict("records")
    pooled = np.sqrt((1 + 1 + 4 + 4) / 2)
    assert (first["angle_deg"], second["angle_deg"], second["change_deg"]) == (41.0, 46.0, 5.0)
    assert first["standard_error_deg"] == pytest.approx(pooled / np.sqrt(2), abs=0.01)
    assert second["change_error_deg"] == pytest.approx(pooled, abs=0.01)


def test_the_twins_energy_density_has_the_pull_off_force():
    """The greatest of k 4 pi R* d - 4/3 E* R*^(1/2) d^(3/2) over the overlaps, found by looking."""
    pull_off, young, radius = 6.1e-4, 4.3e4, 6.5e-4
    density = heap_liggghts.energy_density(pull_off, young, radius)
    overlap = np.linspace(0, radius, 100_001)
    pull = density * 4 * np.pi * radius * overlap - 4 / 3 * young * np.sqrt(radius) * overlap**1.5
    assert pull.max() == pytest.approx(pull_off, rel=1e-6)


def test_the_twin_starts_with_the_rigs_grains(tmp_path, monkeypatch):
    """The rig's own heap of some 180 grains has the radii the twin starts with, in their order."""
    monkeypatch.setenv("PELLET_STUDY_GRAINS", str(tmp_path))
    changes = {"powder_mass_g": 3.0, "outlet_height_mm": 30.0, "outlet_diameter_mm": 20.0, "funnel_diameter_mm": 26.0}
    case = repose_checks.case(5, changes)
    row = dispatch.run([case], tmp_path / ".store", workers=1, quiet=True).iloc[0]
    table = np.loadtxt(tmp_path / f"{row['id']}.csv", delimiter=",", skiprows=1)
    radii, places, speeds, funnel = heap_liggghts.grains(case)
    np.testing.assert_allclose(radii, table[:, 3], rtol=1e-12)
    assert places.shape == speeds.shape == (180, 3)
    assert places[:, 2].min() > funnel.bottom
    gaps = np.linalg.norm(places[:, None] - places[None], axis=2) + np.diag(np.full(180, np.inf))
    assert gaps.min() > 2 * radii.max()


def test_the_twin_makes_a_heap(tmp_path):
    if not heap_liggghts.shutil.which("liggghts"):
        pytest.skip("liggghts is not installed (Debian's package liggghts)")
    changes = {"powder_mass_g": 4.0, "outlet_height_mm": 22.0, "outlet_diameter_mm": 14.0, "funnel_diameter_mm": 26.0}
    case = repose_checks.case(
        5, changes | {"powder_surface_energy": 0.0, "time_step_fraction": 0.09}, law="hertz_mindlin"
    )
    found = heap_liggghts.twin(case, tmp_path)
    assert found["status"] == "ok"
    assert 10 < found["angle_deg"] < 50
    assert found["cpu_seconds"] > 0


def test_funnels_of_the_cost_are_of_one_shape():
    small, large = (heap_cost.scaled(grains) for grains in (500, 4000))
    assert large["conditions"]["powder_mass_g"] == pytest.approx(8 * small["conditions"]["powder_mass_g"])
    assert large["conditions"]["outlet_height_mm"] == pytest.approx(2 * small["conditions"]["outlet_height_mm"])
    for name in ("outlet_diameter_mm", "funnel_diameter_mm"):
        assert large["numerics"][name] == pytest.approx(2 * small["numerics"][name])


def test_the_figures_the_page_states_are_those_of_the_tables():
    """Every row of the page's tables, `| setting | angle +- error | ... |`, stands so in its CSV file."""
    stated = 0
    for name in repose_checks.TABLES:
        for row in pd.read_csv(CHECKS / f"{name}.csv").itertuples():
            if row.lost < row.heaps:
                line = f"| {row.what} | {row.setting} | {row.heaps} | {row.angle_deg:.1f} +- {row.standard_error_deg:.1f} |"
                assert line in DOC, line
                stated += 1
    assert stated > 20
