"""The seed and its mass properties, against Monte Carlo and closed forms."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from yade_scripts import particles

DENSITY = 1250.0


def monte_carlo(centres, radii, density, points=2_000_000):
    """Mass, centre and inertia of a union of spheres by counting random points; about 0.1 % at two million."""
    low = (centres - radii[:, None]).min(axis=0)
    high = (centres + radii[:, None]).max(axis=0)
    drawn = np.random.default_rng(1).uniform(low, high, (points, 3))
    inside = np.zeros(points, bool)
    for centre, radius in zip(centres, radii, strict=True):
        inside |= ((drawn - centre) ** 2).sum(axis=1) < radius**2
    drawn = drawn[inside]
    mass = density * np.prod(high - low) * inside.mean()
    centre = drawn.mean(axis=0)
    arm = drawn - centre
    inertia = mass * ((arm**2).sum(axis=1).mean() * np.eye(3) - arm.T @ arm / len(arm))
    return mass, centre, inertia


def two_spheres(radius, distance, density):
    """Mass and the moments along and across the axis of two overlapping spheres, each a sphere less a cap.

    Discs of area pi (R^2 - u^2) from u = -R to half the distance between the centres, twice.
    """
    u = Polynomial([0, 1])
    disc = np.pi * (radius**2 - u**2)
    half = distance / 2

    def whole(integrand):
        integral = integrand.integ()
        return 2 * density * (integral(half) - integral(-radius))

    along = whole(disc * (radius**2 - u**2) / 2)
    across = whole(disc * (radius**2 - u**2) / 4 + disc * (u - half) ** 2)
    return whole(disc), along, across


def test_closed_form_of_two_spheres_in_its_limits():
    mass, along, across = two_spheres(2.0, 0.0, 3.0)  # one sphere
    assert mass == pytest.approx(3 * 4 / 3 * np.pi * 8)
    assert along == pytest.approx(0.4 * mass * 4) and across == pytest.approx(along)
    mass, along, across = two_spheres(2.0, 4.0, 3.0)  # two that touch
    assert mass == pytest.approx(2 * 3 * 4 / 3 * np.pi * 8)
    assert across == pytest.approx(0.4 * mass * 4 + mass * 4)
    lens = np.pi * (4 * 2 + 1) * (2 * 2 - 1) ** 2 / 12  # of two spheres at distance 1
    assert two_spheres(2.0, 1.0, 1.0)[0] == pytest.approx(2 * 4 / 3 * np.pi * 8 - lens)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("distance", [0.4e-3, 1.1e-3])
def test_two_spheres_in_every_direction(axis, distance):
    radius, shift = 0.6e-3, np.array([2e-3, -1e-3, 3e-3])
    centres = np.zeros((2, 3))
    centres[:, axis] = -distance / 2, distance / 2
    mass, centre, inertia = particles.mass_properties(centres + shift, np.full(2, radius), DENSITY)
    exact, along, across = two_spheres(radius, distance, DENSITY)
    moments = [along if k == axis else across for k in range(3)]
    assert mass == pytest.approx(exact, rel=1e-3)
    assert centre == pytest.approx(shift, abs=1e-6 * radius)
    assert inertia == pytest.approx(np.diag(moments), rel=1e-3, abs=1e-3 * along)


def test_a_lopsided_union():
    """Unequal spheres, one of them inside another, no symmetry: products of inertia and the centre count."""
    centres = 1e-3 * np.array([[0, 0, 0], [0.5, 0.3, 0.2], [-0.4, -0.4, 0.6], [0.05, 0, 0]])
    radii = 1e-3 * np.array([0.6, 0.4, 0.3, 0.2])
    mass, centre, inertia = particles.mass_properties(centres, radii, DENSITY)
    counted = monte_carlo(centres, radii, DENSITY)
    assert mass == pytest.approx(counted[0], rel=0.01)
    assert centre == pytest.approx(counted[1], abs=0.01 * 0.6e-3)
    assert inertia == pytest.approx(counted[2], abs=0.01 * inertia.trace() / 3)
    assert abs(inertia[0, 1]) > 0.05 * inertia.trace() / 3  # so that the products were put to the test


@pytest.mark.parametrize("length_mm", [1.5, 2.2, 3.0])
def test_the_seed(length_mm):
    centres, radii = particles.alfalfa_seed(length_mm)
    counted = monte_carlo(centres, radii, DENSITY)
    mass, moments = particles.seed_mass_properties(length_mm, DENSITY)
    assert mass == pytest.approx(counted[0], rel=0.01)
    assert counted[1] == pytest.approx(np.zeros(3), abs=0.005e-3)
    assert moments == pytest.approx(np.diag(counted[2]), rel=0.01)
    assert counted[2] == pytest.approx(np.diag(moments), abs=0.01 * min(moments))  # its axes are principal


def test_dimensions_of_the_seed():
    centres, radii = particles.alfalfa_seed()
    assert len(radii) >= 6
    extent = (centres + radii[:, None]).max(axis=0) - (centres - radii[:, None]).min(axis=0)
    assert extent == pytest.approx([2.2e-3, 1.3e-3, 1.0e-3], rel=1e-9)


def test_the_seed_stands_on_more_than_a_line():
    centres, radii = particles.alfalfa_seed()
    lowest = centres[:, 2] - radii
    base = centres[lowest < lowest.min() + 1e-9][:, :2]
    assert len(base) >= 3
    assert np.linalg.matrix_rank(base - base[0], tol=1e-6) == 2
    spread = np.array([base.min(axis=0), base.max(axis=0)])
    assert (spread[0] < 0).all() and (spread[1] > 0).all()  # the centre stands over its base


@pytest.fixture(scope="module")
def rotations():
    return np.array([particles.orientation(seed) for seed in range(64 * 64)])


def test_orientations_are_rotations(rotations):
    assert rotations @ rotations.transpose(0, 2, 1) == pytest.approx(np.broadcast_to(np.eye(3), rotations.shape))
    assert np.linalg.det(rotations) == pytest.approx(np.ones(len(rotations)))


def test_orientations_are_uniform(rotations):
    """Every direction cosine of a uniform rotation is uniform in -1 to 1, and two of a row or column are unrelated."""
    for power, moment in ((1, 0), (2, 1 / 3), (3, 0), (4, 1 / 5)):
        assert (rotations**power).mean(axis=0) == pytest.approx(np.full((3, 3), moment), abs=0.02)
    for j, k in ((0, 1), (0, 2), (1, 2)):
        assert (rotations[:, :, j] * rotations[:, :, k]).mean(axis=0) == pytest.approx(np.zeros(3), abs=0.02)
        assert (rotations[:, j, :] * rotations[:, k, :]).mean(axis=0) == pytest.approx(np.zeros(3), abs=0.02)
    # the product of three that make a determinant: E[R11 R22 R33] = 1/6 for rotations, 0 for reflections mixed in
    assert (rotations[:, 0, 0] * rotations[:, 1, 1] * rotations[:, 2, 2]).mean() == pytest.approx(1 / 6, abs=0.02)


def test_a_block_of_orientations_is_more_even_than_chance(rotations):
    """Mean tilt of 64 orientations: its scatter over the blocks is below the 1/sqrt(3 x 64) of independent draws."""
    means = rotations[:, 2, 2].reshape(64, 64).mean(axis=1)
    assert means.std() < 0.5 / np.sqrt(3 * 64)


def test_orientation_depends_on_the_seed_alone():
    again = [particles.orientation(seed) for seed in (7, 3, 7)]
    np.random.seed(5)
    assert (particles.orientation(7) == again[0]).all() and (again[0] == again[2]).all()
    different = {particles.orientation(seed).tobytes() for seed in range(200)}
    assert len(different) == 200
