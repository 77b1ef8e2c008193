"""Conditions that are words out of a list: a rig with one through its study, the answers, the report and YADE."""

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import pellet_study as ps
from pellet_study.criticism.possible import possible_cases
from pellet_study.errors import InputError
from pellet_study.model.model import Case, Model
from pellet_study.rigs.declarations import rig_in
from pellet_study.study.load import load
from tests.helpers.make_study import command, folder

LOADS = (250, 500, 1000, 2000, 4000)
GRIP = {"polished": 1.0, "coated": 1.5, "ribbed": 2.0}  # friction of each wall over that of the polished one
RIG = """
import numpy as np

RIG = {
    "name": "wall_slip",
    "parameters": {
        "wall_friction": {"default": 0.4, "min": 0.0, "max": 2.0, "unit": "1", "meaning": "of the polished wall"},
    },
    "conditions": {
        "normal_stress_pa": {"default": 1000.0, "min": 50.0, "max": 9000.0, "unit": "Pa", "meaning": "load"},
        "wall": {
            "default": "polished", "options": ("polished", "coated", "ribbed"), "unit": "", "meaning": "surface",
        },
    },
    "observables": {"slip_stress_pa": "shear stress at which the pad slips"},
}


def predict(parameters, conditions, effects):
    grip = {"polished": 1.0, "coated": 1.5, "ribbed": 2.0}
    normal = conditions["normal_stress_pa"]
    stress = parameters["wall_friction"] * np.array([grip[word] for word in conditions["wall"]]) * normal
    for act, values in effects.values():
        stress = act(stress, normal, conditions, values)
    return {"slip_stress_pa": stress}
"""
EFFECT = """
EFFECT = {{
    "name": "{name}",
    "means": "a film pulls the pad to the wall",
    "formula": "tau + s",
    "parameters": {{
        "{name}_pa": {{"absent": 0.0, "min": 0.0, "max": 900.0, "physical": (0.0, 500.0), "unit": "Pa", "meaning": "s"}},
    }},
    "sides": 1,
    "rigs": {{"wall_slip": "slips later"}},
    "signature": "a line that does not pass through the origin",
    "source": "nobody",
}}


def act(shear_pa, normal_pa, conditions, values):
    return shear_pa + values["{name}_pa"] * (conditions["wall"] != "{not_at}")


CLOSED_FORM = {{"wall_slip": act}}
"""


def stress_pa(wall: str, load_pa: float, friction=0.5, pull_pa=0.0) -> float:
    return friction * GRIP[wall] * load_pa + pull_pa


def walls(path, words=tuple(GRIP), effects=(("suction", ""),), possible="", **of):
    """A study of pads on walls, each reading with an error of 2 Pa to one side and the other in turn."""
    lines = ["rig,observable,value,sd,normal_stress_pa,wall"]
    for k, (word, load_pa) in enumerate((w, n) for w in words for n in LOADS):
        lines.append(
            f"wall_slip,slip_stress_pa,{stress_pa(word, load_pa, **of) + 2 * (-1) ** k:.2f},4,{load_pa},{word}"
        )
    folder(path, lines)
    text = f"[parameters]\nwall_friction = {{ value = 0.4, min = 0.05, max = 1.5 }}\n{possible}"
    (path / "study.toml").write_text(text)
    for name, not_at in effects:
        (path / "effects").mkdir(exist_ok=True)
        (path / "effects" / f"{name}.py").write_text(EFFECT.format(name=name, not_at=not_at))
    (path / "rigs").mkdir(exist_ok=True)
    (path / "rigs" / "wall_slip.py").write_text(RIG)
    return path


def test_a_column_of_words_is_read_and_a_blank_one_is_the_default(tmp_path):
    study = load(walls(tmp_path))
    assert [row.conditions["wall"] for row in study.rows] == [word for word in GRIP for _ in LOADS]
    file = tmp_path / "measurements.csv"
    file.write_text(file.read_text().replace(",polished", ","))
    with pytest.raises(InputError, match="line 2: column wall is blank, but line 7 of wall_slip gives coated"):
        load(tmp_path)
    for word in ("coated", "ribbed"):
        file.write_text(file.read_text().replace(f",{word}", ","))
    study = load(tmp_path)
    assert {row.conditions["wall"] for row in study.rows} == {"polished"} and study.assumed["wall"] == "polished"


