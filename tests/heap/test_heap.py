"""The repose angle of heaps whose angle is known because they were made that way."""

import sys

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tests import ROOT
from yade_scripts import heap

sys.path.insert(0, str(ROOT / "benchmarks"))

import heap_reader  # noqa: E402

ANGLES = (20.0, 30.0, 41.69, 50.0)


RADIUS = 0.018  # of a grain; coarser grains thin out towards the top of a silhouette and flatten it


def lattice(radius: float, size: float):
    """Centres of touching spheres in hexagonal close packing over a cube, in an arbitrary orientation."""
    n = int(1.4 * size / radius)
    i, j, k = np.meshgrid(*[np.arange(-n, n)] * 3, indexing="ij")
    points = radius * np.stack(
        [2 * i + (j + k) % 2, np.sqrt(3) * (j + (k % 2) / 3), 2 * np.sqrt(6) / 3 * k], axis=-1
    ).reshape(-1, 3)
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    return points @ turn.T


PACKED = lattice(RADIUS, 1.0)


def cone(angle_deg: float, cut: float = 1.0, lean: float = 0.0):
    """The outer grains of a cone of base radius 1; `cut` of its height is left, its apex `lean` off the middle."""
    height = np.tan(np.radians(angle_deg))
    x, y, z = PACKED.T
    up = z / height
    depth = 1 - up - np.hypot(x - lean * up, y)
    centres = PACKED[(z > 0) & (up < cut) & (depth > 0) & ((depth < 0.2) | (up > cut - 0.2))]
    return centres, np.full(len(centres), RADIUS)


@pytest.fixture(scope="module")
def grains():
    return heap_reader.packing(1, wide=40.0, tall=24.0)


def several(grains, shape, base, angle, number=1500, heaps=3, **more):
    """Readings of several heaps of one shape as array (heaps, 3), and the angle that they have."""
    made = [
        heap_reader.made(grains, shape, base, angle, number, np.random.default_rng(seed), **more)
        for seed in range(heaps)
    ]
    seen = [heap.readings(one.centres, one.radii, one.base_radius) for one in made]
    return np.array([[one.flank.angle_deg, one.triangle.angle_deg, one.moment.angle_deg] for one in seen]), made[0]


@pytest.mark.parametrize("base", ("plate", "disc", "disc, cut"))
@pytest.mark.parametrize("angle", (10.0, 15.0, *ANGLES))
def test_a_cone_of_grains_has_its_angle_in_all_readings(grains, angle, base):
    found, made = several(grains, "cone", base, angle)
    assert made.right_deg == pytest.approx(angle, abs=1e-9)
    assert abs(found.mean(axis=0) - angle).max() < 1.5


@pytest.mark.parametrize("angle", ANGLES)
def test_a_cone_of_fine_grains_has_its_angle_in_both_readings_of_its_outline(angle):
    found = heap.readings(*cone(angle))
    assert found.flank.angle_deg == pytest.approx(angle, abs=0.5)
    assert found.triangle.angle_deg == pytest.approx(angle, abs=0.7)
    assert found.flank.standard_error_deg < 0.5 and found.triangle.standard_error_deg < 0.5
    assert found.repose in (found.flank, found.triangle) and not found.no_flank


@pytest.mark.parametrize("cut", (0.5, 0.75))
@pytest.mark.parametrize("angle", ANGLES)
def test_a_truncated_cone_has_the_angle_of_its_flanks(angle, cut):
    assert heap.readings(*cone(angle, cut)).flank.angle_deg == pytest.approx(angle, abs=0.5)


def test_a_skewed_cone_has_the_mean_of_its_two_angles(grains):
    lean, height = 0.3, np.tan(np.radians(35.0))
    flanks = heap.fit_flanks(*heap.silhouette(*cone(35.0, lean=lean), 0.0))
    left, right = (np.degrees(np.arctan(height / (1 + side * lean))) for side in (1, -1))
    assert flanks.left.angle_deg == pytest.approx(left, abs=0.5)
    assert flanks.right.angle_deg == pytest.approx(right, abs=0.5)
    assert flanks.angle_deg == pytest.approx(0.5 * (left + right), abs=0.5)
    found, made = several(grains, "skewed", "plate", 30.0)
    assert found[:, 0].mean() == pytest.approx(made.right_deg, abs=1.5)
    assert found[:, 1].mean() == pytest.approx(30.0, abs=2.0)  # an isosceles triangle as wide and as high


