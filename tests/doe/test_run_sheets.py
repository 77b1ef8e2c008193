"""Run sheets: random order from a seed, blocks, units, workbooks; filled in any order, read back and analysed right."""

import json

import numpy as np
import pandas as pd
import pytest
from scipy.stats import nct, t

from pellet_study.__main__ import main
from pellet_study.doe.factors import Factor
from pellet_study.doe.run_sheet import run_sheet
from pellet_study.doe.screening_designs import coded_matrix
from pellet_study.errors import InputError


def answered(*words, tmp_path, status=0):
    path = tmp_path / "answer.json"
    path.unlink(missing_ok=True)
    assert main([*map(str, words), "--json", str(path)]) == status
    return json.loads(path.read_text()) if status == 0 else None


def fill(path, response):
    """Write responses by a function of the row, then shuffle the rows."""
    frame = pd.read_csv(path)
    frame[frame.columns[-1]] = [response(row) for _, row in frame.iterrows()]
    frame.sample(frac=1, random_state=3).to_csv(path, index=False)


def test_the_order_is_random_and_comes_again_with_the_seed():
    factors = [Factor("A", 1, 2, "mm"), Factor("B", 5, 3)]
    first, again, other = (run_sheet(coded_matrix(2), factors, seed=seed) for seed in (4, 4, 5))
    assert first.frame.equals(again.frame) and not first.frame.equals(other.frame)
    assert list(first.frame) == ["run", "standard_order", "A (mm)", "B", "response"]
    assert sorted(first.frame["standard_order"]) == list(range(1, 13)) != first.frame["standard_order"].tolist()
    back = first.frame.sort_values("standard_order")
    assert np.array_equal(back["A (mm)"], 1.5 + coded_matrix(2)[:, 0] / 2)
    assert np.array_equal(back["B"], 4 - coded_matrix(2)[:, 1])
    orders = {tuple(run_sheet(coded_matrix(2), factors).frame["standard_order"]) for _ in range(20)}
    assert len(orders) > 15


def test_runs_are_shuffled_within_blocks_that_keep_their_order():
    blocks = np.repeat([1, 2, 3], 4)
    frame = run_sheet(coded_matrix(3), [Factor(n) for n in "ABC"], blocks, seed=1).frame
    assert frame["block"].tolist() == blocks.tolist()
    assert set(frame["standard_order"][:4]) == {1, 2, 3, 4} and frame["run"].tolist() == list(range(1, 13))


@pytest.mark.parametrize(("factors", "seed"), [(["run"], 1), (["Block"], 1), (["A", "response"], 1), (["A"], -1)])
def test_names_that_clash_and_negative_seeds_are_refused(factors, seed):
    with pytest.raises(InputError, match="expected"):
        run_sheet(coded_matrix(len(factors)), [Factor(n) for n in factors], seed=seed)


@pytest.mark.parametrize("ending", ["csv", "xlsx"])
def test_a_filled_screening_is_read_back_in_any_order(ending, tmp_path, capsys):
    sheet = tmp_path / f"sheet.{ending}"
    made = answered("pb", "--design", "A=10,20,C", "B=0.9,0.82", "C=old,new", "--centre", 4, "--blocks", 2, "--seed", 7,
                    "--output", sheet, tmp_path=tmp_path)  # fmt: skip
    out = capsys.readouterr().out
    assert made["seed"] == 7 and made["orthogonal_blocks"] and "seed 7" in out and "2 orthogonal blocks" in out
    assert made["design"][0].keys() == {"A", "B", "C"} and sorted(made["standard_order"]) == list(range(1, 17))
    if ending == "xlsx":
        frame = pd.read_excel(sheet)
        sheet = tmp_path / "filled.csv"
        frame.to_csv(sheet, index=False)
    else:  # what the command says to do next works
        assert f"pb {sheet} --block block --factor B=0.9,0.82 --factor C=old,new" in out

    def response(row):
        a, b, c = (row["A (C)"] - 15) / 5, (0.86 - row["B"]) / 0.04, 1 if row["C"] == "new" else -1
        return round(50 + 3 * a - 2 * b + 1 * c + 4 * (row["block"] == 2) + 0.01 * (row["standard_order"] % 3), 4)

    fill(sheet, response)
    answer = answered("pb", sheet, "--block", "block", "--factor", "B=0.9,0.82", "--factor", "C=old,new", tmp_path=tmp_path)  # fmt: skip
    expected = {"A (C)": 6, "B": -4, "C": 2} | dict.fromkeys(("A (C)*B", "A (C)*C", "B*C"), 0)
    assert answer["effects"] == pytest.approx(expected, abs=0.02)
    assert [f["levels"] for f in answer["factors"]] == [[], [], ["old", "new"]]
    assert answer["curvature"]["estimate"] == pytest.approx(0, abs=0.02)


