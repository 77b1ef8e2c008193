"""Tables on which `pb`, `bbd` and the climb once went wrong, each with its right answer from outside the program.

two blocks: rsm's vignette (Lenth, J. Stat. Softw. 32(7) 2009, doi:10.18637/jss.v032.i07, ChemReact). coded composite:
Montgomery, Design and Analysis of Experiments, Wiley, example 11.2. path: ibid., example 11.1. odour: SAS/STAT User's
Guide, The RSREG Procedure. dummies: Wu and Hamada, Experiments, Wiley 2000 (cast fatigue).
"""

import json
import re
import shlex
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.doe import (
    box_behnken,
    composite,
    figures,
    labels,
    linear_model,
    path_turning,
    plackett_burman,
    screening_designs,
    steepest_climb,
)
from pellet_study.doe.design_table import read_design
from pellet_study.doe.terms import quadratic_terms

TABLES = Path(__file__).parent / "tables"


def run(tmp_path, command, table, *options, status=0):
    assert main([command, str(TABLES / table), *map(str, options), "--json", str(tmp_path / "a.json")]) == status
    return json.loads((tmp_path / "a.json").read_text()) if status == 0 else None


def row(answer, source):
    return next(row for row in answer["anova"] if row["source"] == source)


def test_two_blocks_as_published(tmp_path, capsys):
    run(tmp_path, "bbd", "two_blocks.csv", status=2)
    assert "--block Block" in capsys.readouterr().err
    found = run(tmp_path, "bbd", "two_blocks.csv", "--block", "Block", "--target", 81)
    published = {"Time": 0.932541, "Temp": 0.577712, "Time*Temp": 0.125, "Time^2": -1.308555, "Temp^2": -0.933442}
    assert {name: found["coefficients"][name] for name in published} == pytest.approx(published, abs=1e-6)
    assert found["coefficients"]["1"] == pytest.approx(84.095427 - 4.457530 / 2, abs=1e-6)  # theirs is block 1's
    assert found["blocks"]["Block"]["2"] - found["blocks"]["Block"]["1"] == pytest.approx(-4.457530, abs=1e-6)
    block, lack = row(found, "block Block"), row(found, "lack of fit")
    assert (round(block["sum_of_squares"], 3), block["df"], round(block["f"], 4)) == (69.531, 1, 2611.0950)
    assert (round(lack["sum_of_squares"], 3), lack["df"], round(lack["p"], 4)) == (0.053, 3, 0.6851)
    assert (row(found, "pure error")["df"], row(found, "residual")["df"]) == (4, 7)
    assert round(found["r2"], 4) == 0.9981
    assert list(found["stationary_point"]["coded"].values()) == pytest.approx([0.3722954, 0.3343802], abs=1e-6)
    assert sorted(found["stationary_point"]["eigenvalues"]) == pytest.approx([-1.3186949, -0.9233027], abs=1e-6)


def test_three_blocks_of_a_box_behnken_design(tmp_path):
    frame = pd.read_csv(TABLES / "block_column_becomes_factor.csv")
    found = run(tmp_path, "bbd", "block_column_becomes_factor.csv", "--block", "Block", "--target", 42)
    means = frame.groupby("Block")["angle"].agg(["mean", "size"])
    by_hand = float(np.sum(means["size"] * (means["mean"] - frame["angle"].mean()) ** 2))
    assert row(found, "block Block")["sum_of_squares"] == pytest.approx(by_hand)
    assert row(found, "block Block")["df"] == 2
    parts = ("block Block", "model", "residual")
    assert sum(row(found, part)["sum_of_squares"] for part in parts) == pytest.approx(
        row(found, "total")["sum_of_squares"]
    )
    assert set(found["effects"]) & {"A", "B", "C", "D"} and "Block" not in found["optimum"]["physical"]
    corners = frame[["A", "B", "C", "D"]].to_numpy()
    effect = corners[:, 0] @ frame["angle"] / np.sum(corners[:, 0] ** 2)  # A is orthogonal to blocks and all terms
    assert found["coefficients"]["A"] == pytest.approx(effect)