@pytest.mark.parametrize("angle", (5.0, 2.0))
def test_a_flat_heap_has_an_angle(grains, angle):
    found, _ = several(grains, "cone", "plate", angle, 4000)
    assert abs(found[:, 1:].mean(axis=0) - angle).max() < 1.0


@pytest.mark.parametrize("number", (100, 500, 2000))
def test_a_layer_of_one_grain_lies_flat_and_has_no_flank(grains, number):
    made = heap_reader.layer(grains, number, np.random.default_rng(0))
    for base_radius in (None, np.hypot(*made.centres[:, :2].T).max()):
        found = heap.readings(made.centres, made.radii, base_radius)
        assert abs(found.triangle.angle_deg) < 2 and abs(found.moment.angle_deg) < 2
        assert np.isnan(found.flank.angle_deg) and "radii high" in found.no_flank


def test_grains_that_lie_apart_on_the_plate_lie_flat():
    place = 3.0 * np.stack([*np.ndindex(12, 12)])
    found = heap.readings(np.column_stack([place, np.ones(144)]), np.ones(144))
    assert found.triangle.angle_deg == 0 and found.moment.angle_deg == pytest.approx(0, abs=1e-9)


FAR = {
    "far on the plate": [(400.0, 300.0, 1.0)],
    "beside": [(32.0, 5.0, 1.0)],
    "in the air": [(3.0, 1.0, 45.0)],
    "a group": [(-30.0, 20.0, 1.0), (-30.0, 22.0, 1.0), (-28.0, 21.0, 1.0), (-29.0, 21.0, 2.6)],
    "a circle": [(40 * np.cos(t), 40 * np.sin(t), 1.0) for t in np.arange(0, 2 * np.pi, 0.2)],
}


@pytest.mark.parametrize("base", ("plate", "disc"))
@pytest.mark.parametrize("name", FAR)
def test_strays_count_in_no_reading(grains, name, base):
    made = heap_reader.made(grains, "cone", base, 35.0, 1500, np.random.default_rng(3))
    alone = heap.readings(made.centres, made.radii, made.base_radius)
    strays = np.array(FAR[name])
    found = heap.readings(np.vstack([strays, made.centres]), np.r_[np.ones(len(strays)), made.radii], made.base_radius)
    for reading in ("flank", "triangle", "moment"):
        assert getattr(found, reading).angle_deg == pytest.approx(getattr(alone, reading).angle_deg, abs=1e-9)


def test_a_sparse_layer_around_the_foot_moves_the_flank_and_the_triangle_little(grains):
    found, _ = several(grains, "cone", "plate", 35.0, toe=1.3)
    assert abs(found[:, :2].mean(axis=0) - 35).max() < 2.5


@pytest.mark.parametrize(("cut", "base"), [(1.0, None), (1.0, 1.0), (0.7, 0.7)])
@pytest.mark.parametrize("angle", (3.0, 41.69))
def test_the_moment_is_exact_in_a_cone_filled_with_points(angle, cut, base):
    steep = np.tan(np.radians(angle))
    place = np.random.default_rng(0).uniform((-1, -1, 0), (1, 1, 1), (200_000, 3))
    r = np.hypot(place[:, 0], place[:, 1])
    inside = place[(place[:, 2] < 1 - r) & (r < cut)] * (1, 1, steep) + (5, 3, 0)
    radii = np.full(len(inside), 1e-6)
    found = heap.moment(inside, radii, base)
    assert found.angle_deg == pytest.approx(angle, abs=0.3)
    assert abs(found.angle_deg - angle) < 4 * found.standard_error_deg
    if base is not None:  # on other grains
        assert heap.moment(inside + (0, 0, 5.0), radii, base).angle_deg == pytest.approx(found.angle_deg, abs=1e-6)


def test_the_moment_weighs_grains_by_their_volume(grains):
    made = heap_reader.made(grains, "cone", "plate", 35.0, 1500, np.random.default_rng(3))
    rng = np.random.default_rng(0)
    dust = np.column_stack([*rng.uniform(-3, 3, (2, 3000)), rng.uniform(10, 12, 3000)])
    without = heap.moment(made.centres, made.radii).angle_deg
    found = heap.moment(np.vstack([made.centres, dust]), np.r_[made.radii, np.full(3000, 0.05)])
    assert found.angle_deg == pytest.approx(without, abs=0.05)


