"""Box-Behnken designs as published in 1960, central composites as in Box and Hunter (1957), and their blocks."""

import re
from itertools import combinations

import numpy as np
import pandas as pd
import pyDOE3
import pytest

from pellet_study.doe import screening_designs
from pellet_study.doe.box_behnken import coded_matrix
from pellet_study.doe.cautions import level_cautions
from pellet_study.doe.composite import axial_distance, composite_matrix, cube
from pellet_study.doe.design_table import code_design
from pellet_study.doe.published_designs import box_behnken_blocks, box_behnken_matrix, misplaced_level, recognise
from pellet_study.doe.terms import columns_of, quadratic_terms
from pellet_study.errors import InputError

# Box and Behnken (1960): factors, runs without centre points, runs in which a factor is varied
PUBLISHED = [(3, 12, 8), (4, 24, 12), (5, 40, 16), (6, 48, 24), (7, 56, 24), (9, 120, 40), (10, 160, 64), (11, 176, 80),
           (12, 192, 64), (16, 384, 96)]  # fmt: skip


@pytest.mark.parametrize(("n_factors", "runs", "varied"), PUBLISHED)
def test_box_behnken_designs_are_those_published(n_factors, runs, varied):
    matrix = box_behnken_matrix(n_factors, 1)[:-1]
    assert len(matrix) == runs and len(np.unique(matrix, axis=0)) == (96 if n_factors == 9 else runs)
    assert np.allclose(matrix.sum(axis=0), 0)
    assert np.array_equal(matrix.T @ matrix, varied * np.eye(n_factors))
    products = np.column_stack([matrix[:, i] * matrix[:, j] for i, j in combinations(range(n_factors), 2)])
    gram = products.T @ products
    assert np.array_equal(gram, np.diag(np.diag(gram))) and np.all(np.diag(gram) > 0)
    assert np.array_equal(matrix.T @ products, np.zeros((n_factors, products.shape[1])))


@pytest.mark.parametrize("n_factors", [3, 4, 5])
def test_up_to_five_factors_they_are_the_pairs_that_pydoe3_takes(n_factors):
    assert np.array_equal(coded_matrix(n_factors, 2), pyDOE3.bbdesign(n_factors, center=2))


@pytest.mark.parametrize("n_factors", [4, 7])
def test_four_and_seven_factors_are_rotatable(n_factors):
    squares = box_behnken_matrix(n_factors, 3) ** 2
    mixed = (squares.T @ squares)[np.triu_indices(n_factors, 1)]
    assert np.all((squares**2).sum(axis=0) == 3 * mixed[0]) and len(set(mixed)) == 1


# Box and Behnken (1960): blocks, and runs in each with their centre points
@pytest.mark.parametrize(
    ("n_factors", "centre", "n_blocks", "runs"),
    [(4, 3, 3, 9), (5, 6, 2, 23), (6, 6, 2, 27), (7, 6, 2, 31), (9, 10, 5, 26), (9, 10, 10, 13), (10, 10, 2, 85),
     (12, 12, 2, 102), (16, 12, 6, 66), (16, 12, 12, 33)],
)  # fmt: skip
def test_published_blocks_are_orthogonal(n_factors, centre, n_blocks, runs):
    matrix = box_behnken_matrix(n_factors, centre)
    blocks = box_behnken_blocks(matrix, n_blocks)
    assert np.all(np.bincount(blocks)[1:] == runs)
    terms = columns_of(matrix, quadratic_terms([f"x{i}" for i in range(n_factors)]))[:, 1:]
    means = [terms[blocks == block].mean(axis=0) for block in range(1, n_blocks + 1)]
    assert np.allclose(means, terms.mean(axis=0))


@pytest.mark.parametrize(("n_factors", "n_blocks"), [(3, 2), (4, 2), (11, 2), (9, 3)])
def test_no_blocks_are_made_up(n_factors, n_blocks):
    assert box_behnken_blocks(box_behnken_matrix(n_factors, 12), n_blocks) is None


@pytest.mark.parametrize(("n_factors", "words"), [(2, "central composite"), (8, "--axial face"), (13, "screen")])
def test_where_none_was_published_what_is_right_is_offered(n_factors, words):
    with pytest.raises(InputError, match=words):
        box_behnken_matrix(n_factors)


@pytest.mark.parametrize(("n_factors", "alpha"), [(2, 1.414), (3, 1.682), (4, 2.0), (5, 2.378), (6, 2.828)])
def test_rotatable_axial_distances_are_those_of_the_textbooks(n_factors, alpha):
    matrix, _ = composite_matrix(n_factors, "rotatable", 3)
    assert np.abs(matrix).max() == pytest.approx(alpha, abs=6e-4)  # Montgomery prints three decimals
    assert "rotatable" in recognise(matrix)


@pytest.mark.parametrize(("n_factors", "alpha"), [(5, 2.0), (6, 2.378), (7, 2.828), (8, 2.828)])
def test_rotatable_distances_on_fractions_of_resolution_five(n_factors, alpha):
    matrix, _ = composite_matrix(n_factors, "rotatable", 1, fraction=True)
    assert np.abs(matrix).max() == pytest.approx(alpha, abs=6e-4)


