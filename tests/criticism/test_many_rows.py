"""Many rows: the work grows with their number, and the answers are those of the plain formulas."""

import sys

import numpy as np
import pytest
from scipy import special

from pellet_study.criticism import holdout, score_tests
from pellet_study.criticism.calibration import covariance, fit_study
from pellet_study.criticism.cell_means import CellMeans
from pellet_study.criticism.compare import compare
from pellet_study.criticism.residuals import row_residuals
from pellet_study.study.load import load
from tests.helpers.make_study import folder, slip_angle_deg


def many(path, number: int, conditions: int):
    """A study of as many rows, over as many conditions."""
    rng = np.random.default_rng(1)
    lines = ["rig,observable,value,layer_height_mm,sd"]
    for k in range(number):
        h = 8 * 7.5 ** ((k % conditions) / conditions)
        lines.append(
            f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.5, 0) + 0.5 * rng.standard_normal():.4f},{h:.8f},0.5"
        )
    return load(folder(path, lines))


def calls_of(study) -> int:
    """Calls of functions in a comparison: the same on every machine, however busy."""
    count = 0

    def counted(frame, event, argument) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(counted)
    try:
        found = compare(study, level_out=True)
    finally:
        sys.setprofile(None)
    assert len(found.rows) == len(study.rows)
    return count


@pytest.mark.parametrize("conditions", (6, None), ids=["six conditions", "all distinct"])
def test_compare_calls_no_more_than_its_rows_ask_for(tmp_path, conditions):
    """Four times the rows, four times the calls."""
    few, many_of_them = (calls_of(many(tmp_path / str(n), n, conditions or n)) for n in (1_000, 4_000))
    assert many_of_them < 4.4 * few


def test_rows_held_out_are_judged_by_their_whole_covariance(tmp_path):
    lines = ["rig,observable,value,layer_height_mm,sd,split,setup,setup_sd"]
    rng = np.random.default_rng(4)
    for k in range(40):
        h = 8 + 6 * (k % 8)
        lines.append(
            f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.5, 0) + 0.5 * rng.standard_normal():.4f},{h},0.5,"
            f"{'holdout' if k % 3 else 'fit'},day {k % 5},{0.2 + 0.1 * (k % 2)}"
        )
    study = load(folder(tmp_path / "study", lines))
    state = fit_study(study)
    held = [r for r in row_residuals(state) if r.row.split == "holdout"]
    own = np.diag([r.uncertainty**2 for r in held])
    for a, one in enumerate(held):
        for b, other in enumerate(held):
            if a != b and one.row.setup == other.row.setup:
                own[a, b] = one.row.setup_sd * other.row.setup_sd
    at = state.fit.point.copy()
    column, step = state.fit.problem.free[0], 1e-5
    place = {(c.conditions["layer_height_mm"]): k for k, c in enumerate(state.model.cases)}
    mean = state.model.predict(at).mean[0]
    at[column] += step
    slope = (state.model.predict(at).mean[0] - mean) / step
    slope = slope[[place[r.row.conditions["layer_height_mm"]] for r in held]]
    unit = max(1.0, state.fit.chi2 / (len(state.cells.case) - 1))
    together = own + unit * covariance(state.fit)[0, 0] * np.outer(slope, slope)
    error = np.array([r.residual for r in held])
    plain = special.fdtrc(len(held), state.cells.dof, error @ np.linalg.solve(together, error) / len(held))
    assert holdout.holdout_p(state, held) == pytest.approx(plain, rel=1e-3)


def test_draws_in_blocks_are_distributed_as_those_kept(monkeypatch):
    """Student's t of 5 degrees of freedom, by the blocks as by the whole."""
    cells = CellMeans(np.arange(60), np.zeros(60), np.ones(60), np.ones(60), 5.0, 0.0, group=(0,) * 60, group_dof=(5,))
    unit, basis = np.eye(60)[:1], np.zeros((60, 0))
    whole = score_tests.largest_null(unit, basis, cells, True, birge=False)
    monkeypatch.setattr(score_tests, "WHOLE_CELLS", 50)
    blocks = score_tests.largest_null(unit, basis, cells, True, birge=False)
    assert len(whole) == len(blocks) == score_tests.DRAWS
    for draws in (whole, blocks):
        assert (draws > special.stdtrit(5, 0.975)).mean() == pytest.approx(0.05, abs=0.01)


def test_neighbouring_levels_are_left_out_together_where_there_are_many(tmp_path):
    study = many(tmp_path / "study", 200, 100)
    state = fit_study(study)
    errors = holdout.level_out_errors(state)
    assert errors["layer_on_incline.layer_height_mm"] == pytest.approx(0.5, rel=0.15)
