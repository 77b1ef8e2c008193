"""What users of `pb` and `bbd` ran into: each expected value from a grid, a shuffle or a hand calculation."""

import json

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from pellet_study.__main__ import main
from pellet_study.doe import box_behnken, figures, plackett_burman, screening_designs, screening_text
from pellet_study.doe.blocks import Block
from pellet_study.doe.design_table import code_design
from pellet_study.doe.intervals import interval
from pellet_study.paper.printed import table

LEVELS = ["--factor", "B=0.90,0.82", "--factor", "C=0.25,0.33", "--factor", "G=0.10,0.18"]


@pytest.fixture
def surface_csv(tmp_path):
    path = tmp_path / "surface.csv"
    table(12).drop(columns="No.").to_csv(path, index=False)
    return path


@pytest.fixture
def screening_csv(tmp_path):
    path = tmp_path / "screening.csv"
    table(7).drop(columns="No.").to_csv(path, index=False)
    return path


def run(*words, tmp_path, status=0):
    path = tmp_path / "answer.json"
    assert main([*map(str, words), "--json", str(path)]) == status
    return json.loads(path.read_text())


def grid_and_prediction(answer):
    """A dense grid of the box and the equation on it, term by term."""
    line = np.linspace(-1, 1, 81)
    b, c, g = (axis.ravel() for axis in np.meshgrid(line, line, line))
    terms = {
        "1": 1,
        "B": b,
        "C": c,
        "G": g,
        "BC": b * c,
        "BG": b * g,
        "CG": c * g,
        "B2": b * b,
        "C2": c * c,
        "G2": g * g,
    }
    return {"B": b, "C": c, "G": g}, sum(answer["coefficients"][name] * column for name, column in terms.items())


def noisy(n_factors, runs, seed=1, centre=0):
    x = screening_designs.coded_matrix(n_factors, runs, centre)
    y = 40 + 3 * x[:, 0] + np.random.default_rng(seed).normal(size=len(x))
    return pd.DataFrame(x, columns=list("ABCDEFGHIJK")[:n_factors]).assign(y=y)


# --------------------------------------------------------------------------------------------------- target set
@pytest.mark.parametrize(("target", "reachable"), [(41.69, True), (43.5, False)])
def test_extents_are_those_of_the_set_within_the_uncertainty(surface_csv, tmp_path, capsys, target, reachable):
    answer = run("bbd", surface_csv, *LEVELS, "--target", target, "--uncertainty", 0.79, tmp_path=tmp_path)
    grid, predicted = grid_and_prediction(answer)
    inside = np.abs(predicted - target) <= 0.79
    found = answer["optimum"]
    assert found["reachable"] is reachable and found["reachable_within_uncertainty"]
    assert found["fraction_of_box"] == pytest.approx(inside.mean(), abs=0.01)
    for extent in found["extents"]:
        low, high = grid[extent["name"]][inside].min(), grid[extent["name"]][inside].max()
        assert low - 0.05 <= extent["coded"][0] <= low + 1e-9
        assert high - 1e-9 <= extent["coded"][1] <= high + 0.05
    assert ("met within the uncertainty only" in capsys.readouterr().out) is not reachable


def test_without_an_uncertainty_the_extents_are_the_sheets(surface_csv, tmp_path, capsys):
    found = run("bbd", surface_csv, *LEVELS, "--target", 41.69, tmp_path=tmp_path)["optimum"]
    assert found["extents"] == found["sheet_extents"]
    assert "0.0 % of the box lies within the uncertainty" not in capsys.readouterr().out


def test_a_saturated_fit_cannot_say_what_is_not_excluded(tmp_path, capsys):
    path = tmp_path / "saturated.csv"
    path.write_text("A,B,y\n-1,-1,3.1\n1,-1,5.2\n-1,1,4.4\n1,1,9.1\n0,1,7.7\n1,0,6.9\n")
    found = run("bbd", path, "--target", 6, "--uncertainty", 0.5, tmp_path=tmp_path)["optimum"]
    assert found["fraction_not_excluded"] is None and found["measurements"] == []
    assert "- cannot be excluded" in capsys.readouterr().out