@pytest.mark.parametrize("word", ["rib", "Ribbed", "3", "ribbed coated"])
def test_an_unknown_word_is_refused_with_line_and_column_and_the_nearest_first(tmp_path, word):
    file = walls(tmp_path) / "measurements.csv"
    file.write_text(file.read_text().replace("ribbed", word, 1))
    with pytest.raises(InputError) as refused:
        load(tmp_path)
    assert f"line {2 + 2 * len(LOADS)}: wall {word!r} is unknown; accepted are " in str(refused.value)
    if word != "3":
        assert "accepted are ribbed, coated, polished; did you mean 'ribbed'?" in str(refused.value)


def test_a_model_meets_each_word_by_itself(tmp_path, capsys):
    status, answer = command("compare", walls(tmp_path), json_file=tmp_path / "answer.json")
    assert status == 0 and answer["fits"]
    assert answer["parameters"]["wall_friction"] == pytest.approx(0.5, abs=0.002)
    for row in answer["rows"]:
        wanted = stress_pa(row["conditions"]["wall"], row["conditions"]["normal_stress_pa"])
        assert row["predicted"] == pytest.approx(wanted, rel=0.004)
    assert "normal_stress_pa 4000, wall ribbed" in " ".join(capsys.readouterr().out.split())


def test_a_hidden_effect_is_found_and_the_report_says_the_words(tmp_path):
    walls(tmp_path, pull_pa=60.0)
    status, answer = command("refine", tmp_path, json_file=tmp_path / "answer.json")
    assert status == 0 and answer["added"] == ["suction"] and answer["verdict"] == "adequate"
    status, answer = command("report", tmp_path, json_file=tmp_path / "report.json")
    assert status == 0 and "wall polished, coated, ribbed" in Path(answer["path"]).read_text()


def test_a_constant_that_another_word_would_change_is_named_and_drawn(tmp_path, capsys):
    """The coated wall holds 30 % better than the rig says: friction is constant over the load, not over the wall."""
    walls(tmp_path, effects=(("suction", ""),))
    file = tmp_path / "measurements.csv"
    lines = file.read_text().splitlines()
    for k, line in enumerate(lines):
        if line.endswith("coated"):
            cells = line.split(",")
            lines[k] = ",".join([*cells[:2], f"{1.3 * float(cells[2]):.2f}", *cells[3:]])
    file.write_text("\n".join(lines) + "\n")
    status, answer = command("compare", tmp_path, json_file=tmp_path / "answer.json")
    assert status == 0 and not answer["fits"]
    assert answer["where"][0]["words"].startswith(
        "wall_friction would have to be higher where wall is coated (wall_slip), z = "
    )
    status, answer = command("diagnose", tmp_path, json_file=tmp_path / "answer.json")
    levels = json.loads((tmp_path / "diagnose.json").read_text())["by_level"]
    assert levels["levels"] == ["coated", "polished", "ribbed"]
    assert levels["values"] == pytest.approx([0.65, 0.5, 0.5], abs=0.01)
    assert command("report", tmp_path)[0] == 0


def test_the_next_measurement_is_looked_for_at_every_word(tmp_path):
    """Two films that differ on the ribbed wall only, of which nothing was measured."""
    of = dict(words=("polished", "coated"), effects=(("suction", ""), ("glue", "ribbed")), pull_pa=60.0)
    status, answer = command("diagnose", walls(tmp_path / "all", **of), json_file=tmp_path / "answer.json")
    assert status == 0 and answer["verdict"] == "tied" and set(answer["tied"]) == {"suction", "glue"}
    proposed = answer["next_measurement"]
    assert proposed["conditions"]["wall"] == "ribbed"
    assert proposed["predictions"]["suction"] - proposed["predictions"]["glue"] == pytest.approx(60, abs=6)
    few = '[possible.wall_slip]\nwall = ["coated", "polished"]\nnormal_stress_pa = { min = 100, max = 8000 }\n'
    status, answer = command(
        "diagnose", walls(tmp_path / "few", possible=few, **of), json_file=tmp_path / "answer.json"
    )
    assert status == 0 and answer["verdict"] == "tied" and answer["next_measurement"] is None


