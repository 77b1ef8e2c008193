"""The scatter between blocks in what is predicted of a run in a new one, against closed forms and by its coverage."""

import json

import numpy as np
import pandas as pd
import pytest
from scipy.stats import t

from pellet_study.__main__ import main
from pellet_study.doe.block_scatter import block_scatter
from pellet_study.doe.blocks import Block
from pellet_study.doe.composite import composite_matrix
from pellet_study.doe.intervals import interval
from pellet_study.doe.linear_model import fit
from pellet_study.doe.terms import interaction_terms, linear_terms

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]])
TERMS = {**linear_terms(["A", "B"]), **interaction_terms(["A", "B"])}


def in_blocks(response, n_blocks: int):
    """2^2 in each of the blocks."""
    labels = tuple(f"day {k}" for k in range(n_blocks) for _ in range(4))
    return fit(["A", "B"], TERMS, np.tile(SQUARE, (n_blocks, 1)), response, blocks=[Block("day", labels)])


def three_days(offset: float):
    """Days at -offset, 0, offset; the residual is a product of days and A: 8 runs off by 0.5, 6 degrees of freedom."""
    days = np.repeat([-offset, 0.0, offset], 4)
    wrong = 0.5 * np.outer([1, -1, 0], [1, -1, 1, -1]).ravel()
    return in_blocks(10 + np.tile(SQUARE[:, 0], 3) + days + wrong, 3)


def test_the_component_is_that_of_complete_blocks():
    """MSE = 8 x 0.25/6 = 1/3; mean square of the days 4 x (4 + 4)/2 = 16; (16 - 1/3)/4."""
    (found,) = block_scatter(three_days(2.0))
    assert (found.mean_square, found.df, found.size) == (pytest.approx(16), 2, pytest.approx(4))
    assert found.variance == pytest.approx((16 - 1 / 3) / 4)


def test_the_interval_of_a_run_in_a_new_block():
    """At the centre the leverage is 1/12; variance MSE (1 + 1/12) + 4/3 of the component, df by Satterthwaite."""
    error = 1 / 3
    component = (16 - error) / 4
    variance = error * 13 / 12 + component * 4 / 3
    df = variance**2 / ((16 / 3) ** 2 / 2 + ((13 / 12 - 1 / 3) * error) ** 2 / 6)
    found = interval(three_days(2.0), [[0.0, 0.0]])
    assert found.prediction[1] - 10 == pytest.approx(t.ppf(0.975, df) * np.sqrt(variance))
    assert found.within_block[1] - 10 == pytest.approx(t.ppf(0.975, 6) * np.sqrt(error * 13 / 12))
    assert found.confidence[1] - 10 == pytest.approx(t.ppf(0.975, 6) * np.sqrt(error / 12))


def test_blocks_that_differ_no_more_than_runs_add_nothing():
    found = interval(three_days(0.1), [[0.0, 0.0]])
    assert found.block_scatter[0].variance == 0 and found.prediction == pytest.approx(found.within_block)


def test_the_interval_holds_as_many_new_runs_as_it_says():
    """4 days, sd 2 between days and 1 between runs: 19 of 20 runs of a fifth day, to 0.025 (2000 draws)."""
    rng, hits = np.random.default_rng(5), 0
    for _ in range(2000):
        days = np.repeat(rng.normal(0, 2, 4), 4)
        low, high = interval(in_blocks(days + rng.normal(size=16), 4), [[0.5, 0.5]]).prediction
        hits += low <= rng.normal(0, 2) + rng.normal() <= high
    assert hits / 2000 == pytest.approx(0.95, abs=0.025)


def composite_in_days(tmp_path, apart: float):
    """A composite in two blocks; the days stand `apart`, runs scatter by 0.2 around 20 + 2 A - A2 - B2."""
    coded, blocks = composite_matrix(2, "rotatable", 6, False, 2)
    a, b = coded.T
    y = 20 + 2 * a - a**2 - b**2 + apart * (blocks == 2) + 0.2 * np.random.default_rng(8).normal(size=len(a))
    frame = pd.DataFrame({"day": [f"d{k}" for k in blocks], "A": a, "B": b, "y": y.round(3)})
    frame.to_csv(tmp_path / "t.csv", index=False)
    return str(tmp_path / "t.csv")


def verified(tmp_path, table: str, readings: str, *more: str) -> dict:
    words = ["bbd", table, "--block", "day", "--target", "20", "--declare-margin", "3"]
    assert main(words) == 0
    words = [*words[:-2], "--at", "A=0,B=0", "--verify", readings, *more, "--json", str(tmp_path / "a.json")]
    assert main(words) == 0
    return json.loads((tmp_path / "a.json").read_text())["validation"]


def test_a_validation_in_a_new_block_does_not_blame_the_model(tmp_path, capsys):
    """Days 2 apart; a third day 1.5 above their mean of 21 is no surprise, and neither are its runs, which share its level."""
    table = composite_in_days(tmp_path, 2.0)
    found = verified(tmp_path, table, "22.4,22.6,22.5,22.7")
    assert not found["contradicts_prediction"] and found["prediction_of_mean"][1] > 22.7
    captured = capsys.readouterr()
    assert "in a new block" in captured.out and "validation runs lie" not in captured.err


def test_a_validation_far_from_all_blocks_contradicts(tmp_path, capsys):
    table = composite_in_days(tmp_path, 0.0)
    found = verified(tmp_path, table, "26.4,26.6,26.5,26.7")
    assert (
        found["contradicts_prediction"] and "the mean of the 4 validation runs lies beyond" in capsys.readouterr().err
    )


def test_a_prediction_says_what_is_in_its_interval(tmp_path, capsys):
    table = composite_in_days(tmp_path, 2.0)
    assert main(["bbd", table, "--block", "day", "--predict", "A=0,B=0"]) == 0
    said = capsys.readouterr().out
    assert "of one run in a new block" in said and "from 2 blocks, 1 degree of freedom" in said
    assert "in an average one of those run" in said
