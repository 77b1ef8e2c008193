"""The scatter of the simulations beside that of the readings: how large it is, and whether a verdict hangs on it.

Errors of a row are the readings' and the simulations'. Where the simulations' share is large, a model may be called adequate
because they are too few. Such a verdict is asked for once more as if the simulations had no scatter: where it is another one
then, it is limited by them, and more are needed.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.criticism.cell_means import cell_means
from pellet_study.criticism.diagnose import Diagnosis, diagnose
from pellet_study.criticism.least_squares import fit, problem_of
from pellet_study.criticism.verdicts import Limited, Verdict
from pellet_study.study.study import Study

if TYPE_CHECKING:
    from pellet_study.model.surrogate import Surrogate

LOUD = 0.5  # variance of the simulations over that of the readings from which on a verdict may hang on the simulations
MOST_BLOCKS = 32  # times the simulations that a rig has at first


def loud(shares: Mapping[str, float]) -> dict[str, float]:
    """The rigs whose simulations scatter too much beside the readings, the worst first."""
    over = {rig: share for rig, share in shares.items() if share > LOUD}
    return dict(sorted(over.items(), key=lambda item: -item[1]))


def limited(study: Study, state: CalibratedStudy, found: Diagnosis, gate: float) -> bool:
    """Whether `adequate` is so only by the scatter of the simulations."""
    if found.verdict != Verdict.ADEQUATE or not loud(found.comparison.noise_share) or not state.cells.scale_known:
        return False
    cells = cell_means(state.model, [row for row in study.rows if row.split == "fit"])
    alone = replace(state, cells=cells, fit=fit(state.model, cells, problem_of(state.model, 0, state.fit.point)))
    return diagnose(study, alone, gate, propose=False, rank=False).verdict != Verdict.ADEQUATE


def undecided(study: Study, state: CalibratedStudy, found: Diagnosis, gate: float) -> Diagnosis:
    """A diagnosis that says so where its verdict hangs on the scatter of the simulations."""
    if not limited(study, state, found, gate):
        return found
    return replace(found, verdict=Verdict.UNDECIDED, limited=limit_of(state, found))


def limit_of(state: CalibratedStudy, found: Diagnosis) -> Limited:
    """What it would take to be rid of the limit: simulations of the worst rig, and cpu minutes."""
    rig, share = next(iter(loud(found.comparison.noise_share).items()))
    engine = cast("Surrogate", state.model.engines[rig])  # no other engine scatters
    blocks = engine.plan.blocks.get(rig, 1)
    number, seconds = engine.cost_of_more(rig)
    more = int(np.ceil(blocks * (share / LOUD - 1)))
    return Limited(rig, share, LOUD, more * number, more * seconds / 60)


def spent_s(state: CalibratedStudy) -> float:
    """Seconds of a processor that went into simulations so far; what was stored before cost nothing."""
    engines = {id(engine): engine for engine in state.model.engines.values()}
    return sum(engine.means.spent_s for engine in engines.values() if hasattr(engine, "means"))


def more_seeds(state: CalibratedStudy, found: Diagnosis, left_s: float) -> bool:
    """Have the worst rig simulated more from now on, unless that takes longer than is left, or it has been simulated enough."""
    rig = next(iter(loud(found.comparison.noise_share)))
    engine = cast("Surrogate", state.model.engines[rig])
    if engine.plan.blocks.get(rig, 1) >= MOST_BLOCKS:
        return False
    _, seconds = engine.cost_of_more(rig)
    if left_s <= 0 or seconds > left_s:  # seconds is 0 where none was timed
        return False
    engine.more(rig)
    return True
