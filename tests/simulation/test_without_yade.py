"""Without YADE its rigs cannot be compared, and the command says why."""

from tests.helpers.make_study import command, folder


def test_without_yade_its_rigs_cannot_be_compared(tmp_path, capsys, monkeypatch):
    from pellet_study.simulation import yade

    monkeypatch.setenv("PELLET_STUDY_YADE", str(tmp_path / "nowhere"))
    yade.executable.cache_clear()
    yade.version.cache_clear()
    study = folder(tmp_path, ["rig,observable,value,drop_height_mm", "rebound,rebound_height_mm,8,120"])
    status, _ = command("compare", study)
    yade.executable.cache_clear()
    yade.version.cache_clear()
    assert status == 2 and "nowhere" in capsys.readouterr().err