@pytest.mark.parametrize("options", [(), ("--ignore", "Step")])
def test_a_step_column_on_the_path(tmp_path, options):
    runs = TABLES / "path_with_step_column.csv"
    found = run(tmp_path, "pb", "yield_screening.csv", "--climb-runs", runs, *options)["turning"]
    assert found["centre"] == {"Time": 85, "Temperature": 175} and found["turned"] and found["point"] == 10


def test_the_command_after_the_runs_of_a_path_carries_the_levels(tmp_path, capsys):
    """The best run of Montgomery's path is at 85 minutes and 175 F, a step is 5 minutes and 2 F; the command can be run."""
    run(tmp_path, "pb", "yield_screening.csv", "--climb-runs", TABLES / "path_with_step_column.csv")
    command = capsys.readouterr().out.split("next: pellet-study ")[1].splitlines()[0]
    assert "Time=80,90" in command and "Temperature=173,177" in command and "LOW" not in command
    assert main([*shlex.split(command), "--output", str(tmp_path / "design.csv")]) == 0


def test_an_error_column_on_the_path(tmp_path, capsys):
    """A path with the yield and its distance from 71: the yield is best at the top, the error at run 8."""
    frame = pd.read_csv(TABLES / "path_with_step_column.csv").assign(error=lambda f: (f["Yield"] - 71).abs())
    frame.to_csv(tmp_path / "path.csv", index=False)
    found = run(tmp_path, "pb", "yield_screening.csv", "--climb-runs", tmp_path / "path.csv")["turning"]
    assert found["centre"]["Time"] == 85 and "error left out" in capsys.readouterr().err
    found = run(tmp_path, "pb", "yield_screening.csv", "--climb-runs", tmp_path / "path.csv", "--lowest")["turning"]
    assert found["centre"]["Time"] == 75


def test_replicates_on_the_path_are_averaged(tmp_path, capsys):
    runs = TABLES / "path_with_replicates.csv"
    found = run(tmp_path, "pb", "powder_screening.csv", "--climb-runs", runs, "--target", 41.69)["turning"]
    assert {f["name"]: (f["low"], f["high"]) for f in found["next_factors"]} == {
        "C": (0.3, 0.4), "G": (0.15, 0.25), "F": (0.24, 0.34),
    }  # fmt: skip
    assert "point 3 of 4 (mean of 2 runs)" in capsys.readouterr().out


def test_replicates_count_by_their_mean():
    runs = pd.DataFrame({"a": [1, 2, 2, 3, 4.0], "y": [1, 9, 1, 6, 2.0]})
    assert path_turning.turning(runs).centre == {"a": 3}


def test_box_cox_at_the_edge_of_its_search(tmp_path, capsys):
    """The profile's maximum is at 13.7, as a search to 20 finds."""
    found = run(tmp_path, "bbd", "boxcox_beyond_bound.csv")["box_cox"]
    assert found["power"] is None and found["beyond"] == 5
    assert "beyond 5: no power transformation helps" in capsys.readouterr().out
    table = read_design(TABLES / "boxcox_beyond_bound.csv", max_levels=5)
    assert table.factors[0].low == 6.3 and table.factors[1].high == 271


def test_significant_curvature_is_said(tmp_path, capsys):
    found = run(tmp_path, "pb", "strong_curvature.csv", "--climb", "gradient")
    frame = pd.read_csv(TABLES / "strong_curvature.csv")
    corners, centre = frame[frame["A"] != 0]["y"], frame[frame["A"] == 0]["y"]
    assert found["curvature"]["estimate"] == pytest.approx(centre.mean() - corners.mean())
    error = capsys.readouterr().err
    assert "curvature is significant" in error and "45.033" in error and "30.975" in error and "bbd --design" in error


def test_lack_of_fit_negative_predicted_r2_and_a_far_stationary_point_are_said(tmp_path, capsys):
    found = run(tmp_path, "bbd", "significant_lack_of_fit.csv")
    error = capsys.readouterr().err
    assert round(found["lack_of_fit_p"], 4) == 0.0240 and "lack of fit is significant (p 0.0240)" in error
    assert found["stationary_point"]["coded"]["H"] == pytest.approx(1.770525, abs=5e-7)
    assert "stationary point (minimum) lies outside the runs (H 7.541" in error
    assert found["r2_predicted"] < 0 and "mean of the other runs" in error


