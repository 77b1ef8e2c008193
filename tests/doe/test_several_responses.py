"""Several responses on the command line: which columns they are, what is asked of each, what is refused and how."""

import json

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.doe import box_behnken
from pellet_study.paper.printed import table
from tests.helpers.published_designs import TREAD_FACTORS, TREAD_RESPONSES, tyre_tread

TREAD_WORDS = (
    "--maximise abrasion=120,170 --maximise modulus=1000,1300 --target elongation=500 --uncertainty elongation=100 "
    "--target hardness=67.5 --limits hardness=60,75"
).split()
TWO = ["--response", "abrasion", "modulus", "--ignore", "elongation", "--ignore", "hardness"]


@pytest.fixture
def tread_csv(tmp_path):
    path = tmp_path / "tread.csv"
    tyre_tread().to_csv(path, index=False)
    return path


def answer_of(command, path, *words, status=0):
    out = path.parent / "answer.json"
    assert main([command, str(path), *map(str, words), "--json", str(out)]) == status
    return json.loads(out.read_text()) if status == 0 else None


def test_the_command_on_the_tyre_tread(tread_csv, capsys):
    """The published optimum (see test_desirability) from the table alone."""
    answer = answer_of("bbd", tread_csv, "--response", *TREAD_RESPONSES, *TREAD_WORDS)
    joint = answer["joint"]
    assert joint["desirability"] == pytest.approx(0.583, abs=5e-4)
    assert [joint["coded"][name] for name in TREAD_FACTORS] == pytest.approx([-0.0533, 0.144, -0.872], abs=5e-3)
    assert list(answer["responses"]) == TREAD_RESPONSES and answer["response"] == "abrasion"
    assert [factor["name"] for factor in answer["factors"]] == TREAD_FACTORS
    text = capsys.readouterr().out
    assert "overall desirability 0.583" in text and "next: measure" in text and "95 % mean" in text


def test_each_response_is_analysed_as_if_alone(tread_csv):
    together = answer_of("bbd", tread_csv, "--response", *TREAD_RESPONSES)
    for name in TREAD_RESPONSES:
        others = [word for other in TREAD_RESPONSES if other != name for word in ("--ignore", other)]
        alone = answer_of("bbd", tread_csv, "--response", name, *others)
        assert together["responses"][name] == alone and "responses" not in alone
    assert "joint" not in together


def test_the_default_is_the_last_column(tread_csv):
    ignored = [word for name in TREAD_RESPONSES[:3] for word in ("--ignore", name)]
    assert answer_of("bbd", tread_csv, *ignored) == answer_of("bbd", tread_csv, "--response", "hardness", *ignored)


