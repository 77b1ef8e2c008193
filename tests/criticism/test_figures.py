"""What is drawn is what the numbers say: readings, bars, curves, ties and held-out rows, read back from the figure."""

import copy
import math
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex
from PIL import Image

import pellet_study as ps
from pellet_study.api.answers import Refinement
from pellet_study.api.figures import draw_all
from pellet_study.criticism import curves, figures, verdict_facts
from pellet_study.criticism.answers import noise_floor
from pellet_study.criticism.calibration import fit_study
from pellet_study.criticism.compare import compare
from pellet_study.errors import InputError
from pellet_study.output import style
from pellet_study.study.measurements import Measurement
from tests.helpers.make_study import command
from tests.helpers.make_study import slip_angle_deg as slip_deg
from tests.helpers.pictures import assert_readable

TOML = """title = "slipping layers"
measurements = "measurements.csv"
[parameters]
internal_friction = { value = 0.5, min = 0.1, max = 1.2 }
"""


def study_of(folder: Path, rows: list[str]) -> ps.Study:
    folder.mkdir()
    (folder / "study.toml").write_text(TOML)
    head = "rig,observable,value,sd,n,split,layer_height_mm,particle_diameter_mm,normal_stress_pa\n"
    (folder / "measurements.csv").write_text(head + "".join(row + "\n" for row in rows))
    return ps.load_study(folder)


def layers(mu: float, c: float, heights, seed: int, sd=1.0, held=(), diameter="1", n=5) -> list[str]:
    rng = np.random.default_rng(seed)
    return [
        f"layer_on_incline,slip_angle_deg,{slip_deg(h, mu, c) + rng.normal() * sd / math.sqrt(n):.6g},{sd},{n},"
        f"{'holdout' if h in held else 'fit'},{h},{diameter},"
        for h in heights
    ]


@pytest.fixture(scope="module")
def tied(tmp_path_factory):
    """Cohesion over a short range of heights: other effects do as well."""
    rows = layers(0.5, 15.0, (10, 15, 20, 25, 30, 12, 40), 1, held=(12, 40))
    found = ps.refine(study_of(tmp_path_factory.mktemp("figures") / "tie", rows))
    assert found.verdict == "tied" and len(found.tied) > 1
    return found


@pytest.fixture(scope="module")
def two_rigs(tmp_path_factory):
    """Cohesion in two rigs, one with two diameters; some rows held out."""
    rows = layers(0.5, 80.0, (10, 15, 20, 30, 40), 2, 0.8, diameter="0.5")
    rows += layers(0.5, 80.0, (10, 15, 20, 30, 40, 60), 3, 0.8, held=(60,), diameter="1")
    rng = np.random.default_rng(4)
    rows += [
        f"shear_cell,shear_stress_pa,{0.5 * s + 80 + rng.normal() * 10:.6g},17.3,3,{'holdout' if s == 3000 else 'fit'},,,{s}"
        for s in (500, 1000, 2000, 3000, 4000)
    ]
    return ps.refine(study_of(tmp_path_factory.mktemp("figures") / "two", rows))


def bars_of(axes) -> dict[str, list]:
    """{label in the legend of the caller: [(x, y, half a bar)]} of every series with bars, and its face colour."""
    found = {}
    for container in axes.containers:
        line, _, (segments,) = container.lines
        half = [(s[1][1] - s[0][1]) / 2 for s in segments.get_segments()]
        xy = zip(line.get_xdata(), line.get_ydata(), half, strict=True)
        found[matplotlib.colors.to_hex(line.get_markerfacecolor())] = list(xy)
    return found


def curves_of(axes) -> dict[str, tuple]:
    """{colour: (x, y)} of the models' curves."""
    bars = {line for container in axes.containers for line in [container.lines[0], *container.lines[1]]}
    return {to_hex(line.get_color()): line.get_data() for line in axes.lines if line not in bars}


