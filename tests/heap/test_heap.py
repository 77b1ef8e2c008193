"""The repose angle of heaps whose angle is known because they were made that way."""

import numpy as np
import pytest

from yade_scripts import heap

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


@pytest.mark.parametrize("angle", ANGLES)
def test_a_cone_has_its_angle(angle):
    found = heap.repose_angle(*cone(angle))
    assert found.mean_deg == pytest.approx(angle, abs=0.5)
    assert found.standard_error_deg < 0.5
    assert len(found.directions_deg) == heap.DIRECTIONS


@pytest.mark.parametrize("cut", (0.5, 0.75))
@pytest.mark.parametrize("angle", ANGLES)
def test_a_truncated_cone_has_the_angle_of_its_flanks(angle, cut):
    assert heap.repose_angle(*cone(angle, cut)).mean_deg == pytest.approx(angle, abs=0.5)


def test_a_skewed_cone_has_the_mean_of_its_two_angles():
    lean, height = 0.3, np.tan(np.radians(35.0))
    flanks = heap.fit_flanks(*heap.silhouette(*cone(35.0, lean=lean), 0.0))
    left, right = (np.degrees(np.arctan(height / (1 + side * lean))) for side in (1, -1))
    assert flanks.left.angle_deg == pytest.approx(left, abs=0.5)
    assert flanks.right.angle_deg == pytest.approx(right, abs=0.5)
    assert flanks.angle_deg == pytest.approx(0.5 * (left + right), abs=0.5)


@pytest.mark.parametrize(
    "outlier",
    [(1.6, 0.0, RADIUS), (0.0, 0.0, 1.2), (0.5, 0.0, 0.55), (-0.9, 0.3, 0.3)],
    ids=["far on the plate", "in the air", "on a flank", "beside"],
)
def test_outlier_grains_do_not_count(outlier):
    centres, radii = cone(40.0)
    with_outlier = heap.repose_angle(np.vstack([centres, outlier]), np.append(radii, RADIUS))
    assert with_outlier.mean_deg == pytest.approx(40.0, abs=0.5)


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


def test_the_unit_of_length_does_not_matter():
    centres, radii = cone(30.0)
    assert heap.repose_angle(1e-3 * centres, 1e-3 * radii).mean_deg == pytest.approx(
        heap.repose_angle(centres, radii).mean_deg, abs=1e-6
    )


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
