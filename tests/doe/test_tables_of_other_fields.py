"""Tables of other fields as their writers head them: run numbers, paths with days, goals of several responses checked by runs."""

import json
import shlex

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.doe import box_behnken, screening_designs
from pellet_study.doe.factors import factors_meant
from pellet_study.doe.terms import columns_of, quadratic_terms
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
    found = answer(tmp_path, frame, "pb", "--main-effects")
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
    assert set(answer(tmp_path, frame, "pb", "--main-effects")["effects"]) == {"N", "B", "step"}


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
    assert main(readings[:-2]) == 0  # the cost was not measured
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


# ---------------------------------------------------------------------------------------- what the words claim
def test_a_factor_that_is_not_identified_says_what_it_may_do_with_the_others_held(tmp_path, capsys):
    """y = 60 + 4 A - 3 B: the target 60 +- 1 is met at any B with A to suit; at A = B = 0 within B = -1/3 to 1/3."""
    frame = surface()[["A", "B", "C"]].assign(y=lambda f: 60 + 4 * f.A - 3 * f.B + 1e-6 * np.arange(len(f)) ** 2 % 3e-6)
    found = answer(tmp_path, frame, "bbd", "--target", 60, "--uncertainty", 1)
    a, b, c = found["optimum"]["extents"]
    assert found["optimum"]["unidentified"] == ["A", "B", "C"] or found["optimum"]["unidentified"] == ["B", "C"]
    assert b["alone"] == pytest.approx([-1 / 3, 1 / 3], abs=2e-3) and a["alone"] == pytest.approx(
        [-0.25, 0.25], abs=2e-3
    )
    assert c["alone"] == pytest.approx([-1, 1])
    said = capsys.readouterr().out
    assert "both ends of its range will do, the others set to suit; with the others as recommended -0.33" in said
    assert "both ends of its range will do, and all between them with the others as recommended" in said
    joint = answer(tmp_path, None, "bbd", "--limits", "59,61")["joint"]["extents"]
    assert joint[1]["coded"] == pytest.approx([-1, 1]) and joint[2]["alone"] == pytest.approx([-1, 1])


@pytest.mark.parametrize("option", [["--drop", "AB,AC,BC,A2,B2,C2"], ["--reduce", "1e-4"], ["--select"]])
def test_the_reduced_models_own_lack_of_fit_is_warned_of(tmp_path, capsys, option):
    """Nine effects that the replicates show, fitted without some of them; a cube that no quadratic has."""
    coded = box_behnken.coded_matrix(3, 5)
    frame = pd.DataFrame(coded, columns=list("ABC"))
    y = columns_of(coded, quadratic_terms(list("ABC"))) @ [7.2, 0.4, -0.4, 0.4, -0.8, 0.8, 0.8, -0.8, -0.8, 0.8]
    y[-5:] += [0.5, -0.5, 0.25, -0.25, 0]
    found = answer(tmp_path, frame.assign(y=y), "bbd", *option)
    assert found["lack_of_fit_p"] > 0.05 > found["reduced"]["lack_of_fit_p"]
    error = capsys.readouterr().err
    assert f"{option[0]} left out what acts" in error and f"(without {option[0]})" in error
    answer(tmp_path, frame.assign(y=y + 9 * frame.A * frame.B**2), "bbd", *option)
    assert "as that of the full model is" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words", [["--predict", "A=0,B=0,C=0"], ["--target", "60"], ["--limits", "58,62"], ["--maximise"]]
)
def test_what_rests_on_chosen_terms_says_so_in_the_same_words(tmp_path, capsys, words):
    frame = surface()[["A", "B", "C", "yield (%)"]]
    caution = "caution: in the model of yield (%) the terms were chosen by the same runs that now test them"
    for option in (["--select"], ["--reduce"], ["--drop", "AC"]):
        answer(tmp_path, frame, "bbd", *words, *option)
        assert caution in capsys.readouterr().out
    answer(tmp_path, frame, "bbd", *words)
    assert "chosen by the same runs" not in capsys.readouterr().out


