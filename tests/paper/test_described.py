"""Papers that folders describe: the genre's studies, the source paper described like any other, and errors of the format."""

import json
import shutil

import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.doe.validation import Sample
from pellet_study.errors import InputError
from pellet_study.paper.audit import audit
from pellet_study.paper.described.audit import audit_folder
from pellet_study.paper.judging import validation
from pellet_study.paper.verdicts import (
    DATA_MISSING,
    INCONSISTENT,
    NOT_RECOMPUTABLE,
    REPRODUCED,
    TO_ROUNDING,
    compare,
    counts,
    half_last_digit,
    printed_number,
)
from tests import ROOT

GENRE = ROOT / "results" / "genre"
STUDIES = sorted(folder.name for folder in GENRE.iterdir() if folder.is_dir())


def test_there_are_at_least_four_published_studies_with_sources():
    assert len(STUDIES) >= 4
    for name in STUDIES:
        assert len(audit_folder(GENRE / name).paper.source) > 40, name


@pytest.mark.parametrize("name", STUDIES)
def test_committed_audits_are_those_of_now(name):
    kept = pd.read_csv(GENRE / name / "audit" / "audit.csv", keep_default_na=False)
    items = audit_folder(GENRE / name).items
    assert list(kept["item"]) == [item.item for item in items]
    assert list(kept["verdict"]) == [item.verdict for item in items]


def test_the_textbook_misprint_is_found():
    """BC: mean square 12.25 over 10.25 is 1.195; the page prints 1.22 (12.25 / 10.04)."""
    wrong = [item for item in audit_folder(GENRE / "viscosity").items if item.verdict == INCONSISTENT]
    assert [item.item for item in wrong] == ["BC F"]
    assert wrong[0].recomputed == pytest.approx(12.25 / 10.25)
    assert wrong[0].reason.startswith("2.5 units of the last printed digit off")


@pytest.mark.parametrize("name", ["helicopter", "co_emissions", "sixteen_runs", "first_order_yield"])
def test_what_r_and_textbooks_print_comes_out(name):
    verdicts = counts(audit_folder(GENRE / name).items)
    assert set(verdicts) <= {REPRODUCED, "consistent"}


def test_numbers_that_rsm_rounds_twice_are_told_from_misprints():
    """t = 10.012546 is printed as 10.012, rounded to four digits first; everything else comes out."""
    items = audit_folder(GENRE / "chemical_reaction").items
    wrong = [item for item in items if item.verdict == INCONSISTENT]
    assert [item.item for item in wrong] == ["Temp t"] and "0.55 units" in wrong[0].reason


def test_axial_levels_printed_with_few_digits_explain_the_last_ones():
    """92.07 stands for 85 + 5 sqrt(2): with the exact level the printed F comes out."""
    by_item = {item.item: item for item in audit_folder(GENRE / "yield").items}
    assert by_item["Model F"].verdict == TO_ROUNDING
    assert by_item["the setting is the maximum"].verdict == "consistent"


def test_the_source_paper_described_has_the_verdicts_of_its_own_audit():
    own = {(item.item, item.published): item for item in audit()}
    found = {item.item: item for item in audit_folder(GENRE / "coated_seeds").items}
    for term in ("Model", "B", "C", "G", "BC", "Residual"):
        for words in ("sum of squares", "mean square", "P"):
            item = found.get(f"{term} {words}")
            twin = item and own.get((item.item, item.published))
            if twin:
                assert (item.verdict, item.recomputed) == (twin.verdict, twin.recomputed), item.item
    same = ("the best combination is unique", "P of the t test", "relative error, %", "centre of the box and target")
    for name in same:
        twin = next(item for item in own.values() if item.item == name)
        assert (found[name].verdict, found[name].reason) == (twin.verdict, twin.reason), name
    assert found["what the validation can show"].verdict == DATA_MISSING


# ---------------------------------------------------------------------------------------------------- by hand
RUNS = "A,B,y\n-1,-1,10\n1,-1,14\n-1,1,12\n1,1,20\n0,0,13\n0,0,15\n0,0,14\n"
"""Corners: mean 14, effects A 6, B 4, AB 2: sums of squares 36, 16, 4; centre runs 13, 15, 14: no curvature, pure error 2 on 2."""