def test_the_body_is_the_largest_set_of_grains_that_touch():
    rng = np.random.default_rng(5)
    centres, radii = rng.uniform(0, 10.5, (700, 3)), rng.uniform(0.3, 0.7, 700)
    gaps = np.linalg.norm(centres[:, None] - centres[None], axis=2) - radii[:, None] - radii[None]
    near = gaps <= heap.TOUCHING * radii.mean()
    label = connected_components(coo_array(near), directed=False)[1]
    largest = label == np.bincount(label).argmax()
    assert 350 <= largest.sum() < 700
    np.testing.assert_array_equal(heap.body(centres, radii)[0], centres[largest])


def test_places_of_an_outline_have_a_fixed_length():
    centres, radii = np.array([(0.0, 0.0, 1.0), (30.0, 0.0, 1.0)]), np.ones(2)
    for far in (1.0, 100.0):
        x, height = heap.silhouette(centres * (far, 1, 1), radii, 0.0)
        assert np.allclose(np.diff(x), heap.PLACE)
        round_one = np.where(np.abs(x) < 1, 1 + np.sqrt(np.maximum(1 - x**2, 0)), 0)
        assert np.allclose(height[x < 2], round_one[x < 2])


def test_an_exact_triangle_is_found():
    x = np.linspace(-3, 5, 400)
    found = heap.fit_triangle(x, np.maximum(0, 1.5 - 0.6 * np.abs(x - 0.8)))
    assert found.angle_deg == pytest.approx(np.degrees(np.arctan(0.6)), abs=0.1)
    assert found.middle == pytest.approx(0.8, abs=0.02)
    cut = np.abs(x - 0.8) < 1.5  # by the edges of a disc
    assert heap.fit_triangle(x[cut], (1.5 - 0.6 * np.abs(x - 0.8))[cut]).angle_deg == pytest.approx(
        np.degrees(np.arctan(0.6)), abs=0.1
    )


@pytest.mark.parametrize("top", (0.5, 0.8, 1.0))
def test_the_triangle_is_that_of_least_squares_below_the_top(top):
    x = np.linspace(-1.4, 1.6, 500)
    height = np.minimum(np.maximum(0, 1 - np.abs(x)), top) + 0.01 * np.random.default_rng(1).normal(size=500)
    found = heap.fit_triangle(x, height)
    below, above = np.abs(x) > 1 - heap.HIGH * top, np.maximum(height - heap.LOW * top, 0)
    best = least_squares(lambda p: (np.maximum(0, p[1] - p[2] * np.abs(x - p[0])) - above)[below], (0.0, 0.8, 1.0)).x
    assert found.angle_deg == pytest.approx(np.degrees(np.arctan(best[2])), abs=0.3)
    assert found.angle_deg == pytest.approx(45.0, abs=1.0)
    whole = least_squares(lambda p: np.maximum(0, p[1] - p[2] * np.abs(x - p[0])) - height, (0.0, 0.9, 0.8)).x
    with_top = heap.fit_triangle(x, height, low=0, high=2)
    assert with_top.angle_deg == pytest.approx(np.degrees(np.arctan(whole[2])), abs=0.2)
    assert with_top.middle == pytest.approx(whole[0], abs=0.01)


@pytest.mark.parametrize("base", ("plate", "disc"))
@pytest.mark.parametrize("shape", ("truncated", "rounded"))
def test_a_top_does_not_count_in_the_triangle(grains, shape, base):
    found, made = several(grains, shape, base, 35.0)
    assert found[:, 1].mean() == pytest.approx(made.right_deg, abs=1.0)


def test_toes_and_a_rounded_top_do_not_count():
    x = np.linspace(-1.5, 1.5, 600)
    slope = np.tan(np.radians(38.0))
    straight = slope * (1 - np.abs(x))
    profile = np.minimum(straight, 0.85 * slope)  # flat top
    toe = 0.1 * slope * np.exp((straight - 0.1 * slope) / (0.1 * slope))  # joins the flank with the same slope
    profile = np.where(straight < 0.1 * slope, toe, profile)
    assert heap.fit_flanks(x, profile).angle_deg == pytest.approx(38.0, abs=0.1)


