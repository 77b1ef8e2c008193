"""The audit: its verdicts, what is inconsistent and why, and the rule that judges."""

import json

import pytest

from pellet_study.__main__ import main
from pellet_study.paper.audit import audit, counts
from pellet_study.paper.verdicts import INCONSISTENT, REPRODUCED, TO_ROUNDING, VERDICTS, compare


@pytest.fixture(scope="module")
def items():
    return audit()


def test_every_verdict_is_one_of_the_six(items):
    assert {item.verdict for item in items} == set(VERDICTS)


def test_counts_of_the_audit_document(items):
    """As counted in the paper's audit, item by item."""
    assert counts(items) == {
        "consistent": 8,
        "data missing": 7,
        "inconsistent": 14,
        "not recomputable": 6,
        "reproduced": 114,
        "reproduced to rounding": 2,
    }


@pytest.mark.parametrize(
    ("item", "in_reason"),
    [
        ("range 0.1 to 0.3", "0.1 to 0.35"),
        ("range 0.6 to 0.85", "need 0.05"),
        ("Eq. 3 R2", "0.99162"),
        ("root a3", "rounds to 0.254"),
        ("Stdized", "-2.828"),
        ("C and B significant", "0.0032"),
        ("as the steepest climb", "-0.01795"),
        ("row 6 and Table 7", "17.92 %"),
        ("coding of Table 11", "41.8528 to 41.9383"),
        ("best combination is unique", "26.9 %"),
        ("signs of the coding", "(1, 1, 1) 0.32"),
        ("coding of B and row 1", "p 0.0036"),
        ("less than 1 %", "1.007 %"),
        ("P of the t test", "0.6481"),
    ],
)
def test_the_fourteen_inconsistencies_with_their_reasons(items, item, in_reason):
    found = [entry for entry in items if item in entry.item and entry.verdict == INCONSISTENT]
    assert len(found) == 1
    assert in_reason in found[0].reason


def test_recomputed_numbers_of_the_optimum_and_the_t_test(items):
    at = {item.item: item.recomputed for item in items}
    assert round(at["predicted angle at the optimum, coding of Table 11 (-1 = 0.90)"], 2) == 41.90
    assert round(at["predicted angle at the optimum, B coded the other way (-1 = 0.82)"], 2) == 41.63
    assert round(at["P of the t test"], 4) == 0.5896
    unique = next(item for item in items if "unique" in item.item)
    assert "14.7 % within 1 %" in unique.reason


def test_missing_data_is_not_guessed(items):
    missing = [item for item in items if item.section == "Table 10" and item.verdict == "not recomputable"]
    assert [item.recomputed for item in missing] == [None] * 6
    assert "32.1388 or 51.2412" in missing[0].reason


@pytest.mark.parametrize(
    ("printed", "value", "span", "verdict"),
    [
        ("0.63", 0.6333, None, REPRODUCED),
        ("0.63", 0.6351, None, INCONSISTENT),
        ("-1.40", -1.395, None, REPRODUCED),
        ("<0.0001**", 2e-5, None, REPRODUCED),
        ("<0.0001**", 2e-4, None, INCONSISTENT),
        ("0.991", 1.0074, (0.98, 1.03), TO_ROUNDING),
        ("0.991", 1.0074, (1.0, 1.03), INCONSISTENT),
        ("6", 5.0, None, INCONSISTENT),
    ],
)
def test_the_rule_of_judging(printed, value, span, verdict):
    assert compare("", "", printed, value, span=span).verdict == verdict


def test_command_prints_and_writes_rows(tmp_path, capsys):
    assert main(["audit", "--json", str(tmp_path / "audit.json")]) == 0
    text = capsys.readouterr().out
    assert "114 reproduced" in text and "14 inconsistent" in text
    rows = json.loads((tmp_path / "audit.json").read_text())["rows"]
    assert len(rows) == 151
    assert set(rows[0]) == {"section", "item", "published", "recomputed", "difference", "verdict", "reason"}


def test_results_folder_is_remade_by_one_command(tmp_path, capsys):
    import pandas as pd

    folder = tmp_path / "paper"
    assert main(["audit", "--results", str(folder)]) == 0
    capsys.readouterr()
    assert len(pd.read_csv(folder / "audit.csv")) == 151
    assert len(list((folder / "figures").glob("*.png"))) == 7
    assert 'src="http' not in (folder / "audit.html").read_text()
    before = (folder / "audit.csv").read_bytes()
    assert main(["audit", "--results", str(folder)]) == 0
    assert (folder / "audit.csv").read_bytes() == before
    assert main(["pb", str(folder / "table07_design.csv")]) == 0
