"""`pellet-study init --rig`: a study that runs as it stands, of any rig or of one's own."""

import pytest

import pellet_study as ps
from pellet_study.__main__ import main
from pellet_study.rigs import standard
from tests.helpers.make_study import command

FORMULAS = [name for name, rig in standard().rigs.items() if not rig.on_yade]
ON_YADE = [name for name, rig in standard().rigs.items() if rig.on_yade]


@pytest.mark.parametrize("name", [*FORMULAS, "ball_drop"])
def test_it_runs_as_it_stands(tmp_path, capsys, name):
    path = tmp_path / "s"
    assert main(["init", str(path), "--rig", name]) == 0
    assert "check" in capsys.readouterr().out.splitlines()[-1]
    for step in ("check", "compare", "diagnose", "refine", "report"):
        assert main([step, str(path)]) == 0, capsys.readouterr().err
    study = ps.load_study(path)
    assert study.assumed == {} and study.remarks == () and all(row.order for row in study.rows)


@pytest.mark.parametrize("name", ON_YADE)
def test_a_rig_on_yade_is_understood_as_it_stands(tmp_path, name):
    assert main(["init", str(tmp_path / "s"), "--rig", name]) == 0
    status, answer = command("check", tmp_path / "s", json_file=tmp_path / "a.json")
    assert status == 0 and answer["rigs"][0]["rig"] == name and answer["warnings"] == []
    assert sum(parameter["state"] == "free" for parameter in answer["parameters"]) == 1


def test_what_is_hidden_in_the_example_of_ones_own_rig_is_found(tmp_path, capsys):
    path = tmp_path / "s"
    assert main(["init", str(path), "--rig", "my_balance"]) == 0
    assert sorted(str(file.relative_to(path)) for file in path.rglob("*.py")) == [
        "effects/my_balance_offset.py",
        "rigs/my_balance.py",
    ]
    assert "templates for one of your own" in capsys.readouterr().out
    answer = ps.refine(ps.load_study(path))
    assert answer.verdict == "adequate" and answer.added == ["my_balance_offset"]
    assert answer.steps[-1]["parameters"]["my_balance_offset.offset_mm"] == pytest.approx(4.0, abs=2.0)


@pytest.mark.parametrize(
    "words, said",
    [
        (["--rig", "shear_cel"], ["'shear_cel' is unknown", "did you mean 'shear_cell'", "--own"]),
        (["--rig", "shear_cell", "--own"], ["comes with the package"]),
        (["--rig", "My Rig"], ["small letters"]),
        (["--own"], ["--rig NAME"]),
    ],
)
def test_names_that_cannot_be_meant_are_refused(tmp_path, capsys, words, said):
    assert main(["init", str(tmp_path / "s"), *words]) == 2
    error = capsys.readouterr().err
    assert all(word in error for word in said), error
    assert not (tmp_path / "s").exists()


def test_the_advice_for_a_name_near_anothers_works(tmp_path):
    assert main(["init", str(tmp_path / "s"), "--rig", "shear_cel", "--own"]) == 0
    assert (tmp_path / "s" / "rigs" / "shear_cel.py").exists()


def test_nothing_that_exists_is_overwritten(tmp_path, capsys):
    (tmp_path / "kept.txt").touch()
    assert main(["init", str(tmp_path), "--rig", "shear_cell"]) == 2
    assert [file.name for file in tmp_path.iterdir()] == ["kept.txt"]