def test_a_filled_rotatable_composite_is_read_back(tmp_path, capsys):
    sheet = tmp_path / "surface.csv"
    answered("bbd", "--design", "x=0,10,mm", "y=3,1", "--axial", "rotatable", "--centre", 6, "--blocks", 2, "--output",
             sheet, tmp_path=tmp_path)  # fmt: skip
    assert "2 orthogonal blocks" in (out := capsys.readouterr().out) and "--factor x=0,10,mm --factor y=3,1" in out

    def response(row):
        a, b = row["x (mm)"] / 5 - 1, 2 - row["y"]
        return 20 + a - 2 * b + 0.5 * a * b - a**2 + 3 * (row["block"] == 1) + 0.001 * row["standard_order"]

    fill(sheet, response)
    answer = answered("bbd", sheet, "--block", "block", "--factor", "x=0,10,mm", "--factor", "y=3,1", tmp_path=tmp_path)
    assert list(answer["coefficients"].values())[1:] == pytest.approx([1, -2, 0.5, -1, 0], abs=0.01)


def test_six_factors_have_54_runs_and_eight_are_offered_a_composite(tmp_path, capsys):
    six = [f"{name}=0,1" for name in "ABCDEF"]
    assert answered("bbd", "--design", *six, "--centre", 6, tmp_path=tmp_path)["runs"] == 54
    assert answered("bbd", "--design", *six, "G=0,1", "--centre", 6, tmp_path=tmp_path)["runs"] == 62
    eight = [*six, "G=0,1", "H=0,1"]
    capsys.readouterr()
    answered("bbd", "--design", *eight, tmp_path=tmp_path, status=2)
    assert "--axial face --fraction" in capsys.readouterr().err
    assert (
        answered("bbd", "--design", *eight, "--axial", "face", "--fraction", tmp_path=tmp_path)["runs"] == 64 + 16 + 5
    )


def test_a_sheet_is_not_overwritten_and_blocks_that_cost_say_so(tmp_path, capsys):
    sheet = tmp_path / "s.csv"
    words = ("bbd", "--design", "A=0,1", "B=0,1", "C=0,1", "--centre", 4, "--blocks", 2, "--output", sheet)
    assert not answered(*words, tmp_path=tmp_path)["orthogonal_blocks"]
    assert "not orthogonal" in capsys.readouterr().out
    answered(*words, tmp_path=tmp_path, status=2)
    assert "--force" in capsys.readouterr().err
    answered(*words, "--force", tmp_path=tmp_path)


# -------------------------------------------------------------------------------------------- the command design
@pytest.fixture
def half(tmp_path):
    """A 2^(3-1) and centre points, filled."""
    path = tmp_path / "half.csv"
    lines = ["A,B,C,y", "-1,-1,1,10", "1,-1,-1,14", "-1,1,-1,12", "1,1,1,18", "0,0,0,13.4", "0,0,0,13.7"]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_fold_over_from_the_command_line(half, tmp_path, capsys):
    folded = tmp_path / "folded.csv"
    answer = answered("design", "fold", half, "--seed", 1, "--output", folded, tmp_path=tmp_path)
    assert answer["freed"] == {"A": ["BC"], "B": ["AC"], "C": ["AB"]} and answer["added"] == 4
    frame = pd.read_csv(folded)
    assert frame["y"].notna().sum() == 6 and frame["block"].tolist() == [1] * 6 + [2] * 4
    corners = frame[frame["A"] != 0][["A", "B", "C"]]
    assert len(corners.drop_duplicates()) == 8
    assert f"pb {folded} --block block" in capsys.readouterr().out