def test_readings_bars_and_held_out_rows_are_those_of_the_table(two_rigs):
    figure = ps.draw(two_rigs, "readings")
    panels = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title(loc="left").split("\n")[0] for axes in panels] == ["layer_on_incline"] * 2 + ["shear_cell"]
    said = [axes.get_title(loc="left").replace("\N{NO-BREAK SPACE}", " ").replace("\n", " ") for axes in panels]
    assert "particle diameter 0.5 mm" in said[0] and "particle diameter 1 mm" in said[1] and "1400 kg/m³" in said[0]
    told = two_rigs.study.rows
    drawn = {"#000000": [], "#ffffff": []}
    for axes in panels:
        for face, points in bars_of(axes).items():
            drawn[face] += points
    for face, split in (("#000000", "fit"), ("#ffffff", "holdout")):
        of_table = [
            (row.conditions["layer_height_mm" if row.rig == "layer_on_incline" else "normal_stress_pa"], row.value,
             2 * row.sd / math.sqrt(row.n))
            for row in told if row.split == split
        ]  # fmt: skip
        assert np.allclose(sorted(drawn[face]), sorted(of_table), rtol=1e-6)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "base" in labels and "base + cohesion" in labels and any("held out" in text for text in labels)


def test_curves_are_the_closed_forms_of_the_fitted_models(two_rigs):
    figure = ps.draw(two_rigs, "readings")
    first, last = two_rigs.steps[0]["parameters"], two_rigs.steps[-1]["parameters"]
    base, found = style.BASE.colour, style.look_of(["cohesion"], two_rigs.study.acting()).colour
    drawn = curves_of(figure.axes[1])
    mu, c = last["internal_friction"], last["cohesion.cohesive_stress_pa"]
    x, y = drawn[to_hex(found)]
    assert min(x) == 10 and max(x) == 60 and len(x) > 20
    assert np.allclose(y, [slip_deg(h, mu, c) for h in x], atol=2e-3)
    assert np.allclose(drawn[to_hex(base)][1], math.degrees(math.atan(first["internal_friction"])), atol=1e-3)
    x, y = curves_of(figure.axes[2])[to_hex(found)]
    assert np.allclose(y, mu * np.array(x) + c, rtol=1e-5)


def test_a_tie_has_a_curve_and_a_colour_for_each_candidate_the_same_everywhere(tied):
    colours = {name: to_hex(style.look_of([name], tied.study.acting()).colour) for name in tied.tied}
    assert len(set(colours.values())) == len(tied.tied)
    drawn = curves_of(ps.draw(tied, "readings").axes[0])
    assert set(colours.values()) | {to_hex(style.BASE.colour)} == set(drawn)
    ranked = ps.draw(tied, "ranking").axes[0]
    names = [text.get_text().replace("\n", "") for text in ranked.get_yticklabels()]
    bars = [bar for bar in ranked.patches if bar.get_height() == pytest.approx(0.62)]
    faces = {name: to_hex(bar.get_facecolor()) for name, bar in zip(names, reversed(bars), strict=True)}
    assert {name: faces[name] for name in tied.tied} == colours
    assert len(set(faces) - set(tied.tied)) and not set(colours.values()) & {
        faces[name] for name in set(faces) - set(tied.tied)
    }
    lines = {line.get_label(): to_hex(line.get_color()) for line in ps.draw(tied, "constants").axes[0].lines}
    assert all(lines[f"with {name}"] == colours[name] for name in tied.tied)
    rivals = ps.draw(tied, "next_measurement").axes[0]
    named = [text.get_text().replace("\n", "") for text in rivals.get_yticklabels()]
    assert [to_hex(c.lines[0].get_color()) for c in rivals.containers] == [colours[name] for name in named]