# -------------------------------------------------------------------------------------------------------- Lenth
@pytest.mark.parametrize(("n_factors", "runs"), [(5, 16), (9, 16), (3, 12), (4, 12), (2, 12), (3, 16)])
def test_lenths_margin_does_not_depend_on_the_order_of_the_rows(n_factors, runs):
    frame = noisy(n_factors, runs)
    results = [
        plackett_burman.analyse(code_design(frame.sample(frac=1, random_state=seed)), interactions=False)
        for seed in range(8)
    ]
    first = results[0]
    assert len(first.noise_contrasts) == runs - 1 - n_factors
    assert [r.lenth.margin_of_error for r in results] == pytest.approx([first.lenth.margin_of_error] * 8)
    assert runs / 4 * np.sum(np.square(first.noise_contrasts)) == pytest.approx(first.model.ss_residual)


def test_a_regular_design_is_completed_by_its_interactions():
    """2^4: the eleven other contrasts are the interactions, however the rows and columns stand."""
    x = np.array([[1.0 if i >> k & 1 else -1.0 for k in range(4)] for i in range(16)])
    y = 70 + np.random.default_rng(2).normal(size=16)
    products = [x[:, [k for k in range(4) if chosen >> k & 1]].prod(axis=1) for chosen in range(1, 16)]
    expected = sorted(abs(column @ y) / 8 for k, column in enumerate(products, 1) if bin(k).count("1") > 1)
    frame = pd.DataFrame(x, columns=list("ABCD")).assign(y=y)[["C", "A", "D", "B", "y"]].sample(frac=1, random_state=4)
    found = plackett_burman.analyse(code_design(frame), interactions=False).noise_contrasts
    assert sorted(np.abs(found)) == pytest.approx(expected)


def test_where_lenth_cannot_be_used_it_says_so_and_is_not_drawn():
    failed, twenty, whole = noisy(5, 12).drop(index=3), noisy(7, 20), noisy(5, 12)
    for frame, met in ((failed, False), (twenty, False), (whole, True)):
        screening = plackett_burman.analyse(code_design(frame))
        assert screening.lenth.assumption_met is met
        assert ("is not met" in screening_text.screening_text(screening)) is not met
        drawn = [line.get_label() for line in figures.pareto(screening).axes[0].lines]
        assert ("Lenth's margin of error" in drawn) is met


def test_the_half_normal_plot_shows_all_contrasts_and_its_labels_inside():
    screening = plackett_burman.analyse(code_design(noisy(7, 12)))
    figure = figures.half_normal(screening.effects, screening.lenth, "deg", screening.noise_contrasts)
    axes = figure.axes[0]
    shown = np.concatenate([line.get_xdata() for line in axes.lines if line.get_marker() not in ("", "None")])
    assert sorted(shown) == pytest.approx(sorted(np.abs([*screening.effects.values(), *screening.noise_contrasts])))
    figure.canvas.draw()
    box = axes.get_window_extent()
    for label in axes.texts:
        place = label.get_window_extent()
        assert place.x0 >= box.x0 and place.x1 <= box.x1
    assert sorted(filter(None, (label.get_text() for label in axes.texts))) == list("ABCDEFG")


# ------------------------------------------------------------------------------------------- losses, replicates
def test_failed_runs_of_a_response_surface_have_their_loss_stated(surface_csv, tmp_path, capsys):
    assert run("bbd", surface_csv, tmp_path=tmp_path)["orthogonal"]
    assert "not orthogonal" not in capsys.readouterr().err
    lines = surface_csv.read_text().splitlines()
    for row in (1, 5):
        lines[row] = lines[row].rsplit(",", 1)[0] + ","
    surface_csv.write_text("\n".join(lines))
    answer = run("bbd", surface_csv, tmp_path=tmp_path)
    assert not answer["orthogonal"]
    x = table(12).drop(columns="No.").drop(index=[0, 4]).to_numpy()[:, :3]
    b, c, g = x.T
    others = np.column_stack([np.ones(len(b)), c, g, b * c, b * g, c * g, b * b, c * c, g * g])
    left = b - others @ np.linalg.lstsq(others, b, rcond=None)[0]
    inflation = np.sqrt(np.sum((b - b.mean()) ** 2) / np.sum(left**2))
    assert answer["standard_error_inflation"]["B"] == pytest.approx(inflation)
    assert "not orthogonal" in capsys.readouterr().err


