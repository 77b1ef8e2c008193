"""Tables of other fields as their writers head them: run numbers, paths with days, goals of several responses checked by runs."""

import json
import shlex

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.doe import box_behnken, screening_designs
from pellet_study.doe.factors import factors_meant
from pellet_study.errors import InputError

HEADINGS = (
    "Lauf", "Lauf-Nr.", "Versuch Nr", "Versuchsnummer", "Versuchs-Nr.", "Prueba", "Corrida", "Essai", "N° essai", "N°", "Nº", "No.",
    "Nr.", "#", "Run #", "Sample ID", "run_id", "Run ID", "RunID", "exp", "Exp. No.", "Schritt", "Ensayo", "Número de ensayo",
    "序号", "编号", "试验号", "实验编号", "№", "Sl. No.", "Lfd. Nr.", "Test Number", "Ensaio", "Obs.", "Specimen",
)  # fmt: skip


def screening(n_factors=3, centre=3):
    """y = 50 + 3 A - 2 B and a small wobble."""
    coded = screening_designs.coded_matrix(n_factors, 8, centre)
    frame = pd.DataFrame(coded, columns=list("ABCDEFG")[:n_factors])
    frame["y"] = 50 + 3 * frame.A - 2 * frame.B + 0.1 * np.sin(7 * np.arange(len(frame)))
    return frame


def surface(seed=3):
    coded = box_behnken.coded_matrix(3, 5)
    frame = pd.DataFrame(coded, columns=list("ABC"))
    noise = np.random.default_rng(seed).normal(size=(2, len(frame)))
    frame["yield (%)"] = 60 + 4 * frame.A - 3 * frame.B**2 + 0.3 * noise[0]
    frame["cost"] = 9 + 2 * frame.A + frame.C + 0.2 * noise[1]
    return frame


def answer(tmp_path, frame, command, *words, status=0):
    path = tmp_path / "table.csv"
    if frame is not None:
        frame.to_csv(path, index=False)
    assert main([command, str(path), *map(str, words), "--json", str(tmp_path / "a.json")]) == status
    return json.loads((tmp_path / "a.json").read_text()) if status == 0 else None


# ------------------------------------------------------------------------------------------------- run numbers
@pytest.mark.parametrize("heading", HEADINGS)
@pytest.mark.parametrize("numbered", ["{}", "S{:02}"])
def test_run_numbers_are_known_by_their_headings(tmp_path, capsys, heading, numbered):
    frame = screening()
    order = np.random.default_rng(1).permutation(len(frame)) + 1
    frame.insert(0, heading, [numbered.format(k) for k in order])
    found = answer(tmp_path, frame, "pb")
    assert set(found["effects"]) == set("ABC") and found["effects"]["A"] == pytest.approx(6, abs=0.2)
    reason = "order of the runs" if heading == "Run #" else "number of the run"
    assert f"left out: {heading} ({reason}" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["pb", "bbd"])
@pytest.mark.parametrize("numbered", ["{}", "batch-{}x", "P{:03}"])
def test_run_numbers_are_known_by_content_wherever_they_stand(tmp_path, capsys, command, numbered):
    frame = screening() if command == "pb" else surface()[["A", "B", "C", "cost"]]
    frame.insert(2, "Kennung", [numbered.format(k) for k in range(len(frame), 0, -1)])
    assert set("ABC") <= set(answer(tmp_path, frame, command)["effects"])
    assert "of the run: " in capsys.readouterr().err and "Kennung" not in json.dumps(
        answer(tmp_path, None, command)["p"]
    )


@pytest.mark.parametrize("command", ["pb", "bbd"])
def test_a_run_number_that_starts_again_is_asked_for_and_the_advice_works(tmp_path, capsys, command):
    """Five designs of five runs would make `Nr.` a factor at five levels."""
    frame = (
        pd.concat([screening(), screening()]) if command == "pb" else pd.concat([surface()[list("ABC") + ["cost"]]] * 2)
    )
    frame.insert(0, "Nr.", [1 + k % 5 for k in range(len(frame))])
    answer(tmp_path, frame, command, status=2)
    assert "'Nr.' is named like the number of a run" in capsys.readouterr().err
    assert "Nr." not in answer(tmp_path, None, command, "--ignore", "Nr.")["effects"]


