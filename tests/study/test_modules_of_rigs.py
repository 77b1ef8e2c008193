"""Modules that a rig of the user's own imports belong to it: a change in one begins a new history and renews simulations."""

import json
from dataclasses import replace

import pytest

from pellet_study.rigs import on_yade, standard
from pellet_study.rigs.scripts import fingerprint
from tests.criticism.test_newcomer import BALL, ball
from tests.helpers.make_study import command

HELPED = BALL.replace("def predict", "import _helper_of_drop\n\n\ndef predict")


def basis(study, tmp_path):
    assert command("compare", study, json_file=tmp_path / "answer.json")[0] == 0
    return json.loads((tmp_path / "answer.json").read_text())["basis"]


def test_a_study_whose_rig_imports_a_changed_module_has_another_basis(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path / "s" / "rigs"))
    study = ball(tmp_path / "s", lambda h, v: f"{v:.3f},{0.01 * v:.4f},{h}", rig=HELPED)
    (study / "rigs" / "_helper_of_drop.py").write_text("import _deeper_of_drop\n")
    (study / "rigs" / "_deeper_of_drop.py").write_text("FACTOR = 1.0\n")
    first = basis(study, tmp_path)
    assert basis(study, tmp_path) == first
    (study / "rigs" / "_deeper_of_drop.py").write_text("FACTOR = 2.0\n")
    assert basis(study, tmp_path) != first


def test_the_fingerprint_of_a_rig_follows_its_modules_on_the_path_too(tmp_path, monkeypatch):
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.syspath_prepend(str(tmp_path / "elsewhere"))
    rig, beside, away = tmp_path / "rig.py", tmp_path / "beside.py", tmp_path / "elsewhere" / "away.py"
    rig.write_text("import beside\nfrom away import x\nimport numpy\n")
    seen = set()
    for text in ("x = 1\n", "x = 2\n"):
        for module in (beside, away):
            module.write_text(text)
            seen.add(fingerprint(rig))
    assert len(seen) == 4


@pytest.mark.parametrize("rig", [r for r in standard().rigs.values() if r.on_yade], ids=lambda r: r.name)
def test_the_packages_own_rigs_keep_the_fingerprint_of_their_scripts(rig, tmp_path, monkeypatch):
    before = fingerprint(rig.script)
    (tmp_path / "numpy.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert fingerprint(rig.script) == before


def test_effects_added_one_after_the_other_are_all_there(tmp_path):
    effect = standard().effects["air_drag"]
    files = {name: tmp_path / f"{name}.py" for name in ("first", "second")}
    rig = on_yade.rig("rebound")
    for name, file in files.items():
        rig = rig.with_effects([replace(effect, name=name, file=file)])
    assert rig.extra == tuple(files.values()) and set(files) <= set(rig.effects)