def test_a_mistyped_level_is_named(tmp_path, capsys):
    run(tmp_path, "bbd", "typo_level_in_bbd.csv", status=2)
    error = capsys.readouterr().err
    assert "'Temperature', row 4" in error and "15 is a level of that run alone" in error and "150, 175, 200" in error


@pytest.mark.parametrize("table", ["coded_ccd_rescaled.csv", "decimal_comma.csv", "chinese_header.csv"])
def test_a_composite_is_coded_by_its_cube_as_published(tmp_path, table):
    """The one textbook table, coded, in a European and in a Chinese spreadsheet's hand."""
    found = run(tmp_path, "bbd", table)
    published = [79.94, 0.995, 0.515, 0.25, -1.376, -1.001]
    assert [round(value, 3) for value in found["coefficients"].values()] == published
    assert [round(x, 3) for x in found["stationary_point"]["coded"].values()] == [0.389, 0.306]
    assert round(found["stationary_point"]["predicted"], 2) == 80.21


def test_a_filled_table_is_not_overwritten(tmp_path, capsys):
    path = tmp_path / "filled.csv"
    path.write_bytes((TABLES / "filled_table.csv").read_bytes())
    words = ["bbd", "--design", "A=1,2", "B=1,2", "C=1,2", "--output", str(path)]
    assert main(words) == 2 and "--force" in capsys.readouterr().err
    assert path.read_bytes() == (TABLES / "filled_table.csv").read_bytes()
    assert main([*words, "--force"]) == 0 and "41.2" not in path.read_text()


# ------------------------------------------------------------------------------------------------- hints, dummies
def hint(capsys) -> list[str]:
    said = capsys.readouterr().out.split("next: pellet-study ")
    return shlex.split(said[1]) if len(said) > 1 else []


def test_dummies_estimate_noise(tmp_path, capsys):
    frame = pd.read_csv(TABLES / "dummies_in_hint.csv")
    dummies = frame[[f"dummy {i}" for i in range(1, 5)]].to_numpy()
    error = np.sqrt(np.mean((dummies.T @ frame["y"] / 6) ** 2))  # of an effect, 4 degrees of freedom
    found = run(tmp_path, "pb", "dummies_in_hint.csv")
    assert list(found["effects"]) == list("ABCDEFG") and round(found["effects"]["F"], 3) == 0.915
    assert 2 * found["standard_errors"]["F"] == pytest.approx(error)
    assert "dummy" not in " ".join(hint(capsys))
    assert "dummy 1" in run(tmp_path, "pb", "dummies_in_hint.csv", "--factor", "dummy 1=-1,1")["effects"]


def test_a_hint_names_clear_factors_quoted(tmp_path, capsys):
    run(tmp_path, "pb", "block_in_hint.csv", status=2)
    assert "'blk'" in capsys.readouterr().err
    found = run(tmp_path, "pb", "block_in_hint.csv", "--block", "blk")
    names = [word.split("=")[0] for word in hint(capsys)[2:] if "=" in word]
    assert names and all(found["p"][name] < 0.05 for name in names) and "blk" not in names


def test_a_hint_can_be_followed(tmp_path, capsys):
    run(tmp_path, "bbd", "two_blocks.csv", "--block", "Block", "--factor", "Time=80,90")
    words = hint(capsys)
    assert main([word.replace("VALUE", "81") for word in words]) == 0


def test_bookkeeping_of_minitab_and_pandas(tmp_path, capsys):
    found = run(tmp_path, "pb", "minitab_export.csv")
    assert found["left_out"] == ["StdOrder", "RunOrder", "PtType", "Blocks"]
    assert {name: round(effect, 3) for name, effect in found["effects"].items()} == {
        "A": 0.326, "B": 0.294, "C": -0.246, "D": -0.516, "E": 0.150, "F": 0.915, "G": 0.183,
    }  # fmt: skip
    assert capsys.readouterr().err.count("no factors, left out") == 1
    assert run(tmp_path, "bbd", "pandas_export.csv")["coefficients"]["AC"] == pytest.approx(11)