def test_a_profile_in_pixels_with_noise_and_spikes():
    """As from a photograph: whole pixels, rough outline, a tenth of the columns wrong."""
    draw = np.random.default_rng(4)
    x = np.arange(900.0)
    height = np.maximum(0, np.tan(np.radians(41.69)) * (380 - np.abs(x - 460))) + draw.normal(0, 4, 900)
    wrong = draw.random(900) < 0.1
    height[wrong] += draw.uniform(-60, 60, wrong.sum())
    flanks = heap.fit_flanks(x, np.round(np.maximum(height, 0)))
    assert flanks.angle_deg == pytest.approx(41.69, abs=0.5)
    assert flanks.left.slope > 0 > flanks.right.slope
    assert flanks.left.start < flanks.left.end < flanks.right.start < flanks.right.end
    assert heap.fit_triangle(x, np.round(np.maximum(height, 0))).angle_deg == pytest.approx(41.69, abs=0.5)


def test_the_unit_of_length_does_not_matter():
    centres, radii = cone(30.0)
    large, small = heap.readings(centres, radii), heap.readings(1e-3 * centres, 1e-3 * radii)
    np.testing.assert_allclose(small[:3], large[:3], atol=1e-2)


@pytest.mark.parametrize(
    ("centres", "reason"),
    [(np.empty((0, 3)), "0 grains"), ([], "0 grains"), (np.eye(3), "3 grains"), (np.ones((1, 3)), "1 grain")],
)
def test_a_handful_of_grains_is_no_heap(centres, reason):
    with pytest.raises(heap.NoHeap, match=reason):
        heap.readings(centres, np.ones(len(centres)))


@pytest.mark.parametrize(
    ("centres", "radii", "base"),
    [
        (np.ones((5, 2)), np.ones(5), None),
        (np.full((5, 3), np.nan), np.ones(5), None),
        (np.ones((5, 3)), np.zeros(5), None),
        (np.ones((5, 3)), np.ones(5), 0.0),
    ],
)
def test_what_are_no_grains_is_refused(centres, radii, base):
    with pytest.raises(ValueError, match="expected"):
        heap.readings(centres, radii, base)


@pytest.mark.parametrize(
    ("x", "height", "reason"),
    [
        (np.arange(100.0), np.zeros(100), "no height"),
        (np.arange(100.0), np.arange(100.0), "does not come down"),
        (np.arange(100.0), np.r_[np.linspace(0, 9, 50), np.full(50, 9.0)], "does not come down"),
        (np.arange(10.0), np.ones(10), "too coarse"),
        (np.arange(100.0), np.r_[np.zeros(40), np.full(20, 9.0), np.zeros(40)], "only 0 points"),
    ],
)
def test_what_is_no_heap_is_refused(x, height, reason):
    with pytest.raises(heap.NoHeap, match=reason):
        heap.fit_flanks(x, height)


def test_what_is_no_profile_is_refused():
    with pytest.raises(ValueError, match="ascending"):
        heap.fit_flanks([0, 2, 1], [0, 1, 0])
    with pytest.raises(ValueError, match="low 0.9"):
        heap.fit_flanks(np.arange(100.0), np.ones(100), low=0.9)


def test_the_height_is_that_of_the_highest_grain_over_the_radius_of_the_base():
    """Three layers of touching grains, the top at 2 + 2 sqrt(2/3) 2 = 5.27 radii, on a base of 6; a grain in the air counts for nothing."""
    row = np.array([[0, 0, 1.0], [2, 0, 1], [1, np.sqrt(3), 1], [4, 0, 1], [3, np.sqrt(3), 1], [2, 2 * np.sqrt(3), 1]])
    layer = 2 * np.sqrt(2 / 3)
    stack = [row, row[[0, 1, 2]] + [1, 1 / np.sqrt(3), layer], row[[0]] + [2, 2 / np.sqrt(3), 2 * layer]]
    centres = np.vstack([*stack, [[1.0, 1.0, 30.0]]])
    found = heap.height_deg(centres, np.ones(len(centres)), 6.0)
    assert found == pytest.approx(np.degrees(np.arctan((2 + 2 * layer) / 6)))
    assert heap.height_deg(centres, np.ones(len(centres)), None) is None
