"""The figures practitioners print, read back: surfaces, sections, residuals, the path with its runs, names that do not clip."""

from itertools import combinations, product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm
from statsmodels.stats.outliers_influence import OLSInfluence

from pellet_study.doe import (
    box_behnken,
    figures,
    path_turning,
    plackett_burman,
    reduction,
    screening_designs,
    steepest_climb,
)
from pellet_study.doe.design_table import code_design, read_design
from pellet_study.doe.importance import importance, important_pairs
from pellet_study.doe.optimum import target_set
from pellet_study.doe.path_table import read_path
from pellet_study.errors import InputError
from pellet_study.output import style
from tests.helpers.make_study import command
from tests.helpers.pictures import assert_readable


def truth(a, b, c):
    """The surface behind the tables below, in coded units: A matters most, then B, then C."""
    return 50 + 8 * a - 3 * b + c - 4 * a * b - 2 * a**2


def box(folder: Path, order: bool = True, names=("A", "B", "C"), response="angle") -> Path:
    """A Box-Behnken table with a little scatter, the runs in an order of their own."""
    coded = box_behnken.coded_matrix(3, 4)
    rng = np.random.default_rng(5)
    frame = pd.DataFrame({"RunOrder": rng.permutation(len(coded)) + 1} if order else {})
    for i, name in enumerate(names):
        frame[name] = 10.0 + 2 * coded[:, i]
    frame[response] = truth(*coded.T) + 0.2 * rng.normal(size=len(coded))
    file = folder / "box.csv"
    frame.to_csv(file, index=False)
    return file


@pytest.fixture
def surface(tmp_path):
    return box_behnken.analyse(read_design(box(tmp_path), max_levels=5))


def test_the_most_important_factors_are_those_the_truth_moves_most(surface):
    weight = importance(surface.model)
    assert list(weight) == ["A", "B", "C"] and weight["A"] > weight["B"] > weight["C"] > 0
    assert important_pairs(surface.model) == [(0, 1), (0, 2), (1, 2)]
    assert important_pairs(surface.model, 2) == [(0, 1)]
    coded = surface.table.coded.to_numpy()
    line, product_of_both = 64 * (coded[:, 0] ** 2).sum(), 16 * ((coded[:, 0] * coded[:, 1]) ** 2).sum()
    assert weight["A"] > 0.9 * (line + product_of_both)  # the square comes on top


def test_surfaces_and_contours_show_the_model_and_say_where_the_others_are(surface):
    found = target_set(surface, 52.0, 0.5)
    for target, said in ((None, "(centre)"), (found, "(recommended)")):
        rest = np.zeros(3) if target is None else found.coded
        figure = figures.surface_3d(surface, target, "deg")
        solids, flats = figure.axes[::2], figure.axes[1::2]
        assert len(solids) == 3 and all(axes.name == "3d" for axes in solids)
        for flat, solid, (i, j) in zip(flats, solids, combinations(range(3), 2), strict=True):
            other = 3 - i - j
            level = surface.table.factors[other].physical(rest[other])
            assert flat.get_title(loc="left") == f"{'ABC'[other]} = {float(level):.4g} {said}"
            assert (flat.get_xlabel(), flat.get_ylabel()) == ("ABC"[i], "ABC"[j])
            corners = np.tile(rest, (4, 1)).astype(float)
            corners[:, [i, j]] = list(product((-1, 1), repeat=2))
            heights = surface.model.predict(corners)
            vertices = np.vstack(list(solid.collections[0]._faces))
            for corner, height in zip(corners, heights, strict=True):
                x, y = (float(surface.table.factors[k].physical(corner[k])) for k in (i, j))
                near = vertices[np.isclose(vertices[:, 0], x) & np.isclose(vertices[:, 1], y)]
                assert np.allclose(near[:, 2], height)
            assert any(text.get_text() for text in flat.texts)  # contours carry their values
        assert_readable(figure)
    star = [line for line in flats[0].lines if line.get_marker() == "*"]
    assert np.allclose(star[0].get_xydata()[0], [found.physical["A"], found.physical["B"]])


