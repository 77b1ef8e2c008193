"""The bulk density of a fill is that of packings of known density."""

import sys

import numpy as np
import pytest

from tests import ROOT
from yade_scripts import fill

sys.path.insert(0, str(ROOT / "benchmarks"))

import heap_reader  # noqa: E402


@pytest.mark.parametrize("outlet", [6.0, 9.0])
def test_a_random_packing_has_its_density(outlet):
    """Solid 0.6 of grains of 2,000 kg/m3: 1,200 kg/m3, in the mean over places of the axis."""
    packed = heap_reader.packing(2, wide=24.0, tall=20.0)
    found = []
    for k in range(12):
        centres = packed.centres - [8 + k % 4 * 3, 8 + k // 4 * 3, 0]
        centres[:, :2] -= packed.wide * np.round(centres[:, :2] / packed.wide)
        found.append(fill.bulk_density(1e-3 * centres, 1e-3 * packed.radii, 2000.0, 1e-3 * outlet))
    assert np.mean(found) == pytest.approx(1200.0, rel=0.02)
    assert np.std(found) < 60


def test_a_fill_too_low_to_be_read_has_none():
    low = np.random.default_rng(1).uniform(-5, 5, (60, 3)) * [1, 1, 0.1]
    assert fill.bulk_density(low, np.ones(60), 1.0, 5.0) is None
    assert fill.bulk_density(low + [40, 0, 0], np.ones(60), 1.0, 5.0) is None
