"""Equivalence tests against statsmodels' own (raw data), their level, the margin declared beforehand."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from pellet_study.__main__ import main
from pellet_study.doe import box_behnken, margins, validation
from pellet_study.doe.validation import Sample, equivalence, sample_of
from pellet_study.doe.validation_text import equivalence_text
from pellet_study.errors import InputError

# heights printed by T. S. Juzek, "The TOST - an example of setting delta", with their means and sd
ANSTRUTHER = [
    173,
    168,
    150,
    171,
    166,
    161,
    170,
    163,
    164,
    169,
    178,
    178,
    158,
    164,
    165,
    165,
    180,
    193,
    174,
    165,
    170,
    180,
    171,
    157,
    169,
    178,
    163,
    167,
    180,
    168,
]
CRAIL = [
    164,
    177,
    176,
    154,
    176,
    145,
    170,
    172,
    171,
    171,
    174,
    165,
    169,
    179,
    163,
    166,
    173,
    181,
    169,
    171,
    170,
    153,
    169,
    175,
    178,
    165,
    159,
    163,
    152,
    168,
]


def test_means_and_sd_as_printed():
    first, second = sample_of(ANSTRUTHER), sample_of(CRAIL)
    assert [round(x, 2) for x in (first.mean, first.sd, second.mean, second.sd)] == [
        169.27,
        8.52,
        167.93,
        8.59,
    ]


def test_two_samples_as_statsmodels():
    from statsmodels.stats.weightstats import ttest_ind, ttost_ind

    p, lower, upper = ttost_ind(np.array(ANSTRUTHER), np.array(CRAIL), -5, 5, usevar="unequal")
    found = equivalence(sample_of(ANSTRUTHER), sample_of(CRAIL), 5)
    assert found.p == pytest.approx(p)
    assert (found.p_lower, found.p_upper, found.df) == pytest.approx((lower[1], upper[1], lower[2]))
    t, p_difference, _ = ttest_ind(np.array(ANSTRUTHER), np.array(CRAIL), usevar="unequal")
    assert (found.t, found.p_difference) == pytest.approx((t, p_difference))


def test_one_sample_as_statsmodels():
    from statsmodels.stats.weightstats import DescrStatsW

    p, lower, upper = DescrStatsW(CRAIL).ttost_mean(165, 173)
    found = equivalence(sample_of(CRAIL), Sample(169), 4)
    assert (found.p, found.p_lower, found.p_upper) == pytest.approx((p, lower[1], upper[1]))


def test_equivalence_is_the_interval_inside_the_margin():
    for margin in (1, 2, 3, 4, 5, 6):
        found = equivalence(sample_of(ANSTRUTHER), sample_of(CRAIL), margin)
        assert found.equivalent == (-margin < found.interval[0] and found.interval[1] < margin)


def test_level_and_power_by_simulation():
    rng = np.random.default_rng(3)
    n, margin = 10, 1.2

    def shown(difference):
        x = rng.normal(difference, 1, size=(20000, n))
        error = x.std(axis=1, ddof=1) / np.sqrt(n)
        t = 1.833112932656236  # printed tables: t(0.95; 9)
        return np.mean((x.mean(axis=1) + margin > t * error) & (margin - x.mean(axis=1) > t * error))

    assert shown(margin) == pytest.approx(0.05, abs=0.006)
    predicted = validation.tost_power(margin, 1 / np.sqrt(n), n - 1)
    assert shown(0.0) == pytest.approx(predicted, abs=0.03)


@pytest.mark.parametrize(("cv", "n", "power"), [(0.3, 40, 0.815845), (0.2, 20, 0.834680)])
def test_power_as_published(cv, n, power):
    """sampleN.TOST of the R package PowerTOST (exact, by Owen's Q): 2 x 2 crossover, true ratio 0.95, limits 0.8 to 1.25."""
    error = np.sqrt(2 * np.log(1 + cv**2) / n)
    assert validation.tost_power(np.log(1.25), error, n - 2, 0.05, np.log(0.95)) == pytest.approx(power, abs=1e-6)


@pytest.mark.parametrize(("n", "margin"), [(2, 3.0), (3, 1.5), (4, 1.2)])
def test_power_of_few_runs_by_simulation(n, margin):
    x = np.random.default_rng(0).normal(size=(200_000, n))
    t = {2: 6.313751514675043, 3: 2.9199855803537256, 4: 2.3533634348018264}[n]  # printed tables: t(0.95; n - 1)
    shown = np.mean(np.abs(x.mean(axis=1)) < margin - t * x.std(axis=1, ddof=1) / np.sqrt(n))
    assert validation.tost_power(margin, 1 / np.sqrt(n), n - 1) == pytest.approx(shown, abs=0.004)


def test_a_large_p_is_never_called_equality():
    few = equivalence(Sample(41.27, 2.0, 3), Sample(41.69, 0.79, 5), 0.8)
    text = equivalence_text(few)
    assert few.p_difference > 0.05 and not few.equivalent
    assert "equivalence is not shown" in text and "which does not show that there is none" in text
    assert "n 3" in text and "sd 2" in text and "power" in text


def test_a_small_difference_can_be_both_real_and_within_the_margin():
    found = equivalence(Sample(10.1, 0.1, 50), Sample(10), 0.5)
    assert found.equivalent and found.different


@pytest.mark.parametrize(
    ("runs", "target", "margin"),
    [
        (Sample(1, 0.1, 5), Sample(1), 0),
        (Sample(1, 0.1, 1), Sample(1), 1),
        (Sample(1, 0.1, 5), Sample(1, 0.1, 1), 1),
        (Sample(1, 0.0, 5), Sample(1), 1),
    ],
)
def test_what_cannot_be_tested_is_refused(runs, target, margin):
    with pytest.raises(InputError):
        equivalence(runs, target, margin)


def test_one_run_is_no_validation():
    with pytest.raises(InputError, match="2 or more"):
        sample_of([41.27])


def test_the_margin_is_declared_once_before_the_runs(tmp_path):
    path = tmp_path / "margin.json"
    with pytest.raises(InputError, match="no margin was declared"):
        margins.read_margin(path)
    margins.declare_margin(path, 0.8, "deg")
    margins.declare_margin(path, 0.8, "deg")
    assert margins.read_margin(path) == 0.8
    with pytest.raises(InputError, match="not changed"):
        margins.declare_margin(path, 1.2, "deg")
    path.write_text('{"margin": "wide"}')
    with pytest.raises(InputError, match="expected"):
        margins.read_margin(path)


def test_each_response_has_a_margin_of_its_own(tmp_path):
    path = tmp_path / "margin.json"
    margins.declare_margin(path, 3, "cSt", "Viscosity", only=False)
    with pytest.raises(InputError, match="no margin of Yield, but of Viscosity"):
        margins.read_margin(path, "Yield", only=False)
    margins.declare_margin(path, 0.5, "%", "Yield", only=False)
    assert [margins.read_margin(path, name) for name in ("Viscosity", "Yield")] == [3, 0.5]
    with pytest.raises(InputError, match="3 of Viscosity already, not 4"):
        margins.declare_margin(path, 4, "cSt", "Viscosity")


def test_a_margin_without_a_name_belongs_to_the_only_response(tmp_path):
    path = tmp_path / "margin.json"
    path.write_text('{"margin": 3.0, "unit": ""}')
    assert margins.read_margin(path, "Yield", only=True) == 3
    with pytest.raises(InputError, match="without saying of which") as told:
        margins.read_margin(path, "Yield", only=False)
    path.write_text(str(told.value).split(" write ")[1].split(" into the file")[0])  # the advice works when followed
    assert margins.read_margin(path, "Yield", only=False) == 3
    path.write_text('{"margin": 3.0, "unit": ""}')
    margins.declare_margin(path, 0.5, "%", "Yield", only=False)
    assert margins.read_margin(path, "Yield", only=False) == 0.5 and margins.read_margin(path) == 3


def test_a_mean_within_limits_is_the_one_sided_t_test_of_scipy():
    values = [79.1, 79.6, 78.9, 79.4, 79.3]
    found = validation.within_limits(values, (78.5, 80.5))
    for word, limit, side in (("at least", 78.5, "greater"), ("at most", 80.5, "less")):
        assert found.p[word][0] == limit
        assert found.p[word][1] == pytest.approx(stats.ttest_1samp(values, limit, alternative=side).pvalue)
    assert found.shown
    assert not validation.within_limits(values, (79.2, np.inf)).shown
    with pytest.raises(InputError, match="all runs are equal"):
        validation.within_limits([1, 1], (0, 2))


@pytest.mark.parametrize("inside, contradicted", [(4, False), (3, False), (2, True), (0, True)])
def test_too_few_runs_where_the_fit_predicts_them_are_said(inside, contradicted):
    """Of 4 runs, 95 % expected each: 3 or fewer have p 0.19, 2 or fewer p 0.014 (binomial)."""
    found = validation.beside_prediction([1.0] * inside + [3.0] * (4 - inside), (0.5, 2.0), 0.95)
    assert found.inside == inside and found.contradicted is contradicted
    assert found.p == pytest.approx(stats.binom.cdf(inside, 4, 0.95))


def test_runs_that_contradict_the_model_are_never_silent(tmp_path, capsys):
    """Below the limit as wanted, and far from what the model predicts: both are said; so of a target."""
    coded = box_behnken.coded_matrix(3, 5)
    frame = pd.DataFrame(coded, columns=list("ABC"))
    frame["y"] = 5 + coded @ [1, -0.5, 0] + 0.05 * np.random.default_rng(7).normal(size=len(coded))
    path = tmp_path / "runs.csv"
    frame.to_csv(path, index=False)
    at = ["--at", "A=0,B=0,C=0"]
    assert main(["bbd", str(path), "--limits", ",6", "--verify", "4.1,4.2,4.0", *at]) == 0
    told = capsys.readouterr()
    assert ": shown" in told.out and "0 of 3 runs lie in the 95 % prediction interval" in told.out
    assert "it does not hold at this setting" in told.err
    assert main(["bbd", str(path), "--declare-margin", "0.5"]) == 0
    assert main(["bbd", str(path), "--target", "4.1", "--verify", "4.1,4.2,4.0", *at]) == 0
    told = capsys.readouterr()
    assert "equivalent within the margin" in told.out and "it does not hold at this setting" in told.err
    assert main(["bbd", str(path), "--target", "5", "--verify", "5.04,4.97,5.02", *at]) == 0
    assert "does not hold" not in capsys.readouterr().err


def test_more_runs_that_reach_the_power_asked_for():
    found = equivalence(Sample(10, 1.0, 4), Sample(10), 1.0)
    n = found.n_for_power
    assert (
        validation.tost_power(1.0, 1 / np.sqrt(n), n - 1) >= 0.8 > validation.tost_power(1.0, 1 / np.sqrt(n - 1), n - 2)
    )