def test_the_ladder_shows_what_each_tied_candidate_would_do_held_out_included(tied):
    figure = ps.draw(tied, "ladder")
    axes, last = figure.axes[0], tied.steps[-1]
    found = {}
    for line in axes.lines:
        x, y = line.get_data()
        if len(x) == 2 and y[0] in (last["rms_error"], last["holdout_rms_error"]) and x[1] >= len(tied.steps):
            found[int(x[1]), line.get_linestyle()] = y[1]
    assert len(found) == 2 * len(tied.tied)
    rows = tied.steps[-1]["rows"]
    for place, (name, curve) in enumerate(
        zip(tied.tied, tied.diagnoses[-1]["curves"], strict=True), start=len(tied.steps)
    ):
        (panel,) = curve["panels"]
        assert curve["effects"] == [name]
        for split, dash in (("fit", "-"), ("holdout", "--")):  # the error of the curve drawn in `readings`
            off = [r["value"] - np.interp(r["conditions"]["layer_height_mm"], panel["at"], panel["predicted"])
                   for r in rows if r["split"] == split]  # fmt: skip
            assert found[place, dash] == pytest.approx(np.sqrt(np.mean(np.square(off))), abs=0.01)
    names = [text.get_text().replace("\n", "") for text in axes.get_xticklabels()]
    assert names == ["base", *(f"+ {name}" for name in tied.tied)]
    assert figures.tied_errors({**tied.diagnoses[-1], "tied": []}) == []


def test_table_and_bars_agree_on_what_explains(tied):
    told = copy.deepcopy(tied.diagnoses[0])
    best = told["ranking"][0]
    far = {**best, "effect": "too_late", "chi2_drop": best["chi2_drop"] - 20, "explains": True}
    refused = {**best, "effect": "near", "chi2_drop": best["chi2_drop"] - 0.1, "explains": False}
    told["ranking"] += [far, refused]
    assert (
        verdict_facts.standing(told, far) == verdict_facts.EXPLAINS
        and verdict_facts.standing(told, refused) == verdict_facts.REFUSED
    )
    labels = [text.get_text() for text in figures.ranking(told).legends[0].get_texts()]
    assert verdict_facts.EXPLAINS in labels and verdict_facts.REFUSED in labels and "missing" not in labels
    pair = {**told, "tied": [[best["effect"], "cohesion"], ["near", "cohesion"]]}
    assert "together" in verdict_facts.standing(pair, refused)


def test_predictions_have_the_readings_bars(two_rigs):
    axes = ps.draw(two_rigs, "predictions").axes[1]
    rows = [r for r in two_rigs.steps[-1]["rows"] if r["rig"] == "shear_cell"]
    drawn = []
    for container in axes.containers:
        line, _, (segments,) = container.lines
        half = [(s[1][0] - s[0][0]) / 2 for s in segments.get_segments()]
        drawn += list(zip(line.get_xdata(), line.get_ydata(), half, strict=True))
    assert np.allclose(sorted(drawn), sorted((r["value"], r["predicted"], 2 * 17.3 / math.sqrt(3)) for r in rows))


def test_one_imprecise_row_does_not_rule_the_noise_floor(tmp_path):
    rows = layers(0.5, 15.0, (10, 15, 20, 25, 30, 35), 1, 0.5, n=1)
    usual = noise_floor(compare(study_of(tmp_path / "a", rows)))
    rows[2] = rows[2].replace(",0.5,1,fit", ",20,1,fit")
    assert usual == pytest.approx(0.5) and noise_floor(compare(study_of(tmp_path / "b", rows))) == pytest.approx(0.5)


def test_rows_without_a_common_setting_have_the_model_at_each_row(tmp_path):
    rng = np.random.default_rng(0)
    rows = [
        f"layer_on_incline,slip_angle_deg,{slip_deg(h, 0.5, 60) + 0.1 * rng.normal():.5g},0.5,3,fit,{h:.1f},{d:.2f},"
        for h, d in zip(rng.uniform(10, 50, 9), rng.uniform(0.3, 1.5, 9), strict=True)
    ]
    found = ps.compare(study_of(tmp_path / "s", rows))
    (panel,) = found.curves[0]["panels"]
    assert panel["condition"] == "layer_height_mm" and panel["drawn"] == curves.ROWS
    line = ps.draw(found, "readings").axes[0].lines[0]
    assert np.allclose(line.get_ydata(), [r["predicted"] for r in found.rows])
    assert np.allclose(line.get_xdata(), [r["conditions"]["layer_height_mm"] for r in found.rows])


