"""pb, bbd, climb and canonical analysis against R's numbers (results/checks/compared_with_r.csv); R itself is not needed."""

import importlib.util

import pandas as pd
import pytest

from tests import ROOT

_spec = importlib.util.spec_from_file_location("compare_with_r", ROOT / "benchmarks" / "compare_with_r.py")
comparison = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(comparison)
TABLES = {spec["table"]: spec for spec in comparison.specifications()}


@pytest.fixture(scope="module")
def kept():
    return pd.read_csv(comparison.RESULT, keep_default_na=False)


def test_ten_tables_or_more_with_all_that_is_promised(kept):
    assert set(kept["table"]) == set(TABLES) and len(TABLES) >= 10
    promised = {
        "coefficient",
        "standard error",
        "p",
        "sum of squares",
        "effect",
        "Lenth",
        "path level",
        "path prediction",
    }
    promised |= {"R2", "lack of fit p", "leverage", "R-student", "Cook's D", "stationary point", "eigenvalue"}
    assert set(kept["quantity"]) == promised | {"confidence", "prediction"}


@pytest.mark.parametrize("table", TABLES)
def test_our_numbers_are_those_of_r(kept, table):
    rows = kept[kept["table"] == table]
    theirs = {tuple(row[:3]): float(row[3]) for row in rows[["table", "quantity", "item", "r"]].itertuples(index=False)}
    found = comparison.compared(comparison.ours(TABLES[table]), theirs)
    assert len(found) > 15
    assert not [row for row in found if not row["agrees"]]


def test_a_number_that_differs_is_noticed():
    key = ("t", "p", "A:B")
    assert [row["agrees"] for row in comparison.compared({("t", "p", "AB"): 0.5}, {key: 0.5})] == [True]
    assert [row["agrees"] for row in comparison.compared({("t", "p", "AB"): 0.50001}, {key: 0.5})] == [False]
    assert [row["agrees"] for row in comparison.compared({}, {key: 0.5})] == [False]
