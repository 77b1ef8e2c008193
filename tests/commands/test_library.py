"""Effects and rigs that several studies share: `--library DIR` on the command line, `library=` in Python."""

import shutil

import pytest

import pellet_study as ps
from tests.helpers.make_study import command, incline

EFFECT = '''"""Friction that fades with the height of the layer."""

EFFECT = {
    "name": "fading_friction",
    "means": "thick layers rub less",
    "formula": "mu = mu0 (1 + a / h)",
    "parameters": {
        "share_mm": {"absent": 0.0, "min": 0.0, "max": 50.0, "physical": (0.0, 20.0), "unit": "mm", "meaning": "a"},
    },
    "sides": 1,
    "rigs": {"layer_on_incline": "thin layers hold to steeper angles"},
    "signature": "slip angles fall with the height of the layer",
    "source": "made up for this test",
}


def act(shear, normal, conditions, values):
    """Shear stress with the friction's share."""
    return shear * (1 + values["share_mm"] / conditions["layer_height_mm"])


CLOSED_FORM = {"layer_on_incline": act}
'''


@pytest.fixture
def library(tmp_path):
    (tmp_path / "shared" / "effects").mkdir(parents=True)
    (tmp_path / "shared" / "effects" / "fading_friction.py").write_text(EFFECT)
    return tmp_path / "shared"


def names(answer) -> set[str]:
    return {suspect["effect"] for suspect in answer["ranking"]}


def test_two_studies_share_an_effect_and_it_is_named_when_it_is_loaded(tmp_path, library, caplog):
    for name in ("one", "two"):
        study = incline(tmp_path / name, c=40.0)
        caplog.clear()
        _, answer = command("diagnose", study, "--library", library, json_file=tmp_path / "a.json")
        assert "fading_friction" in names(answer)
        told = " ".join(record.getMessage() for record in caplog.records)
        assert "fading_friction.py" in told and f"code of the library {library}" in told
    _, without = command("diagnose", study, json_file=tmp_path / "a.json")
    assert "fading_friction" not in names(without)


def test_every_command_on_a_study_takes_it(tmp_path, library):
    study = incline(tmp_path / "one", c=40.0)
    assert command("add", study, "fading_friction", "--library", library)[0] == 0
    for name in ("compare", "diagnose", "history", "refine", "report"):
        assert command(name, study, "--library", library)[0] == 0, name
    assert command("drop", study, "fading_friction", "--library", library)[0] == 0


def test_a_study_that_needs_a_library_says_what_is_unknown_without_it(tmp_path, library, capsys):
    study = incline(tmp_path / "one", more="\n[effects]\nfading_friction = { share_mm = 2.0 }\n")
    assert command("compare", study, "--library", library)[0] == 0
    capsys.readouterr()
    assert command("compare", study)[0] == 2
    assert "'fading_friction' is unknown" in capsys.readouterr().err


def test_a_study_cannot_name_its_library_itself(tmp_path, library, capsys):
    study = incline(tmp_path / "one")
    toml = (study / "study.toml").read_text()
    (study / "study.toml").write_text(f'library = "{library}"\n' + toml)
    assert command("compare", study)[0] == 2
    assert "'library' is unknown" in capsys.readouterr().err


def test_what_cannot_be_a_library_is_refused(tmp_path, library, capsys):
    study = incline(tmp_path / "one")
    (tmp_path / "empty").mkdir()
    for given, words in ((tmp_path / "nowhere", "no such folder"), (tmp_path / "empty", "expected at least one")):
        assert command("compare", study, "--library", given)[0] == 2
        assert words in capsys.readouterr().err
    outside = tmp_path / "outside.py"
    shutil.move(library / "effects" / "fading_friction.py", outside)
    (library / "effects" / "fading_friction.py").symlink_to(outside)
    assert command("compare", study, "--library", library)[0] == 2
    assert "is a link to" in capsys.readouterr().err


def test_a_name_in_both_is_refused_with_both_files(tmp_path, library, capsys):
    study = incline(tmp_path / "one")
    shutil.copytree(library / "effects", study / "effects")
    assert command("compare", study, "--library", library)[0] == 2
    told = capsys.readouterr().err
    assert str(library / "effects") in told and str(study / "effects") in told


def test_from_python(tmp_path, library):
    study = ps.load_study(incline(tmp_path / "one", c=40.0), library=library)
    assert "fading_friction" in set(ps.diagnose(study).frame()["effect"])