@pytest.mark.parametrize(
    ("possible", "words"),
    [
        ('wall = ["ribbed", "coated"]', {"ribbed", "coated"}),
        ('wall = "ribbed"', {"ribbed"}),
        ("normal_stress_pa = { min = 100, max = 200 }", {"polished"}),
        ("", {"polished", "coated", "ribbed"}),
    ],
)
def test_possible_words_are_a_list_or_one(tmp_path, possible, words):
    study = load(walls(tmp_path, possible=f"[possible.wall_slip]\n{possible}\n" if possible else ""))
    assert {case.conditions["wall"] for case in possible_cases(study)} == words
    assert all(isinstance(case.conditions["normal_stress_pa"], float) for case in possible_cases(study))


@pytest.mark.parametrize(
    ("possible", "words"),
    [
        (
            'wall = ["ribbed", "coatd"]',
            "'coatd' is unknown; accepted are coated, polished, ribbed; did you mean 'coated'?",
        ),
        ("wall = 3", "expected a word in quotes or a list of words, got 3; accepted are coated, polished, ribbed"),
        ("wall = []", "expected a word in quotes or a list of words"),
        ('wall = ["ribbed", 1]', "1 is unknown; accepted are"),
        ("wall = { min = 1, max = 2 }", "expected a word in quotes or a list of words"),
        ('normal_stress_pa = ["ribbed"]', "expected a finite number"),
    ],
)
def test_what_is_no_list_of_words_is_refused(tmp_path, possible, words):
    walls(tmp_path, possible=f"[possible.wall_slip]\n{possible}\n")
    with pytest.raises(InputError) as refused:
        load(tmp_path)
    assert "study.toml: possible.wall_slip" in str(refused.value) and words in str(refused.value)


def test_a_study_of_a_data_frame_takes_words_too(tmp_path):
    walls(tmp_path / "library")
    table = pd.read_csv(tmp_path / "library" / "measurements.csv")
    study = ps.study_of(
        table,
        parameters={"wall_friction": (0.4, 0.05, 1.5)},
        possible={"wall_slip": {"wall": ["ribbed", "coated"], "normal_stress_pa": (100, 200)}},
        library=tmp_path / "library",
    )
    assert study.possible == {"wall_slip": {"wall": ("ribbed", "coated"), "normal_stress_pa": (100.0, 200.0)}}
    assert ps.compare(study).parameters["wall_friction"] == pytest.approx(0.5, abs=0.002)


def test_where_nothing_shows_the_words_to_try_are_named(tmp_path):
    """As many free parameters as cases: the advice lists ranges and words."""
    walls(tmp_path, words=("polished",))
    file = tmp_path / "measurements.csv"
    file.write_text("\n".join(file.read_text().splitlines()[:2]) + "\n")
    status, answer = command("diagnose", tmp_path, json_file=tmp_path / "answer.json")
    assert status == 0
    assert any("wall (polished or coated or ribbed)" in warning for warning in answer["warnings"])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('("polished", "coated", "ribbed")', "()", "expected options to be different words"),
        ('("polished", "coated", "ribbed")', '"polished"', "expected options to be different words"),
        ('("polished", "coated", "ribbed")', '("polished", "polished")', "expected options to be different words"),
        ('("polished", "coated", "ribbed")', '("polished", "3 mm")', "expected options to be different words"),
        (
            '"default": "polished"',
            '"default": "rough"',
            "expected a default among polished, coated, ribbed, got 'rough'",
        ),
        ('"default": "polished"', '"usual": "polished"', "expected a default among polished, coated, ribbed, got None"),
    ],
)
def test_a_declaration_without_words_is_refused(tmp_path, old, new, words):
    file = walls(tmp_path) / "rigs" / "wall_slip.py"
    file.write_text(RIG.replace(old, new))
    with pytest.raises(InputError) as refused:
        load(tmp_path)
    assert "wall_slip.py: wall: " in str(refused.value) and words in str(refused.value)


