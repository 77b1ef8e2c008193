"""Fold-over, axial points, repair, power, score and blocks against textbook answers and closed forms."""

from itertools import combinations, product

import numpy as np
import pandas as pd
import pytest

from pellet_study.doe import blocking
from pellet_study.doe.augment import add_axial
from pellet_study.doe.box_behnken import coded_matrix as surface_matrix
from pellet_study.doe.categorical import analyse_levels
from pellet_study.doe.composite import composite_matrix, cube
from pellet_study.doe.fold_over import fold_over, resolution
from pellet_study.doe.power import design_power, power_of, screening_runs
from pellet_study.doe.repair import repair
from pellet_study.doe.score import model_terms, score
from pellet_study.doe.screening_designs import coded_matrix
from pellet_study.doe.terms import columns_of, linear_terms, quadratic_terms
from pellet_study.errors import InputError

A_TO_G = list("ABCDEFG")


def fraction_7_4():
    """The 2^(7-4) of resolution III: D = AB, E = AC, F = BC, G = ABC (Montgomery, ch. 8)."""
    a, b, c = np.array(list(product((-1.0, 1.0), repeat=3))).T
    return np.column_stack([a, b, c, a * b, a * c, b * c, a * b * c])


# ---------------------------------------------------------------------------------------------------- fold-over
def test_a_full_fold_over_of_resolution_three_gives_resolution_four():
    found = fold_over(A_TO_G, fraction_7_4())
    # Montgomery, ch. 8: [A] estimates A + BD + CE + FG, the full fold-over leaves A alone
    assert set(found.freed["A"]) == {"BD", "CE", "FG"} and found.full
    assert not any(found.after.values()) and not found.interactions_freed
    assert resolution(fraction_7_4()) == 3 and resolution(np.vstack([fraction_7_4(), found.added])) == 4


def test_folding_on_one_factor_frees_it_and_its_interactions():
    found = fold_over(A_TO_G, fraction_7_4(), ["D"])
    # Montgomery, ch. 8: folding on D isolates D and all its two-factor interactions
    assert found.after["D"] == {} and set(found.freed["D"]) == {"AB", "CG", "EF"}
    assert set(found.interactions_freed) == {"AD", "BD", "CD", "DE", "DF", "DG"}
    assert set(found.after["A"]) == {"CE", "FG"}


def test_plackett_burman_is_freed_from_partial_aliases_by_folding():
    found = fold_over(A_TO_G, coded_matrix(7, 12))
    assert all(abs(share) == pytest.approx(1 / 3) for shares in found.before.values() for share in shares.values())
    assert not any(found.after.values())


@pytest.mark.parametrize(("coded", "on"), [(cube(3), None), (fraction_7_4(), ["Q"]), (surface_matrix(3, 2), None)])
def test_fold_overs_that_bring_nothing_are_refused(coded, on):
    with pytest.raises(InputError, match="expected|accepted are|frees nothing"):
        fold_over(A_TO_G[: coded.shape[1]], coded, on)


# ------------------------------------------------------------------------------------------------- axial points
def test_a_factorial_with_axial_points_is_the_rotatable_composite():
    coded = np.vstack([cube(2), np.zeros((3, 2))])
    found = add_axial(["A", "B"], coded, centre_points=3)
    assert found.distance == pytest.approx(2**0.5) and not found.lost
    assert found.block_inflation == pytest.approx(1)  # Box and Hunter (1957): 4 + 3 and 4 + 3 runs are orthogonal
    expected, _ = composite_matrix(2, "rotatable", 6)
    together = np.vstack([coded, found.added])
    assert sorted(map(tuple, together.round(9))) == sorted(map(tuple, expected.round(9)))


def test_axial_points_of_some_factors_keep_the_others_where_they_are_held():
    found = add_axial(A_TO_G, coded_matrix(7, 12, 3), ["B", "F"], "face", 2, {"A": 1.0})
    assert np.all(found.added[:, 0] == 1) and np.all(found.added[:, [2, 3, 4, 6]] == 0)
    assert sorted(map(tuple, found.added[:4, [1, 5]])) == [(-1, 0), (0, -1), (0, 1), (1, 0)] and len(found.added) == 6


def test_terms_that_stay_mixed_are_named():
    half = cube(3)[cube(3).prod(axis=1) > 0]  # C = AB: each main effect is an interaction on the corners
    found = add_axial(list("ABCDE"), np.column_stack([half, half[:, :2]]))
    assert {"AD", "BE"} & set(found.lost)
    with pytest.raises(InputError, match="no factor"):
        add_axial(["A", "B"], cube(2), ["A", "C"])
    with pytest.raises(InputError, match="bbd"):
        add_axial(list("ABC"), surface_matrix(3, 3))