@pytest.mark.parametrize("n_factors", range(5, 11))
def test_the_fractions_have_resolution_five(n_factors):
    corners = cube(n_factors, fraction=True)
    pairs = [corners[:, i] * corners[:, j] for i, j in combinations(range(n_factors), 2)]
    columns = np.column_stack([np.ones(len(corners)), corners, *pairs])
    assert np.allclose(columns.T @ columns, len(corners) * np.eye(columns.shape[1]))


# Box and Hunter (1957): factors, half fraction, blocks, centre points, alpha for orthogonal blocks
@pytest.mark.parametrize(
    ("n_factors", "fraction", "n_blocks", "centre", "alpha"),
    [(2, False, 2, 6, 1.4142), (3, False, 3, 6, 1.6330), (4, False, 3, 6, 2.0), (5, True, 2, 7, 2.0)],
)
def test_composites_in_orthogonal_blocks(n_factors, fraction, n_blocks, centre, alpha):
    if fraction:  # 16 + 6 and 10 + 1
        assert axial_distance("orthogonal", 5, 16, (6, 1)) == pytest.approx(alpha, abs=1e-4)
        return
    matrix, blocks = composite_matrix(n_factors, "orthogonal", centre, fraction, n_blocks)
    assert np.abs(matrix).max() == pytest.approx(alpha, abs=1e-4)
    terms = columns_of(matrix, quadratic_terms([f"x{i}" for i in range(n_factors)]))[:, 1:]
    means = [terms[blocks == block].mean(axis=0) for block in range(1, n_blocks + 1)]
    assert np.allclose(means, terms.mean(axis=0))


def test_face_centred_designs_are_those_of_pydoe3():
    ours = coded_matrix(3, 4, face_centred=True)
    assert np.array_equal(ours, pyDOE3.ccdesign(3, center=(0, 4), face="ccf"))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: composite_matrix(3, "star"), "rotatable, face, orthogonal"),
        (lambda: composite_matrix(3, 0.1), "from 0.5"),
        (lambda: composite_matrix(3, "face", 3, n_blocks=5), "2 or 3"),
        (lambda: composite_matrix(11), "2 to 10"),
    ],
)
def test_impossible_composites_are_refused_with_what_is_possible(call, words):
    with pytest.raises(InputError, match=words):
        call()


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (pyDOE3.bbdesign(6, center=3), "all pairs of 6 factors, which is not Box and Behnken's"),
        (box_behnken_matrix(6, 3), "Box-Behnken design of 6 factors .1960., 48 \\+ 3 centre points"),
        (pyDOE3.ccdesign(3, center=(0, 3), face="ccf"), "face-centred central composite of 3 factors"),
        (pyDOE3.pbdesign(7), "orthogonal two-level design of 7 factors, 8 runs"),
        (pyDOE3.ff2n(3), "full two-level factorial"),
        (np.random.default_rng(1).uniform(-1, 1, (9, 3)), "no kind known here"),
    ],
)
def test_designs_are_recognised_in_any_order(matrix, words):
    rng = np.random.default_rng(0)
    mixed = rng.permutation(matrix)[:, rng.permutation(matrix.shape[1])] * rng.choice([-1, 1], matrix.shape[1])
    assert re.search(words, recognise(mixed))


@pytest.mark.parametrize(
    "coded",
    [
        box_behnken_matrix(3, 3),
        box_behnken_matrix(4, 5),
        composite_matrix(3, "rotatable", 5)[0],
        composite_matrix(2, "face", 5)[0],
        screening_designs.coded_matrix(7, 12, 3),
        screening_designs.coded_matrix(11, 12),
    ],
)
def test_a_wrong_level_is_found_and_set_right(coded):
    """Any level of -1 set to +1: the cell is named, alone or with a run that the error made alike; no right table is accused."""
    assert misplaced_level(coded) == []
    for run, column in np.argwhere(np.round(coded, 6) == -1):
        wrong = coded.copy()
        wrong[run, column] = 1
        cells = misplaced_level(wrong)
        assert (run, column, -1) in cells
        for other, place, level in cells:
            assert place == column and level == -1
            assert other == run or np.allclose(np.delete(wrong[other], column), np.delete(wrong[run], column))
    for run in np.flatnonzero(np.abs(coded).max(axis=1) > 0):
        assert misplaced_level(np.delete(coded, run, axis=0)) == []  # a lost run is no wrong level


def test_a_wrong_level_is_told_by_row_and_column_with_what_was_expected():
    coded = box_behnken_matrix(4, 5)
    place = int(np.flatnonzero((coded[:, 0] == -1) & (coded[:, 1] == -1))[0])
    frame = pd.DataFrame(coded, columns=["Heat", "B", "C", "D"]).assign(y=np.arange(len(coded)) ** 1.5)
    frame["Heat"] = 95 + 15 * frame["Heat"]
    frame.loc[place, "Heat"] = 110.0
    (told,) = level_cautions(code_design(frame))
    assert told.startswith("column 'Heat', row ") and f"row {place + 1}" in told
    assert "110 where 80 is expected" in told and "Box-Behnken design of 4 factors (1960)" in told