def test_exactly_equal_replicates_are_called_that(tmp_path, capsys):
    frame = noisy(3, 12)
    path = tmp_path / "copies.csv"
    frame["y"] = 0.1 + frame["A"] * 0.7 + frame["B"] * frame["C"] * 0.3
    pd.concat([frame, frame, frame]).to_csv(path, index=False)
    answer = run("pb", path, tmp_path=tmp_path)
    error = capsys.readouterr().err
    assert "exactly equal" in error and "no replicated runs" not in error
    assert next(row for row in answer["anova"] if row["source"] == "pure error")["sum_of_squares"] == 0


def test_a_mean_of_zero_has_no_coefficient_of_variation():
    frame = noisy(7, 12)
    frame["y"] -= frame["y"].mean()
    assert plackett_burman.analyse(code_design(frame)).cv_percent is None


def test_two_factors_in_twelve_runs_have_a_detectable_effect():
    screening = plackett_burman.analyse(code_design(noisy(2, 12)))
    assert screening.detectable_effects["A"] > 0


# ------------------------------------------------------------------------------------------------------ options
@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--target", "41.69", "--target-n", "5"], "standard deviation"),
        (["--reduce", "5"], "--reduce 5"),
        (["--predict", "Q=1"], "--predict"),
        (["--drop", "QQ"], "no term"),
        (["--reduce", "-1"], "--reduce -1"),
        (["--factor", "B=0.9,0.82", "--factor", "B=1,2"], "2 times"),
    ],
)
def test_options_of_bbd_that_cannot_be_used(surface_csv, capsys, options, expected):
    assert main(["bbd", str(surface_csv), *options]) == 2
    captured = capsys.readouterr()
    assert expected in captured.err and captured.out == ""


@pytest.mark.parametrize("options", [["--climb-step", "B=0.02"], ["--climb-factors", "B,C"]])
def test_a_path_is_shaped_only_where_there_is_one(screening_csv, capsys, options):
    assert main(["pb", str(screening_csv), *options]) == 2
    captured = capsys.readouterr()
    assert "--climb gradient" in captured.err and captured.out == ""


def test_a_path_that_meets_a_limit_says_so(screening_csv, capsys):
    words = ["--climb", "gradient", "--climb-factors", "G", "--climb-points", "6", "--climb-step", "G=0.4"]
    assert main(["pb", str(screening_csv), *words]) == 0
    assert "a limit stopped the path after 3 of 6 points" in capsys.readouterr().out


def test_climb_runs_with_an_unknown_column_or_a_failed_run(screening_csv, tmp_path, capsys):
    runs = tmp_path / "climb.csv"
    runs.write_text("B,humidity,C,G,error\n" + "".join(f"{i},{i},{i},{i},{abs(i - 2)}\n" for i in range(5)))
    assert main(["pb", str(screening_csv), "--climb-runs", str(runs), "--lowest"]) == 2
    captured = capsys.readouterr()
    assert "humidity" in captured.err and captured.out == ""
    words = ["pb", str(screening_csv), "--climb-runs", str(runs), "--lowest", "--ignore"]
    assert main([*words, "humidity"]) == 0  # a column of either table
    assert main([*words, "humdity"]) == 2
    assert "no column 'humdity'" in capsys.readouterr().err
    runs.write_text("B,C,G,error\n0,0,0,2\n1,1,1,1\n2,2,2,0\n3,3,3,\n4,4,4,5\n")
    answer = run("pb", screening_csv, "--climb-runs", runs, "--lowest", tmp_path=tmp_path)
    assert "climb.csv: row 5 has no 'error'" in capsys.readouterr().err
    assert any("row 5" in warning for warning in answer["warnings"])


@pytest.mark.parametrize("separator", [";", "\t"])
def test_semicolons_and_tabs_are_read(screening_csv, tmp_path, separator):
    other = tmp_path / "other.csv"
    other.write_text(screening_csv.read_text().replace(",", separator))
    assert run("pb", other, tmp_path=tmp_path)["effects"] == run("pb", screening_csv, tmp_path=tmp_path)["effects"]