PAPER = """
title = "by hand"
source = "worked out on paper: 4 corners, 3 centre runs"
[[analysis]]
name = "T"
table = "t.csv"
model = "first order"
design = "factorial"
[analysis.printed]
effects = { A = "6.0", B = "4.0" }
[analysis.printed.anova]
A = { sum_of_squares = "36" }
B = { sum_of_squares = "16" }
curvature = { sum_of_squares = "0" }
"pure error" = { sum_of_squares = "2", df = "2" }
residual = { sum_of_squares = "6", df = "3", mean_square = "2" }
"lack of fit" = { sum_of_squares = "4", f = "4.0" }
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "t.csv").write_text(RUNS)
    (tmp_path / "paper.toml").write_text(PAPER)
    return tmp_path


def test_sums_worked_out_by_hand(folder):
    assert counts(audit_folder(folder).items) == {REPRODUCED: 13}


def test_centre_points_in_the_residual(folder):
    """They move neither slopes nor sums of squares of A and B; the residual gains the curvature, here 0, and its df."""
    text = PAPER.replace('design = "factorial"', 'centre_points = "residual"')
    text = (
        text.replace('curvature = { sum_of_squares = "0" }\n', "")
        .replace('df = "3", mean_square = "2"', 'df = "4"')
        .replace('sum_of_squares = "4", f = "4.0"', 'sum_of_squares = "4", df = "2", f = "2.0"')
    )
    (folder / "paper.toml").write_text(text)
    assert set(counts(audit_folder(folder).items)) == {REPRODUCED}


def test_claims(folder):
    claims = """