def test_interaction_lines_are_sections_at_both_ends(surface):
    figure = figures.interactions(surface, None, "deg")
    axes = figure.axes[0]
    low, high = axes.lines[:2]
    a = (low.get_xdata() - 10) / 2
    assert np.allclose(low.get_ydata(), truth(a, -1, 0), atol=0.6)
    assert np.allclose(high.get_ydata(), truth(a, 1, 0), atol=0.6)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["B = 8", "B = 12"]
    title = axes.get_title(loc="left")
    assert "product: p < 0.001" in title and "C = 10 (centre)" in title
    without = reduction.without(surface, ["AB"])
    assert "no product" in figures.interactions(without).axes[0].get_title(loc="left")


def test_perturbation_moves_one_factor_at_a_time_from_the_reference(surface):
    found = target_set(surface, 52.0, 0.5)
    axes = figures.perturbation(surface, found, "deg").axes[0]
    for i, line in enumerate(axes.lines[:3]):
        moved = np.tile(found.coded, (len(line.get_xdata()), 1))
        moved[:, i] += line.get_xdata()
        assert moved[:, i].min() == pytest.approx(-1) and moved[:, i].max() == pytest.approx(1)
        assert np.allclose(line.get_ydata(), truth(*moved.T), atol=0.6)
    assert "(recommended)" in axes.get_title(loc="left")


def test_residuals_stand_against_fitted_order_and_normal_scores(surface):
    figure = figures.residual_plots(surface.table, surface.model, surface.runs, "deg")
    external = OLSInfluence(surface.model.results).resid_studentized_external
    fitted, order, normal = figure.axes
    points = {panel: np.vstack([line.get_xydata() for line in panel.lines if line.get_marker() != "None"])
              for panel in figure.axes}  # fmt: skip
    assert np.allclose(sorted(map(tuple, points[fitted])), sorted(zip(surface.model.fitted, external, strict=True)))
    assert np.allclose(sorted(map(tuple, points[order])), sorted(zip(surface.table.order, external, strict=True)))
    assert "RunOrder" in order.get_xlabel()
    n = len(external)
    blom = norm.ppf((np.arange(1, n + 1) - 0.375) / (n + 0.25))
    assert np.allclose(sorted(map(tuple, points[normal])), list(zip(blom, sorted(external), strict=True)))
    assert_readable(figure)


def test_without_an_order_of_runs_there_is_no_such_panel(tmp_path):
    table = read_design(box(tmp_path, order=False), max_levels=5)
    found = box_behnken.analyse(table)
    assert table.order is None and len(figures.residual_plots(table, found.model, found.runs).axes) == 2


def test_the_run_order_is_read_and_a_standard_order_is_not_taken_for_it(tmp_path):
    file = box(tmp_path)
    frame = pd.read_csv(file)
    assert list(read_design(file, max_levels=5).order) == list(frame["RunOrder"])
    frame.insert(0, "StdOrder", range(1, len(frame) + 1))
    frame.drop(columns="RunOrder").to_csv(file, index=False)
    assert read_design(file, max_levels=5).order is None


def test_screening_interactions_are_means_of_the_runs():
    coded = screening_designs.coded_matrix(3, 12)
    frame = pd.DataFrame(coded, columns=["A", "B", "C"]).assign(y=10 + coded @ [3, 2, 0] + coded[:, 0] * coded[:, 1])
    table = code_design(frame)
    screening = plackett_burman.analyse(table)
    axes = figures.observed_interactions(screening).axes[0]
    first, second = axes.get_xlabel(), axes.get_legend().get_texts()[0].get_text().split(" = ")[0]
    for line, end in zip(axes.lines, (-1, 1), strict=True):
        for x, mean in zip((-1, 1), line.get_ydata(), strict=True):
            rows = (table.coded[first] == x) & (table.coded[second] == end)
            assert mean == pytest.approx(table.response[rows.to_numpy()].mean())


def path_of(tmp_path):
    """A screening of two factors, its path, and runs made on it, one point of it twice."""
    coded = screening_designs.coded_matrix(3, 12)
    frame = pd.DataFrame(5 + coded, columns=["A", "B", "C"]).assign(y=20 + coded @ [4, 2, 0] + 0.1 * coded[:, 2])
    frame["y"] += 0.05 * np.random.default_rng(1).normal(size=12)
    frame.to_csv(tmp_path / "screening.csv", index=False)
    table = read_design(tmp_path / "screening.csv")
    climb = steepest_climb.path(*steepest_climb.first_order_model(plackett_burman.analyse(table), ["A", "B"]), points=4)
    runs = climb.points.iloc[[0, 1, 2, 2, 3]].assign(y=[20.0, 23.0, 25.0, 27.0, 22.0])
    runs.to_csv(tmp_path / "path.csv", index=False)
    return table, climb


