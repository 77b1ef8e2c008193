"""All figures: a unit on every axis, series told apart in grey, nothing drawn twice differently; grains as pictures."""

import json

import numpy as np
import pytest
from matplotlib.colors import to_rgb

import pellet_study as ps
from pellet_study.criticism import figures
from pellet_study.errors import InputError
from pellet_study.heap import render
from pellet_study.output import style
from pellet_study.paper.results import drawn
from tests import ROOT


def answer(study: str, name: str) -> dict:
    return json.loads((ROOT / "results" / study / f"{name}.json").read_text(encoding="utf-8"))


def criticism() -> dict:
    """The figures of a study whose missing effect was found."""
    refined, steps = answer("wet_beads", "refine"), answer("wet_beads", "history")["steps"]
    return {
        "ladder": figures.ladder(steps),
        "residuals": figures.residuals(steps),
        "readings": ps.draw(ps.compare(ps.load_study(ROOT / "results" / "wet_beads")), "readings"),
        "predictions": figures.predictions(steps[-1]["rows"]),
        "ranking": figures.ranking(refined["diagnoses"][0]),
        "constants": figures.constants(refined["diagnoses"][0]["by_level"]),
        "next": figures.next_measurement(refined["diagnoses"][0]["next_measurement"]),
    }


NAMED = ("model", "explanation", "candidate effect", "factor")  # axes of names, not of quantities


def test_a_unit_on_every_axis():
    for name, figure in {**criticism(), **drawn()}.items():
        for axes in figure.axes:
            for label in filter(None, (axes.get_xlabel(), axes.get_ylabel())):
                assert "(" in label or label in (*NAMED, "B", "C", "half-normal quantile"), f"{name}: {label}"


def test_series_differ_in_grey_or_by_another_sign():
    grey = [0.2126 * r + 0.7152 * g + 0.0722 * b for r, g, b in map(to_rgb, style.SERIES)]
    for k, a in enumerate(grey):
        for m in range(k):
            assert abs(a - grey[m]) > 0.1 or (
                style.MARKERS[k] != style.MARKERS[m] and style.DASHES[k] != style.DASHES[m]
            )


def test_legends_lie_inside_their_figures():
    steps = answer("wet_beads", "history")["steps"]
    for step in steps:
        for k, row in enumerate(step["rows"]):
            row["split"] = "holdout" if k % 3 == 0 else "fit"
    steps[-1]["effects"] = ["cohesion", "side_wall_friction", "finite_thickness", "stress_dependent_friction"]
    for figure in (figures.residuals(steps), figures.predictions(steps[-1]["rows"]), figures.ladder(steps)):
        figure.canvas.draw()
        legend = figure.legends[0].get_window_extent()
        assert legend.x0 >= 0 and legend.x1 <= figure.bbox.width
    labels = [text.get_text() for text in figures.residuals(steps).legends[0].get_texts()]
    assert len(labels) == 5 and labels[-1].endswith(", held out")


@pytest.mark.parametrize(
    "name, label",
    [
        ("layer_height_mm", "layer height (mm)"),
        ("bulk_density_kg_m3", "bulk density (kg/m³)"),
        ("cohesive_stress_pa", "cohesive stress (Pa)"),
        ("internal_friction", "internal friction (-)"),
    ],
)
def test_names_become_labels(name, label):
    assert style.label(name) == label


def test_a_picture_of_grains_shows_them_where_they_are():
    centres = np.array([[0.0, 0.0, 1.0], [0.0, 3.0, 1.0]])
    image = render.picture(centres, np.ones(2), width=200, azimuth_deg=0, elevation_deg=0, plate=None, margin=0)
    rows, columns, _ = image.shape
    assert columns == 200 and rows == pytest.approx(200 * 2 / 5, abs=2)
    white = (image > 0.999).all(axis=2)
    assert not white[rows // 2, 40] and not white[rows // 2, 160] and white[rows // 2, 100]
    covered = 1 - white.mean()
    assert covered == pytest.approx(2 * np.pi / 10, rel=0.05)


@pytest.mark.parametrize("text", ("", "a,b\n1,2\n", "x_m,y_m,z_m,radius_m\n", "x_m,y_m,z_m,radius_m\n0,0,0,-1\n"))
def test_a_file_without_grains_is_refused(text, tmp_path):
    (tmp_path / "grains.csv").write_text(text)
    with pytest.raises(InputError, match=r"grains\.csv"):
        render.read_grains(tmp_path / "grains.csv")


@pytest.mark.parametrize("width", ["single", "double"])
@pytest.mark.parametrize("count", [1, 3, 7])
def test_a_legend_that_needs_one_column_still_names_every_kind(width, count, monkeypatch):
    """Handles given once are drawn in every arrangement that is tried."""
    from matplotlib.patches import Patch

    from tests.helpers.pictures import assert_readable

    names = [f"a kind of bar with a long name of its own, the {k}" for k in range(count)]

    @style.styled
    def drawn():
        figure, axes = style.new_axes(6.0, 3.0 + 0.3 * count)
        axes.set(xlabel="x (-)", ylabel="y (-)")
        style.legend_below(figure, (Patch(facecolor="red") for _ in names), names)
        return figure

    with style.column(style.COLUMNS[width]):
        figure = drawn()
        assert_readable(figure)
        (legend,) = figure.legends
        shown = [" ".join(text.get_text().split()) for text in legend.get_texts()]
        assert shown == names and len(legend.legend_handles) == count
        assert figure.axes[0].get_window_extent().height > 0.5 * figure.dpi
