"""What cannot be analysed ends with exit status 2 and says column, row, what was expected, what to do."""

import shlex

import pytest

from pellet_study.__main__ import main
from pellet_study.doe import box_behnken, screening_designs

NAMES = list("ABCDEFG")


def screening_csv(n_factors=7):
    lines = [",".join([*NAMES[:n_factors], "angle"])]
    for i, row in enumerate(screening_designs.coded_matrix(n_factors)):
        lines.append(",".join([f"{x:g}" for x in row] + [f"{30 + (i * 7) % 11 + i / 10:g}"]))
    return lines


def surface_csv():
    lines = ["B,C,G,angle"]
    for i, row in enumerate(box_behnken.coded_matrix(3, 5)):
        lines.append(",".join([f"{x:g}" for x in row] + [f"{30 + (i * 7) % 11 + i / 10:g}"]))
    return lines


def replaced(lines, row, column, value):
    """The lines with one cell of a 1-based file row changed."""
    cells = lines[row - 1].split(",")
    cells[column] = value
    return [*lines[: row - 1], ",".join(cells), *lines[row:]]


def answer(tmp_path, capsys, command, lines, *options):
    path = tmp_path / "table.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    status = main([command, str(path), *options])
    return status, capsys.readouterr().err


@pytest.mark.parametrize("command", ["pb", "bbd"])
@pytest.mark.parametrize("cell", ["high", "1;2", "inf", "nan", ""])
def test_text_in_a_factor_column(tmp_path, capsys, command, cell):
    lines = screening_csv() if command == "pb" else surface_csv()
    status, error = answer(tmp_path, capsys, command, replaced(lines, 5, 1, cell))
    assert status == 2
    name = lines[0].split(",")[1]
    assert f"column '{name}'" in error and "row 5" in error and "expected" in error


def test_text_in_the_response(tmp_path, capsys):
    status, error = answer(tmp_path, capsys, "pb", replaced(screening_csv(), 7, 7, "about 40"))
    assert status == 2 and "column 'angle', row 7" in error and "'about 40' is not a number" in error


@pytest.mark.parametrize("command", ["pb", "bbd"])
def test_a_constant_column(tmp_path, capsys, command):
    lines = screening_csv() if command == "pb" else surface_csv()
    for row in range(2, len(lines) + 1):
        lines = replaced(lines, row, 2, "1")
    status, error = answer(tmp_path, capsys, command, lines)
    name = lines[0].split(",")[2]
    assert status == 2 and f"column '{name}'" in error and f"rows 2 to {len(lines)}" in error and "remove" in error


@pytest.mark.parametrize("command", ["pb", "bbd"])
def test_fewer_runs_than_terms(tmp_path, capsys, command):
    lines = screening_csv()[:7] if command == "pb" else surface_csv()[:8]
    status, error = answer(tmp_path, capsys, command, lines)
    assert status == 2 and ("expected at least" in error or "levels" in error)


def test_fewer_runs_than_terms_names_both_numbers(tmp_path, capsys):
    status, error = answer(tmp_path, capsys, "pb", screening_csv()[:7])
    assert status == 2 and "6 runs" in error and "8 terms" in error


def test_duplicate_factor_names(tmp_path, capsys):
    lines = screening_csv()
    lines[0] = "A,B,C,A,E,F,G,angle"
    status, error = answer(tmp_path, capsys, "pb", lines)
    assert status == 2 and "'A' stands 2 times" in error and "rename" in error


@pytest.mark.parametrize("command", ["pb", "bbd"])
def test_a_missing_response_column(tmp_path, capsys, command):
    lines = [line.rsplit(",", 1)[0] for line in (screening_csv() if command == "pb" else surface_csv())]
    status, error = answer(tmp_path, capsys, command, lines)
    assert status == 2 and "response column is missing" in error and "rows 2 to" in error


def test_a_missing_response_column_in_physical_units(tmp_path, capsys):
    lines = ["A,B,C"] + [
        ",".join(f"{0.5 + 0.1 * x:g}" for x in row) for row in screening_designs.coded_matrix(3, centre_points=1)
    ]
    status, error = answer(tmp_path, capsys, "pb", lines)
    assert status == 2 and "column 'C'" in error and "response column is missing" in error


def test_an_empty_response_column(tmp_path, capsys):
    lines = [screening_csv()[0]] + [line.rsplit(",", 1)[0] + "," for line in screening_csv()[1:]]
    status, error = answer(tmp_path, capsys, "pb", lines)
    assert status == 2 and "'angle'" in error and "missing" in error


@pytest.mark.parametrize("command", ["pb", "bbd"])
def test_not_a_design_at_all(tmp_path, capsys, command):
    lines = ["x,y,z,response"] + [
        f"{i * 0.37:.3f},{i * i % 7 + i / 9:.3f},{i % 5 + i / 3:.3f},{i}" for i in range(1, 21)
    ]
    status, error = answer(tmp_path, capsys, command, lines)
    assert (
        status == 2 and "not a design" in error and "column 'x'" in error and "row 2" in error and "--ignore" in error
    )


def test_a_run_number_column_is_left_out_and_can_be_ignored(tmp_path, capsys):
    lines = [f"No.,{line}" if i == 0 else f"{i},{line}" for i, line in enumerate(screening_csv())]
    status, error = answer(tmp_path, capsys, "pb", lines)
    assert status == 0 and "left out: No. (number of the run)" in error
    assert answer(tmp_path, capsys, "pb", lines, "--ignore", "No.")[0] == 0
    assert answer(tmp_path, capsys, "pb", lines, "--ignore", "Number")[0] == 2


