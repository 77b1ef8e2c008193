"""A file that looks like a rig or an effect is loaded or named, never ignored: the verdict would be another."""

import shutil

import pytest

from pellet_study.__main__ import main
from tests.helpers.make_study import folder, slip_angle_deg
from tests.test_bad_input import OWN
from tests.test_bad_input import RIG as PAD

ROWS = [f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.5, 60):.3f},0.5,{h}" for h in (8, 16, 32, 60)]


def study(path):
    return folder(path, ["rig,observable,value,sd,layer_height_mm", *ROWS])


def put(path, place, text):
    (path / place).parent.mkdir(parents=True, exist_ok=True)
    (path / place).write_text(text)
    return path


@pytest.mark.parametrize(
    "place, text, words",
    [
        ("suction.py", OWN, ["suction.py: looks like an effect", "move it to", "effects/suction.py", "suction.py.off"]),
        ("effect/suction.py", OWN, ["effect/suction.py: looks like an effect", "effects/suction.py"]),
        ("Effects/suction.py", OWN, ["looks like an effect", "effects/suction.py"]),
        ("rigs/suction.py", OWN, ["rigs/suction.py: looks like an effect", "effects/suction.py"]),
        ("effects/old/suction.py", OWN, ["effects/old/suction.py: looks like an effect"]),
        ("effects/suction.py.txt", OWN, ["suction.py.txt: looks like an effect", "effects/suction.py,"]),
        ("effects/suction.txt", OWN, ["suction.txt: looks like an effect", "effects/suction.py,"]),
        ("effects/Suction.PY", OWN, ["Suction.PY: looks like an effect", "effects/Suction.py,"]),
        ("effects/suction", OWN, ["effects/suction: looks like an effect", "effects/suction.py,"]),
        ("pad.py", PAD, ["pad.py: looks like a rig", "rigs/pad.py"]),
        ("effects/pad.py", PAD, ["effects/pad.py: looks like a rig", "rigs/pad.py"]),
        ("effects/suction.py", OWN.replace("EFFECT =", "Effect ="), ["`EFFECT = {...}`", "in capitals"]),
        ("effects/suction.py", "X = 1\n", ["effects/suction.py: declares no EFFECT", "begin its name with _"]),
        ("rigs/pad.py", "X = 1\n", ["rigs/pad.py: declares no RIG"]),
    ],
)
def test_what_lies_in_the_wrong_place_is_named(tmp_path, capsys, place, text, words):
    path = put(study(tmp_path / "s"), place, text)
    for command in ("diagnose", "refine"):
        assert main([command, str(path)]) == 2
        said = capsys.readouterr().err
        assert all(word in said for word in words), said


def test_the_advice_works(tmp_path, capsys):
    path = put(study(tmp_path / "s"), "suction.py", OWN)
    (path / "effects").mkdir()
    shutil.move(path / "suction.py", path / "effects" / "suction.py")
    assert main(["diagnose", str(path)]) == 0
    assert "suction" in capsys.readouterr().out
    shutil.move(path / "effects" / "suction.py", path / "effects" / "suction.py.off")
    assert main(["diagnose", str(path)]) == 0
    assert "suction" not in capsys.readouterr().out


@pytest.mark.parametrize(
    "declaration", ["EFFECT={", "EFFECT  = {", "EFFECT: dict = {", "EFFECT: dict[str, object] = {"]
)
def test_however_it_is_written_it_is_loaded(tmp_path, capsys, declaration):
    path = put(study(tmp_path / "s"), "effects/suction.py", OWN.replace("EFFECT = {", declaration))
    assert main(["diagnose", str(path)]) == 0
    assert "suction" in capsys.readouterr().out


@pytest.mark.parametrize(
    "place, text",
    [
        ("make_readings.py", "effect = 3\nrig = 'pad'\n"),
        ("effects/_shared.py", "X = 1\n"),
        ("other/study.toml", ""),
        (".trash/suction.py", OWN),
        ("notes.txt", "EFFECT = {\n"),
    ],
)
def test_what_is_no_rig_and_no_effect_is_left_alone(tmp_path, capsys, place, text):
    path = put(study(tmp_path / "s"), place, text)
    if place.startswith("other/"):  # a study inside a study has effects of its own
        put(path, "other/effects/suction.py", OWN)
    assert main(["diagnose", str(path)]) == 0


def test_a_library_is_looked_through_too(tmp_path, capsys):
    library = put(put(tmp_path / "library", "effects/suction.py", OWN), "pad.py", PAD)
    assert main(["diagnose", str(study(tmp_path / "s")), "--library", str(library)]) == 2
    assert "pad.py: looks like a rig" in capsys.readouterr().err
