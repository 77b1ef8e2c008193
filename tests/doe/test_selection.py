"""Backward selection by AICc: the criterion of others, a truth known, an exhaustive search, the price."""

from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from statsmodels.tools.eval_measures import aicc as aicc_of_statsmodels

from pellet_study.doe import box_behnken
from pellet_study.doe.design_table import code_design
from pellet_study.doe.linear_model import fit, quadratic_terms
from pellet_study.doe.selection import aicc, select_by_aicc
from pellet_study.errors import InputError
from tests.helpers.published_designs import worsted_yarn


def surface_of(function, noise, seed=0, runs=3):
    coded = box_behnken.coded_matrix(3, 4, face_centred=True)
    coded = np.vstack([coded] * runs)
    response = function(coded.T) + noise * np.random.default_rng(seed).normal(size=len(coded))
    return box_behnken.analyse(code_design(pd.DataFrame(coded, columns=list("ABC")).assign(y=response)))


def test_the_criterion_differs_from_that_of_statsmodels_by_a_constant():
    surface = surface_of(lambda x: 5 * x[0], 1.0)
    differences = []
    for names in (["1", "A"], ["1", "A", "B", "AB"], list(surface.model.terms)):
        terms = {name: surface.model.terms[name] for name in names}
        model = fit(list("ABC"), terms, surface.model.coded, surface.model.response)
        runs = len(model.response)
        theirs = aicc_of_statsmodels(model.results.llf, runs, len(names) + 1)
        differences.append(theirs - aicc(model.ss_residual, runs, len(names)))
    assert differences == pytest.approx([differences[0]] * 3)


def test_the_terms_that_are_there_stay():
    found = select_by_aicc(surface_of(lambda x: 10 + 5 * x[0] + 4 * x[1] * x[2] - 3 * x[0] ** 2, 0.1))
    assert {"A", "B", "C", "BC", "A2"} <= set(found.surface.model.terms)  # B and C for the sake of BC
    assert found.aicc == sorted(found.aicc, reverse=True)


def test_no_smaller_model_that_keeps_hierarchy_has_a_lower_aicc():
    """ln(cycles) of the worsted yarn, all 3 x 3 x 3 runs: an exhaustive search over the hierarchical models."""
    frame = worsted_yarn().assign(cycles=lambda f: np.log(f.cycles))
    surface = box_behnken.analyse(code_design(frame))
    found = select_by_aicc(surface)
    everything, names = quadratic_terms(["length", "amplitude", "load"]), ["length", "amplitude", "load"]
    second = [name for name, indices in everything.items() if len(indices) == 2]
    best = np.inf
    for size in range(len(second) + 1):
        for chosen in combinations(second, size):
            needed = {i for name in chosen for i in everything[name]}
            for mains in range(8):
                kept = {i for i in range(3) if mains >> i & 1}
                if needed <= kept:
                    terms = {"1": (), **{names[i]: (i,) for i in sorted(kept)}, **{n: everything[n] for n in chosen}}
                    model = fit(names, terms, surface.model.coded, surface.model.response)
                    best = min(best, aicc(model.ss_residual, 27, len(terms)))
    assert found.aicc[-1] == pytest.approx(best)


def test_pure_noise_has_its_price_said():
    """Nothing acts: the selected model's own predicted R2 flatters, the one with the selection repeated does not."""
    flattery, honest = [], []
    for seed in range(40):
        found = select_by_aicc(surface_of(lambda x: 0 * x[0], 1.0, seed, runs=1))
        flattery.append(found.surface.r2_predicted)
        honest.append(found.r2_predicted_honest)
    assert np.mean(honest) < np.mean(flattery) - 0.1
    assert np.mean(honest) < 0  # the truth: the mean predicts better than any model


def test_a_model_too_large_for_aicc_is_still_reduced():
    """Ten terms in twelve runs: AICc is infinite, then defined."""
    coded = box_behnken.coded_matrix(3, 1)[:12]
    coded = np.vstack([coded[:11], [[0, 0, 0]]])
    response = 3 * coded[:, 0] + 0.1 * np.sin(np.arange(12) ** 2)
    surface = box_behnken.analyse(code_design(pd.DataFrame(coded, columns=list("ABC")).assign(y=response)))
    found = select_by_aicc(surface)
    assert np.isinf(found.aicc[0]) and np.isfinite(found.aicc[-1]) and "A" in found.surface.model.terms


def test_an_exact_fit_is_refused():
    with pytest.raises(InputError, match="fits every run exactly"):
        select_by_aicc(surface_of(lambda x: 3 * x[0] ** 2 + x[1], 0.0))