def test_a_level_off_the_design(tmp_path, capsys):
    status, error = answer(tmp_path, capsys, "pb", replaced(screening_csv(), 4, 0, "0.4"))
    assert status == 2 and "column 'A', row 4" in error


def test_a_middle_level_that_is_not_in_the_middle(tmp_path, capsys):
    lines = surface_csv()
    for row in range(2, len(lines) + 1):
        level = {"-1": "10", "0": "100", "1": "1000"}[lines[row - 1].split(",")[0]]
        lines = replaced(lines, row, 0, level)
    status, error = answer(tmp_path, capsys, "bbd", lines)
    assert status == 2 and "column 'B'" in error and "logarithm" in error


def test_a_three_level_table_is_sent_to_bbd_and_a_two_level_one_to_pb(tmp_path, capsys):
    status, error = answer(tmp_path, capsys, "pb", surface_csv())
    assert status == 2 and "Box-Behnken design of 3 factors" in error and followed(error) == 0
    status, error = answer(tmp_path, capsys, "bbd", screening_csv(3))
    assert status == 2 and "two-level design" in error and followed(error) == 0
    status, error = answer(tmp_path, capsys, "bbd", ["A,B,y", "1,1,3", "1,2,4", "2,1,5"])
    assert status == 2 and "Analyse it with: pellet-study pb" in error and followed(error) == 0
    status, error = answer(tmp_path, capsys, "bbd", ["A,B,y", "1,1,3", "1,2,4"])
    assert status == 2 and "Analyse it with" not in error


def followed(error: str) -> int:
    """What comes of the command that an error ends with."""
    return main(shlex.split(error.rsplit("pellet-study ", 1)[1]))


def test_two_columns_that_are_copies(tmp_path, capsys):
    lines = screening_csv()
    for row in range(2, len(lines) + 1):
        lines = replaced(lines, row, 1, lines[row - 1].split(",")[0])
    status, error = answer(tmp_path, capsys, "pb", lines)
    assert status == 2 and "'A', 'B'" in error and "copies" in error


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("", "no runs"),
        ("A,B,y\n", "no runs"),
        ("A,B,y\n1,1\n", "2 cells"),
        ("1,1,3\n-1,1,4\n", "column names"),
        ("A,,y\n1,1,3\n", "no name"),
        ("y\n1\n2\n", "single column"),
        ("A,B,y\n1,1,3,5\n", "decimal point"),
        ("A;B;y\n1;1;3,5\n-1;-1;2.5\n", "decimal comma"),
        ("A;B\ty\n1;1\t3\n", "save with commas"),
    ],
)
def test_broken_tables(tmp_path, capsys, content, expected):
    path = tmp_path / "table.csv"
    path.write_text(content)
    assert main(["pb", str(path)]) == 2
    assert expected in capsys.readouterr().err


def test_a_missing_or_binary_file(tmp_path, capsys):
    assert main(["pb", str(tmp_path / "none.csv")]) == 2
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00A,B")
    assert main(["bbd", str(tmp_path / "binary.csv")]) == 2
    assert main(["pb", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("pellet-study:") == 3


@pytest.mark.parametrize(
    "options",
    [
        ["--factor", "A=1,1"],
        ["--factor", "A:1,2"],
        ["--factor", "Z=1,2"],
        ["--alpha", "1.5"],
        ["--climb", "gradient", "--climb-factors", "Z"],
        ["--climb", "gradient", "--climb-factors", "A", "--climb-step", "Z=1"],
        ["--climb", "gradient", "--climb-factors", "A", "--climb-points", "1"],
        ["--climb", "gradient", "--climb-factors", "A", "--climb-step", "fast"],
    ],
)
def test_bad_options_of_pb(tmp_path, capsys, options):
    status, error = answer(tmp_path, capsys, "pb", screening_csv(), *options)
    assert (
        status == 2
        and error.startswith("pellet-study:")
        and "expected" in error
        or "is no factor" in error
        or "not a column" in error
    )


@pytest.mark.parametrize(
    "options",
    [
        ["--predict", "B=1,C=1"],
        ["--drop", "XY"],
        ["--drop", "B"],
        ["--target", "35", "--uncertainty", "-1"],
        ["--verify", "35.1,35.3", "--target", "35"],
        ["--verify", "35.1,35.3"],
        ["--verify", "a,b", "--target", "35"],
        ["--declare-margin", "0"],
        ["--declare-margin", "1", "--verify", "35,36", "--target", "35"],
    ],
)
def test_bad_options_of_bbd(tmp_path, capsys, options):
    status, error = answer(tmp_path, capsys, "bbd", surface_csv(), *options)
    assert status == 2 and error.startswith("pellet-study:")


def test_neither_table_nor_design(capsys):
    assert main(["pb"]) == 2 and main(["bbd"]) == 2
    assert main(["pb", "--design", "A=0,1", "A=1,2"]) == 2
    assert main(["bbd", "--design", "A=0,1"]) == 2
    assert capsys.readouterr().err.count("expected") == 4


@pytest.mark.parametrize("name", ["1", "residual", "A*B", "A^2"])
def test_a_factor_named_like_a_term(tmp_path, capsys, name):
    lines = screening_csv()
    lines[0] = f"{name},B,C,D,E,F,G,angle"
    status, error = answer(tmp_path, capsys, "pb", lines)
    assert status == 2 and repr(name) in error and "rename" in error