def test_a_folder_that_is_missing_is_named(tmp_path, capsys):
    assert main(["pb", "--design", "A=0,1", "B=0,1", "--output", str(tmp_path / "nodir" / "x.csv")]) == 2
    error = capsys.readouterr().err
    assert "None" not in error and "nodir" in error


def test_a_table_coded_with_axial_points_stays_coded(tmp_path):
    coded = np.vstack([box_behnken.coded_matrix(2, 4, face_centred=True)])
    coded[4:8] *= 2**0.5
    y = 5 + 2 * coded[:, 0] + np.random.default_rng(3).normal(size=len(coded)) * 0.1
    path = tmp_path / "rotatable.csv"
    pd.DataFrame(coded, columns=["A", "B"]).assign(y=y).to_csv(path, index=False)
    plain = run("bbd", path, tmp_path=tmp_path)["coefficients"]["A"]
    kept = run("bbd", path, "--factor", "A=-1,1", "--factor", "B=-1,1", tmp_path=tmp_path)["coefficients"]["A"]
    pd.DataFrame(80 + 5 * coded, columns=["A", "B"]).assign(y=y).to_csv(path, index=False)
    physical = run("bbd", path, tmp_path=tmp_path)["coefficients"]["A"]
    truth = np.sum(coded[:, 0] * y) / np.sum(coded[:, 0] ** 2)  # the column is orthogonal to all others
    assert plain == kept == pytest.approx(truth) and physical == pytest.approx(truth)


def test_the_row_of_an_odd_level_is_named(screening_csv, capsys):
    lines = screening_csv.read_text().splitlines()
    cells = lines[4].split(",")
    lines[4] = ",".join([cells[0], "10", *cells[2:]])
    screening_csv.write_text("\n".join(lines))
    assert main(["pb", str(screening_csv)]) == 2
    error = capsys.readouterr().err
    assert "row 5" in error and "10" in error


def test_what_comes_next_agrees_with_the_warning_of_curvature(tmp_path, capsys):
    """The centre runs lie 14 above the plane: nobody is sent along a path that the warning says not to climb."""
    path = tmp_path / "curved.csv"
    corners = [
        (a, b, 30 + 2 * a + 3 * b + noise) for a, b, noise in ((-1, -1, 0.1), (1, -1, 0), (-1, 1, 0), (1, 1, 0.1))
    ]
    runs = [*corners, *((0, 0, y) for y in (44.0, 44.2, 43.9, 44.1))]
    pd.DataFrame(runs, columns=["A", "B", "y"]).to_csv(path, index=False)
    assert main(["pb", str(path), "--climb", "gradient"]) == 0
    out, err = capsys.readouterr()
    assert "do not climb by it" in err
    assert "next: pellet-study design axial" in out and "--climb-runs" not in out


def test_a_target_out_of_reach_is_not_validated(surface_csv, capsys):
    """Table 12 reads 37.9 to 44.5: 60 deg is met nowhere, 43 deg is."""
    assert main(["bbd", str(surface_csv), *LEVELS, "--target", "60"]) == 0
    assert "not reached" in (out := capsys.readouterr().out) and "--declare-margin" not in out
    assert main(["bbd", str(surface_csv), *LEVELS, "--target", "41"]) == 0
    assert "--declare-margin M" in capsys.readouterr().out


def test_axial_points_below_zero_are_said_and_the_advice_keeps_them_above(tmp_path, capsys):
    """Centre 6 h, half range 4 h: the rotatable distance, 2^(3/4) = 1.682, asks for -0.73 h; 1.5 for 0 h."""
    path = tmp_path / "screening.csv"
    corners = [(t, p, d, t + p + d) for t in (2, 10) for p in (-5, 8) for d in (5, 20)]
    pd.DataFrame([*corners, (6, 1.5, 12.5, 20), (6, 1.5, 12.5, 21)], columns=["hours", "kelvin", "dose", "y"]).to_csv(
        path, index=False
    )
    answer = run("design", "axial", path, "--output", tmp_path / "a.csv", tmp_path=tmp_path)
    said = capsys.readouterr().err
    assert "below zero" in said and "hours -0.727" in said and "dose -0.1134" in said and "kelvin" not in said
    assert any("below zero" in warning for warning in answer["warnings"]) and "--axial 1.5 at zero or above" in said
    for distance in ("1.5", "face"):
        run("design", "axial", path, "--axial", distance, "--output", tmp_path / f"{distance}.csv", tmp_path=tmp_path)
        assert "below zero" not in capsys.readouterr().err
        assert pd.read_csv(tmp_path / f"{distance}.csv")[["hours", "dose"]].to_numpy().min() >= 0
    assert main(["bbd", "--design", "A=1,5", "B=20,30", "--axial", "1.8", "--output", str(tmp_path / "b.csv")]) == 0
    assert "A -0.6" in capsys.readouterr().err