# -------------------------------------------------------------------------------------------------------- repair
def test_one_run_lost_of_a_two_level_factorial():
    matrix = columns_of(cube(3), linear_terms(list("ABC")))
    found = repair(matrix, [5], ["1", "A", "B", "C"])
    # |X'X - x x'| = |X'X| (1 - p/n): D-efficiency (1/2)^(1/4); a diagonal of (X'X - xx')^-1 is (1/8)(1 + 1/8/(1 - 1/2))
    assert found.efficiency == pytest.approx([100 * 0.5**0.25, 100])
    assert found.worst_inflation == pytest.approx([1.25**0.5, 1])
    assert found.repeated == [5] and found.needed == 0


def test_a_saturated_design_needs_every_run():
    matrix = columns_of(coded_matrix(11, 12), linear_terms([f"x{i}" for i in range(11)]))
    found = repair(matrix, [2, 7, 9], ["1", *(f"x{i}" for i in range(11))])
    assert found.needed == 3 and sorted(found.repeated) == [2, 7, 9] and not found.confounded_after
    assert found.confounded_now and found.efficiency[0] == 0 and found.efficiency[-1] == pytest.approx(100)


def test_the_choice_is_the_best_of_all():
    terms = quadratic_terms(list("ABC"))
    matrix, lost = columns_of(surface_matrix(3, 3), terms), [0, 3, 5, 8, 12, 13]
    found = repair(matrix, lost, list(terms), 3)
    kept = [i for i in range(15) if i not in lost]
    size = {c: np.linalg.det(matrix[[*kept, *c]].T @ matrix[[*kept, *c]]) for c in combinations(lost, 3)}
    best = [c for c, value in size.items() if value > max(size.values()) * (1 - 1e-9)]
    assert tuple(sorted(found.repeated)) in best
    with pytest.raises(InputError, match="expected 1 to 6"):
        repair(matrix, lost, list(terms), 7)
    with pytest.raises(InputError, match="no run is lost"):
        repair(matrix, [], list(terms))


# --------------------------------------------------------------------------------------------------------- power
# Cohen (1988), Table 2.3.5 (two-sided t test of two means, alpha .05): n in each group, d, power
@pytest.mark.parametrize(("n", "d", "power"), [(20, 0.5, 0.33), (64, 0.5, 0.80), (26, 0.8, 0.81)])
def test_power_of_a_factor_is_that_of_cohens_two_means(n, d, power):
    matrix = np.column_stack([np.ones(2 * n), np.repeat([-1.0, 1.0], n)])
    found = design_power(matrix, linear_terms(["A"]), sd=2.0, effect=2.0 * d)
    assert found.power["A"] == pytest.approx(power, abs=0.01)  # his two digits rest on an approximation


