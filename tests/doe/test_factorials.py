"""Two-level factorials with their interactions, and what blocks are confounded with, against published answers.

filtration rate: Montgomery, Design and Analysis of Experiments, Wiley, example 6.2 (2^4, unreplicated) and 8.1 (its half
fraction D = ABC). pilot plant: Box, Hunter, Hunter, Statistics for Experimenters, Wiley 1978, table 10.1 (2^3).
"""

import json

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.doe import interactions, plackett_burman, screening_designs
from pellet_study.doe.blocking import screening_blocks
from pellet_study.doe.confounding import confounded_with
from pellet_study.doe.design_table import code_design
from pellet_study.doe.score import score

FILTRATION_RATE = [45, 71, 48, 65, 68, 60, 80, 65, 43, 100, 45, 104, 75, 86, 70, 96]
PILOT_PLANT = [60, 72, 54, 68, 52, 83, 45, 80]


def factorial(names: str, response) -> pd.DataFrame:
    """A full factorial in standard order, the first factor running fastest."""
    runs = range(2 ** len(names))
    columns = {name: [1.0 if i >> k & 1 else -1.0 for i in runs] for k, name in enumerate(names)}
    return pd.DataFrame(columns).assign(y=np.asarray(response, dtype=float))


def answer(frame: pd.DataFrame, tmp_path, *options: str) -> dict:
    frame.to_csv(tmp_path / "table.csv", index=False)
    assert main(["pb", str(tmp_path / "table.csv"), *options, "--json", str(tmp_path / "a.json")]) == 0
    return json.loads((tmp_path / "a.json").read_text())


# ----------------------------------------------------------------------------------------------- interactions
def test_filtration_rate_as_published(tmp_path, capsys):
    """Effects and Lenth's margin as printed; the residual is that of the five higher interactions, 4 times the squared effects."""
    found = answer(factorial("ABCD", FILTRATION_RATE), tmp_path)
    printed = {"A": 21.625, "B": 3.125, "C": 9.875, "D": 14.625, "AB": 0.125, "AC": -18.125, "AD": 16.625, "BC": 2.375}
    printed |= {"BD": -0.375, "CD": -1.125}
    assert found["effects"] == pytest.approx(printed)
    higher = {"ABC": 1.875, "ABD": 4.125, "ACD": -1.625, "BCD": -2.625, "ABCD": 1.375}
    assert found["contrasts"] == pytest.approx(higher)
    residual = next(row for row in found["anova"] if row["source"] == "residual")
    assert (residual["sum_of_squares"], residual["df"]) == (pytest.approx(4 * sum(v**2 for v in higher.values())), 5)
    assert (found["lenth"]["contrasts"], round(found["lenth"]["margin_of_error"], 3)) == (15, 6.748)
    text = capsys.readouterr().out
    assert "beyond the margin: A, AC, AD, D, C\n" in text and "no effect carries another" in text
    assert "bbd --design A=LOW,HIGH C=LOW,HIGH D=LOW,HIGH" in text


def test_pilot_plant_as_published(tmp_path, capsys):
    found = answer(factorial("TCK", PILOT_PLANT), tmp_path)
    assert found["effects"] == pytest.approx({"T": 23, "C": -5, "K": 1.5, "TC": 1.5, "TK": 10, "CK": 0}, abs=1e-9)
    assert found["contrasts"] == pytest.approx({"TCK": 0.5})
    assert "beyond the margin: T, TK\n" in capsys.readouterr().out
    assert "bbd --design K=LOW,HIGH T=LOW,HIGH" in run_text(tmp_path, capsys)  # K acts by TK alone


def run_text(tmp_path, capsys) -> str:
    assert main(["pb", str(tmp_path / "table.csv")]) == 0
    return capsys.readouterr().out


def test_half_fraction_names_what_shares_a_contrast(tmp_path, capsys):
    """D = ABC of the same runs: A 19, B 1.5, C 14, D 16.5, AB+CD -1, AC+BD -18.5, AD+BC 19 as printed."""
    whole = factorial("ABCD", FILTRATION_RATE)
    found = answer(whole[whole.D == whole.A * whole.B * whole.C], tmp_path)
    assert found["effects"] == pytest.approx({"A": 19, "B": 1.5, "C": 14, "D": 16.5})
    assert found["contrasts"] == pytest.approx({"AB+CD": -1, "AC+BD": -18.5, "AD+BC": 19})
    assert found["interactions"] == [] and "Fractional factorial" in capsys.readouterr().out