# ------------------------------------------------------------------------------------------- levels of intervals
def test_every_interval_has_its_level_and_a_reduced_model_says_what_its_p_values_follow(tmp_path, capsys):
    options = ("--predict", "A=0,B=0,C=0", "--target", 60, "--alpha", 0.1, "--reduce", 0.1)
    found = run(tmp_path, "bbd", "pandas_export.csv", *options)
    whole = capsys.readouterr().out
    said = whole.split("\nresults:")[0].replace("p values and intervals follow", "")
    assert re.findall(r"interval", said) and not re.findall(
        r"(?<!% )(?<!% confidence )(?<!% prediction )interval", said
    )
    assert "90 % confidence interval" in said and "follow that selection" in whole
    assert found["reduced"]["p_follow_selection"] and found["prediction"]["level"] == pytest.approx(0.9)


# -------------------------------------------------------------------------------------------------------- figures
def drawn(table, max_levels):
    found = read_design(TABLES / table, max_levels=max_levels)
    if max_levels > 3:
        surface = box_behnken.analyse(found)
        return [figures.surface_contours(surface, None, "%"), figures.predicted_observed(surface, "%")]
    screening = plackett_burman.analyse(found)
    names = found.names[::3]
    climb = steepest_climb.path(*steepest_climb.first_order_model(screening, names))
    noise = screening.noise_contrasts
    return [
        figures.pareto(screening, "°"),
        figures.half_normal(screening.effects, screening.lenth, "°", noise, found.names),
        figures.climb_path(climb, "°", None, found.names),
    ]


@pytest.mark.parametrize(("table", "max_levels"), [("chinese_header.csv", 5), ("long_names.csv", 3)])
def test_figures_have_no_missing_letter_and_nothing_outside(table, max_levels):
    from matplotlib.text import Text

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for figure in drawn(table, max_levels):
            figure.canvas.draw()
            for text in figure.findobj(Text):
                if text.get_visible() and re.search(r"[^\d\s.,\u2212-]", text.get_text()):  # ticks may stand beyond
                    assert text.get_text().count("%") <= 1
                    place = text.get_window_extent()
                    assert place.x0 >= -1 and place.y0 >= -1, text.get_text()
                    assert place.x1 <= figure.bbox.width + 1 and place.y1 <= figure.bbox.height + 1, text.get_text()


def test_names_that_no_font_has_are_said_in_words(monkeypatch):
    monkeypatch.setattr(labels.fonts, "missing", lambda text: "".join(x for x in text if x > "\u3000"))
    names, response = ["时间/min", "A", "温度"], "产率/%"
    shown = labels.drawable(names, response)
    assert [shown(name) for name in names] == ["factor 1 (min)", "A", "factor 3"] and shown(response) == "response (%)"
    assert shown("时间/min*温度^2") == "factor 1 (min)*factor 3^2"
    assert "时间/min" in labels.degraded(names, response)[0] and not labels.degraded(["A"], "y")


def test_a_font_that_has_the_letters_is_used(tmp_path):
    from fontTools.fontBuilder import FontBuilder
    from fontTools.pens.ttGlyphPen import TTGlyphPen
    from matplotlib.font_manager import fontManager

    pen = TTGlyphPen(None)
    pen.moveTo((0, 0)), pen.lineTo((0, 700)), pen.lineTo((500, 700)), pen.closePath()
    builder = FontBuilder(1000)
    builder.setupGlyphOrder([".notdef", "box"])
    builder.setupCharacterMap({ord(letter): "box" for letter in "时间温度产率"})
    builder.setupGlyf({".notdef": pen.glyph(), "box": pen.glyph()})
    builder.setupHorizontalMetrics({".notdef": (600, 0), "box": (600, 0)})
    builder.setupHorizontalHeader(ascent=800, descent=-200)
    builder.setupNameTable({"familyName": "Noto Sans CJK SC", "styleName": "Regular"})
    builder.setupOS2(), builder.setupPost()
    builder.save(tmp_path / "some.ttf")
    caches, before = (labels.fonts.families, labels.fonts._faces, labels.fonts._has), list(fontManager.ttflist)
    try:
        fontManager.addfont(tmp_path / "some.ttf")
        for cache in caches:
            cache.cache_clear()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            first, second = drawn("chinese_header.csv", 5)
            first.canvas.draw(), second.canvas.draw()
        assert first.axes[0].get_xlabel() == "时间/min" and second.axes[0].get_xlabel() == "observed 产率/%"
        assert not labels.degraded(["时间/min"], "产率/%")
    finally:
        fontManager.ttflist[:] = before
        for cache in caches:
            cache.cache_clear()


