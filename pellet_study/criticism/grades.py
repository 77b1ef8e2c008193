"""How well a model fits, in graded words: fits, doubtful, does not fit, each with the p value and the rule behind it.

A model does not fit where one test is below its own limit: lack of fit over all rigs, lack of fit of one rig (the limit
shared among the rigs), drift of a constant over a condition, or of the readings with
their order (p over all drifts together). It is doubtful where one of them
is below `DOUBTFUL`, shared likewise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pellet_study.criticism.constancy import DRIFT, Drift
from pellet_study.criticism.lack_of_fit import LACK_IN_A_RIG
from pellet_study.criticism.time_drift import TimeDrift
from pellet_study.criticism.verdicts import Grade

# p over all rigs together below which a model fails; the gate of `diagnose` has most of the 5 % of alarms that nothing
# hidden may raise, so that little is left for lack of fit and drift
LACK_OF_FIT = 0.001
DOUBTFUL = 0.05  # p below which a fit is doubtful: of twenty good models one is, by each test
RULE = (
    f"does not fit where lack of fit has p < {LACK_OF_FIT:g} (in one rig p < {LACK_IN_A_RIG:g}, shared among the rigs) or a "
    f"constant, or readings with their order, drift with p < {DRIFT:g}; doubtful where one of these has p < {DOUBTFUL:g}"
)


@dataclass(frozen=True)
class FitTest:
    """A test of a model: what it is `of`, its p, and the p below which the model fails, or is doubtful."""

    of: str
    p: float
    fails: float
    doubtful: float


@dataclass(frozen=True)
class Judgement:
    """A grade and the test that decides it; None where no test could be made."""

    grade: Grade | None
    by: FitTest | None


def tests_of(
    lack: float | None, by_rig: Mapping[str, float], drifts: Sequence[Drift], over_time: Sequence[TimeDrift] = ()
) -> list[FitTest]:
    """The tests of a model: lack of fit over all, of every rig, the worst drift, and the worst with time."""
    found = [] if lack is None else [FitTest("lack of fit", lack, LACK_OF_FIT, DOUBTFUL)]
    share = max(len(by_rig), 1)
    for rig, p in by_rig.items():
        what = "lack of fit" if share == 1 else f"lack of fit of {rig}"
        found.append(FitTest(what, p, LACK_IN_A_RIG / share, DOUBTFUL / share))
    if drifts:
        worst = drifts[0]
        found.append(FitTest(f"drift of {worst.parameter} with {worst.condition}", worst.p, DRIFT, DOUBTFUL))
    if over_time:
        worst_of = over_time[0]
        found.append(FitTest(f"drift of {worst_of.observable} with time", worst_of.p, DRIFT, DOUBTFUL))
    return found


def judged(tests: Sequence[FitTest]) -> Judgement:
    """The grade by the test that speaks most against the model."""
    failing = [test for test in tests if test.p < test.fails]
    if failing:
        return Judgement(Grade.FAILS, min(failing, key=lambda test: test.p / test.fails))
    worst = min(tests, key=lambda test: test.p / test.doubtful, default=None)
    if worst is None:
        return Judgement(None, None)
    return Judgement(Grade.DOUBTFUL if worst.p < worst.doubtful else Grade.FITS, worst)
