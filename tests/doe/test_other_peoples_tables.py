"""Tables as other people's programs and hands write them: the answer must be that of the plain table, or the cell named.

resin viscosity: Myers and Montgomery, Response Surface Methodology, 2nd ed., Wiley 2002, example 7.5, whose equation is
62 + A + 2.625 B - 2.375 C - 2 AB + 11 AC + 1.75 BC - 7.375 A2 + 1.875 B2 - 3.625 C2 in coded units.
"""

import json

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.doe import box_behnken

RESIN = {
    "1": 62,
    "A": 1,
    "B": 2.625,
    "C": -2.375,
    "AB": -2,
    "AC": 11,
    "BC": 1.75,
    "A2": -7.375,
    "B2": 1.875,
    "C2": -3.625,
}
EDGES = [(-1, -1, 0), (1, -1, 0), (-1, 1, 0), (1, 1, 0), (-1, 0, -1), (1, 0, -1), (-1, 0, 1), (1, 0, 1)]
EDGES += [(0, -1, -1), (0, 1, -1), (0, -1, 1), (0, 1, 1), (0, 0, 0), (0, 0, 0), (0, 0, 0)]
VISCOSITY = [53, 58, 59, 56, 64, 45, 35, 60, 59, 64, 53, 65, 65, 59, 62]
PLAIN = "A,B,C,y\n" + "".join(
    f"{175 + 25 * a},{7.5 + 2.5 * b},{20 + 5 * c},{y}.0\n" for (a, b, c), y in zip(EDGES, VISCOSITY, strict=True)
)


def answer(tmp_path, content, *options, name="table.csv", command="bbd"):
    table = tmp_path / name
    table.write_bytes(content if isinstance(content, bytes) else content.encode())
    status = main([command, str(table), *options, "--json", str(tmp_path / "answer.json")])
    return json.loads((tmp_path / "answer.json").read_text()) if status == 0 else status


def edited(change):
    """PLAIN with each line's cells changed."""
    return "\n".join(",".join(change(i, line.split(","))) for i, line in enumerate(PLAIN.splitlines())) + "\n"


def comma(text):
    return text.replace(",", ";").replace(".", ",")


WRITTEN = {
    "semicolons, decimal commas, BOM, CRLF, empty columns and rows": b"\xef\xbb\xbf"
    + comma(PLAIN).replace("\n", ";;\r\n").encode()
    + b";;;;;\r\n;;;;;\r\n",
    "sep=": "sep=;\r\n" + comma(PLAIN),
    "tabs and decimal commas": PLAIN.replace(",", "\t").replace(".", ","),
    "bars": PLAIN.replace(",", "|"),
    "UTF-16": PLAIN.replace(",", "\t").encode("utf-16"),
    "UTF-16, big end first": b"\xfe\xff" + PLAIN.encode("utf-16-be"),
    "quoted": edited(lambda i, cells: [f'"{cell.replace(".", ",") if i else cell}"' for cell in cells]),
    "minus signs of a word processor": edited(
        lambda i, cells: cells if i == 0 else ["\u2212" + cells[0], *cells[1:]]
    ).replace("A,", "A,", 1),
    "blank lines above": "\n\n" + PLAIN,
    "a line of units": PLAIN.replace("\n", "\n°C,rpm,J/m^2,mPa·s\n", 1),
    "Design-Expert": "Std,Run,Space Type,"
    + edited(lambda i, cells: cells if i == 0 else [str(i), str(16 - i), "Factorial", *cells]),
    "Minitab": edited(
        lambda i, cells: (
            ["StdOrder", "RunOrder", "PtType", "Blocks", *cells] if i == 0 else [str(i), str(16 - i), "2", "1", *cells]
        )
    ),
    "pandas": edited(lambda i, cells: ["" if i == 0 else str(i - 1), *cells]),
    "run order last": edited(lambda i, cells: [*cells, "RunOrder" if i == 0 else str(16 - i)]),
    "run names": edited(lambda i, cells: ["Run" if i == 0 else f"R{i}", *cells]),
    "Chinese run numbers in GBK": edited(lambda i, cells: ["序号" if i == 0 else str(i), *cells]).encode("gbk"),
}