def with_a_typing_error(frame, place, factor=10.0):
    response = frame.columns[-1]
    frame.loc[place, response] *= factor
    return frame


def made_surface(seed=3):
    """A quadratic surface about 50 with noise of 0.1 on Box and Behnken's design of three factors."""
    coded = box_behnken.coded_matrix(3, 5)
    a, b, c = coded.T
    y = 50 + 4 * a - 3 * b + 2 * c + a * b - 2 * a**2 + 0.1 * np.random.default_rng(seed).normal(size=len(coded))
    return pd.DataFrame(coded, columns=list("ABC")).assign(y=y.round(2))


@pytest.mark.parametrize("option", [(), ("--reduce",), ("--select",)])
def test_a_typing_error_in_a_surface_is_named_by_its_row(tmp_path, capsys, option):
    with_a_typing_error(made_surface(), 4).to_csv(tmp_path / "t.csv", index=False)
    found = run(tmp_path, "bbd", tmp_path / "t.csv", *option)
    told = [line.split("warning: ")[1] for line in capsys.readouterr().err.splitlines() if "warning: " in line]
    assert found["suspect_runs"][0]["row"] == 6  # line 1 is the header
    antipode = [suspect["row"] for suspect in found["suspect_runs"][1:]]
    assert antipode == [9]  # in this design the full model fits a run and its opposite in the same group alike
    assert told[0].startswith("row 6: R-student") and "before anything else" in told[0]
    costly = [word for word in told[1:] if "lack of fit" in word or "predicted R2" in word]
    assert costly and all(word.startswith("check rows 6, 9 first") for word in costly)
    if option:
        assert any(word.startswith("before the reduced model is used, row 6") for word in told)


def test_a_typing_error_in_a_screening_is_named_by_its_row(tmp_path, capsys):
    coded = screening_designs.coded_matrix(5, 12, 3)
    y = 50 + coded @ [5, -3, 2, 0, 0] + 0.1 * np.random.default_rng(5).normal(size=len(coded))
    frame = pd.DataFrame(coded, columns=list("ABCDE")).assign(y=y.round(2))
    frame.to_csv(tmp_path / "right.csv", index=False)
    assert run(tmp_path, "pb", tmp_path / "right.csv")["suspect_runs"] == []
    capsys.readouterr()
    with_a_typing_error(frame, 7, 0.1).to_csv(tmp_path / "wrong.csv", index=False)
    assert [suspect["row"] for suspect in run(tmp_path, "pb", tmp_path / "wrong.csv")["suspect_runs"]] == [9]
    assert "row 9: R-student" in capsys.readouterr().err


def test_runs_without_an_error_are_suspected_no_more_often_than_the_level_says():
    """500 tables of normal noise: one in twenty at most has a run beyond Bonferroni's bound (0.05 + 3 standard errors)."""
    coded, noise = box_behnken.coded_matrix(3, 5), np.random.default_rng(11)
    terms = quadratic_terms(list("ABC"))
    hits = [
        bool(linear_model.fit(list("ABC"), terms, coded, 9 + noise.normal(size=len(coded))).suspects(0.05))
        for _ in range(500)
    ]
    assert 0.01 < np.mean(hits) < 0.05 + 3 * np.sqrt(0.05 * 0.95 / 500)


def composite_frame():
    """Myers, Montgomery and Anderson-Cook's chemical process: time and temperature, a composite rotatable in two factors."""
    coded = composite.composite_matrix(2, "rotatable", 5)[0]
    y = 80 + coded[:, 0] - coded[:, 0] ** 2 - coded[:, 1] ** 2 + np.linspace(-0.1, 0.1, len(coded))
    return pd.DataFrame({"Time": (85 + 5 * coded[:, 0]).round(2), "Temp": (175 + 5 * coded[:, 1]).round(2), "y": y})