[[claim]]
says = "A is larger than B"
kind = "order"
of = ["A", "B"]
[[claim]]
says = "B lowers"
kind = "negative"
of = ["B"]
[[claim]]
says = "A is significant"
kind = "significant"
of = ["A"]
[[claim]]
says = "B is significant"
kind = "significant"
of = ["B"]
"""
    (folder / "paper.toml").write_text(PAPER + claims)
    found = {item.item: item.verdict for item in audit_folder(folder).items}
    assert found["A is larger than B"] == "consistent"
    assert found["B lowers"] == INCONSISTENT
    assert found["A is significant"] == "consistent"  # F 18 on 1 and 3: p 0.024
    assert found["B is significant"] == INCONSISTENT  # F 8 on 1 and 3: p 0.066


def test_a_number_without_residual_is_not_recomputable(folder):
    (folder / "t.csv").write_text("A,B,y\n-1,-1,10\n1,-1,14\n-1,1,12\n")
    text = PAPER.split("[analysis.printed.anova]")[0].replace('design = "factorial"\n', "")
    (folder / "paper.toml").write_text(
        text.replace('effects = { A = "6.0", B = "4.0" }', 'standard_errors = { A = "1" }')
    )
    assert [item.verdict for item in audit_folder(folder).items] == [NOT_RECOMPUTABLE]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('effects = { A = "6.0"', "effects = { A = 6.0"), ["key 'A'", "in quotes", "6.0"]),
        (('name = "T"', 'name = "T"\nmodell = "x"'), ["[[analysis]] 1 (T)", "'modell'", "did you mean 'model'"]),
        (('model = "first order"', 'model = "cubic"'), ["key 'model'", "'quadratic'", "'cubic'"]),
        (('table = "t.csv"', 'table = "u.csv"'), ["key 'table'", "u.csv"]),
        (('effects = { A = "6.0"', 'effects = { X = "6.0"'), ["key 'X'", "accepted are"]),
        (("A = { sum_of_squares", "Q = { sum_of_squares"), ["printed.anova", "key 'Q'"]),
        (('title = "by hand"\n', ""), ["key 'title'", "missing"]),
        (('title = "by hand"', 'title = "by hand'), ["not TOML"]),
        (('design = "factorial"', 'drop = ["AC"]'), ["key 'drop'", "ignore"]),
        (('design = "factorial"', 'block = "day"'), ["[[analysis]] (T)", "day"]),
        (('design = "factorial"', "factors.A = { low = 1, high = 1 }"), ["key 'high'", "another level"]),
        (('design = "factorial"', 'intercept_in_block = "B1"'), ["intercept_in_block", "B1"]),
    ],
)
def test_errors_name_file_key_and_what_is_expected(folder, capsys, change, words):
    (folder / "paper.toml").write_text(PAPER.replace(*change))
    assert main(["audit", str(folder)]) == 2
    error = capsys.readouterr().err
    assert "paper.toml" in error
    for word in words:
        assert word in error, error


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ('[validation]\nmean = "3"', ["[validation]", "[target]"]),
        ('[target]\nwant = "target"', ["[target]", "key 'value'"]),
        ('[target]\nvalue = "14"', ["[target]", "key 'analysis'", "centre_points"]),
        ('[[claim]]\nsays = "x"\nkind = "significant"\nof = ["Z"]', ["[[claim]] 'x'", "'Z'"]),
        ('[[claim]]\nsays = "x"\nkind = "lack of fit"\nof = ["A"]', ["key 'of'", "not significant"]),
    ],
)
def test_errors_of_goal_and_claims(folder, capsys, more, words):
    (folder / "paper.toml").write_text(PAPER + more + "\n")
    assert main(["audit", str(folder)]) == 2
    error = capsys.readouterr().err
    assert all(word in error for word in ["paper.toml", *words]), error


def test_a_folder_without_a_description(tmp_path, capsys):
    assert main(["audit", str(tmp_path)]) == 2
    assert "docs/audit_a_paper.md" in capsys.readouterr().err


def test_command_writes_json_and_results(tmp_path, capsys):
    shutil.copytree(GENRE / "yield", tmp_path / "yield")
    out = tmp_path / "out"
    assert main(["audit", str(tmp_path / "yield"), "--results", str(out), "--json", str(tmp_path / "a.json")]) == 0
    capsys.readouterr()
    answer = json.loads((tmp_path / "a.json").read_text())
    assert set(answer) == {"title", "source", "optimum", "rows", "counts", "files"}
    assert list(pd.read_csv(out / "audit.csv")["verdict"]) == [row["verdict"] for row in answer["rows"]]
    assert 'src="http' not in (out / "audit.html").read_text()
    anova = pd.read_csv(out / "example_11_1_anova.csv").set_index("source")
    assert anova.loc["total", "sum_of_squares"] == pytest.approx(28.74, abs=0.005)


# ------------------------------------------------------------------------------------------------- validation
def test_margin_that_a_validation_shows():
    """n = 4, sd 1, known target: half width t(0.95, 3) / 2 = 2.3534 / 2; difference 0.5: margin 1.6767."""
    item = validation.what_it_shows("", Sample(10.0), Sample(10.5, 1.0, 4), "deg")
    assert item.recomputed == pytest.approx(0.5 + 2.353363 / 2, abs=1e-5)


def test_printed_p_with_n_and_sd_of_both_sides():
    """Equal n and sd: both t tests agree; t = 2 on 8 df has p 0.0805."""
    sd = 1.0
    item = validation.t_test_of_samples("", Sample(2 * sd * (2 / 5) ** 0.5, sd, 5), Sample(0.0, sd, 5), "0.0805")
    assert item.verdict == REPRODUCED


def test_printed_p_that_some_n_gives():
    """|t| = sqrt(n) on n - 1 df: n = 4 gives 0.1393."""
    item = validation.t_test("", 1.0, 1.0, "0.1393", "deg")
    assert item.verdict == "consistent" and "n = 4, one sample" in item.reason


# ---------------------------------------------------------------------------------------------------- numbers
@pytest.mark.parametrize(
    ("printed", "number", "half"),
    [
        ("0.30", 0.3, 0.005),
        (".78", 0.78, 0.005),
        ("58", 58.0, 0.5),
        ("8.444e-07", 8.444e-7, 5e-11),
        ("\u22121.5*", -1.5, 0.05),
        ("<0.0001", None, 0.00005),
    ],
)
def test_numbers_as_papers_print_them(printed, number, half):
    assert printed_number(printed) == number
    assert half_last_digit(printed) == pytest.approx(half)


def test_rounding_of_inputs_and_of_the_printed_number_add_up():
    assert compare("", "", "1.00", 1.02, span=(1.004, 1.03)).verdict == TO_ROUNDING
    assert compare("", "", "1.00", 1.02, span=(1.006, 1.03)).verdict == INCONSISTENT


def test_only_input_errors_leave_the_library(folder):
    (folder / "t.csv").write_text("A,B,y\n-1,-1,1\n")
    with pytest.raises(InputError, match="paper.toml"):
        audit_folder(folder)