def test_resolution_five_has_all_interactions_and_says_what_they_carry(tmp_path):
    """E = ABCD: 15 effects in 16 runs, each interaction with that of the three other factors."""
    frame = factorial("ABCD", np.zeros(16))
    frame.insert(4, "E", frame.A * frame.B * frame.C * frame.D)
    found = answer(frame.assign(y=10 + 2 * frame.A - 3 * frame.D * frame.E + 0.01 * np.arange(16) ** 2), tmp_path)
    assert len(found["interactions"]) == 10 and found["saturated"] and found["lenth"]["contrasts"] == 15
    assert found["aliases"]["AB"] == {"CDE": 1} and found["aliases"]["A"] == {}
    assert found["effects"]["DE"] == pytest.approx(-6, abs=0.5)


@pytest.mark.parametrize(
    ("names", "lost", "fitted"),
    [("ABCD", [], 6), ("ABCD", [3], 6), ("ABCD", [3, 9], 6), ("ABC", [5], 3), ("AB", [1], 0)],
)
def test_a_factorial_that_lost_runs_is_still_one(names, lost, fitted):
    """The mean, two effects and an interaction without noise are found exactly by least squares, where they can be told."""
    frame = factorial(names, np.zeros(2 ** len(names)))
    frame = frame.assign(y=5 + 2 * frame.A + (3 * frame.A * frame.B if fitted else frame.B)).drop(index=lost)
    found = plackett_burman.analyse(code_design(frame))
    assert len(found.interactions) == fitted
    assert found.effects["A"] == pytest.approx(4) and found.effects.get("AB", 6) == pytest.approx(6)


@pytest.mark.parametrize(("n_factors", "runs", "fitted"), [(3, 12, 3), (4, 12, 0), (5, 20, 0), (7, 12, 0), (4, 8, 0)])
def test_plackett_burman_designs_stay_screenings(n_factors, runs, fitted):
    """12 runs of three factors hold all eight corners; in 8 runs of four a main effect is mixed with an interaction."""
    coded = screening_designs.coded_matrix(n_factors, runs)
    found = interactions.clear_interactions(list("ABCDEFG"[:n_factors]), coded, np.zeros(runs, dtype=bool))
    assert len(found) == fitted


def test_replicates_and_centre_points_make_the_error():
    """2^2 twice: the error of y = A + B + AB is that of the pairs, 4 pairs that differ by 0.2: 4 x 0.02."""
    frame = factorial("AB", [1, 2, 3, 8])
    twice = pd.concat([frame.assign(y=frame.y + 0.1), frame.assign(y=frame.y - 0.1)])
    found = plackett_burman.analyse(code_design(twice))
    assert found.effects == pytest.approx({"A": 3, "B": 4, "AB": 2})
    assert (found.model.ss_residual, found.model.df_residual) == (pytest.approx(0.08), 4)
    centre = pd.DataFrame({"A": [0.0] * 3, "B": [0.0] * 3, "y": [3.4, 3.5, 3.6]})
    found = plackett_burman.analyse(code_design(pd.concat([frame, centre])))
    assert (found.model.ss_residual, found.model.df_residual) == (pytest.approx(0.02), 2)
    assert found.curvature.estimate == pytest.approx(0)


def test_main_effects_alone_where_asked_for(tmp_path):
    found = answer(factorial("ABCD", FILTRATION_RATE), tmp_path, "--main-effects")
    assert set(found["effects"]) == set("ABCD") and found["contrasts"]["AC"] == pytest.approx(-18.125)


def test_the_logarithm_of_a_product_has_no_interactions(tmp_path, capsys):
    """y = exp(2 + A/2 + B): the effects of ln y are 1 and 2, and no interaction is left."""
    frame = factorial("AB", np.zeros(4))
    twice = pd.concat([frame, frame], ignore_index=True)
    y = np.exp(2 + twice.A / 2 + twice.B + 0.01 * np.repeat([1.0, -1.0], 4))
    found = answer(twice.assign(y=y), tmp_path, "--transform", "log")
    assert found["effects"] == pytest.approx({"A": 1, "B": 2, "AB": 0}, abs=1e-9)
    assert found["transformation"]["power"] == 0 and found["response"] == "ln(y)"
    assert answer(twice.assign(y=y), tmp_path, "--transform")["transformation"]["advised"] == "log"
    words = ["pb", str(tmp_path / "table.csv"), "--transform", "log", "--climb", "gradient"]
    assert main(words) == 2 and "leave --transform out" in capsys.readouterr().err


# ----------------------------------------------------------------------------------------------------- advice
def lacking(frame: pd.DataFrame, tmp_path, capsys, *options: str) -> str:
    answer(frame, tmp_path, *options)
    return next(line for line in capsys.readouterr().err.splitlines() if "lack of fit is significant" in line)