def test_names_do_without_their_units_beside_blocks_and_bookkeeping(tmp_path):
    """A sheet as it comes back: run order first, a block, the responses amid the columns."""
    coded = box_behnken.coded_matrix(3, 6)
    noise = np.random.default_rng(3).normal(size=(2, len(coded)))
    frame = pd.DataFrame({"run": range(1, len(coded) + 1), "A": coded[:, 0]})
    frame["yield (%)"] = 60 + 5 * coded[:, 0] + 0.5 * noise[0]
    frame["B"], frame["C"] = coded[:, 1], coded[:, 2]
    frame["day"] = ["mon", "tue"] * (len(coded) // 2)
    frame["cost [EUR]"] = 9 - 2 * coded[:, 1] + 0.5 * noise[1] + (frame.day == "tue")
    path = tmp_path / "sheet.csv"
    frame.to_csv(path, index=False)
    words = [
        "--response",
        "yield",
        "cost",
        "--block",
        "day",
        "--maximise",
        "yield",
        "--minimise",
        "cost=7,8",
        "--unit",
        "cost=EUR",
    ]
    answer = answer_of("bbd", path, *words)
    assert list(answer["responses"]) == ["yield (%)", "cost [EUR]"] == list(answer["joint"]["responses"])
    assert answer["responses"]["cost [EUR]"]["blocks"]["day"]["tue"] == pytest.approx(0.5, abs=0.3)
    assert answer["joint"]["physical"]["A"] == pytest.approx(1, abs=1e-6)
    assert sum("run (order" in warning for warning in answer["warnings"]) == 1  # said of both at once


def test_runs_lost_for_one_response_stay_for_the_other(tmp_path):
    frame = tyre_tread()[[*TREAD_FACTORS, "abrasion", "hardness"]].astype(object)
    frame.loc[19, "abrasion"] = ""
    path = tmp_path / "lost.csv"
    frame.to_csv(path, index=False)
    answer = answer_of("bbd", path, "--response", "abrasion", "hardness")
    assert [answer["responses"][name]["runs"] for name in ("abrasion", "hardness")] == [19, 20]
    assert any(warning.startswith("abrasion: row 21") for warning in answer["warnings"])


def test_levels_lost_for_one_response_are_asked_for_and_then_given(tmp_path, capsys):
    """Without the runs at +1 of C a response's own table would code C anew: refused, and the advice works."""
    coded = box_behnken.coded_matrix(3, 5)
    levels = coded * [10, 2, 1] + [50, 6, 3]
    levels = np.vstack([levels, [[50, 6, 3.5], [50, 8, 3.5], [60, 6, 3.5], [40, 6, 3.5], [50, 4, 3.5]]])
    frame = pd.DataFrame(levels, columns=["T", "pH", "C"]).astype(object)
    x = (levels - [50, 6, 3]) / [10, 2, 1]
    frame["p"], frame["q"] = 9 + 2 * x[:, 0] + 0.1 * np.sin(9 * x).sum(axis=1), 5 + 3 * x[:, 1] ** 2 + 0.1 * x[:, 2]
    frame.loc[levels[:, 2] > 3.9, "q"] = np.nan
    path = tmp_path / "half.csv"
    frame.to_csv(path, index=False)
    words = ["--response", "p", "q", "--maximise", "p", "--limits", "q=,7"]
    factors = [word for f in ("T=40,60", "pH=4,8", "C=2,4") for word in ("--factor", f)]
    answer_of("bbd", path, *words, status=2)
    assert "--factor NAME=LOW,HIGH" in capsys.readouterr().err
    assert answer_of("bbd", path, *words, *factors)["joint"]["met"]


def test_maximise_alone_goes_to_the_highest_prediction(tread_csv):
    ignored = [word for name in TREAD_RESPONSES[:3] for word in ("--ignore", name)]
    answer = answer_of("bbd", tread_csv, *ignored, "--maximise")
    coefficients = answer["coefficients"]
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 21)] * 3), axis=-1).reshape(-1, 3)
    values = {**dict(zip(TREAD_FACTORS, grid.T, strict=True)), "1": 1.0}
    highest = sum(
        value * np.prod([values[f] for f in name.replace("^2", f"*{name[:-2]}").split("*")], axis=0)
        for name, value in coefficients.items()
    ).max()
    found = answer["joint"]["responses"]["hardness"]["prediction"]["predicted"]
    assert highest - 1e-9 <= found < highest + 0.05
    assert answer["joint"]["desirability"] == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize(
    "words, message",
    [
        (["--target", "5"], "say which, as in abrasion=5"),
        (["--target", "abrasion=5", "--target", "abrasion=6"], "given twice"),
        (["--target", "abrasoin=5"], "did you mean 'abrasion'"),
        (["--target", "abrasion=five"], "expected a number"),
        (["--target", "abrasion=150"], "--uncertainty abrasion=U"),
        (["--maximise", "abrasion", "--minimise", "abrasion"], "one goal a response"),
        (["--maximise", "abrasion", "--limits", "abrasion=1,2"], "--maximise NAME=LOW,HIGH"),
        (["--maximise", "abrasion=1,2,3"], "expected LOW,HIGH"),
        (["--maximise"], "say which"),
        (["--weight", "abrasion=2", "--maximise", "modulus"], "no goal"),
        (["--maximise", "abrasion", "--rule", "insensitive"], "leave it out"),
        (["--limits", "abrasion=1,200", "--verify", "1,2"], "say which"),
        (["--limits", "abrasion=1,200", "--verify", "modulus=1,2"], "what modulus is to meet"),
        (["--limits", "abrasion=9,3"], "lower one first"),
        (["--transform", "log"], "say which"),
    ],
)
def test_goals_that_cannot_be_are_refused_in_words(tread_csv, words, message, capsys):
    answer_of("bbd", tread_csv, *TWO, *words, status=2)
    assert message in capsys.readouterr().err