def test_a_factor_named_like_a_number_stays_one(tmp_path):
    """Nitrogen at two levels; a response of whole numbers in a row in the last column."""
    frame = screening().rename(columns={"A": "N", "C": "step"})
    frame["y"] = np.argsort(np.argsort(frame["y"])) + 1
    assert set(answer(tmp_path, frame, "pb")["effects"]) == {"N", "B", "step"}


@pytest.mark.parametrize(
    "words", [["--response", "Yeild"], ["--factor", "yeild=1,2"], ["--ignore", "YEILD"], ["--block", "Yeild"]]
)
def test_a_mistyped_column_is_answered_with_the_nearest_and_the_list(tmp_path, capsys, words):
    answer(tmp_path, screening().rename(columns={"B": "Yield [%]", "y": "colour"}), "pb", *words, status=2)
    error = capsys.readouterr().err
    assert "did you mean 'Yield [%]'" in error and "accepted are" in error and "C" in error


# ------------------------------------------------------------------------------------------------- days on a path
def path_runs():
    at = np.arange(5)
    return pd.DataFrame(
        {"Schritt": at + 1, "A": at * 0.5, "B": -at / 3, "Tag": [1, 1, 2, 2, 2], "y": [50, 52, 54, 53, 51.0]}
    )


@pytest.mark.parametrize("words", [[], ["--block", "Tag"], ["--ignore", "Tag"]])
def test_a_day_on_a_path_is_no_block_and_no_advice_leads_astray(tmp_path, capsys, words):
    path_runs().to_csv(tmp_path / "climb.csv", index=False)
    climb = [
        "--climb",
        "gradient",
        "--climb-limits",
        "A=-9,9",
        "--climb-limits",
        "B=-9,9",
        "--climb-runs",
        tmp_path / "climb.csv",
    ]
    found = answer(tmp_path, screening(), "pb", *climb, *words)
    assert found["turning"]["point"] == 3 and set(found["turning"]["centre"]) == {"A", "B"}
    error = capsys.readouterr().err
    assert "--block" not in error and ("Tag (blocks, which a path cannot tell" in error) == (
        words != ["--ignore", "Tag"]
    )


