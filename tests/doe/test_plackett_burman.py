"""Plackett-Burman: the design against its defining properties, the analysis against published answers.

Sources of the published answers
--------------------------------
cast fatigue: Hunter, Hodi, Eagar, Metall. Trans. A 13 (1982) 1589; data as BM93.e2.data of the R package
BsMD; main effects as printed by Wu and Hamada, Experiments, Wiley 2000 (chapter 8).
unbalanced 2 x 2: SAS/STAT User's Guide, The GLM Procedure, "PROC GLM for Unbalanced ANOVA": a replicated
two-level design with one run missing, type III sums of squares.
filtration rate: Montgomery, Design and Analysis of Experiments, Wiley, example 6.2 (2^4, unreplicated):
Lenth's method. chemical process: Montgomery, solutions manual, problem 8.1 (half fraction): Design-Expert's
Lenth ME and SME.
"""

from itertools import combinations

import numpy as np
import pandas as pd
import pytest

from pellet_study.doe import lenth as lenth_module
from pellet_study.doe import plackett_burman, screening_designs
from pellet_study.doe.design_table import code_design
from pellet_study.doe.factors import Factor
from pellet_study.doe.interactions import aliases
from pellet_study.doe.terms import linear_terms
from pellet_study.errors import InputError
from pellet_study.paper.printed import table

CAST_FATIGUE = """
+ + - + + + -  6.058
+ - + + + - -  4.733
- + + + - - -  4.625
+ + + - - - +  5.899
+ + - - - + -  7.000
+ - - - + - +  5.752
- - - + - + +  5.682
- - + - + + -  6.607
- + - + + - +  5.818
+ - + + - + +  5.917
- + + - + + +  5.863
- - - - - - -  4.809
"""

FILTRATION_RATE = [45, 71, 48, 65, 68, 60, 80, 65, 43, 100, 45, 104, 75, 86, 70, 96]


def cast_fatigue() -> pd.DataFrame:
    rows = [line.split() for line in CAST_FATIGUE.strip().splitlines()]
    values = [[1.0 if cell == "+" else -1.0 for cell in row[:7]] + [float(row[7])] for row in rows]
    return pd.DataFrame(values, columns=[*"ABCDEFG", "log_life"])


def filtration_rate() -> pd.DataFrame:
    base = np.array([[1.0 if i >> k & 1 else -1.0 for k in range(4)] for i in range(16)])
    columns = {}
    for size in range(1, 5):
        for chosen in combinations(range(4), size):
            columns["".join("ABCD"[k] for k in chosen)] = base[:, list(chosen)].prod(axis=1)
    return pd.DataFrame(columns).assign(rate=[float(y) for y in FILTRATION_RATE])


# ---------------------------------------------------------------------------------------------------- design
@pytest.mark.parametrize("n_factors", range(1, 24))
def test_every_size_up_to_23_factors_is_orthogonal_and_balanced(n_factors):
    matrix = screening_designs.coded_matrix(n_factors)
    runs = len(matrix)
    assert runs % 4 == 0 and runs > n_factors
    assert np.array_equal(matrix.T @ matrix, runs * np.eye(n_factors))
    assert not matrix.sum(axis=0).any()


@pytest.mark.parametrize("runs", [8, 12, 16, 20, 24])
def test_saturated_sizes_are_hadamard_like_those_of_the_library(runs):
    import pyDOE3

    ours, library = screening_designs.coded_matrix(runs - 1, runs), pyDOE3.pbdesign(runs - 1)
    assert ours.shape == library.shape
    assert np.array_equal(ours.T @ ours, library.T @ library)


def test_seven_factors_give_the_papers_twelve_runs_in_its_order():
    assert np.array_equal(screening_designs.coded_matrix(7, centre_points=1), table(7).to_numpy()[:, 1:8])


def test_physical_levels_with_units_centre_points_and_a_reversed_factor():
    frame = screening_designs.design([Factor("B", 0.9, 0.7), Factor("G", 0.1, 0.3, "J/m2")], centre_points=2)
    assert len(frame) == 14
    assert frame["B"].iloc[0] == 0.7 and frame["B"].iloc[11] == 0.9
    assert frame.iloc[12].tolist() == [0.8, 0.2]