def test_goals_that_exclude_each_other_say_which_stands_in_the_way(tread_csv, capsys):
    """No setting has an abrasion of 300; without that goal nothing would be in the way."""
    answer = answer_of("bbd", tread_csv, *TWO, "--limits", "abrasion=300,", "--limits", "modulus=0,")
    assert (
        answer["joint"]["met"] is False and answer["joint"]["fraction_of_box"] == 0 == answer["joint"]["desirability"]
    )
    text = capsys.readouterr().out
    assert "no setting of the box meets all goals; if abrasion were let go, " in text
    assert "nearest (its worst response misses by least)" in text


def test_what_the_refusals_advise_works(tread_csv):
    answer = answer_of("bbd", tread_csv, *TWO, "--target", "abrasion=150", "--uncertainty", "abrasion=10")
    assert answer["joint"]["met"]
    answer = answer_of("bbd", tread_csv, *TWO, "--transform", "abrasion=log")
    assert answer["responses"]["abrasion"]["response"] == "ln(abrasion)"
    assert answer["responses"]["modulus"]["response"] == "modulus"
    answer = answer_of("bbd", tread_csv, *TWO, "--transform")
    assert set(answer["responses"]) == {"abrasion", "modulus"} <= set(TREAD_RESPONSES)


def test_columns_that_cannot_be_responses_are_refused(tread_csv, capsys):
    answer_of("bbd", tread_csv, "--response", "abrasion", "wear", status=2)
    assert "no column 'wear'" in capsys.readouterr().err
    answer_of("bbd", tread_csv, "--response", "abrasion", "abrasion", status=2)
    assert "came twice" in capsys.readouterr().err
    answer_of("bbd", tread_csv, "--response", "abrasion", "--ignore", "abrasion", status=2)
    assert "expected one of them" in capsys.readouterr().err
    assert main(["bbd", "--response", "abrasion", str(tread_csv)]) == 2
    assert "the table stands before --response and the like" in capsys.readouterr().err


def test_figures_of_each_response(tread_csv):
    folder = tread_csv.parent / "figures"
    answer = answer_of("bbd", tread_csv, *TWO, "--figures", folder)
    names = {path.name for path in folder.glob("*.png")}
    assert {"abrasion_response_surface.png", "modulus_predicted_observed.png"} <= names
    assert len(answer["figures"]) == len(names) >= 4


def test_pb_analyses_each_response(tmp_path, capsys):
    """Two responses of which one is a line of the other: twice the effects, the same F and p."""
    frame = table(7).drop(columns="No.")
    name = frame.columns[-1]
    frame["twice"] = 2 * frame[name] + 1
    path = tmp_path / "two.csv"
    frame.to_csv(path, index=False)
    answer = answer_of("pb", path, "--response", name, "twice", "--figures", tmp_path / "figures")
    first, second = (answer["responses"][each] for each in (name, "twice"))
    assert second["effects"] == pytest.approx({factor: 2 * effect for factor, effect in first["effects"].items()})
    assert second["p"] == pytest.approx(first["p"])
    text = capsys.readouterr().out
    assert answer["effects"] == first["effects"] and "---- twice ----" in text
    side_by_side = text.split("effects from -1 to +1 on each response")[1].splitlines()
    for line in side_by_side[2:9]:
        factor, one, two = line.split()
        assert float(two.strip("*")) == pytest.approx(2 * float(one.strip("*")), rel=1e-3)
        assert one.endswith("*") == two.endswith("*") == (first["p"][factor] < 0.05)
    assert (tmp_path / "figures" / "twice_pareto.png").exists()
    answer_of("pb", path, "--response", name, "twice", "--climb", "gradient", status=2)
    assert "one response" in capsys.readouterr().err
    assert "climb" in answer_of("pb", path, "--response", name, "--ignore", "twice", "--climb", "gradient")


def test_pb_with_named_levels_analyses_each_response(tmp_path):
    rows = [(a, c) for a in (-1, 1) for c in ("x", "y", "z")] * 2
    frame = pd.DataFrame(rows, columns=["A", "catalyst"])
    step = frame.catalyst.map({"x": 0, "y": 1, "z": 5})
    frame["p"] = 3 * frame.A + step + 0.1 * np.arange(12) % 0.3
    frame["q"] = -frame.A + 0.1 * np.arange(12) % 0.4
    path = tmp_path / "levels.csv"
    frame.to_csv(path, index=False)
    answer = answer_of("pb", path, "--factor", "catalyst=x,y,z", "--response", "p", "q")
    effects = [answer["responses"][name]["effects"]["A"] for name in ("p", "q")]
    assert effects == pytest.approx([6, -2], abs=0.3)


