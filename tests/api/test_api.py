"""The Python API: the same answers as the commands, nothing written unless asked for."""

import json
import shutil
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

import pellet_study as ps
from tests import ROOT
from tests.helpers.make_study import command

BEADS = ROOT / "results" / "wet_beads"


def copy(tmp_path, name="study"):
    """wet_beads as it came, without answers."""
    folder = tmp_path / name
    folder.mkdir()
    for file in ("study.toml", "measurements.csv"):
        shutil.copy(BEADS / file, folder / file)
    return folder


def contents(folder):
    return {file.relative_to(folder): file.read_bytes() for file in sorted(folder.rglob("*")) if file.is_file()}


@pytest.mark.parametrize("name", ["compare", "diagnose", "refine"])
def test_a_function_answers_what_its_command_answers_and_writes_what_it_writes(tmp_path, name):
    by_command, by_function = copy(tmp_path, "one"), copy(tmp_path, "two")
    _, answer = command(name, by_command, json_file=tmp_path / "answer.json")
    study = ps.load_study(by_function)
    found = getattr(ps, name)(study)
    assert json.loads(json.dumps(found.json)) == answer
    assert contents(by_function) == contents(copy(tmp_path, "three"))
    getattr(ps, name)(study, write=True)
    assert contents(by_function) == contents(by_command)


def test_add_and_drop_do_and_undo(tmp_path):
    folder = copy(tmp_path)
    study = ps.load_study(folder)
    more = ps.add(study, "cohesion")
    assert more.effects == ["cohesion"] and more.rms_error < 0.5 * more.before["rms_error"]
    assert "cohesion" in more.study.effects and "cohesion" not in study.effects
    less = ps.drop(more.study, "cohesion")
    assert less.rms_error == pytest.approx(more.before["rms_error"])
    ps.add(study, "cohesion", write=True)
    assert ps.load_study(folder).effects["cohesion"]["cohesive_stress_pa"].value == pytest.approx(
        more.parameters["cohesion.cohesive_stress_pa"], rel=1e-5
    )


def test_keys_are_attributes_and_an_unknown_one_says_what_there_is(tmp_path):
    answer = ps.compare(ps.load_study(copy(tmp_path)))
    for key, value in answer.json.items():
        assert getattr(answer, key) == value
        assert key in dir(answer)
    with pytest.raises(AttributeError, match="chi2"):
        answer.chi_squared  # noqa: B018


def test_answers_as_frames_and_in_a_notebook(tmp_path):
    study = ps.load_study(copy(tmp_path))
    answer = ps.refine(study)
    steps = answer.frame()
    assert list(steps["effects"]) == ["base", "cohesion"] and steps["chi2"].is_monotonic_decreasing
    rows = ps.compare(study).frame()
    np.testing.assert_allclose(rows["residual"], rows["value"] - rows["predicted"])
    assert rows["conditions.layer_height_mm"].nunique() > 2
    assert answer._repr_html_().startswith("<pre>") and "<script" not in answer._repr_html_()
    assert "cohesion" in repr(answer) and str(answer) == answer.page


def test_the_next_measurement_is_that_of_the_diagnosis(tmp_path):
    study = ps.load_study(copy(tmp_path))
    assert ps.next_measurement(study) == ps.diagnose(study).next_measurement


def readings(**more):
    """Shear stresses of mu = 0.6 and 100 Pa cohesion, exact."""
    stress = np.array([500.0, 1000.0, 2000.0, 4000.0, 8000.0])
    return pd.DataFrame(
        {"rig": "shear_cell", "observable": "shear_stress_pa", "sd": 20.0, "normal_stress_pa": stress}
        | {"value": 0.6 * stress + 100.0}
        | more
    )


def test_a_study_of_a_data_frame_gives_back_what_made_it():
    study = ps.study_of(readings(), parameters={"internal_friction": (0.1, 1.5)})
    answer = ps.refine(study)
    assert answer.added == ["cohesion"]
    values = answer.steps[-1]["parameters"]
    assert values["internal_friction"] == pytest.approx(0.6, rel=1e-4)
    assert values["cohesion.cohesive_stress_pa"] == pytest.approx(100.0, rel=1e-3)