def test_a_block_of_the_screening_and_of_its_path(tmp_path):
    path_runs().to_csv(tmp_path / "climb.csv", index=False)
    frame = pd.concat([screening()] * 2).assign(y=lambda f: f.y + np.repeat([0, 5], len(f) // 2))
    frame.insert(0, "Tag", np.repeat([1, 2], len(frame) // 2))
    climb = ["--climb-runs", tmp_path / "climb.csv"]
    found = answer(tmp_path, frame, "pb", "--block", "Tag", *climb)
    assert found["blocks"]["Tag"]["2"] == pytest.approx(2.5) and found["turning"]["turned"]


def test_words_on_a_path_are_only_to_be_ignored(tmp_path, capsys):
    path_runs().assign(Tag=["Eva", "Eva", "Jo", "Jo", "Jo"]).rename(columns={"Tag": "who"})[
        ["A", "B", "who", "y"]
    ].to_csv(tmp_path / "climb.csv", index=False)
    climb = ["--climb-runs", tmp_path / "climb.csv"]
    answer(tmp_path, screening(), "pb", *climb, status=2)
    error = capsys.readouterr().err
    assert "--ignore" in error and "--block" not in error and "--factor" not in error
    assert answer(tmp_path, screening(), "pb", *climb, "--ignore", "who")["turning"]["point"] == 3


def test_a_path_holds_a_categorical_factor_at_one_level(tmp_path, capsys):
    frame = screening().assign(C=lambda f: np.where(f.C > 0, "new", "old"))
    path_runs().assign(C="new")[["A", "B", "C", "y"]].to_csv(tmp_path / "climb.csv", index=False)
    words = ["--factor", "C=old,new", "--climb-runs", tmp_path / "climb.csv"]
    assert set(answer(tmp_path, frame, "pb", *words)["turning"]["centre"]) == {"A", "B"}
    path_runs().assign(C=["new", "old"] * 2 + ["new"])[["A", "B", "C", "y"]].to_csv(tmp_path / "climb.csv", index=False)
    answer(tmp_path, frame, "pb", *words, status=2)
    assert "two levels of 'C'" in capsys.readouterr().err


def test_names_with_commas_may_be_moved(tmp_path):
    names = ["x, first", "x", "y (g, dry)"]
    assert factors_meant("x, first,y", names) == ["x, first", "y (g, dry)"]
    with pytest.raises(InputError, match="did you mean 'x, first'"):
        factors_meant("x, frist", names)
    frame = screening().rename(columns={"A": "x, first", "B": "x"})
    found = answer(tmp_path, frame, "pb", "--climb", "gradient", "--climb-factors", "x, first,x")
    assert list(found["climb"]["points"][0]) == ["x, first", "x"]


# ------------------------------------------------------------------------------------------- goals and their check
GOALS = ("--target", "yield=61", "--uncertainty", "yield=1", "--limits", "cost=,10")


def commands_of(capsys) -> list[str]:
    return [
        line.split("pellet-study ", 1)[1] for line in capsys.readouterr().out.splitlines() if "pellet-study " in line
    ]


def test_the_commands_after_joint_goals_check_the_setting_for_all_responses(tmp_path, capsys):
    found = answer(tmp_path, surface(), "bbd", "--response", "yield", "cost", *GOALS, "--select")
    declare, check = commands_of(capsys)
    assert "--declare-margin 'yield (%)=M'" in declare and "cost=M" not in declare
    place = dict(pair.split("=") for pair in shlex.split(check)[shlex.split(check).index("--at") + 1].split(","))
    assert {name: float(level) for name, level in place.items()} == pytest.approx(
        found["joint"]["physical"], rel=1e-3, abs=1e-3
    )
    assert main(shlex.split(declare.replace("=M", "=1.5"))) == 0
    assert commands_of(capsys) == [check]  # the margin is there, so the check is next
    readings = shlex.split(
        check.replace("'yield (%)=Y1,Y2,...'", "'yield (%)=61.1,60.8,61.2'").replace("Y1,Y2,...", "9.1,9.3,9.2")
    )
    assert main([*readings, "--json", str(tmp_path / "b.json")]) == 0
    told = json.loads((tmp_path / "b.json").read_text())["responses"]
    assert told["yield (%)"]["validation"]["equivalent"] and told["cost"]["validation"]["shown"]
    said = capsys.readouterr().out
    assert (
        "validation of yield (%)" in said and "all goals together: shown" in said and "next: pellet-study" not in said
    )
    assert main([word.replace("9.1,9.3,9.2", "9.9,10.1,10.3") for word in readings]) == 0
    assert "all goals together: not shown, for want of cost" in capsys.readouterr().out


def test_goals_out_of_reach_are_not_to_be_checked(tmp_path, capsys):
    answer(tmp_path, surface(), "bbd", "--response", "yield", "cost", "--limits", "yield=200,", "--limits", "cost=,10")
    assert commands_of(capsys) == []


def test_a_goal_without_a_limit_has_nothing_to_be_tested_but_the_prediction(tmp_path, capsys):
    answer(tmp_path, surface(), "bbd", "--response", "yield", "cost", "--maximise", "yield", "--minimise", "cost")
    (check,) = commands_of(capsys)
    assert main(shlex.split(check.replace("Y1,Y2,...", "9.1,9.3,9.2"))) == 0
    said = capsys.readouterr().out
    assert (
        said.count("its goal has no limit") == 2
        and "all goals together" not in said
        and "prediction interval of one run" in said
    )


def test_readings_with_decimal_commas_are_asked_for(tmp_path, capsys):
    """In a table with decimal commas 41,5,41,7 is two readings or four; with semicolons it is two."""
    frame = surface()[["A", "B", "C", "cost"]]
    frame.to_csv(tmp_path / "table.csv", index=False, sep=";", decimal=",")
    words = ["--limits", ",10", "--at", "A=0,B=0,C=0", "--verify"]
    answer(tmp_path, None, "bbd", *words, "9,1,9,3", status=2)
    two, four = capsys.readouterr().err.strip().rsplit(": ", 1)[1].split(", or ")
    assert answer(tmp_path, None, "bbd", *words, two.strip("'"))["validation"]["runs"]["mean"] == pytest.approx(9.2)
    assert answer(tmp_path, None, "bbd", *words, four.strip("'"))["validation"]["runs"]["n"] == 4
    assert answer(tmp_path, None, "bbd", *words, "9.1,9.3")["validation"]["runs"]["mean"] == pytest.approx(9.2)