def test_a_saturated_design_says_that_nothing_is_known_of_its_uncertainty(tmp_path, capsys):
    """Ten runs for ten terms: the set as predicted, no confidence in it, the setting given all the same."""
    coded = np.vstack([box_behnken.coded_matrix(3, 1), [[1, 1, 1], [-1, -1, -1]]])[[0, 1, 2, 3, 4, 6, 8, 11, 12, 13]]
    frame = pd.DataFrame(coded, columns=list("ABC"))
    frame["p"], frame["q"] = 5 + 2 * coded[:, 0] + coded[:, 1] ** 2, 3 + 2 * coded[:, 1] - coded[:, 0] * coded[:, 2]
    path = tmp_path / "ten.csv"
    frame.to_csv(path, index=False)
    answer = answer_of("bbd", path, "--response", "p", "q", "--maximise", "p=4,8", "--limits", "q=2,4")
    assert answer["saturated"] and answer["joint"]["met"] and answer["joint"]["fraction_not_excluded"] is None
    assert answer["joint"]["physical"]["A"] == pytest.approx(1)
    assert "nothing is known of its uncertainty" in capsys.readouterr().out


def test_a_new_design_has_a_column_for_each_response(tmp_path, capsys):
    """Made, filled in by a plane each, and analysed by the command that it printed."""
    path = tmp_path / "sheet.csv"
    words = ["A=1,3", "B=10,30", "C=5,9"]
    assert main(["bbd", "--design", *words, "--response", "p (N)", "q", "--seed", "3", "--output", str(path)]) == 0
    text = capsys.readouterr().out
    assert "fill the last 2 columns in" in text and "--response 'p (N)' q" in text
    frame = pd.read_csv(path)
    wobble = 0.01 * np.sin(np.arange(len(frame)) ** 2)
    frame["p (N)"], frame["q"] = 3 * frame.A + wobble, 7 - frame.B / 10 + wobble[::-1]
    frame.to_csv(path, index=False)
    answer = answer_of("bbd", path, "--response", "p (N)", "q")
    slopes = [answer["responses"][name]["coefficients"][factor] for name, factor in (("p (N)", "A"), ("q", "B"))]
    assert slopes == pytest.approx([3, -1], abs=0.02)


def test_a_design_with_several_responses_is_judged_extended_and_mended(tmp_path, capsys):
    """A fresh sheet is scored; measured, its fold keeps both responses; a run that lacks one is a lost run."""
    path, folded, again = (tmp_path / name for name in ("sheet.csv", "folded.csv", "again.csv"))
    both = ["--response", "p", "q"]
    words = [f"{name}=1,3" for name in "ABCDEFG"]
    assert main(["pb", "--design", *words, *both, "--runs", "8", "--seed", "1", "--output", str(path)]) == 0
    assert main(["design", "score", str(path), *both]) == 0
    frame = pd.read_csv(path)
    frame["p"], frame["q"] = 5 + 2.0 * frame.A, 3 - 1.5 * frame.B
    frame.to_csv(path, index=False)
    assert main(["design", "fold", str(path), *both, "--seed", "2", "--output", str(folded)]) == 0
    written = pd.read_csv(folded)
    assert list(written.columns[-2:]) == ["p", "q"] and written[["p", "q"]].isna().sum().tolist() == [8, 8]
    kept = written.dropna()
    assert (kept.p - 5 - 2.0 * kept.A).abs().max() < 1e-9 and (kept.q - 3 + 1.5 * kept.B).abs().max() < 1e-9
    assert "fill the last 2 columns in" in capsys.readouterr().out
    frame.loc[3, "q"] = np.nan
    frame.to_csv(path, index=False)
    assert main(["design", "repair", str(path), *both, "--seed", "2", "--output", str(again)]) == 0
    assert "1 of 8 runs" in capsys.readouterr().out
    assert main(["design", "score", str(path), "--response", "p", "p"]) == 2
