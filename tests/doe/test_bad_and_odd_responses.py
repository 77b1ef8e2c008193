"""Several responses of which one is bad, alike in name, beyond its scale, or constant as modelled; and the hints that follow."""

import json

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.commands.responses import figure_prefixes
from pellet_study.doe import box_behnken

OTHERS = ["--ignore", "flat", "--ignore", "grade"]
TWO = ["--response", "p", "q", *OTHERS]


@pytest.fixture
def runs_csv(tmp_path):
    """1/p is a plane that falls below 0 in a corner, q a plane; `flat` and `grade` are no responses."""
    coded = box_behnken.coded_matrix(3, 5)
    noise = 0.02 * np.random.default_rng(1).normal(size=(2, len(coded)))
    frame = pd.DataFrame(coded * [10, 2, 1] + [50, 6, 3], columns=["T", "pH", "C"])
    frame["p"] = 1 / (0.9 + coded @ [0.35, 0.3, 0.3] + noise[0])
    frame["q"] = 5 + coded @ [2, -1, 0] + noise[1]
    frame["flat"], frame["grade"] = 5, "x"
    path = tmp_path / "runs.csv"
    frame.to_csv(path, index=False)
    return path


def bbd(path, *words, status=0):
    out = path.parent / "answer.json"
    assert main(["bbd", str(path), *map(str, words), "--json", str(out)]) == status
    return json.loads(out.read_text()) if status == 0 else None


def test_a_bad_response_is_named_and_the_others_are_analysed(runs_csv, capsys):
    alone = bbd(runs_csv, *TWO)
    capsys.readouterr()
    answer = bbd(runs_csv, "--response", "p", "flat", "q", "grade")
    told = capsys.readouterr().err
    assert (
        "flat is not analysed: the response column 'flat'" in told and "grade is not analysed: column 'grade'" in told
    )
    assert set(answer["not_analysed"]) == {"flat", "grade"} and set(answer["responses"]) == {"p", "q"}
    assert answer["responses"]["q"]["coefficients"] == alone["responses"]["q"]["coefficients"]


def test_a_bad_response_with_a_goal_is_an_error_that_names_it(runs_csv, capsys):
    bbd(runs_csv, "--response", "p", "q", "flat", "--ignore", "grade", "--limits", "flat=1,2", status=2)
    assert "flat has a goal and cannot be analysed" in capsys.readouterr().err
    bbd(runs_csv, "--response", "grade", "flat", "--ignore", "p", "--ignore", "q", status=2)
    told = capsys.readouterr().err
    assert "grade is not analysed" in told and "flat is not analysed" in told


def test_a_fault_of_the_table_is_told_once(runs_csv, capsys):
    pd.read_csv(runs_csv).assign(T=50).to_csv(runs_csv, index=False)
    bbd(runs_csv, *TWO, status=2)
    told = capsys.readouterr().err
    assert told.count("column 'T'") == 1 and "not analysed" not in told


def test_pb_names_a_bad_response_too(tmp_path, capsys):
    path = tmp_path / "screening.csv"
    assert main(["pb", "--design", "A=1,2", "B=3,4", "C=5,6", "--seed", "1", "--output", str(path)]) == 0
    frame = pd.read_csv(path)
    frame["response"], frame["later"] = 3 * frame.A + 0.1 * np.arange(12) % 0.3, ""
    frame.to_csv(path, index=False)
    out = tmp_path / "answer.json"
    assert main(["pb", str(path), "--response", "response", "later", "--json", str(out)]) == 0
    assert "later is not analysed: no run" in capsys.readouterr().err
    answer = json.loads(out.read_text())
    assert list(answer["not_analysed"]) == ["later"] and answer["effects"]["A"] == pytest.approx(3, abs=0.2)


def test_figures_of_names_that_differ_in_signs_only_keep_apart():
    names = ["a/b", "a.b", "A b", "溶出", "%"]
    prefixes = list(figure_prefixes(names).values())
    assert prefixes == ["a_b_", "a_b_2_", "A_b_3_", "溶出_", "response_"]
    assert figure_prefixes(["a/b"]) == {"a/b": ""}


def test_a_prediction_beyond_the_scale_is_cautioned_with_advice_that_works(runs_csv, capsys):
    corner = ["--predict", "T=40,pH=4,C=2"]
    answer = bbd(runs_csv, *TWO, "--transform", "p=inverse", *corner)
    told = capsys.readouterr().err
    assert "1/p is predicted as -0.0" in told and "--transform p=log" in told
    assert answer["responses"]["p"]["prediction"]["predicted"] is None
    answer = bbd(runs_csv, *TWO, "--transform", "p=log", *corner)
    assert "is predicted as" not in capsys.readouterr().err
    assert answer["responses"]["p"]["prediction"]["predicted"] > 3


def test_an_interval_that_leaves_the_scale_is_said(runs_csv, capsys):
    bbd(runs_csv, *TWO, "--transform", "p=inverse", "--predict", "T=40.6,pH=4.12,C=2.06")
    assert "its upper end is none" in capsys.readouterr().err