def test_axial_points_from_the_command_line(half, tmp_path, capsys):
    surface = tmp_path / "surface.csv"
    answer = answered(
        "design", "axial", half, "--factors", "A,B", "--hold", "C=1", "--output", surface, tmp_path=tmp_path
    )
    assert answer["distance"] == pytest.approx(2**0.5) and answer["lost"] == [] and answer["added"] == 7
    frame = pd.read_csv(surface)
    assert frame["C"][6:].tolist() == [1] * 7 and frame["A"].abs().max() == pytest.approx(2**0.5)
    assert "--ignore C" in capsys.readouterr().out


def test_repair_names_the_rows_and_writes_the_runs(tmp_path, capsys):
    table = tmp_path / "lost.csv"
    frame = pd.DataFrame(coded_matrix(3, 8), columns=list("ABC")).assign(y=[3.0, "", 5, 6, "", 2, 8, 4])
    frame.to_csv(table, index=False)
    again = tmp_path / "again.csv"
    answer = answered("design", "repair", table, "--repeats", 1, "--output", again, tmp_path=tmp_path)
    assert set(answer["rows"]) <= {3, 6} and len(answer["rows"]) == 1 and "row" in capsys.readouterr().out
    written = pd.read_csv(again)
    assert len(written) == 7 and written["y"].isna().sum() == 1 and np.isnan(written["y"].iloc[-1])


def test_power_and_score_of_a_sheet_that_is_not_run(tmp_path, capsys):
    sheet = tmp_path / "sheet.csv"
    answered("pb", "--design", *[f"{n}=0,1" for n in "ABCDE"], "--output", sheet, tmp_path=tmp_path)
    power = answered("design", "power", sheet, "--sd", 1, "--effect", 2, tmp_path=tmp_path)
    # 12 runs, 6 residual degrees of freedom: noncentrality 12 (2/2)^2
    assert power["df_residual"] == 6 and len(set(np.round(list(power["power"].values()), 9))) == 1
    exact = nct.sf(t.isf(0.025, 6), 6, 12**0.5) + nct.cdf(-t.isf(0.025, 6), 6, 12**0.5)
    assert power["power"]["A"] == pytest.approx(exact, abs=1e-6)
    score = answered("design", "score", sheet, tmp_path=tmp_path)
    assert score["d_efficiency"] == pytest.approx(100) and "orthogonal two-level design" in score["kind"]
    answered("design", "score", sheet, "--model", "quadratic", tmp_path=tmp_path)
    assert "do not separate" in capsys.readouterr().out


def test_a_design_without_a_response_column_is_scored(tmp_path):
    table = tmp_path / "bare.csv"
    pd.DataFrame(coded_matrix(4, 8), columns=list("ABCD")).to_csv(table, index=False)
    assert answered("design", "score", table, tmp_path=tmp_path)["terms"] == 5


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fold", "T", "--on", "Q"], "no factor of the table"),
        (["axial", "T", "--axial", "star"], "rotatable, face, orthogonal"),
        (["axial", "T", "--factors", "A"], "two factors or more"),
        (["repair", "T"], "no run is lost"),
        (["power", "T", "--sd", "0", "--effect", "1"], "expected an sd above 0"),
        (["score", "missing.csv"], "no such file"),
    ],
)
def test_what_cannot_be_done_is_refused_in_words(words, said, half, tmp_path, capsys):
    words = [str(half) if word == "T" else word for word in words]
    answered("design", *words, tmp_path=tmp_path, status=2)
    assert said in capsys.readouterr().err