def test_the_advice_is_never_what_the_table_is_already(tmp_path, capsys):
    """2^3 twice with a product of three: neither a full factorial nor a fold-over is advised to it."""
    frame = factorial("ABC", np.zeros(8))
    frame = frame.assign(y=10 + frame.A + 2 * frame.A * frame.B * frame.C)
    twice = pd.concat([frame.assign(y=frame.y + 0.1), frame.assign(y=frame.y - 0.1)])
    said = lacking(twice, tmp_path, capsys)
    assert "factorial" not in said and "fold" not in said and "--transform log" in said
    said = lacking(twice.assign(y=twice.y + 2 * twice.A * twice.B), tmp_path, capsys, "--main-effects")
    assert "leave out --main-effects" in said


def test_a_half_fraction_is_told_to_fold_on_one_factor_and_that_works(tmp_path, capsys):
    whole = factorial("ABCD", FILTRATION_RATE)
    half = whole[whole.D == whole.A * whole.B * whole.C]
    said = lacking(pd.concat([half.assign(y=half.y + 0.5), half.assign(y=half.y - 0.5)]), tmp_path, capsys)
    assert "design fold --on A" in said
    assert main(["design", "fold", str(tmp_path / "table.csv"), "--on", "A"]) == 0
    assert "interactions now clear of everything up to two factors: AB, AC, AD" in capsys.readouterr().out


# ----------------------------------------------------------------------------------------------------- blocks
@pytest.mark.parametrize(
    ("n_factors", "runs", "n_blocks", "whole"),
    [(3, 8, 2, {"ABC"}), (3, 8, 4, {"AB", "AC", "BC"}), (4, 16, 2, {"ABCD"})],
)
def test_blocks_are_confounded_with_the_highest_interaction(n_factors, runs, n_blocks, whole):
    """The plans of Box, Hunter and Hunter 1978, table 10.17 (and ABC where two blocks are made of 2^3)."""
    coded = screening_designs.coded_matrix(n_factors, runs)
    found = confounded_with(list("ABCD"[:n_factors]), coded, screening_blocks(coded, n_blocks))
    assert found == pytest.approx(dict.fromkeys(whole, 1.0))


def test_four_blocks_of_sixteen_runs_hide_one_interaction_of_two_factors():
    """Any 2^4 in four blocks hides one at least: ABC, ABD and so CD; or ABCD, AB and so CD, which are two."""
    coded = screening_designs.coded_matrix(4, 16)
    found = confounded_with(list("ABCD"), coded, screening_blocks(coded, 4))
    assert [len(name) for name, share in found.items() if share > 0.99] == [2, 3, 3]


def test_a_design_in_blocks_says_with_what_they_are_confounded(tmp_path, capsys):
    words = ["pb", "--design", "A=1,2", "B=1,2", "C=1,2", "--runs", "8", "--blocks", "2", "--seed", "1"]
    assert main([*words, "--output", str(tmp_path / "d.csv"), "--json", str(tmp_path / "a.json")]) == 0
    assert "confounded with ABC:" in capsys.readouterr().out
    assert json.loads((tmp_path / "a.json").read_text())["block_confounded"] == {"ABC": pytest.approx(1)}


def blocked_by_ac() -> pd.DataFrame:
    frame = factorial("ABC", PILOT_PLANT)
    frame.insert(3, "day", np.where(frame.A * frame.C > 0, "Mo", "Tu"))
    return frame


def test_an_analysis_in_blocks_leaves_out_what_they_hide_and_says_so(tmp_path, capsys):
    found = answer(blocked_by_ac(), tmp_path, "--block", "day")
    assert set(found["interactions"]) == {"AB", "BC"} and found["block_confounded"] == {"AC": pytest.approx(1)}
    assert found["effects"]["A"] == pytest.approx(23) and "confounded with AC:" in capsys.readouterr().out
    assert main(["design", "score", str(tmp_path / "table.csv"), "--block", "day"]) == 0
    assert "confounded with AC:" in capsys.readouterr().out
    assert main(["design", "score", str(tmp_path / "table.csv"), "--block", "day", "--model", "interactions"]) == 0
    said = capsys.readouterr().out
    assert "another way" in said and "fold" not in said


def test_a_score_has_the_share_that_lies_between_blocks():
    frame = blocked_by_ac()
    found = score(list("ABC"), frame[["A", "B", "C"]], "main", list(frame.day))
    assert found.block_confounded == {"AC": pytest.approx(1)}