def test_where_the_first_condition_has_no_curves_the_next_one_has():
    """Lengths with another ball each: no two rows differ in the length only, but three of each length in the amplitude."""
    settings = [
        (length, ball, swing) for length, ball in ((200, 30), (400, 20), (800, 10), (1500, 5)) for swing in (5, 25, 50)
    ]
    rows = [
        Measurement(
            "pendulum", "period_s", length / 100 + swing / 1000, None, 1,
            {"length_mm": float(length), "radius_mm": float(ball), "amplitude_deg": float(swing)}, {}, "", 0.0, "fit", "", k,
        )
        for k, (length, ball, swing) in enumerate(settings)
    ]  # fmt: skip
    panels = curves.panels_of(rows)
    assert [panel.condition for panel in panels] == 4 * ["amplitude_deg"] and all(panel.alike for panel in panels)
    assert [panel.others["length_mm"] for panel in panels] == [200, 400, 800, 1500]


def test_compare_draws_the_base_model_beside_the_effects_present(tmp_path):
    study = study_of(tmp_path / "s", layers(0.5, 80.0, (10, 15, 20, 30, 40), 2))
    alone = ps.compare(study)
    added = ps.add(study, "cohesion")
    both = ps.compare(added.study)
    assert [c["effects"] for c in both.curves] == [[], ["cohesion"]] and both.curves[0] == alone.curves[0]
    assert {to_hex(style.BASE.colour)} < set(curves_of(ps.draw(added, "readings").axes[0]))


@pytest.mark.parametrize("ending", style.FORMATS)
def test_format_and_width_are_those_asked_for(tmp_path, ending):
    study = study_of(tmp_path / "s", layers(0.5, 80.0, (10, 15, 20, 30, 40), 2))
    options = ("--figures", tmp_path / "paper", "--format", ending, "--width", "single")
    status, _ = command("refine", study.folder, *options, json_file=tmp_path / "a.json")
    files = sorted((tmp_path / "paper").iterdir())
    assert status == 0 and {f.suffix for f in files} == {f".{ending}"}
    assert {"readings", "ladder", "predictions", "residuals", "ranking"} <= {f.stem for f in files}
    for file in files:
        assert width_mm(file) == pytest.approx(85, abs=0.1), file
    assert command("compare", study.folder, *options)[0] == 0  # what it drew itself, it draws anew


def width_mm(file: Path) -> float:
    """The width a file says it has when it is placed on a page."""
    if file.suffix == ".png":
        with Image.open(file) as image:
            return image.width / image.info["dpi"][0] * 25.4
    text = file.read_bytes().decode("latin-1")
    if file.suffix == ".svg":
        return float(text.split('width="')[1].split("pt")[0]) / 72 * 25.4
    return float(text.split("/MediaBox [ 0 0 ")[1].split()[0]) / 72 * 25.4


def test_a_width_that_no_page_has_is_refused_before_anything_is_done(tmp_path, capsys):
    study = study_of(tmp_path / "s", layers(0.5, 80.0, (10, 15, 20), 2)).folder
    assert ps.__version__ and command("compare", study, "--figures", "--width", "8.5")[0] == 2
    assert "40 to 400 mm" in capsys.readouterr().err and not (study / "compare.json").exists()
    assert command("compare", study, "--format", "pdf")[0] == 2
    with pytest.raises(InputError, match="40 to 400"), style.column(1000):
        pass


@pytest.mark.parametrize("width", (None, 85.0, 175.0))
def test_no_name_is_clipped_and_no_label_touches(tied, two_rigs, width):
    for answer in (tied, two_rigs):
        for name, figure in draw_all(answer, width).items():
            if width:
                assert figure.get_figwidth() * 25.4 == pytest.approx(width), name
            assert_readable(figure)


