"""Rows that are left out: kept with their reason, and used for nothing."""

from pellet_study.study.load import load
from tests.helpers.make_study import command, folder, slip_angle_deg

HEAD = "rig,observable,value,sd,layer_height_mm,split,reason"


def rows(more: list[str]) -> list[str]:
    fitted = [f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.6, 0.0):.4f},0.5,{h},," for h in (8, 16, 32, 60)]
    return [HEAD, *fitted, *more]


def answer(path):
    status, found = command("refine", path, json_file=path.parent / f"{path.name}.json")
    assert status == 0
    return [{k: v for k, v in step.items() if k != "left_out"} for step in found.pop("steps")], found


def test_a_row_left_out_changes_nothing(tmp_path):
    spilt = "layer_on_incline,slip_angle_deg,700,0.5,12,leave_out,the tray was knocked"  # no angle that can be read
    with_it, without = folder(tmp_path / "with", rows([spilt])), folder(tmp_path / "without", rows([]))
    assert answer(with_it) == answer(without)
    left = load(with_it).left_out
    assert [(row.value, row.reason, row.line) for row in left] == [(700.0, "the tray was knocked", 6)]
    assert len(load(with_it).rows) == 4


def test_fitted_it_would_change_the_answer(tmp_path):
    with_it, without = folder(tmp_path / "with", rows(["layer_on_incline,slip_angle_deg,70,0.5,12,,"])), rows([])
    assert answer(with_it) != answer(folder(tmp_path / "without", without))


def test_a_row_held_out_may_have_a_reason(tmp_path):
    held = "layer_on_incline,slip_angle_deg,31,0.5,12,holdout,kept for the check"
    assert load(folder(tmp_path / "study", rows([held]))).rows[-1].reason == "kept for the check"
