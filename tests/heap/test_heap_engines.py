"""Heaps by other engines: cells that exist, dampers that give what is asked of them, a table that follows from its heaps."""

import io
import shutil
import sys

import pandas as pd
import pytest

from tests import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))

import heap_engines  # noqa: E402
from engines import lammps, liggghts  # noqa: E402

CHECKS = ROOT / "results" / "checks"
SWITCHES = {"YADE": set(), "LIGGGHTS": liggghts.SWITCHES, "LAMMPS": lammps.SWITCHES}


def test_cells_have_names_of_their_own_and_known_switches():
    names = [cell.what for cell in heap_engines.CELLS]
    assert len(set(names)) == len(names)
    for cell in heap_engines.CELLS:
        assert set(cell.switches) <= SWITCHES[cell.engine]
        assert cell.ours in heap_engines.CELLS
        assert cell.case(1)["contact_law"] == "cohesive_frictional" + "_local_damping" * cell.release
        assert cell.release or cell.case(1)["numerics"]["time_step_fraction"] == cell.step


@pytest.mark.parametrize("share", [lammps.SHARE, 1.0])
@pytest.mark.parametrize("restitution", [0.15, 0.3, 0.7])
def test_the_damper_has_the_restitution_asked_for(restitution, share):
    assert lammps.impact(lammps.viscosity(restitution, share, 0.05), share, 0.05) == pytest.approx(
        restitution, abs=1e-4
    )


def test_a_step_too_long_for_a_damper_is_refused():
    with pytest.raises(ValueError, match="too long"):
        lammps.viscosity(0.05, 1.0, 0.5)


@pytest.mark.parametrize("engine", ["LIGGGHTS", "LAMMPS"])
def test_another_engine_makes_our_heap(engine, tmp_path):
    """500 grains without cohesion: 32 to 42 deg of height in ours (results/checks/default_heaps.csv)."""
    if not shutil.which(heap_engines.COMMANDS[engine]):
        pytest.skip(f"Debian's package {engine.lower()} is not installed")
    row, seconds = heap_engines.other(heap_engines.Cell(engine, 0.0, small=True), 7, tmp_path)
    assert row["status"] == "ok" and seconds > 0
    assert 28 < row["repose_height_deg"] < 46


def test_the_table_has_a_line_a_cell_and_reading():
    ours, theirs = (heap_engines.Cell(engine, 0.0, 0.3) for engine in ("YADE", "LAMMPS"))
    rows = [
        {"what": cell.what, "seed": seed, "status": "ok", "cpu_seconds": 5.0}
        | {key: 30.0 + 2 * (cell == theirs) + 0.1 * seed for key in heap_engines.READINGS}
        for cell in (ours, theirs)
        for seed in range(3)
    ]
    lost = {"what": theirs.what, "seed": 3, "status": "jammed", "cpu_seconds": 9.0}
    table = heap_engines.summary(pd.DataFrame([*rows, lost])).set_index(["what", "reading"])
    line = table.loc[(theirs.what, "repose_triangle_deg")]
    assert (line["heaps"], line["lost"], line["cpu_seconds"], line["first_loss"]) == (3, 1, 6.0, "jammed")
    assert line["to_ours_change_deg"] == pytest.approx(2.0)
    assert line["to_ours_low_deg"] < 2.0 < line["to_ours_high_deg"]
    spread = 0.1  # of 0, 0.1 and 0.2
    assert line["cpu_seconds_quarter_deg"] == pytest.approx(24.0 / 3 * (spread / 0.25) ** 2, abs=0.01)
    assert len(table) == 8


def test_the_table_follows_from_its_heaps_and_stands_on_the_page():
    made = io.StringIO(heap_engines.summary(pd.read_csv(CHECKS / "heap_engines_heaps.csv")).to_csv(index=False))
    table = pd.read_csv(CHECKS / "heap_engines.csv")
    pd.testing.assert_frame_equal(pd.read_csv(made), table)
    page = (ROOT / "docs" / "heap_physics.md").read_text(encoding="utf-8")
    for line in heap_engines.page(table):
        assert line in page, line
