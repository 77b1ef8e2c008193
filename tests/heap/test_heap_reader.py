"""The table of what the readings of a heap are worth follows from heaps of known shape, and the choice from the table."""

import sys

import numpy as np
import pandas as pd
import pytest

from tests import ROOT
from yade_scripts import heap

sys.path.insert(0, str(ROOT / "benchmarks"))

import heap_reader  # noqa: E402

TABLE = pd.read_csv(heap_reader.OUT)
CONES = TABLE[TABLE["shape"] == "cone"]


def test_the_right_angles_are_those_of_closed_forms():
    assert heap_reader.right_deg("cone", 37.0) == pytest.approx(37.0, abs=1e-6)
    assert heap_reader.right_deg("truncated", 37.0) == pytest.approx(37.0, abs=1e-6)
    r = np.linspace(0.2, 0.8, 10)
    round_top = np.degrees(np.arctan(r / np.hypot(r, heap_reader.ROUND)))  # falls less than 45 deg everywhere
    assert round_top.min() < heap_reader.right_deg("rounded", 45.0) < 45
    both = np.degrees(np.arctan([2 - heap_reader.STEEPER, heap_reader.STEEPER]))
    assert both[0] < heap_reader.right_deg("two slopes", 45.0) < both[1]
    lean = heap_reader.LEAN * np.cos(np.linspace(0, np.pi, 7, endpoint=False))  # foot moved against the apex
    both = [np.degrees(np.arctan(1 / (1 + side * lean))) for side in (1, -1)]
    assert heap_reader.right_deg("skewed", 45.0) == pytest.approx(np.mean(both), abs=0.05)


@pytest.mark.parametrize(("shape", "cut"), [("cone", 1.0), ("cone", 0.8), ("truncated", 1.0), ("skewed", 1.0)])
def test_volumes_are_those_of_closed_forms(shape, cut):
    whole = np.pi / 3 if cut == 1 else 2 * np.pi * (cut**2 / 2 - cut**3 / 3)
    volume = whole * (1 - 0.4**3) if shape == "truncated" else whole
    assert heap_reader.volume(shape, cut) == pytest.approx(volume, rel=0.02)


def test_a_packing_is_dense_and_hardly_overlaps():
    made = heap_reader.packing(2, wide=20.0, tall=12.0)
    apart = made.centres[:, None] - made.centres[None]
    apart[..., :2] -= made.wide * np.round(apart[..., :2] / made.wide)
    gap = np.linalg.norm(apart, axis=2) - made.radii[:, None] - made.radii[None] + 9 * np.eye(len(made.radii))
    assert gap.min() > -0.1
    solid = (4 / 3 * np.pi * made.radii**3).sum() / (20 * 20 * 12)
    assert solid == pytest.approx(heap_reader.SOLID, abs=0.01)
    assert (made.centres[:, 2] >= made.radii - 1e-9).all()


def test_the_rule_chooses_the_reading_that_stands_for_the_repose_angle():
    chosen = heap_reader.chosen(TABLE).split()[-1]
    found = heap.Readings(heap.Reading(1.0, 0.1), heap.Reading(2.0, 0.1), heap.Reading(3.0, 0.1))
    assert found.repose == getattr(found, chosen)


def test_every_reading_is_right_where_a_heap_is_some_grains_high():
    high = CONES[(CONES["grains"] > 1200) & (CONES["angle_deg"] >= 10)]
    assert len(high) > 30
    for reading in ("flank", "triangle", "moment"):
        bias = high[f"{reading}_bias_deg"].abs().dropna()
        photograph = high["base"].loc[bias.index] == "photograph"  # of few heaps, each seen from one side
        assert bias[~photograph].max() < 1.6 and not (bias[photograph] > 2).any(), reading


def test_a_row_follows_from_its_heaps():
    packings = [heap_reader.packing(seed) for seed in (1, 2, 3)]
    draws = [np.random.default_rng([k, 15]) for k in range(heap_reader.HEAPS)]
    heaps = [heap_reader.made(packings[k % 3], "cone", "plate", 30.0, 500, draw) for k, draw in enumerate(draws)]
    found = heap_reader.row("cone", "plate", 30.0, heaps)
    (committed,) = CONES[
        (CONES["base"] == "plate") & (CONES["angle_deg"] == 30) & CONES["grains"].between(400, 600)
    ].to_dict("records")
    for name, value in found.items():
        assert value == (committed[name] if isinstance(value, str) else pytest.approx(committed[name], abs=0.02)), name


def test_the_figures_the_page_states_are_those_of_the_table():
    """Every row `| shape | base | right | grains | bias +- sd ... |` of docs/heap_checks.md stands so in the table."""
    page = (ROOT / "docs" / "heap_checks.md").read_text(encoding="utf-8")
    section = page[page.index("## How the angle is read") : page.index("## Photographs taken badly")]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in section.splitlines() if line[:1] == "|"]
    for shape, base, right, grains, *readings in rows[2:]:
        same = (TABLE["shape"] == shape) & (TABLE["base"] == base) & (TABLE["right_deg"] == float(right))
        (found,) = TABLE[same & (TABLE["grains"] == int(grains))].to_dict("records")
        for name, stated in zip(("flank", "triangle", "moment"), readings, strict=True):
            bias, sd = found[f"{name}_bias_deg"], found[f"{name}_sd_deg"]
            assert stated == ("-" if np.isnan(bias) else f"{bias:+.2f} +- {sd:.2f}"), (shape, base, right, grains)
    assert len(rows) > 30