def test_the_path_shows_its_runs_where_they_lie(tmp_path):
    table, climb = path_of(tmp_path)
    runs, _ = read_path(tmp_path / "path.csv", table)
    turning = path_turning.turning(runs)
    for figure in (
        figures.climb_path(climb, "deg", 26.0, table.names, runs, turning),
        figures.path_runs(runs, turning, table.factors, "deg", 26.0, table.names),
    ):
        axes = figure.axes[0]
        by_marker = {line.get_marker(): line.get_xydata() for line in axes.lines}
        expected = [(1, 20.0), (2, 23.0), (3, 25.0), (3, 27.0), (4, 22.0)]
        assert np.allclose(sorted(map(tuple, by_marker["s"])), expected, atol=1e-6)
        assert np.allclose(by_marker["*"], [(3, 26.0)], atol=1e-6)
        assert_readable(figure)


@pytest.mark.parametrize("width", (None, 85.0))
@pytest.mark.parametrize(
    "names",
    [
        ("Powder-powder coefficient of restitution", "Powder-steel rolling friction", "JKR surface energy (J·m⁻²)"),
        ("粉末与钢板之间的滚动摩擦系数/-", "加料时间/min", "表面能(J/m²)"),
    ],
)
def test_long_and_chinese_names_do_not_clip(tmp_path, width, names):
    response = "Repose angle of the poured heap on a steel plate (°)" if names[0].isascii() else "堆积角/°"
    found = box_behnken.analyse(read_design(box(tmp_path, True, names, response), max_levels=5))
    target = target_set(found, 52.0, 0.5)
    table = found.table
    with style.column(width):
        drawn = [
            figures.surface_3d(found, target),
            figures.surface_contours(found, target),
            figures.interactions(found, target),
            figures.perturbation(found, target),
            figures.residual_plots(table, found.model, found.runs),
            figures.predicted_observed(found),
        ]
    for figure in drawn:
        if width:
            assert figure.get_figwidth() * 25.4 == pytest.approx(width)
        assert_readable(figure)


@pytest.mark.parametrize("ending", style.FORMATS)
def test_the_commands_write_them_in_the_format_asked_for(tmp_path, ending):
    folder = tmp_path / "figures"
    status, answer = command(
        "bbd",
        box(tmp_path),
        "--figures",
        folder,
        "--format",
        ending,
        "--width",
        "double",
        json_file=tmp_path / "a.json",
    )
    expected = {"response_surface", "surface_3d", "interactions", "perturbation", "residuals", "predicted_observed"}
    assert status == 0 and {Path(name).stem for name in answer["figures"]} == expected
    assert {file.name for file in folder.iterdir()} == {f"{name}.{ending}" for name in expected}
    path_of(tmp_path)
    words = (
        "--climb",
        "gradient",
        "--climb-factors",
        "A,B",
        "--climb-runs",
        tmp_path / "path.csv",
        "--figures",
        folder,
    )
    status, answer = command("pb", tmp_path / "screening.csv", *words, json_file=tmp_path / "p.json")
    assert {Path(name).name for name in answer["figures"]} == {
        f"{name}.png"
        for name in ("pareto", "half_normal", "screening_interactions", "screening_residuals", "climb", "path")
    }


def test_they_are_drawn_on_axes_of_ones_own(surface):
    from matplotlib.figure import Figure

    for draw, projections in (
        (figures.surface_3d, ["3d", None] * 3),
        (figures.surface_contours, [None] * 3),
        (figures.interactions, [None] * 3),
        (figures.perturbation, [None]),
        (figures.predicted_observed, [None]),
    ):
        own = Figure(figsize=(8, 8), layout="constrained")
        grid = [own.add_subplot(4, 2, k, projection=kind) for k, kind in enumerate(projections, start=1)]
        spare = own.add_subplot(4, 2, 8)
        assert draw(surface, ax=grid if len(grid) > 1 else grid[0]) is own
        assert all(axes.has_data() for axes in grid) and not spare.has_data() and not own.legends
    with pytest.raises(InputError, match="6 panels, got 1"):
        figures.surface_3d(surface, ax=spare)