@pytest.mark.parametrize("arguments", [(0,), (24,), (7, 10), (8, 8), (3, None, -1)])
def test_impossible_designs_are_refused(arguments):
    with pytest.raises(InputError, match="expected"):
        screening_designs.coded_matrix(*arguments)


# -------------------------------------------------------------------------------------------------- analysis
def test_cast_fatigue_main_effects_as_published():
    screening = plackett_burman.analyse(code_design(cast_fatigue()))
    published = {"A": 0.326, "B": 0.294, "C": -0.246, "D": -0.516, "E": 0.150, "F": 0.915, "G": 0.183}
    assert {name: round(effect, 3) for name, effect in screening.effects.items()} == published


def test_row_order_does_not_matter():
    frame = cast_fatigue()
    shuffled = frame.sample(frac=1, random_state=3)
    first, second = (plackett_burman.analyse(code_design(data)) for data in (frame, shuffled))
    for name in "ABCDEFG":
        assert second.effects[name] == pytest.approx(first.effects[name])
        assert second.p[name] == pytest.approx(first.p[name])


def test_a_two_level_design_with_a_missing_run_has_the_published_type_three_sums():
    frame = pd.DataFrame({"A": [-1, -1, -1, -1, 1, 1, 1], "B": [-1, -1, 1, 1, -1, -1, 1]}, dtype=float)
    frame = frame.assign(AB=frame.A * frame.B, Y=[12, 14, 11, 9, 20, 18, 17])
    screening = plackett_burman.analyse(code_design(frame))
    rows = {row["source"]: row for row in screening.anova}
    assert rows["model"]["sum_of_squares"] == pytest.approx(91.71428571, abs=1e-8)
    assert [rows[name]["sum_of_squares"] for name in ("A", "B", "AB")] == pytest.approx([67.6, 10.0, 0.4], abs=1e-8)
    assert (rows["residual"]["sum_of_squares"], rows["residual"]["df"]) == (pytest.approx(6.0), 3)
    assert not screening.orthogonal


def test_a_failed_run_is_left_out_by_least_squares_and_its_loss_is_stated():
    frame = cast_fatigue().drop(index=4)
    screening = plackett_burman.analyse(code_design(frame))
    x = np.column_stack([np.ones(11), frame.iloc[:, :7]])
    expected = 2 * np.linalg.lstsq(x, frame["log_life"], rcond=None)[0][1:]
    assert list(screening.effects.values()) == pytest.approx(expected)
    assert not screening.orthogonal
    # 11 of 12 orthogonal runs: (X'X)^-1 = (I + xx'/(12 - x'x)) / 12 with x'x = 8
    inflation = np.sqrt(11 * (1 + 1 / (12 - 8)) / 12)
    assert list(screening.standard_error_inflation.values()) == pytest.approx([inflation] * 7)


def test_replicated_runs_give_pure_error_and_the_same_effects():
    frame = cast_fatigue()
    noisy = pd.concat([frame.assign(log_life=frame.log_life + 0.1), frame.assign(log_life=frame.log_life - 0.1)])
    screening = plackett_burman.analyse(code_design(noisy))
    rows = {row["source"]: row for row in screening.anova}
    assert (rows["pure error"]["sum_of_squares"], rows["pure error"]["df"]) == (pytest.approx(12 * 0.02), 12)
    assert screening.effects["F"] == pytest.approx(0.915, abs=5e-4)
    assert 0 < screening.lack_of_fit_p < 1


# ----------------------------------------------------------------------------------------- Lenth, saturation
def test_lenth_of_the_filtration_rate_as_published_and_no_p_values_when_saturated():
    screening = plackett_burman.analyse(code_design(filtration_rate()))
    assert screening.saturated
    assert set(screening.p.values()) == set(screening.p_adjusted.values()) == {None}
    assert (screening.r2_adjusted, screening.r2_predicted, screening.cv_percent) == (None, None, None)
    lenth = screening.lenth
    assert lenth.contrasts == 15
    assert round(lenth.pseudo_standard_error, 3) == 2.625
    assert round(lenth.margin_of_error, 3) == 6.748
    assert round(lenth.simultaneous_margin_of_error, 3) == 13.699
    printed = {"A": 21.625, "C": 9.875, "D": 14.625, "AC": -18.125, "AD": 16.625}
    assert {name: pytest.approx(screening.effects[name]) for name in printed} == printed


