"""The target set against surfaces whose sets are known in closed form."""

import numpy as np
import pandas as pd
import pytest

from pellet_study.doe import box_behnken
from pellet_study.doe.design_table import code_design
from pellet_study.doe.factors import Factor
from pellet_study.doe.optimum import target_set
from pellet_study.doe.terms import columns_of
from pellet_study.errors import InputError


def surface_of(function, n_factors=3, noise=0.0, factors=()):
    coded = box_behnken.coded_matrix(n_factors, 4, face_centred=True)
    names = list("ABC")[:n_factors]
    response = function(coded.T) + noise * np.random.default_rng(5).normal(size=len(coded))
    frame = pd.DataFrame(coded, columns=names).assign(y=response)
    return box_behnken.analyse(code_design(frame, factors))


@pytest.fixture(scope="module")
def ball():
    return surface_of(lambda x: x[0] ** 2 + x[1] ** 2 + x[2] ** 2)


@pytest.fixture(scope="module")
def slope():
    return surface_of(lambda x: 10 + 2 * x[0], noise=0.05)


def test_a_sphere(ball):
    """y = r^2: the target 0.25 +- 0.09 is the shell from r = 0.4 to sqrt(0.34)."""
    found = target_set(ball, 0.25, 0.09)
    shell = 4 / 3 * np.pi * (0.34**1.5 - 0.16**1.5) / 8
    assert found.fraction == pytest.approx(shell, abs=1e-3)
    for extent, sheet in zip(found.extents, found.sheet_extents, strict=True):
        assert extent.coded == pytest.approx((-np.sqrt(0.34), np.sqrt(0.34)), abs=1e-5)
        assert sheet.coded == pytest.approx((-0.5, 0.5), abs=1e-5)
    assert found.unidentified == []
    assert np.linalg.norm(found.coded) == pytest.approx(0.5, abs=1e-5)
    assert found.lowest == pytest.approx(0, abs=1e-6) and found.highest == pytest.approx(3, abs=1e-6)


def test_a_slope_identifies_one_factor_only(slope):
    found = target_set(slope, 10.5, 0.3)
    assert found.fraction == pytest.approx(0.15, abs=0.01)
    assert found.unidentified == ["B", "C"]
    assert found.coded == pytest.approx([0.25, 0, 0], abs=0.05)
    assert found.prediction.predicted == pytest.approx(10.5)
    assert found.prediction.confidence[0] < 10.5 < found.prediction.confidence[1]


def test_the_least_sensitive_point_has_the_smallest_slope():
    """y = A + A B: on y = 0 the slope (1 + B, A) vanishes at A = 0, B = -1."""
    surface = surface_of(lambda x: x[0] + x[0] * x[1], n_factors=2)
    found = target_set(surface, 0.0, 0.0, rule="insensitive")
    assert np.linalg.norm(surface.model.gradient(found.coded)) < 1e-2
    central = target_set(surface, 0.0, 0.0, rule="centre")
    assert np.linalg.norm(central.coded) < 1e-3


def test_an_unreachable_target_gives_the_nearest_point(slope):
    found = target_set(slope, 20, 0.1)
    assert not found.reachable and found.extents == [] and found.measurements == []
    assert found.coded[0] == pytest.approx(1)
    assert found.highest < 13


def test_a_reversed_factor_is_recommended_in_physical_units(slope):
    reversed_ = surface_of(lambda x: 10 + 2 * x[0], noise=0.05, factors=[Factor("A", 0.9, 0.8)])
    found = target_set(reversed_, 10.5, 0.3)
    assert found.physical["A"] == pytest.approx(0.85 - 0.05 * found.coded[0])


def test_the_best_further_run_really_shrinks_the_set_as_said(slope):
    """The announced fraction is the one of the design with that run in it."""
    found = target_set(slope, 10.5, 0.3)
    run = next(option for option in found.measurements if option.coded is not None)
    model = slope.model
    larger = np.vstack([model.matrix, columns_of(run.coded, model.terms)])
    from scipy.stats import t
    from scipy.stats.qmc import Sobol

    sample = 2 * Sobol(3, scramble=False).random_base2(16) - 1
    points = columns_of(sample, model.terms)
    leverage = np.einsum("ij,jk,ik->i", points, np.linalg.inv(larger.T @ larger), points)
    squared = 0.3**2 + t.ppf(0.975, model.df_residual) ** 2 * model.mean_square_error * leverage
    assert run.fraction == pytest.approx(np.mean((model.predict(sample) - 10.5) ** 2 <= squared))
    assert run.fraction < found.fraction_not_excluded
    assert [option.fraction for option in found.measurements] == sorted(o.fraction for o in found.measurements)


@pytest.mark.parametrize("arguments", [(10, -1), (float("nan"), 0), (10, 0.1, "best")])
def test_impossible_targets_are_refused(slope, arguments):
    with pytest.raises(InputError, match="expected"):
        target_set(slope, *arguments)