def test_a_curvature_that_is_small_beside_the_slopes_does_not_turn_a_climb(tmp_path, capsys):
    """1 at the centre where the slopes give 10: clear of a scatter of 0.1, and no reason to stay."""
    path = tmp_path / "slopes.csv"
    corners = [
        (a, b, 30 + 6 * a + 4 * b + noise) for a, b, noise in ((-1, -1, 0.1), (1, -1, 0), (-1, 1, 0), (1, 1, 0.1))
    ]
    runs = [*corners, *((0, 0, y) for y in (31.0, 31.1, 30.9, 31.1))]
    pd.DataFrame(runs, columns=["A (g)", "B (mm)", "y"]).to_csv(path, index=False)
    assert main(["pb", str(path), "--climb", "gradient"]) == 0
    out, err = capsys.readouterr()
    assert "significant" in err and "and small" in err and "do not climb" not in err
    assert "--climb-runs climb.csv" in out
    climbed = tmp_path / "climb.csv"
    climbed.write_text("A,B,y\n0,0,31\n1,0.7,38\n2,1.3,43\n3,2,41\n")  # without the units
    assert main(["pb", str(path), "--climb", "gradient", "--climb-runs", str(climbed)]) == 0
    assert "next: pellet-study bbd --design 'A (g)=1,3'" in capsys.readouterr().out