def test_ways_to_say_that_a_parameter_is_free():
    for given in ((0.1, 1.5), (0.8, 0.1, 1.5), ps.Setting(0.8, 0.1, 1.5)):
        study = ps.study_of(readings(), parameters={"internal_friction": given})
        assert study.parameters["internal_friction"] == ps.Setting(0.8, 0.1, 1.5)
    fixed = ps.study_of(readings(), parameters={"internal_friction": 0.6})
    assert not fixed.parameters["internal_friction"].free


@pytest.mark.parametrize(
    "table, more, words",
    [
        (readings(colour="red"), {}, "colour"),
        (readings(rig="shear_cel"), {}, "did you mean 'shear_cell'"),
        (readings(), {"parameters": {"internal_frction": 0.5}}, "did you mean 'internal_friction'"),
        (readings(), {"parameters": {"internal_friction": (0.5,)}}, r"\(value, min, max\)"),
        (readings(), {"candidates": ["cohesoin"]}, "did you mean 'cohesion'"),
    ],
)
def test_what_cannot_be_used_is_named(table, more, words):
    with pytest.raises(ps.InputError, match=words) as told:
        ps.study_of(table, **more)
    assert "/tmp" not in str(told.value)


def test_a_rig_on_yade_needs_a_folder(tmp_path):
    table = pd.DataFrame({"rig": ["rebound"], "observable": ["rebound_height_mm"], "value": [8.0]})
    with pytest.raises(ps.InputError, match="folder="):
        ps.study_of(table)
    assert ps.study_of(table, folder=tmp_path / "seeds").folder == tmp_path / "seeds"


def test_write_needs_a_folder():
    with pytest.raises(ps.InputError, match="folder"):
        ps.refine(ps.study_of(readings(), parameters={"internal_friction": (0.1, 1.5)}), write=True)


@pytest.mark.parametrize(
    "ask, figures",
    [("compare", ["residuals", "predictions"]), ("diagnose", ["ranking", "constants"]), ("refine", ["ladder"])],
)
def test_figures_on_axes_of_ones_own(tmp_path, ask, figures):
    from matplotlib.figure import Figure

    answer = getattr(ps, ask)(ps.load_study(copy(tmp_path)))
    for name in figures:
        figure = Figure()
        axes = figure.subplots(1, 2)
        drawn = ps.draw(answer, name, ax=axes[0])
        assert drawn is figure and axes[0].has_data() and not axes[1].has_data()
        assert axes[0].get_xlabel()
        new = ps.draw(answer, name)
        assert new is not figure
        if name in ("residuals", "predictions"):
            with pytest.raises(ps.InputError, match="1 panels"):
                ps.draw(answer, name, ax=axes)
    with pytest.raises(ps.InputError, match="ladder|residuals|ranking"):
        ps.draw(answer, "ladders")


def test_importing_the_package_loads_nothing_heavy_and_every_name_is_there():
    code = (
        "import sys, pellet_study as ps\n"
        "assert not {'numpy', 'scipy', 'pandas', 'matplotlib', 'statsmodels'} & set(sys.modules)\n"
        "assert set(ps.__all__) <= set(dir(ps))\n"
        "assert all(getattr(ps, name).__doc__ for name in ps.__all__)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    with pytest.raises(AttributeError, match="no attribute 'refne'"):
        ps.refne  # noqa: B018


def test_no_name_of_the_package_is_hidden_by_a_room_once_that_is_loaded():
    code = (
        "import importlib, pkgutil, pellet_study as ps\n"
        "for found in pkgutil.iter_modules(ps.__path__):\n"
        "    importlib.import_module(f'pellet_study.{found.name}') if found.name != '__main__' else None\n"
        "modules = [name for name in ps.__all__ if type(getattr(ps, name)).__name__ == 'module']\n"
        "assert modules == ['doe'], modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