def test_a_slip_in_an_axial_level_is_named(tmp_path, capsys):
    frame = composite_frame()
    place = int(np.flatnonzero(frame["Time"] == 92.07)[0])
    frame.loc[place, "Time"] = 97.02
    frame.to_csv(tmp_path / "t.csv", index=False)
    run(tmp_path, "bbd", tmp_path / "t.csv")
    assert f"column 'Time', row {place + 2}: 97.02 where 92.07 is expected" in capsys.readouterr().err


def test_a_slip_in_a_centre_run_is_named(tmp_path, capsys):
    frame = composite_frame()
    frame.loc[10, "Temp"] = 157.0  # row 12, a centre run
    frame.to_csv(tmp_path / "t.csv", index=False)
    run(tmp_path, "bbd", tmp_path / "t.csv", status=2)
    told = capsys.readouterr().err
    assert "column 'Temp', row 12" in told and "157 is a level of that run alone" in told and "'Temp=157" not in told


def test_a_slip_in_a_centre_run_of_three_levels_is_named(tmp_path, capsys):
    frame = made_surface().assign(A=lambda f: 175 + 5 * f["A"])
    frame.loc[14, "A"] = 157.0
    frame.to_csv(tmp_path / "t.csv", index=False)
    run(tmp_path, "bbd", tmp_path / "t.csv", status=2)
    told = capsys.readouterr().err
    assert "column 'A', row 16" in told and "157 is a level of that run alone" in told and "'A=157" not in told


def test_a_path_says_where_the_factors_it_does_not_move_are_held(tmp_path, capsys):
    coded = screening_designs.coded_matrix(4, 12, 3)
    frame = pd.DataFrame(coded * [10, 5, 2, 1] + [50, 20, 8, 3], columns=["T", "t", "ratio", "pH"])
    y = coded @ [5, 3, 0, 0] + 0.1 * np.random.default_rng(2).normal(size=len(coded))
    frame.assign(y=y).to_csv(tmp_path / "t.csv", index=False)
    run(tmp_path, "pb", tmp_path / "t.csv", "--climb", "gradient", "--climb-factors", "T,t")
    assert "at the middle of their range: ratio 8, pH 3" in capsys.readouterr().out


def test_a_full_factorial_is_not_called_a_plackett_burman_design(tmp_path, capsys):
    run(tmp_path, "pb", "yield_screening.csv")  # 2^2 with five centre runs
    assert "Full factorial: 9 runs, 2 factors" in capsys.readouterr().out


def test_the_warning_of_a_missing_font_comes_once_for_all_responses(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(labels.fonts, "missing", lambda text: "\u6e29" in text)
    frame = made_surface().rename(columns={"A": "\u6e29"})
    frame.assign(z=frame["y"] ** 2).to_csv(tmp_path / "t.csv", index=False)
    run(tmp_path, "bbd", tmp_path / "t.csv", "--response", "y", "z", "--figures", tmp_path / "f")
    assert capsys.readouterr().err.count("no installed font") == 1


def test_runs_of_a_maximised_response_are_validated_at_the_setting_they_count_for(tmp_path, capsys):
    """y = 80 + x1 - x1^2 - x2^2: at (0.5, 0) it is 80.25, far above the limit of 79; 70 is no run of it."""
    composite_frame().to_csv(tmp_path / "t.csv", index=False)
    goal, runs = ("--maximise", "y=79,80.2"), ("--verify", "80.2,80.3,80.25")
    found = run(tmp_path, "bbd", tmp_path / "t.csv", *goal, *runs)
    assert found["validation"]["shown"] and found["validation"]["inside"] == 3
    assert found["validated_at"] == found["joint"]["physical"]
    assert "mean at least 79" in capsys.readouterr().out
    found = run(tmp_path, "bbd", tmp_path / "t.csv", *goal, *runs, "--at", "Time=80,Temp=170")
    assert found["validated_at"] == {"Time": 80, "Temp": 170} and found["validation"]["inside"] == 0
    run(tmp_path, "bbd", tmp_path / "t.csv", *goal, *runs, "--at", "Time=80", status=2)
    run(tmp_path, "bbd", tmp_path / "t.csv", *goal, "--at", "Time=80,Temp=170", status=2)
