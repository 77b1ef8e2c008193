"""How often a row is named as typed wrong: the committed counts, some of them counted anew, and the page that states them."""

import sys

import pandas as pd
import pytest

from tests import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))

import typed_wrong  # noqa: E402

COUNTS = pd.read_csv(typed_wrong.FILE).set_index(["hidden_cohesion_pa", "one_reading_wrong"])


@pytest.mark.parametrize("cohesion", [0.0, typed_wrong.COHESION_PA])
def test_the_wrong_row_is_named_and_no_other(cohesion):
    assert [typed_wrong.named(cohesion, True, seed) for seed in (1, 2)] == [(True, True)] * 2
    assert [typed_wrong.named(cohesion, False, seed) for seed in (1, 2)] == [(False, False)] * 2


def test_a_row_is_named_wrongly_in_less_than_one_set_of_a_hundred():
    assert (COUNTS["sets"] >= 200).all()
    right = COUNTS.xs(False, level="one_reading_wrong")
    assert (right["a_row_named"] < 0.01 * right["sets"]).all()
    wrong = COUNTS.xs(True, level="one_reading_wrong")
    assert (wrong["the_wrong_one"] == wrong["a_row_named"]).all()


def test_the_page_states_the_counts():
    page = " ".join((ROOT / "docs" / "method.md").read_text(encoding="utf-8").split())
    sets, false = COUNTS.xs(False, level="one_reading_wrong")[["sets", "a_row_named"]].sum()
    assert f"{false} of {sets} data sets without a wrong reading" in page
    for count in COUNTS.xs(True, level="one_reading_wrong")["the_wrong_one"]:
        assert f"{count:g}" in page