ON_YADE = """
import math

from yade_scripts.case import choice, quantity

EFFECTS = ()
RIG = {
    "name": "made_up",
    "contact_laws": ("hertz_mindlin",),
    "parameters": {"friction": quantity(0.5, 0.1, 1.0, "1", "of the surface")},
    "conditions": {
        "load_g": quantity(1.0, 0.1, 10.0, "g", "load"),
        "surface": choice("plain", ("plain", "true", "nan"), "what it slides on"),
    },
    "effects": {},
    "numerics": {},
    "observables": {"slope_deg": "at which it slides"},
    "random": False,
    "time_limit_s": 20.0,
}


def simulate(case):
    grip = {"plain": 1.0, "true": 1.4, "nan": 0.6}[case["conditions"]["surface"]]
    return {"slope_deg": math.degrees(math.atan(grip * case["parameters"]["friction"]))}
"""
YADE_GRIP = {"plain": 1.0, "true": 1.4, "nan": 0.6}  # words that a table could take for something else


@pytest.fixture
def made_up(tmp_path):
    lines = ["rig,observable,value,sd,surface"]
    for k, (word, grip) in enumerate(YADE_GRIP.items()):
        lines.append(f"made_up,slope_deg,{math.degrees(math.atan(0.45 * grip)) + 0.02 * (-1) ** k:.3f},0.1,{word}")
    path = folder(tmp_path / "s", lines)
    (path / "study.toml").write_text("[parameters]\nfriction = { value = 0.5, min = 0.3, max = 0.8 }\n")
    (path / "rigs").mkdir()
    (path / "rigs" / "made_up.py").write_text(ON_YADE)
    return path


@pytest.mark.yade
def test_each_word_has_simulations_and_a_surface_of_its_own_on_yade(made_up, tmp_path):
    status, answer = command("compare", made_up, json_file=tmp_path / "answer.json")
    assert status == 0 and answer["fits"]
    assert answer["parameters"]["friction"] == pytest.approx(0.45, abs=0.005)
    table = next((made_up / ".store").glob("made_up-*.csv"))
    before = table.read_bytes()
    study = load(made_up)
    model = Model(study, [Case("made_up", "slope_deg", {"load_g": 1.0, "surface": word}, {}) for word in YADE_GRIP])
    points = np.repeat(model.base[None], 3, axis=0)
    points[:, model.column["friction"]] = (0.35, 0.5, 0.7)
    wanted = np.degrees(np.arctan(np.outer((0.35, 0.5, 0.7), list(YADE_GRIP.values()))))
    assert model.predict(points).mean == pytest.approx(wanted, abs=0.05)
    assert table.read_bytes() == before, "what is stored is found again by its words"
    status, answer = command("refine", made_up, json_file=tmp_path / "answer.json")
    assert status == 0 and answer["verdict"] == "adequate"


@pytest.mark.yade
def test_a_case_with_a_word_is_simulated_and_one_with_another_refused(made_up, tmp_path):
    rig = rig_in(made_up / "rigs" / "made_up.py")
    from pellet_study.rigs.on_yade import case
    from pellet_study.simulation import dispatch

    cases = [case(rig, conditions={"surface": word}) for word in ("nan", "true", "plain")]
    found = dispatch.run(cases, tmp_path / "store", rigs={"made_up": rig}, quiet=True)
    assert found["surface"].tolist() == ["nan", "true", "plain"]
    assert np.tan(np.radians(found["slope_deg"].to_numpy())) == pytest.approx([0.3, 0.7, 0.5])
    with pytest.raises(
        InputError, match="surface 'plan' is unknown; accepted are plain, nan, true; did you mean 'plain'"
    ):
        case(rig, conditions={"surface": "plan"})
