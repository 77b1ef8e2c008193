"""The commands `pb` and `bbd`: JSON keys, what they print, designs made and read back, what they import."""

import json
import subprocess
import sys

import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.paper.printed import table

KEYS = {
    "effects",
    "anova",
    "coefficients",
    "r2",
    "r2_adjusted",
    "r2_predicted",
    "cv_percent",
    "lack_of_fit_p",
}


@pytest.fixture
def screening_csv(tmp_path):
    path = tmp_path / "screening.csv"
    table(7).drop(columns="No.").to_csv(path, index=False)
    return path


@pytest.fixture
def surface_csv(tmp_path):
    path = tmp_path / "surface.csv"
    table(12).drop(columns="No.").to_csv(path, index=False)
    return path


def run(*words, tmp_path, status=0):
    path = tmp_path / "answer.json"
    assert main([*map(str, words), "--json", str(path)]) == status
    return json.loads(path.read_text(), parse_constant=lambda name: pytest.fail(f"{name} in the JSON"))


def test_pb_answers_with_the_contracted_keys(screening_csv, tmp_path, capsys):
    answer = run("pb", screening_csv, tmp_path=tmp_path)
    assert KEYS <= set(answer)
    assert round(answer["effects"]["G"], 2) == 7.48
    assert round(answer["coefficients"]["1"], 2) == 40.75
    assert answer["lack_of_fit_p"] is None
    assert round(answer["cv_percent"], 2) == round(100 * 3.9043833**0.5 / 40.98, 2)
    text = capsys.readouterr()
    assert "0.0474" in text.out and "Lenth" in text.out and "aliases" in text.out and "curvature" in text.out
    assert "lack of fit cannot be tested" in text.err


def test_bbd_answers_with_the_contracted_keys(surface_csv, tmp_path, capsys):
    answer = run("bbd", surface_csv, tmp_path=tmp_path)
    assert KEYS <= set(answer)
    assert list(answer["coefficients"]) == ["1", "B", "C", "G", "BC", "BG", "CG", "B2", "C2", "G2"]
    assert round(answer["r2_predicted"], 4) == 0.7916
    assert round(answer["lack_of_fit_p"], 4) == 0.1190
    assert "lack of fit" in capsys.readouterr().out


def test_physical_units_byte_order_mark_and_crlf_give_the_same_answer(surface_csv, tmp_path, capsys):
    frame = pd.read_csv(surface_csv)
    frame["B"] = 0.86 - 0.04 * frame["B"]
    frame["C"] = 0.29 + 0.04 * frame["C"]
    other = tmp_path / "physical.csv"
    other.write_bytes(b"\xef\xbb\xbf" + frame.to_csv(index=False, lineterminator="\r\n").encode())
    first = run("bbd", surface_csv, tmp_path=tmp_path)
    second = run("bbd", other, "--factor", "B=0.90,0.82", tmp_path=tmp_path)
    assert second["coefficients"] == pytest.approx(first["coefficients"])
    turned = run("bbd", other, tmp_path=tmp_path)
    assert turned["coefficients"]["B"] == pytest.approx(-first["coefficients"]["B"])
    assert turned["coefficients_physical"] == pytest.approx(second["coefficients_physical"])


def test_a_failed_run_is_named_and_the_loss_stated(screening_csv, tmp_path, capsys):
    lines = screening_csv.read_text().splitlines()
    lines[3] = lines[3].rsplit(",", 1)[0] + ","
    screening_csv.write_text("\n".join(lines))
    answer = run("pb", screening_csv, tmp_path=tmp_path)
    error = capsys.readouterr().err
    assert "row 4 has no" in error and "not orthogonal" in error and "% larger" in error
    assert answer["runs"] == 12 and not answer["orthogonal"]


def test_a_saturated_design_says_so_and_has_no_p_values(tmp_path, capsys):
    assert main(["pb", "--design", *[f"{n}=0,1" for n in "ABCDEFGHIJK"], "--output", str(tmp_path / "d.csv")]) == 0
    frame = pd.read_csv(tmp_path / "d.csv")
    frame["response"] = [40.1, 47, 42, 39, 51, 44, 45, 38, 49, 43, 46, 41]
    frame.to_csv(tmp_path / "d.csv", index=False)
    answer = run("pb", tmp_path / "d.csv", tmp_path=tmp_path)
    assert answer["saturated"] and set(answer["p"].values()) == {None} and answer["lenth"]["contrasts"] == 11
    assert "saturated" in capsys.readouterr().err


def test_climb_equal_steps_and_reading_the_papers_runs_back(screening_csv, tmp_path, capsys):
    runs = tmp_path / "climb.csv"
    table(10).drop(columns="No.").to_csv(runs, index=False)
    levels = ["--factor", "B=0.7,0.9", "--factor", "C=0.25,0.45", "--factor", "G=0.1,0.3,J/m2"]
    answer = run(
        "pb",
        screening_csv,
        *levels,
        "--climb",
        "equal",
        "--climb-start",
        "worst",
        "--climb-runs",
        runs,
        "--lowest",
        tmp_path=tmp_path,
    )
    assert [point["B"] for point in answer["climb"]["points"]] == pytest.approx([0.9, 0.86, 0.82, 0.78, 0.74, 0.7])
    assert answer["turning"]["centre"] == {"B": 0.86, "C": 0.29, "G": 0.14}
    assert "the path turned at run 2 of 6" in capsys.readouterr().out