@pytest.mark.parametrize("written", WRITTEN)
def test_the_same_answer_however_it_is_written(tmp_path, written):
    found = answer(tmp_path, WRITTEN[written])
    expected = RESIN
    if "minus" in written:  # A runs from -200 to -150: its sign turns
        expected = {name: -value if name in ("A", "AB", "AC") else value for name, value in RESIN.items()}
    if "units" in written:
        assert list(found["effects"])[:3] == ["A (°C)", "B (rpm)", "C (J/m^2)"] and found["response"] == "y (mPa·s)"
        assert list(found["coefficients"].values()) == pytest.approx(list(RESIN.values()))
    else:
        assert found["coefficients"] == pytest.approx(expected)


def test_three_lines_of_header_as_design_expert_copies_them(tmp_path):
    lines = edited(lambda i, cells: ["Std", "Run", *cells] if i == 0 else [str(i), str(16 - i), *cells]).splitlines()
    content = "\n".join([",,Factor 1,Factor 2,Factor 3,Response 1", lines[0], ",,C,rpm,%,mPas", *lines[1:]])
    found = answer(tmp_path, content)
    assert list(found["coefficients"].values()) == pytest.approx(list(RESIN.values()))
    assert found["left_out"] == ["Std", "Run"]


@pytest.mark.parametrize("code", ["gbk", "cp1252"])
def test_names_in_a_code_page(tmp_path, capsys, code):
    name = {"gbk": "温度/℃", "cp1252": "Größe (µm)"}[code]
    found = answer(tmp_path, PLAIN.replace("A,", f"{name},", 1).encode(code))
    assert list(found["effects"])[0] == name and found["coefficients"][name] == pytest.approx(1)
    assert "read as" in capsys.readouterr().err


def test_a_workbook(tmp_path):
    from openpyxl import Workbook

    book = Workbook()
    book.active.append([None, None])
    sheet = book.create_sheet("runs")
    for i, line in enumerate(PLAIN.splitlines()):
        cells = line.split(",")
        sheet.append(["Run", *cells] if i == 0 else [i, *map(float, cells)])
    book.save(tmp_path / "table.xlsx")
    assert main(["bbd", str(tmp_path / "table.xlsx"), "--json", str(tmp_path / "answer.json")]) == 0
    assert json.loads((tmp_path / "answer.json").read_text())["coefficients"] == pytest.approx(RESIN)


@pytest.mark.parametrize("name", ["table.xls", "table.ods", "table.xlsx"])
def test_workbooks_that_cannot_be_read(tmp_path, capsys, name):
    assert answer(tmp_path, b"no workbook", name=name) == 2
    assert "save" in capsys.readouterr().err


@pytest.mark.parametrize("cell", ["*", "#N/A", "/", "#NV", "NaN", "-", "—", "失败", "#DIV/0!", "", "lost"])
def test_a_run_that_failed_however_it_is_marked(tmp_path, capsys, cell):
    found = answer(tmp_path, edited(lambda i, cells: [*cells[:3], cell] if i == 15 else cells))
    assert found["runs"] == 14 and "row 16 has no 'y'" in capsys.readouterr().err


def test_such_a_mark_is_no_level(tmp_path, capsys):
    assert answer(tmp_path, edited(lambda i, cells: ["*", *cells[1:]] if i == 3 else cells)) == 2
    assert "column 'A', row 4" in capsys.readouterr().err


def test_plus_and_minus_as_levels(tmp_path):
    """2^2 with the responses 1, 3, 7, 9: effects 2, 6 and no interaction."""
    found = answer(tmp_path, "A,B,y\n-,-,1\n+,-,3\n−,+,7\n+,+,9\n", command="pb")
    assert found["effects"] == pytest.approx({"A": 2, "B": 6, "AB": 0})


def test_units_in_the_header_and_options_by_the_bare_name(tmp_path):
    content = PLAIN.replace("A,B,C,y", "γ (J/m^2),time [min],温度/℃,y", 1)
    found = answer(tmp_path, content, "--factor", "γ=200,150", "--predict", "γ=200,time=5,温度=20")
    assert found["coefficients"]["γ (J/m^2)"] == pytest.approx(-1)
    assert found["prediction"]["predicted"] == pytest.approx(62 + 1 - 2.625 + 2 - 7.375 + 1.875)


