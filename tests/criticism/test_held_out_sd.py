"""A reading held out has the scatter that the fitted ones' rule gives a reading of its size."""

import numpy as np
import pytest

from pellet_study.criticism.used_sd import reading_sd, used_sds
from pellet_study.study.measurements import Measurement


def rows_of(sizes, held, rng, share=0.02, repeats=4, constant=0.0):
    """Readings of a rig at conditions whose true values are `sizes` and, held out, `held`; sd blank."""
    rows = []
    for split, values in (("fit", sizes), ("holdout", held)):
        for value in values:
            for _ in range(repeats):
                reading = value + rng.normal() * (share * value + constant)
                given = {"diameter_mm": value}
                rows.append(
                    Measurement("hopper", "rate_g_s", reading, None, 1, given, {}, "", 0.0, split, "", len(rows))
                )
    return rows


SIZES = np.array([12.0, 25.0, 50.0, 90.0, 150.0, 240.0, 400.0])


def test_noise_that_grows_with_the_reading_grows_beyond_the_rows_fitted():
    """2 % of 800 are 16; that of the nearest cell fitted, of 400, would be 8."""
    rng = np.random.default_rng(1)
    found = []
    for _ in range(60):
        rows = rows_of(SIZES, [800.0], rng)
        found += [sd / row.value for row, sd in zip(rows, reading_sd(rows), strict=True) if row.split == "holdout"]
    assert np.median(found) == pytest.approx(0.02, rel=0.15)


@pytest.mark.parametrize(("share", "constant"), [(0.02, 0.0), (0.2, 0.0), (0.0, 2.0)])
@pytest.mark.parametrize("held", [18.0, 120.0, 800.0])
def test_honest_readings_held_out_lie_within_their_scatter(share, constant, held):
    """They scatter by one of their own standard deviations, and none of 600 lies beyond 5."""
    rng = np.random.default_rng(2)
    z = []
    for _ in range(150):
        rows = rows_of(SIZES, [held], rng, share, constant=constant)
        at = {id(r): held for r in rows if r.split == "holdout"}  # as the true model predicts it
        z += [(r.value - held) / sd for r, sd in zip(rows, reading_sd(rows, at), strict=True) if r.split == "holdout"]
    assert np.max(np.abs(z)) < 5
    assert 0.8 < np.std(z) < 1.3


def test_the_sd_that_is_shown_is_the_one_that_counts():
    rows = rows_of(SIZES, [18.0, 800.0], np.random.default_rng(3))
    shown = used_sds(rows)
    for row, sd, used in zip(rows, reading_sd(rows), shown, strict=True):
        if row.split == "holdout":
            assert used.sd == sd
            assert "of this size" in used.why


@pytest.mark.parametrize(
    ("values", "held"), [([[30.0, 30.0], [40.0, 40.0]], [30.6, 15.05]), ([[0.1] * 3, [0.3] * 3], [0.0])]
)
def test_a_row_held_out_does_not_change_what_the_fitted_ones_have(values, held):
    """Equal replicates have the last digit written as their sd; another last digit held out makes it no finer."""
    cells = [(value, "fit", k) for k, of in enumerate(values) for value in of] + [(v, "holdout", 9) for v in held]
    rows = [
        Measurement("box", "angle_deg", value, None, 1, {"wall": float(k)}, {}, "", 0.0, split, "", line)
        for line, (value, split, k) in enumerate(cells)
    ]
    fitted = [row for row in rows if row.split == "fit"]
    alone, together = reading_sd(fitted), reading_sd(rows)
    assert together[: len(fitted)] == alone and min(alone) > 0.05
    assert min(together[len(fitted) :]) >= min(alone)


def test_stated_sds_that_grow_with_the_reading_do_so_for_one_held_out():
    """2 % of 10, 50, 100 and 400 are stated: of 800 they say 16; a row that is fitted without one has their root mean square."""
    stated = [(10.0, 0.2), (50.0, 1.0), (100.0, 2.0), (400.0, 8.0)]
    rows = [
        Measurement("box", "angle_deg", v, sd, 1, {"wall": v}, {}, "", 0.0, "fit", "", k)
        for k, (v, sd) in enumerate(stated)
    ]
    rows.append(Measurement("box", "angle_deg", 800.0, None, 1, {"wall": 800.0}, {}, "", 0.0, "holdout", "", 9))
    assert reading_sd(rows)[-1] == pytest.approx(16.0, rel=0.1)
    rows.append(Measurement("box", "angle_deg", 70.0, None, 1, {"wall": 70.0}, {}, "", 0.0, "fit", "", 10))
    assert reading_sd(rows)[-1] == pytest.approx(np.sqrt(np.mean([0.2**2, 1.0, 4.0, 64.0])))
    alone = [rows[-2], Measurement("box", "angle_deg", 5.0, 0.1, 1, {"wall": 5.0}, {}, "", 0.0, "holdout", "", 11)]
    assert reading_sd(alone) == [None, 0.1]
