"""Backward selection by AICc: the criterion of statsmodels, a truth known, an exhaustive search, blocks, the price."""

import json
from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from statsmodels.regression.linear_model import OLS
from statsmodels.tools.eval_measures import aicc as aicc_of_statsmodels

from pellet_study.__main__ import main
from pellet_study.doe import box_behnken, reduction
from pellet_study.doe.blocks import Block
from pellet_study.doe.design_table import code_design
from pellet_study.doe.selection import aicc, select_by_aicc
from pellet_study.doe.terms import columns_of, quadratic_terms
from pellet_study.errors import InputError
from tests.helpers.published_designs import worsted_yarn


def surface_of(function, noise, seed=0, copies=3, blocks=None):
    """The full quadratic fit of `function` with noise on a face-centred design, in two blocks that differ by `blocks`."""
    coded = np.vstack([box_behnken.coded_matrix(3, 4, face_centred=True)] * copies)
    response = function(coded.T) + noise * np.random.default_rng(seed).normal(size=len(coded))
    groups = []
    if blocks is not None:
        second = np.arange(len(coded)) % 2 == 1
        response = response + blocks * second
        groups = [Block("day", tuple("two" if late else "one" for late in second))]
    frame = pd.DataFrame(coded, columns=list("ABC")).assign(y=response)
    return box_behnken.analyse(code_design(frame, blocks=groups))


def exhaustive(surface) -> tuple[float, set[str]]:
    """The lowest AICc of statsmodels over all models that keep hierarchy, the blocks in each, and its terms."""
    names, table = surface.table.names, surface.table
    everything = quadratic_terms(names)
    second = [name for name, indices in everything.items() if len(indices) == 2]
    blocks = [column for block in table.blocks for column in block.columns().values()]
    best = (np.inf, set())
    for size in range(len(second) + 1):
        for chosen in combinations(second, size):
            needed = {i for name in chosen for i in everything[name]}
            for mains in range(2 ** len(names)):
                kept = {i for i in range(len(names)) if mains >> i & 1}
                if needed <= kept:
                    terms = {"1": (), **{names[i]: (i,) for i in sorted(kept)}, **{n: everything[n] for n in chosen}}
                    matrix = np.column_stack([columns_of(table.coded, terms), *blocks])
                    likelihood = OLS(table.response.to_numpy(), matrix).fit().llf
                    criterion = aicc_of_statsmodels(likelihood, len(table.response), matrix.shape[1] + 1)
                    best = min(best, (criterion, set(terms)), key=lambda found: found[0])
    return best


def statsmodels_aicc(model) -> float:
    return aicc_of_statsmodels(model.results.llf, len(model.response), model.matrix.shape[1] + 1)


@pytest.mark.parametrize("blocks", [None, 3.0])
def test_the_criterion_differs_from_that_of_statsmodels_by_a_constant(blocks):
    surface = surface_of(lambda x: 5 * x[0], 1.0, blocks=blocks)
    models = [surface.model] + [
        reduction.without(surface, dropped).model for dropped in (["AB"], ["AB", "BC", "B2"], ["A2", "B2", "C2"])
    ]
    differences = [
        statsmodels_aicc(model) - aicc(model.ss_residual, len(model.response), model.matrix.shape[1])
        for model in models
    ]
    assert differences == pytest.approx([differences[0]] * 4)


def test_the_terms_that_are_there_stay():
    found = select_by_aicc(surface_of(lambda x: 10 + 5 * x[0] + 4 * x[1] * x[2] - 3 * x[0] ** 2, 0.1))
    assert {"A", "B", "C", "BC", "A2"} <= set(found.surface.model.terms)  # B and C for the sake of BC
    assert found.aicc == sorted(found.aicc, reverse=True)