@pytest.mark.parametrize("scale", [1e-15, 1e-6, 1e9, 1e15])
def test_any_magnitude_of_levels_and_responses(tmp_path, scale):
    def scaled(i, cells):
        return cells if i == 0 else [repr(float(cell) * scale) for cell in cells]

    found = answer(tmp_path, edited(scaled), "--target", repr(62 * scale), "--uncertainty", repr(scale))
    plain = answer(tmp_path, PLAIN, "--target", "62", "--uncertainty", "1")
    assert {name: value / scale for name, value in found["coefficients"].items()} == pytest.approx(RESIN)
    assert found["optimum"]["prediction"]["predicted"] == pytest.approx(62 * scale, rel=1e-4)
    assert found["optimum"]["fraction_of_box"] == pytest.approx(plain["optimum"]["fraction_of_box"], abs=1e-3)
    for mine, theirs in zip(found["optimum"]["extents"], plain["optimum"]["extents"], strict=True):
        assert mine["coded"] == pytest.approx(theirs["coded"], abs=0.02)


# ------------------------------------------------------------------------------------------- columns of other kinds
@pytest.mark.parametrize("name", ["Block", "blk", "Day", "Batch No.", "区组", "Charge", "Date"])
def test_a_block_is_asked_for_and_each_advice_works(tmp_path, capsys, name):
    content = edited(lambda i, cells: [name, *cells] if i == 0 else [str(1 + i % 3), *cells])
    assert answer(tmp_path, content) == 2
    error = capsys.readouterr().err
    assert name in error and "--block" in error and "--ignore" in error
    assert answer(tmp_path, content, "--ignore", name)["coefficients"] == pytest.approx(RESIN)
    assert list(answer(tmp_path, content, "--block", name)["blocks"]) == [name]
    assert f"--factor '{name}=1,3'" in error or f"--factor {name}=1,3" in error
    as_factor = answer(tmp_path, content, "--factor", f"{name}=1,3")
    assert as_factor == 2 or name in as_factor["effects"]  # 15 terms in 15 runs may not be separable


def test_all_columns_that_must_be_said_are_named_at_once(tmp_path, capsys):
    content = edited(
        lambda i, cells: ["day", *cells[:3], "who", cells[3]] if i == 0 else ["1", *cells[:3], "Anna", cells[3]]
    )
    content = content.replace("\n1,", "\n2,", 5)
    assert answer(tmp_path, content) == 2
    error = capsys.readouterr().err
    assert "'day'" in error and "'who'" in error
    assert answer(tmp_path, content, "--ignore", "who", "--block", "day")["blocks"]["day"]


def test_blocks_may_be_words(tmp_path):
    """A block effect of +-3 added to runs of two days is found, and the surface is as without it."""
    shift = [3, -3, -3, 3] * 3 + [3, -3, 3]

    def with_day(i, cells):
        if i == 0:
            return ["day", *cells]
        return ["Monday" if shift[i - 1] > 0 else "Tuesday", *cells[:3], str(float(cells[3]) + shift[i - 1])]

    plain = answer(tmp_path, edited(lambda i, c: ["day", *c] if i == 0 else ["m" if shift[i - 1] > 0 else "t", *c]), "--block", "day")  # fmt: skip
    moved = answer(tmp_path, edited(with_day), "--block", "day")
    assert moved["coefficients"] == pytest.approx(plain["coefficients"])
    assert moved["blocks"]["day"]["Monday"] == pytest.approx(plain["blocks"]["day"]["m"] + 3)
    assert moved["blocks"]["day"]["Tuesday"] == -moved["blocks"]["day"]["Monday"]


@pytest.mark.parametrize("cells", [["1"] * 15, [str(i) for i in range(15)]])
def test_a_column_that_is_no_block(tmp_path, capsys, cells):
    content = edited(lambda i, c: ["group", *c] if i == 0 else [cells[i - 1], *c])
    assert answer(tmp_path, content, "--block", "group") == 2
    assert "no block" in capsys.readouterr().err


# -------------------------------------------------------------------------------------------------- levels
@pytest.mark.parametrize("column, row, level", [(0, 4, "15"), (1, 3, "50.0"), (2, 7, "1.5"), (1, 14, "75")])
def test_a_slip_of_the_pen_is_named(tmp_path, capsys, column, row, level):
    def slip(i, cells):
        return [*cells[:column], level, *cells[column + 1 :]] if i == row else cells

    found = answer(tmp_path, edited(slip))
    if row == 14:  # a centre run: its level could be meant
        return
    error = capsys.readouterr().err
    assert (
        found == 2 and f"column '{'ABC'[column]}', row {row + 1}" in error and f"{float(level):g} is a level" in error
    )
    advice = error.split("with --factor '")[1].split("'")[0]
    as_run = answer(tmp_path, edited(slip), "--factor", advice)
    assert as_run != 2 and "analysed where they were run" in capsys.readouterr().err