def test_lenth_of_the_half_fraction_as_published():
    lenth = lenth_module.lenth([-12, -1, 4, -1, 6, -1, -5])
    # the program's t quantile at 7/3 degrees of freedom differs in the fifth digit
    assert lenth.margin_of_error == pytest.approx(22.5856, rel=5e-5)
    assert lenth.simultaneous_margin_of_error == pytest.approx(54.0516, rel=5e-5)


def test_lenth_leaves_out_what_exceeds_two_and_a_half_times_the_first_estimate():
    """s0 = 1.5 x 2: 7.4 is below 2.5 s0 = 7.5 and kept, 7.6 is not."""
    assert lenth_module.lenth([1, -2, 7.4]).pseudo_standard_error == pytest.approx(1.5 * 2)
    assert lenth_module.lenth([1, -2, 7.6]).pseudo_standard_error == pytest.approx(1.5 * 1.5)


def test_lenth_uses_the_unused_columns_of_the_design():
    """The sums of squares of the completing columns add up to the residual."""
    table_ = code_design(cast_fatigue())
    contrasts = lenth_module._unused_contrasts(table_, np.zeros(12, bool), linear_terms(table_.names))
    screening = plackett_burman.analyse(table_)
    assert len(contrasts) == 4 and screening.lenth.contrasts == 11
    assert 3 * np.sum(np.square(contrasts)) == pytest.approx(screening.model.ss_residual)


# -------------------------------------------------------------------------------------------- aliases, power
def test_aliases_of_eleven_factors_are_none_or_one_third():
    """Plackett and Burman's 12 runs: an interaction is spread over the factors not in it, a third to each."""
    names = list("ABCDEFGHIJK")
    found = aliases(names, screening_designs.coded_matrix(11))
    for name, shares in found.items():
        assert len(shares) == 45 and not any(name in pair for pair in shares)
        assert np.allclose(np.abs(list(shares.values())), 1 / 3)


def test_aliases_of_eight_runs_are_complete():
    found = aliases(list("ABCDEFG"), screening_designs.coded_matrix(7, 8))
    assert all(abs(share) == 1 and len(shares) == 3 for shares in found.values() for share in shares.values())


def test_the_detectable_effect_is_found_four_times_in_five():
    rng = np.random.default_rng(7)
    x = screening_designs.coded_matrix(7)
    frame = pd.DataFrame(x, columns=list("ABCDEFG")).assign(y=rng.normal(size=12))
    screening = plackett_burman.analyse(code_design(frame))
    detectable = screening.detectable_effects["A"] / np.sqrt(screening.model.mean_square_error)  # per unit sigma
    y = 0.5 * detectable * x[:, :1] + rng.normal(size=(12, 20000))
    full = np.column_stack([np.ones(12), x])
    fitted = full @ (full.T @ y) / 12
    sums = 12 * ((x[:, 0] @ y) / 12) ** 2
    f = sums / (np.sum((y - fitted) ** 2, axis=0) / 4)
    assert np.mean(f > 7.708647422176786) == pytest.approx(0.8, abs=0.01)  # F(0.95; 1, 4) of printed tables


def test_curvature_is_the_centre_minus_the_mean_of_the_corners():
    frame = cast_fatigue()
    centre = pd.DataFrame([[0.0] * 7 + [y] for y in (6.9, 7.1)], columns=frame.columns)
    screening = plackett_burman.analyse(code_design(pd.concat([frame, centre])))
    assert screening.curvature.estimate == pytest.approx(7.0 - frame.log_life.mean())
    assert screening.effects["F"] == pytest.approx(0.915, abs=5e-4)
    assert screening.orthogonal