def test_replicates_that_differ_in_what_was_ignored_are_said(tmp_path, capsys):
    """A gas worth 4 is ignored: it is in the pure error, until it is fitted as a block."""
    coded = np.vstack([box_behnken.coded_matrix(2, 4, face_centred=True)] * 2)
    gas = np.repeat(["argon", "co2"], len(coded) // 2)
    y = 20 + coded[:, 0] + 4 * (gas == "co2") + 0.1 * np.random.default_rng(2).normal(size=len(coded))
    path = tmp_path / "weld.csv"
    frame = pd.DataFrame(coded, columns=["current", "speed"]).assign(gas=gas, y=y, z=y**2)
    frame.to_csv(path, index=False)
    words = ["--response", "y", "--ignore", "z"]
    assert main(["bbd", str(path), "--ignore", "gas", *words]) == 0
    said = capsys.readouterr().err
    assert "differ in gas, which was ignored" in said and "differ in gas, z" not in said
    kept = run("bbd", path, "--block", "gas", *words, tmp_path=tmp_path)
    assert "which was ignored" not in capsys.readouterr().err and kept["r2"] > 0.99


def test_an_ignored_factor_accuses_no_other_and_stays_in_the_runs_to_repeat(tmp_path, capsys):
    """A sheet of five factors, of which the second and the fourth are ignored; two runs are lost."""
    sheet, again = tmp_path / "sheet.csv", tmp_path / "again.csv"
    names = ["A=1,2", "B=10,20", "C=5,7", "D=x,y", "E=0,8"]
    assert main(["pb", "--design", *names, "--seed", "4", "--output", str(sheet)]) == 0
    frame = pd.read_csv(sheet)
    frame["response"] = 10 + 3 * frame["A"] + frame["C"] + 0.1 * np.random.default_rng(0).normal(size=len(frame))
    frame.to_csv(sheet, index=False)
    capsys.readouterr()
    words = ["--ignore", "B", "--ignore", "D"]
    assert main(["pb", str(sheet), *words]) == 0
    assert "standard_order the runs have" not in capsys.readouterr().err
    frame.loc[[2, 5], "response"] = np.nan
    frame.to_csv(sheet, index=False)
    assert main(["design", "repair", str(sheet), *words, "--repeats", "2", "--output", str(again)]) == 0
    repeated = pd.read_csv(again)
    assert repeated[["B", "D"]].notna().all(axis=None) and list(repeated)[-1] == "response"
    left = repeated[repeated["response"].isna()].sort_values("standard_order")
    lost = frame.loc[[2, 5]].sort_values("standard_order")
    assert left[["A", "B", "C", "D", "E"]].to_numpy().tolist() == lost[["A", "B", "C", "D", "E"]].to_numpy().tolist()


def test_the_mean_of_runs_in_a_new_block_is_predicted_no_worse_than_one_of_them():
    random = np.random.default_rng(3)
    coded = np.vstack([box_behnken.coded_matrix(2, 3, face_centred=True)] * 3)
    day = np.repeat(["1", "2", "3"], len(coded) // 3)
    y = 5 + coded[:, 0] + np.repeat([0.0, 1.5, -1.0], len(coded) // 3) + 0.3 * random.normal(size=len(coded))
    frame = pd.DataFrame(coded, columns=["A", "B"]).assign(y=y)
    table = code_design(frame, blocks=[Block("day", tuple(day))])
    model = box_behnken.analyse(table).model
    one, six = (np.ptp(interval(model, [0.5, 0.5], runs=n).prediction) for n in (1, 6))
    assert six <= one


def test_a_design_that_mixes_main_effects_wholly_says_so_when_it_is_made(tmp_path, capsys):
    names = [f"{name}=0,1" for name in "ABCD"]
    for runs, mixed in (("8", True), ("12", False)):
        assert main(["pb", "--design", *names, "--runs", runs, "--output", str(tmp_path / f"{runs}.csv")]) == 0
        assert ("wholly mixed with interactions" in capsys.readouterr().err) is mixed
    assert main(["pb", "--design", *names[:3], "--runs", "8", "--output", str(tmp_path / "full.csv")]) == 0
    assert "wholly mixed" not in capsys.readouterr().err


def test_named_levels_are_held_and_no_other_factor_is_meant(tmp_path):
    """Whose name ends with the other's, at a level that begins with the other's."""
    path, made = tmp_path / "sheet.csv", tmp_path / "axial.csv"
    runs = [
        (a, b, gas, bio, a + b) for a in (1, 3) for b in (5, 9) for gas in ("mix", "co2") for bio in ("mix2", "none")
    ]
    pd.DataFrame(runs, columns=["A", "B", "gas", "biogas", "y"]).to_csv(path, index=False)
    words = ["--factor", "gas=mix,co2", "--factor", "biogas=none,mix2", "--factors", "A,B"]
    run("design", "axial", path, *words, "--hold", "biogas=mix2,gas=co2", "--output", made, tmp_path=tmp_path)
    added = pd.read_csv(made).iloc[len(runs) :]
    assert set(added["gas"]) == {"co2"} and set(added["biogas"]) == {"mix2"}


def test_the_pareto_chart_has_a_margin_of_each_bar_where_standard_errors_differ():
    """A run repeated four times at one corner: the bars' own margins are those of the table's p values."""
    coded = pd.DataFrame(
        [(a, b) for a in (-1, 1) for b in (-1, 1)] + 3 * [(1, 1)] + 2 * [(-1, 1)], columns=["A", "B"], dtype=float
    )
    y = 3 * coded["A"] + coded["B"] + np.random.default_rng(1).normal(size=len(coded))
    screening = plackett_burman.analyse(code_design(coded.assign(y=y)), interactions=False)
    axes = figures.pareto(screening).axes[0]
    (margins,) = axes.collections
    names = sorted(screening.effects, key=lambda name: abs(screening.effects[name]))
    p = {row["source"]: row["p"] for row in screening.anova}
    for name, segment in zip(names, margins.get_segments(), strict=True):
        assert (abs(screening.effects[name]) > segment[0][0]) == (p[name] < 0.05)
        assert segment[0][0] == pytest.approx(
            2 * screening.model.standard_errors[name] * stats.t.ppf(0.975, screening.model.df_residual)
        )