def test_an_axial_point_that_failed_is_no_slip(tmp_path):
    """A composite of two factors on y = 3 + 2 x1 - x2^2, one axial run lost: recovered exactly."""
    runs = [(-1, -1), (1, -1), (-1, 1), (1, 1), (1.414, 0), (0, 1.414), (0, -1.414), (0, 0), (0, 0)]
    for scale, middle in ((1, 0), (5, 85)):
        rows = [f"{middle + scale * a:g},{middle + scale * b:g},{3 + 2 * a - b * b}" for a, b in runs]
        found = answer(tmp_path, "a,b,y\n" + "\n".join(rows) + "\n")
        assert found["coefficients"]["a"] == pytest.approx(2) and found["coefficients"]["b2"] == pytest.approx(-1)
        assert found["factors"][0]["high"] == middle + scale


@pytest.mark.parametrize("middle", [170, 182])
def test_a_middle_level_off_the_middle_is_analysed_where_it_was_run(tmp_path, capsys, middle):
    """y = 0.1 A + (A - 150)^2 / 100 whatever the middle level is."""

    def moved(i, cells):
        if i == 0:
            return cells
        a = middle if cells[0] == "175" else int(cells[0])
        return [str(a), *cells[1:3], repr(0.1 * a + (a - 150) ** 2 / 100)]

    found = answer(tmp_path, edited(moved))
    assert found["coefficients_physical"]["A2"] == pytest.approx(0.01)
    assert "where it was run" in capsys.readouterr().err


def test_a_level_far_off_the_middle_needs_a_word_and_the_advice_works(tmp_path, capsys):
    content = edited(lambda i, cells: [{"150": "10", "175": "100", "200": "1000"}.get(cells[0], "A"), *cells[1:]])
    assert answer(tmp_path, content) == 2
    error = capsys.readouterr().err
    advice = error.split("--factor '")[1].split("'")[0]
    assert "logarithm" in error and advice == "A=10,1000"
    found = answer(tmp_path, content, "--factor", advice)
    assert found["factors"][0]["low"] == 10


def test_names_may_hold_signs_and_commas(tmp_path, capsys):
    """`=` and commas in quoted headers: the levels of -1 and +1, and a prediction, are given by these names."""
    coded = box_behnken.coded_matrix(3, 5)
    frame = pd.DataFrame(coded, columns=["T, in C", "a=b", "C"])
    frame["y"] = 50 + 3 * coded[:, 0] + 2 * coded[:, 1] + 0.1 * np.random.default_rng(2).normal(size=len(coded))
    path = tmp_path / "signs.csv"
    frame.to_csv(path, index=False)
    words = ["--factor", "T, in C=10,30", "--factor", "a=b=1,2", "--predict", "T, in C=25,a=b=1.5,C=0"]
    assert main(["bbd", str(path), *words]) == 0
    told = capsys.readouterr().out
    assert "at T, in C 25, a=b 1.5, C 0;" in told
    assert float(told.split("\npredicted ")[1].split()[0]) == pytest.approx(51.5, abs=0.2)
    assert main(["bbd", str(path), "--predict", "T, in C=2,5,a=b=1.5,C=0"]) == 2
    assert "decimal points" in capsys.readouterr().err


def test_numbers_with_their_unit_in_the_cell_are_told_where_the_unit_goes(tmp_path, capsys):
    coded = box_behnken.coded_matrix(3, 5)
    frame = pd.DataFrame(coded, columns=list("ABC"))
    frame["y"] = [f"{50 + 3 * a:g} %" for a in coded[:, 0]]
    path = tmp_path / "percent.csv"
    frame.to_csv(path, index=False)
    assert main(["bbd", str(path)]) == 2
    told = capsys.readouterr().err
    assert "write the numbers alone" in told and "--block" not in told


def test_an_offset_of_rounding_is_zero(tmp_path, capsys):
    coded = np.vstack([box_behnken.coded_matrix(3, 3)] * 2)
    frame = pd.DataFrame(coded, columns=list("ABC")).assign(day=np.repeat(["mo", "di"], len(coded) // 2))
    wobble = np.tile([0.1, -0.1, 0.2, -0.2, 0.3], 3)
    frame["y"] = 62.7 + 3 * frame.A + np.concatenate([wobble, wobble[::-1]])
    path = tmp_path / "days.csv"
    frame.to_csv(path, index=False)
    assert main(["bbd", str(path), "--block", "day"]) == 0
    assert "mo +0, di +0" in capsys.readouterr().out.replace("-0", "+0")