# R, power.t.test(delta=d, power=0.8): n = 393.41, 63.77, 25.52 in each group
@pytest.mark.parametrize(("d", "n"), [(0.2, 394), (0.5, 64), (0.8, 26)])
def test_runs_needed_are_those_of_two_means(d, n):
    pair = np.array([[1.0, -1.0], [1.0, 1.0]])
    found = design_power(pair, linear_terms(["A"]), sd=1.0, effect=d)
    assert found.power["A"] is None and found.runs_needed == 2 * n == 2 * found.replicates
    assert screening_runs(1, 1.0, d) == 4 * -(-2 * n // 4)


def test_power_agrees_with_simulated_runs_and_with_statsmodels():
    from statsmodels.stats.power import FTestAnovaPower

    assert power_of(2.5**2 * 2, 20, 0.05) == pytest.approx(
        FTestAnovaPower().power(2.5 * (2 / 22) ** 0.5, 22, 0.05, k_groups=2), abs=1e-6
    )
    terms = quadratic_terms(list("ABC"))
    matrix, rng = columns_of(surface_matrix(3, 3), terms), np.random.default_rng(1)
    found = design_power(matrix, terms, sd=1.0, effect=2.0)
    inverse = np.linalg.inv(matrix.T @ matrix)
    truth = np.zeros(10)
    truth[1], truth[7] = 1.0, 2.0  # A by 2 from -1 to +1, A^2 by 2 from the middle to an end
    y = matrix @ truth + rng.normal(size=(20000, 15))
    estimates = y @ matrix @ inverse
    sigma = np.sqrt(np.sum((y - estimates @ matrix.T) ** 2, axis=1) / 5)
    from scipy.stats import t

    shown = np.abs(estimates) / sigma[:, None] / np.sqrt(np.diag(inverse)) > t.isf(0.025, 5)
    assert found.power["A"] == pytest.approx(shown[:, 1].mean(), abs=0.012)
    assert found.power["A2"] == pytest.approx(shown[:, 7].mean(), abs=0.012)
    again = design_power(matrix, terms, sd=1.0, effect=found.detectable["A"])
    assert again.power["A"] == pytest.approx(0.8)


@pytest.mark.parametrize("numbers", [{"sd": 0}, {"effect": 0}, {"alpha": 1}, {"wanted": 0.01}, {"sd": float("nan")}])
def test_impossible_powers_are_refused(numbers):
    with pytest.raises(InputError, match="expected"):
        design_power(np.eye(2), linear_terms(["A"]), **{"sd": 1.0, "effect": 1.0, **numbers})


# --------------------------------------------------------------------------------------------------------- score
def test_orthogonal_two_level_designs_have_every_efficiency_100():
    for coded in (cube(3), coded_matrix(11, 12), coded_matrix(5, 8)):
        k = coded.shape[1]
        found = score([f"x{i}" for i in range(k)], coded, "main")
        assert [found.d_efficiency, found.a_efficiency, found.g_efficiency] == pytest.approx([100] * 3)
        assert found.average_variance == pytest.approx((1 + k / 3) / len(coded))
        assert found.max_variance == pytest.approx((1 + k) / len(coded))
        assert list(found.vif.values()) == pytest.approx([1] * k)


def test_three_by_three_factorial_for_the_quadratic_model():
    found = score(["A", "B"], np.array(list(product((-1.0, 0.0, 1.0), repeat=2))), "quadratic")
    # |X'X| = 6 6 4 |9 6 6; 6 6 4; 6 4 6| = 5184; the largest variance, 29/36, is at the corners
    assert found.d_efficiency == pytest.approx(100 * 5184 ** (1 / 6) / 9)
    assert found.max_variance == pytest.approx(29 / 36) and found.g_efficiency == pytest.approx(100 * 6 * 36 / 29 / 9)
    assert found.aliases["A"] == {"AAA": 1.0, "ABB": pytest.approx(2 / 3)}


def test_aliases_and_confounded_terms_of_a_fraction():
    names = A_TO_G
    assert set(score(names, fraction_7_4(), "main").aliases["A"]) == {"BD", "CE", "FG"}
    mixed = score(names, fraction_7_4(), "interactions")
    assert "BD" in mixed.confounded and mixed.d_efficiency is None
    with pytest.raises(InputError, match="main, interactions, quadratic"):
        model_terms(names, "cubic")


# -------------------------------------------------------------------------------------------------------- blocks
@pytest.mark.parametrize(("n_factors", "runs", "n_blocks"), [(7, 12, 2), (4, 8, 2), (5, 16, 4), (11, 24, 2), (3, 8, 2)])
def test_screenings_in_orthogonal_blocks(n_factors, runs, n_blocks):
    coded = coded_matrix(n_factors, runs, n_blocks)
    blocks = blocking.screening_blocks(coded, n_blocks)
    assert np.ptp(np.bincount(blocks)[1:]) == 0
    assert all(np.allclose(coded[blocks == block].mean(axis=0), 0) for block in range(1, n_blocks + 1))


def test_blocks_that_cannot_be_orthogonal_are_said_to_be_so():
    full = np.column_stack([np.ones(12), coded_matrix(11, 12)])
    assert blocking.inflation(full, blocking.screening_blocks(coded_matrix(11, 12), 2)).max() == np.inf
    coded = surface_matrix(3, 4)
    matrix = columns_of(coded, quadratic_terms(list("ABC")))
    worst = blocking.inflation(matrix, blocking.surface_blocks(coded, matrix, 2)).max()
    assert 1 < worst < 1.1
    with pytest.raises(InputError, match="expected 1 to 6"):
        blocking.screening_blocks(coded_matrix(7, 12), 7)


# -------------------------------------------------------------------------------------------------- named levels
def test_montgomerys_batteries_have_his_sums_of_squares():
    # Montgomery, Design and Analysis of Experiments, Tables 5.1 and 5.5: material (1, 2, 3) by temperature
    life = {
        (0, 0): (130, 155, 74, 180), (0, 1): (34, 40, 80, 75), (0, 2): (20, 70, 82, 58),
        (1, 0): (150, 188, 159, 126), (1, 1): (136, 122, 106, 115), (1, 2): (25, 70, 58, 45),
        (2, 0): (138, 110, 168, 160), (2, 1): (174, 120, 150, 139), (2, 2): (96, 104, 82, 60),
    }  # fmt: skip
    rows = [(m, t, y) for (m, t), values in life.items() for y in values]
    frame = pd.DataFrame(rows, columns=["material", "temperature", "life"])
    levels = {"material": ("1", "2", "3"), "temperature": ("15 F", "70 F", "125 F")}
    found = analyse_levels(
        pd.DataFrame(index=frame.index), [], {name: frame[name] for name in levels}, levels, frame["life"]
    )
    sums = {row["source"]: row["sum_of_squares"] for row in found.anova}
    assert sums["material"] == pytest.approx(10683.72, abs=0.005)
    assert sums["temperature"] == pytest.approx(39118.72, abs=0.005)
    assert sums["pure error"] == pytest.approx(18230.75) and sums["total"] == pytest.approx(77646.97, abs=0.005)
    assert sums["lack of fit"] == pytest.approx(9613.78, abs=0.005)  # his interaction
    assert found.means["material"]["3"][0] == pytest.approx(125.08, abs=0.005)
    assert sum(found.effects[f"material[{k}]"] for k in "123") == pytest.approx(0)
    with pytest.raises(InputError, match="never run"):
        analyse_levels(pd.DataFrame(index=frame.index), [], {"material": frame["material"] * 0}, levels, frame["life"])