@pytest.mark.parametrize("blocks", [None, 6.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_model_that_keeps_hierarchy_has_a_lower_aicc(seed, blocks):
    """Three factors, two real effects: an exhaustive search by statsmodels, with two blocks in every model too."""
    surface = surface_of(lambda x: 2 * x[0] - 1.5 * x[0] * x[1], 1.0, seed, copies=1, blocks=blocks)
    found = select_by_aicc(surface)
    lowest, terms = exhaustive(surface)
    assert statsmodels_aicc(found.surface.model) == pytest.approx(lowest)
    assert set(found.surface.model.terms) == terms
    assert found.surface.table.blocks == surface.table.blocks


def test_the_worsted_yarn_is_reduced_to_the_best_model():
    """ln(cycles) over all 3 x 3 x 3 runs: as the exhaustive search."""
    frame = worsted_yarn().assign(cycles=lambda f: np.log(f.cycles))
    found = select_by_aicc(box_behnken.analyse(code_design(frame)))
    lowest, terms = exhaustive(found.surface)
    assert statsmodels_aicc(found.surface.model) == pytest.approx(lowest) and set(found.surface.model.terms) == terms


def test_a_difference_of_blocks_is_no_reason_to_keep_or_to_drop_a_term():
    """Blocks fitted beside the terms take up whatever they differ by: the choice is the same for 0 and for 1000."""
    chosen = [
        select_by_aicc(surface_of(lambda x: 2 * x[0] - 3 * x[1] ** 2, 1.0, 5, 1, blocks)).dropped
        for blocks in (0.0, 1000.0)
    ]
    assert chosen[0] == chosen[1]


def test_pure_noise_has_its_price_said():
    """Nothing acts: the selected model's own predicted R2 flatters, the one with the selection repeated does not."""
    flattery, honest = [], []
    for seed in range(40):
        found = select_by_aicc(surface_of(lambda x: 0 * x[0], 1.0, seed, copies=1))
        flattery.append(found.surface.r2_predicted)
        honest.append(found.r2_predicted_honest)
    assert np.mean(honest) < np.mean(flattery) - 0.1
    assert np.mean(honest) < 0  # the truth: the mean predicts better than any model


def test_a_model_too_large_for_aicc_is_still_reduced():
    """Ten terms in twelve runs: AICc is infinite, then defined."""
    coded = np.vstack([box_behnken.coded_matrix(3, 1)[:11], [[0, 0, 0]]])
    response = 3 * coded[:, 0] + 0.1 * np.sin(np.arange(12) ** 2)
    surface = box_behnken.analyse(code_design(pd.DataFrame(coded, columns=list("ABC")).assign(y=response)))
    found = select_by_aicc(surface)
    assert np.isinf(found.aicc[0]) and np.isfinite(found.aicc[-1]) and "A" in found.surface.model.terms


def test_an_exact_fit_is_refused():
    with pytest.raises(InputError, match="fits every run exactly"):
        select_by_aicc(surface_of(lambda x: 3 * x[0] ** 2 + x[1], 0.0))


def test_the_command_says_the_price(tmp_path, capsys):
    surface = surface_of(lambda x: 4 * x[0], 1.0, 7, copies=1, blocks=2.0)
    table = surface.table
    path, out = tmp_path / "blocked.csv", tmp_path / "answer.json"
    table.coded.assign(day=table.blocks[0].labels, y=table.response).to_csv(path, index=False)
    assert main(["bbd", str(path), "--block", "day", "--select", "--json", str(out)]) == 0
    answer, text = json.loads(out.read_text()), capsys.readouterr().out
    expected = select_by_aicc(surface)
    assert answer["reduced"]["dropped"] == expected.dropped and answer["reduced"]["p_follow_selection"] is True
    assert answer["reduced"]["r2_predicted_honest"] == pytest.approx(expected.r2_predicted_honest)
    assert len(answer["coefficients"]) == 10 > len(answer["reduced"]["coefficients"])
    assert "blocks of day" in text and "its price" in text and "p values and intervals follow that selection" in text
    assert main(["bbd", str(path), "--block", "day", "--select", "--reduce"]) == 2
    assert "one way to leave terms out" in capsys.readouterr().err


def test_a_selection_that_leaves_nothing_is_warned_of(tmp_path, capsys):
    """Nine effects that the replicates show: AICc of 17 runs still prefers the mean to all of them together."""
    coded, terms = box_behnken.coded_matrix(3, 5), quadratic_terms(list("ABC"))
    y = columns_of(coded, terms) @ [7.2, 0.4, -0.4, 0.4, -0.8, 0.8, 0.8, -0.8, -0.8, 0.8]
    y[-5:] += [0.5, -0.5, 0.25, -0.25, 0]
    frame = pd.DataFrame(coded, columns=list("ABC")).assign(y=y)
    assert exhaustive(box_behnken.analyse(code_design(frame)))[1] == {"1"}
    path = tmp_path / "small.csv"
    frame.to_csv(path, index=False)
    assert main(["bbd", str(path), "--select"]) == 0
    warned = capsys.readouterr().err
    assert "--select left no term" in warned and "--select left out what acts" in warned