def test_a_categorical_factor_has_no_path_and_no_square(tmp_path, capsys):
    answered("bbd", "--design", "A=0,1", "B=0,1", "C=old,new", tmp_path=tmp_path, status=2)
    assert "categorical" in capsys.readouterr().err
    sheet = tmp_path / "s.csv"
    answered("pb", "--design", "A=0,1", "C=old,new", "--output", sheet, tmp_path=tmp_path)
    fill(sheet, lambda row: row["A"] + 5 * (row["C"] == "new") + 0.001 * row["standard_order"])
    words = ("pb", sheet, "--factor", "C=old,new", "--climb", "gradient")
    answered(*words, "--climb-factors", "A,C", tmp_path=tmp_path, status=2)
    assert "no path along it" in capsys.readouterr().err
    assert list(answered(*words, tmp_path=tmp_path)["climb"]["points"][0]) == ["A"]
    assert "C old or new (predicted is the mean of both)" in capsys.readouterr().out


def test_the_surface_that_is_hinted_at_has_no_categorical_factor(tmp_path, capsys):
    """A, B and C act; C has no middle, so the surface is one of A and B, and its design can be made."""
    sheet = tmp_path / "s.csv"
    answered("pb", "--design", "A=0,1", "B=0,1", "C=old,new", "--output", sheet, tmp_path=tmp_path)
    fill(sheet, lambda row: row["A"] + row["B"] + 5 * (row["C"] == "new") + 0.001 * row["standard_order"])
    capsys.readouterr()
    answered("pb", sheet, "--factor", "C=old,new", tmp_path=tmp_path)
    told = capsys.readouterr().out.rsplit("next: pellet-study ", 1)[1]
    assert told.split() == ["bbd", "--design", "A=LOW,HIGH", "B=LOW,HIGH", "--face-centred"]
    answered(*told.replace("LOW,HIGH", "0,1").split(), tmp_path=tmp_path)


def test_three_named_levels_are_analysed(tmp_path, capsys):
    table = tmp_path / "t.csv"
    rows = [(c, x, {"a": 1, "b": 4, "c": 7}[c] + 2 * x + 0.01 * k) for k, (c, x) in
            enumerate([(c, x) for c in "abc" for x in (-1, 1)] * 2)]  # fmt: skip
    pd.DataFrame(rows, columns=["catalyst", "T", "y"]).to_csv(table, index=False)
    answered("pb", table, tmp_path=tmp_path, status=2)
    assert "--factor catalyst=a,b,c" in capsys.readouterr().err  # and that advice works
    answer = answered("pb", table, "--factor", "catalyst=a,b,c", tmp_path=tmp_path)
    assert answer["effects"]["T"] == pytest.approx(4, abs=0.05)
    assert answer["effects"]["catalyst[b]"] == pytest.approx(0, abs=0.05)
    assert {"effects", "anova", "coefficients", "r2", "r2_adjusted", "r2_predicted", "cv_percent", "lack_of_fit_p"} <= set(answer)  # fmt: skip


def test_a_fraction_with_a_categorical_factor_is_no_full_factorial(tmp_path, capsys):
    """Eight runs of four factors, one of them a gas: the other three alone are a full factorial, the four are not."""
    path = tmp_path / "weld.csv"
    words = ["gas=argon,co2", "current=100,200", "speed=2,6", "gap=0,2", "--runs", "8", "--centre", "2", "--seed", "3"]
    assert main(["pb", "--design", *words, "--output", str(path)]) == 0
    frame = pd.read_csv(path)
    frame["response"] = np.random.default_rng(0).normal(420, 5, len(frame))
    frame.to_csv(path, index=False)
    capsys.readouterr()
    assert main(["pb", str(path), "--factor", "gas=argon,co2"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("Fractional factorial: 10 runs, 4 factors")
    assert "design: orthogonal two-level design of 4 factors, 8 + 2 centre points" in said