def test_a_box_in_which_the_scale_runs_out_is_said_and_moves_no_limit(runs_csv, capsys):
    """At p = 3, far from its limit 1, the endless predictions of a corner once made it seem to lie on it."""
    frame = pd.read_csv(runs_csv)
    frame["p"] = 1 / (1 / frame.p - 0.2).clip(0.01)
    frame.to_csv(runs_csv, index=False)
    answer = bbd(runs_csv, *TWO, "--transform", "p=inverse", "--maximise", "p=1,3", "--minimise", "q")
    told = capsys.readouterr()
    assert "% of the box 1/p is predicted where no p has it" in told.err
    assert answer["joint"]["responses"]["p"]["on_limit"] is None
    bbd(runs_csv, *TWO, "--transform", "p=inverse", "--maximise", "p", status=2)
    assert "--maximise p=LOW,HIGH" in capsys.readouterr().err


def test_a_constant_model_has_no_best_end(runs_csv, capsys):
    frame = pd.read_csv(runs_csv)
    frame["q"] = 5 + 0.1 * np.random.default_rng(5).normal(size=len(frame))
    frame.to_csv(runs_csv, index=False)
    assert bbd(runs_csv, *TWO, "--select")["responses"]["q"]["reduced"]["coefficients"].keys() == {"1"}
    bbd(runs_csv, *TWO, "--select", "--maximise", "q", status=2)
    told = capsys.readouterr().err
    assert "--maximise q: its model predicts" in told and "without --select" in told
    assert bbd(runs_csv, *TWO, "--maximise", "q")["joint"]["met"]


@pytest.mark.parametrize(
    "words, options",
    [
        (["--maximise", "p=3,1"], "--maximise p=3,1: the limits 3 and 1"),
        (["--limits", "p=3,1"], "--limits p=3,1: the limits 3 and 1"),
        (["--target", "p=1", "--limits", "p=2,3"], "--target p=1 --limits p=2,3: the limits 2 and 3"),
        (["--minimise", "p", "--weight", "p=-1"], "--minimise p --weight p=-1: weights -1"),
        (["--minimise", "p", "--importance", "p=0"], "--minimise p --importance p=0: weights"),
        (["--uncertainty", "p=1"], "--uncertainty p=1 is that of a target"),
        (["--uncertainty", "q=1", "--maximise", "q"], "--uncertainty q=1 is that of a target"),
        (["--target", "q=5", "--uncertainty", "q=1", "--target-n", "3"], "--target-n 3 counts"),
    ],
)
def test_what_is_wrong_with_a_goal_is_said_of_its_options(runs_csv, capsys, words, options):
    bbd(runs_csv, *TWO, *words, status=2)
    assert options in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--transform", "--transform", "p=log"], ["--transform", "p=log", "--transform"]])
def test_the_order_of_transformations_does_not_matter(runs_csv, words):
    answer = bbd(runs_csv, *TWO, *words)
    assert answer["responses"]["p"]["transformation"]["power"] == 0
    assert "transformation" in answer["responses"]["q"]


def hint(capsys) -> str:
    return capsys.readouterr().out.rsplit("next: pellet-study ", 1)[1].strip()


def test_the_hint_after_several_responses_works(runs_csv, capsys):
    bbd(runs_csv, *TWO, "--transform", "p=log", "--select")
    told = hint(capsys).replace("p=VALUE", "p=1").replace("q=VALUE", "q=5").replace("=U", "=0.2")
    assert "--transform p=log" in told and "--select" in told
    assert main(told.split()) == 0
    assert "goals of p, q together" in capsys.readouterr().out


def test_the_hints_lead_from_the_target_to_the_validation(runs_csv, capsys):
    bbd(runs_csv, "--response", "q", "--ignore", "p", *OTHERS)
    for placeholder, value in (
        ("VALUE", "5"),
        ("--declare-margin M", "--declare-margin 0.3"),
        ("Y1,Y2,...", "5.1,4.9,5.0"),
    ):
        told = hint(capsys)
        assert placeholder in told
        assert main(told.replace(placeholder, value).split()) == 0
    assert "equivalence" in capsys.readouterr().out


@pytest.mark.parametrize("words", [["--target", "5"], ["--descend"], ["--lowest"], ["--climb-limits", "A=0,3"]])
def test_what_is_wanted_on_a_path_is_not_ignored_where_there_is_none(tmp_path, capsys, words):
    path = tmp_path / "screening.csv"
    assert main(["pb", "--design", "A=1,2", "B=3,4", "--seed", "1", "--output", str(path)]) == 0
    frame = pd.read_csv(path)
    frame["response"] = 3 * frame.A + 0.1 * np.arange(12) % 0.3
    frame.to_csv(path, index=False)
    assert main(["pb", str(path), *words]) == 2
    assert "give --climb gradient" in capsys.readouterr().err
    assert main(["pb", str(path), *words, "--climb", "gradient", "--climb-factors", "A"]) == 0