LONG = "a_very_long_name_of_an_effect_that_somebody_gave"


@pytest.mark.filterwarnings("ignore:Glyph")  # where no font has the letters, boxes stand for them
@pytest.mark.parametrize("width", (None, 85.0))
@pytest.mark.parametrize("name", (LONG, "长名称效应" * 5))
def test_long_and_chinese_names_are_folded(tied, width, name):
    def renamed(part):
        if isinstance(part, dict):
            return {renamed(k): renamed(v) for k, v in part.items()}
        if isinstance(part, list):
            return [renamed(v) for v in part]
        for old in ("cohesion", "layer_on_incline"):
            if isinstance(part, str) and part.split(".")[0] == old:
                part = part.replace(old, name)
        return part

    told = Refinement(renamed(tied.json), tied.page, tied.study)
    for figure in draw_all(told, width).values():
        assert_readable(figure)


def test_a_rig_that_simulates_is_drawn_at_the_measured_levels_only(tmp_path):
    """Nothing is asked of it between them; a closed form stands in for it."""

    class Simulating:
        simulates = True

        def __init__(self, engine):
            self.engine = engine

        def __getattr__(self, name):
            return getattr(self.engine, name)

    rows = layers(0.5, 80.0, (10, 15, 20, 30), 2) + layers(0.5, 80.0, (10, 15, 20, 30), 3)
    state = fit_study(study_of(tmp_path / "s", rows))
    found = compare(state.study, state)
    state.model.engines = {name: Simulating(engine) for name, engine in state.model.engines.items()}
    told = curves.curves_of(state, found)
    (panel,) = told["panels"]
    assert panel["drawn"] == curves.LEVELS and panel["at"] == [10, 15, 20, 30]
    assert np.allclose(panel["predicted"], math.degrees(math.atan(found.parameters["internal_friction"])), rtol=1e-6)
    figure = figures.readings([{"value": r.row.value, "split": "fit"} for r in found.rows], [told])
    assert figure.axes[0].lines[0].get_marker() == "."
    assert "model at the dots" in figure.axes[0].get_title(loc="left").replace("\N{NO-BREAK SPACE}", " ")


def test_a_condition_that_is_a_word_has_a_place_a_word():
    rows = [
        Measurement("box", "angle_deg", value, None, 1, {"wall": wall, "load_n": 1.0}, {}, "", 0.0, "fit", "", k)
        for k, (wall, value) in enumerate((("smooth", 20.0), ("rough", 35.0), ("smooth", 21.0)))
    ]
    (panel,) = curves.panels_of(rows)
    assert (
        panel.condition == "wall" and panel.levels == ("smooth", "rough", "smooth") and panel.others == {"load_n": 1.0}
    )
    told = {
        **{"rig": "box", "observable": "angle_deg", "condition": "wall", "others": {"load_n": 1.0, "lid": "open"}},
        **{"rows": [0, 1, 2], "levels": list(panel.levels), "uncertainties": [None] * 3, "drawn": curves.LEVELS},
        **{"at": ["rough", "smooth"], "predicted": [34.0, 20.5]},
    }
    shown = [{"value": row.value, "split": "fit"} for row in rows]
    axes = figures.readings(shown, [{"effects": [], "panels": [told]}]).axes[0]
    assert list(zip(*axes.lines[0].get_data(), strict=True)) == [(0, 34.0), (1, 20.5)]
    points = axes.containers[0].lines[0].get_xydata()
    assert np.allclose(points[:, 1], [20, 35, 21]) and np.allclose(points[:, 0], [1, 0, 1], atol=0.01)
    assert {text.get_text() for text in axes.get_xticklabels()} == {"rough", "smooth"}
    assert "lid open" in axes.get_title(loc="left").replace("\N{NO-BREAK SPACE}", " ")
    with_number = [replace(row, conditions={**row.conditions, "load_n": float(k)}) for k, row in enumerate(rows)]
    assert {panel.condition for panel in curves.panels_of(with_number)} == {"load_n"}