# ---------------------------------------------------------------------------------------------------- screenings
def test_curvature_leads_to_axial_points_on_the_same_table(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    frame = screening().assign(y=lambda f: f.y - 6 * f.A**2)
    frame.insert(0, "Lauf", range(1, len(frame) + 1))
    answer(tmp_path, frame, "pb")
    told = capsys.readouterr()
    (command,) = [
        line.split("next: pellet-study ")[1] for line in told.out.splitlines() if "next: pellet-study" in line
    ]
    assert command.startswith("design axial") and "design axial" in told.err
    assert main(shlex.split(command)) == 0
    assert len(pd.read_csv(tmp_path / "surface.csv")) == len(frame) + 4 + 3


def test_a_borderline_factor_of_the_hint_is_called_so(tmp_path, capsys):
    rng = np.random.default_rng(2)
    coded = screening_designs.coded_matrix(6, 12, 0)
    frame = pd.DataFrame(coded, columns=list("ABCDEF"))
    frame["y"] = 20 + coded @ [6, 4, 0.75, 0, 0, 0] + rng.normal(size=len(coded))
    found = answer(tmp_path, frame, "pb")
    borderline = [name for name, p in found["p"].items() if p < 0.05 <= found["p_adjusted"][name]]
    said = capsys.readouterr().out
    assert borderline and all(f"{name} (p " in said.split("borderline for y: ")[1] for name in borderline)
    assert "26 % of screenings" in said  # 1 - 0.95^6
    answer(tmp_path, frame[["A", "B", "y"]], "pb")
    assert "borderline for" not in capsys.readouterr().out


def test_long_lists_of_aliases_name_those_of_the_factors_that_act(tmp_path, capsys):
    coded = screening_designs.coded_matrix(8, 12, 0)
    frame = pd.DataFrame(coded, columns=list("ABCDEFGH"))
    frame["y"] = 20 + coded @ [6, 4, 3, 0.1, -0.1, 0.05, 0, 0.02] + 0.01 * np.arange(12) ** 2 % 0.7
    found = answer(tmp_path, frame, "pb")
    lines = {line.split(":")[0].strip(): line for line in capsys.readouterr().out.splitlines() if line.endswith("more")}
    assert (
        set(lines) == set("ABCDEFGH")
        and all("BC" in lines[name] for name in "ADEFGH")
        and len(found["aliases"]["A"]) > 6
    )
    assert all(len(line) < 80 for line in lines.values())


def test_replicates_in_blocks_are_not_called_none(tmp_path, capsys):
    frame = pd.concat([screening(centre=0)] * 2).assign(day=np.repeat(["a", "b"], 8))[["A", "B", "C", "day", "y"]]
    answer(tmp_path, frame, "pb", "--block", "day")
    error = capsys.readouterr().err
    assert "runs are repeated in different blocks only" in error and "no replicated runs" not in error
    answer(tmp_path, screening(centre=0), "pb")
    assert "no replicated runs" in capsys.readouterr().err


def test_the_stationary_point_and_the_climb_carry_the_responses_name(tmp_path, capsys):
    from pellet_study.doe import figures, plackett_burman, steepest_climb
    from pellet_study.doe.design_table import code_design

    frame = surface()[["A", "B", "C", "yield (%)"]].rename(columns={"yield (%)": "ΔE"})
    found = answer(tmp_path, frame, "bbd")
    value = found["stationary_point"]["predicted"]
    assert f", ΔE {value:.5g} at A " in capsys.readouterr().out
    analysis = plackett_burman.analyse(code_design(screening().rename(columns={"y": "ΔE"})))
    climb = steepest_climb.path(*steepest_climb.first_order_model(analysis))
    drawn = figures.climb_path(climb, "", response="ΔE")
    assert drawn.axes[0].get_ylabel() == "ΔE"


def test_a_path_is_followed_by_the_command_that_reads_its_runs(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    climb = [
        "--climb",
        "gradient",
        "--climb-step",
        "A=0.5",
        "--climb-limits",
        "A=-9,9",
        "--climb-limits",
        "B=-9,9",
        "--target",
        "-5",
    ]
    answer(tmp_path, screening(), "pb", *climb)
    (command,) = commands_of(capsys)
    path_runs().to_csv(tmp_path / "climb.csv", index=False)
    assert main(shlex.split(command)) == 0
    assert "the path" in capsys.readouterr().out and "--target=-5" in command