def test_target_reduction_prediction_and_extrapolation_warning(surface_csv, tmp_path, capsys):
    answer = run(
        "bbd",
        surface_csv,
        "--factor",
        "B=0.9,0.82",
        "--factor",
        "C=0.25,0.33",
        "--factor",
        "G=0.1,0.18",
        "--target",
        41.69,
        "--uncertainty",
        0.79,
        "--predict",
        "B=0.9,C=0.33,G=0.18",
        tmp_path=tmp_path,
    )
    captured = capsys.readouterr()
    assert round(100 * answer["optimum"]["fraction_of_box"]) == 27
    assert answer["optimum"]["unidentified"] == ["B"]
    assert answer["prediction"]["extrapolation"] and "extrapolation" in captured.err
    assert "not at one point" in captured.out and "second response" in captured.out
    reduced = run("bbd", surface_csv, "--reduce", tmp_path=tmp_path)["reduced"]
    assert reduced["dropped"] == ["BC"] and "BC" not in reduced["coefficients"]


def test_validation_needs_a_margin_declared_before(surface_csv, tmp_path, capsys):
    words = [
        "bbd",
        surface_csv,
        "--target",
        41.69,
        "--uncertainty",
        0.79,
        "--target-n",
        5,
        "--verify",
        "41.1,41.5,40.9,41.6,41.2",
    ]
    assert main(list(map(str, words))) == 2
    assert "no margin was declared" in capsys.readouterr().err
    assert main(["bbd", str(surface_csv), "--declare-margin", "1.5"]) == 0
    answer = run(*words, tmp_path=tmp_path)
    assert answer["validation"]["margin"] == 1.5 and answer["validation"]["equivalent"]


def test_figures_are_written_only_when_asked(screening_csv, surface_csv, tmp_path, capsys):
    folder = tmp_path / "figures"
    run("pb", screening_csv, "--climb", "gradient", "--figures", folder, tmp_path=tmp_path)
    run("bbd", surface_csv, "--figures", folder, tmp_path=tmp_path)
    names = {path.name for path in folder.glob("*.png")}
    assert names == {
        "pareto.png",
        "half_normal.png",
        "climb.png",
        "interactions.png",
        "residuals.png",
        "screening_interactions.png",
        "screening_residuals.png",
        "perturbation.png",
        "surface_3d.png",
        "response_surface.png",
        "predicted_observed.png",
    }


def test_central_composite_tables_and_long_names(tmp_path, capsys):
    path = tmp_path / "ccf.csv"
    assert (
        main(
            [
                "bbd",
                "--design",
                "time=10,20",
                "heat=150,160",
                "--face-centred",
                "--centre",
                "4",
                "--seed",
                "1",
                "--output",
                str(path),
            ]
        )
        == 0
    )
    frame = pd.read_csv(path)
    t, h = (frame["time"] - 15) / 5, (frame["heat"] - 155) / 5
    frame["response"] = 60 + 3 * t - 2 * h + t * h - 4 * t**2 + [0.1, -0.1] * (len(frame) // 2)
    frame.to_csv(path, index=False)
    answer = run("bbd", path, tmp_path=tmp_path)
    assert {"time*heat", "time^2", "heat^2"} < set(answer["coefficients"])
    assert answer["coefficients"]["time"] == pytest.approx(3, abs=0.1)
    rotatable = frame.assign(time=frame["time"].where(abs(t) + abs(h) > 1, 15 + 7.07 * t))
    rotatable.to_csv(path, index=False)
    assert "time" in run("bbd", path, "--factor", "time=10,20", tmp_path=tmp_path)["coefficients"]


@pytest.mark.parametrize("command", ["pb", "bbd", "audit"])
def test_help_has_an_example(command, capsys):
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    assert f"pellet-study {command}" in capsys.readouterr().out.split("examples:")[1]


@pytest.mark.parametrize("command", ["pb", "bbd"])
def test_the_commands_import_no_plots_no_design_library_and_not_all_of_statsmodels(command, screening_csv, surface_csv):
    path = screening_csv if command == "pb" else surface_csv
    code = (
        "import sys; from pellet_study.__main__ import main; "
        f"main(['{command}', {str(path)!r}]); "
        "slow = ('matplotlib', 'pyDOE3', 'statsmodels.api', 'statsmodels.formula.api'); "
        "loaded = [m for m in slow if m in sys.modules]; "
        "sys.exit(repr(loaded) if loaded else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_a_saturated_quadratic_is_judged_by_lenth_and_half_normal(tmp_path, capsys):
    path = tmp_path / "saturated.csv"
    runs = ["-1,-1,3.1", "1,-1,5.2", "-1,1,4.4", "1,1,9.1", "0,1,7.7", "1,0,6.9"]
    path.write_text("A,B,y\n" + "\n".join(runs) + "\n")
    answer = run("bbd", path, "--figures", tmp_path / "figures", tmp_path=tmp_path)
    captured = capsys.readouterr()
    assert answer["saturated"] and set(answer["p"].values()) == {None}
    assert "saturated" in captured.err and "Lenth, 5 coefficients" in captured.out
    assert (tmp_path / "figures" / "half_normal.png").exists()


def test_a_place_that_cannot_be_written_to(screening_csv, tmp_path, capsys):
    assert main(["pb", str(screening_csv), "--figures", str(screening_csv)]) == 2
    assert main(["pb", "--design", "A=0,1", "B=0,1", "--output", str(tmp_path / "no" / "design.csv")]) == 2
    assert capsys.readouterr().err.count("cannot write") == 2
