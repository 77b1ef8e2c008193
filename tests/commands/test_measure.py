"""`refine --measure FILE`: compare, diagnose, measure, refine as one story, and the rows it puts into measurements.csv."""

import json

import numpy as np
import pytest

from tests.helpers.make_study import command, folder, slip_angle_deg

MU, C = 0.6, 30.0
HEIGHTS = (15.0, 18.0, 22.0, 27.0, 33.0, 40.0)
POSSIBLE = """
[possible.layer_on_incline]
layer_height_mm = { min = 5, max = 80 }

[possible.shear_cell]
normal_stress_pa = { min = 100, max = 5000 }
"""


def truth(rig: str, conditions: dict) -> float:
    if rig == "shear_cell":
        return MU * conditions["normal_stress_pa"] + C
    return slip_angle_deg(conditions["layer_height_mm"], MU, C, conditions["bulk_density_kg_m3"])


@pytest.fixture
def tie(tmp_path):
    """Layers of so few heights that cohesion is not alone in explaining them."""
    rng, lines = np.random.default_rng(7), ["rig,observable,value,sd,n,layer_height_mm"]
    for h in HEIGHTS:
        lines.append(
            f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, MU, C) + 0.2 * rng.standard_normal():.3f},0.5,6,{h}"
        )
    return folder(tmp_path / "s", lines, POSSIBLE)


def refined(path, *more):
    status, answer = command("refine", path, *more, json_file=path.parent / "answer.json")
    assert status == 0
    return answer


def proposed(path, answer, name="next.csv"):
    """A file with the reading that was proposed, as the truth has it."""
    asked = answer["next_measurement"]
    value = truth(asked["rig"], asked["conditions"])
    sd = 0.5 if asked["rig"] == "layer_on_incline" else 0.02 * value
    names = ["rig", "observable", "value", "sd", "n", *asked["conditions"]]
    cells = [
        asked["rig"],
        asked["observable"],
        f"{value:.4f}",
        f"{sd:.4f}",
        "6",
        *map(str, asked["conditions"].values()),
    ]
    file = path.parent / name
    file.write_text(",".join(names) + "\n" + ",".join(cells) + "\n")
    return file


def test_the_proposed_reading_is_added_and_the_tie_is_undone(tie, capsys):
    first = refined(tie)
    assert first["verdict"] == "tied" and "cohesion" in first["tied"] and first["added"] == []
    rows = (tie / "measurements.csv").read_text().splitlines()
    answer = refined(tie, "--measure", proposed(tie, first))
    after = (tie / "measurements.csv").read_text().splitlines()
    assert len(after) == len(rows) + 1
    assert answer["added"] == ["cohesion"]
    assert answer["steps"][-1]["parameters"]["cohesion.cohesive_stress_pa"] == pytest.approx(C, rel=0.2)
    capsys.readouterr()
    status, told = command("history", tie, json_file=tie.parent / "history.json")
    said = capsys.readouterr().out
    assert status == 0 and [s["effects"] for s in told["steps"]] == [[], [], ["cohesion"]]
    assert [bool(s.get("measured")) for s in told["steps"]] == [False, True, False]
    asked = first["next_measurement"]
    assert f"measured: {asked['rig']} {asked['observable']}" in said
    assert command("report", tie)[0] == 0


def test_rows_that_are_there_already_are_not_added_again(tie, capsys):
    file = proposed(tie, refined(tie))
    refined(tie, "--measure", file)
    content = (tie / "measurements.csv").read_bytes()
    assert command("refine", tie, "--measure", file)[0] == 2  # an answer was given with them
    assert "the last answer was given with them: nothing is added. Leave out --measure" in capsys.readouterr().err
    (tie / "history.json").unlink()  # as where the first call was interrupted
    refined(tie, "--measure", file)
    assert (tie / "measurements.csv").read_bytes() == content


def test_a_row_with_which_the_study_could_not_be_loaded_is_not_added(tie, capsys):
    """A heap beside layers: cohesion is a stress in the one and an energy in the other, so that no study may have both."""
    before = (tie / "measurements.csv").read_bytes()
    text = "rig,observable,value,sd\nrepose,repose_angle_deg,35,1\n"
    assert command("refine", tie, "--measure", one_row(tie, text))[0] == 2
    said = capsys.readouterr().err
    assert "is not the same quantity in all rigs used" in said
    assert (tie / "measurements.csv").read_bytes() == before


def one_row(path, text: str):
    file = path.parent / "more.csv"
    file.write_text(text)
    return file


def test_the_form_of_the_file_is_kept(tie):
    file = tie / "measurements.csv"
    file.write_bytes(
        b"\xef\xbb\xbf" + file.read_text().replace(",", ";").replace(".", ",").replace("\n", "\r\n").encode()
    )
    before = file.read_bytes()
    more = one_row(tie, "rig,observable,value,sd,n,layer_height_mm\nlayer_on_incline,slip_angle_deg,41.5,0.5,6,10.5\n")
    answer = refined(tie, "--measure", more)
    assert file.read_bytes().startswith(before)
    assert file.read_bytes()[len(before) :].split() == [b"layer_on_incline;slip_angle_deg;41,5;0,5;6;10,5"]
    assert answer["steps"][0]["rows"][-1]["value"] == 41.5


def test_a_condition_that_only_the_new_row_has_is_the_assumed_one_in_the_others(tie):
    more = one_row(
        tie,
        "rig,observable,value,sd,n,layer_height_mm,particle_diameter_mm\nlayer_on_incline,slip_angle_deg,41.5,0.5,6,15,2\n",
    )
    assert "particle_diameter_mm" in refined(tie)["assumed"]
    answer = refined(tie, "--measure", more)
    diameters = [row["conditions"]["particle_diameter_mm"] for row in answer["steps"][0]["rows"]]
    assert diameters == [1.0] * len(HEIGHTS) + [2.0] and "particle_diameter_mm" not in answer["assumed"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "more.csv: empty"),
        ("rig,observable,value\nlayer_on_incline,slip_angle_deg,41\n", "layer_height_mm is blank"),
        ("rig,observable,value,height\nlayer_on_incline,slip_angle_deg,41,3\n", "column 'height' is unknown"),
        ("rig,observable,value,layer_height_mm\nlayer_on_incline,slip_angle_deg,forty,3\n", "expected a number"),
    ],
)
def test_rows_that_cannot_be_used_are_refused_and_nothing_is_written(tie, capsys, text, words):
    before = {file.name: file.read_bytes() for file in tie.iterdir()}
    assert command("refine", tie, "--measure", one_row(tie, text))[0] == 2
    said = capsys.readouterr().err
    assert words in said and "more.csv" in said
    assert {file.name: file.read_bytes() for file in tie.iterdir()} == before


def test_a_file_that_is_not_there_is_said(tie, capsys):
    assert command("refine", tie, "--measure", tie.parent / "none.csv")[0] == 2
    assert "none.csv: no such file" in capsys.readouterr().err


def test_the_answer_says_how_to_go_on(tie, capsys):
    refined(tie)
    assert "--measure" in capsys.readouterr().out
    assert json.loads((tie / "refine.json").read_text())["verdict"] == "tied"
