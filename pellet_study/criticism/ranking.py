"""The candidates in order, with what each would do and how large it would have to be to be seen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from pellet_study.criticism.calibration import CalibratedStudy, covariance, reduced_chi2
from pellet_study.criticism.score_tests import (
    exceedance,
    lack_of_fit,
)
from pellet_study.criticism.signatures import Signature, physical

PLAUSIBLE = 4.0  # chi2 by which a fit beyond the physical range must be better to be called implausible


@dataclass(frozen=True)
class Suspect:
    """One absent effect against the data.

    `score` is signed, in standard errors; `value` the fitted parameters; `note` is empty, or what speaks against it:
    "wrong sign", "implausible size", "these data cannot show it"; `smallest_visible` is the amount that would be
    noticed in 80 of 100 such data sets. `beyond` are the values a fit without the physical limit takes, and
    `beyond_chi2_drop` what they would gain.
    """

    effect: str
    score: float | None
    p: float | None
    p_adjusted: float | None
    chi2_drop: float
    value: dict[str, float]
    interval: tuple[float, float] | None
    visible_share: float
    smallest_visible: float | None
    lack_of_fit_p: float | None
    explains: bool
    note: str
    beyond: dict[str, float]
    beyond_chi2_drop: float | None = None


def _ranking(state, names, found, shown, scores, null, rivals, beyond) -> tuple[Suspect, ...]:
    cells, base = state.cells, len(state.fit.problem.free)
    known = cells.dof or max(len(cells.case) - base - 1, 1)
    fitted = {r.effects[0]: r for r in rivals if len(r.effects) == 1}
    critical = null[int(0.95 * len(null))] if len(null) else 2.6
    ranking = []
    for name in names:
        effect = state.model.study.catalogue.effects[name]
        mine = [k for k, s in enumerate(shown) if s.effect == name]
        if not mine:
            ranking.append(_unjudged(state, name, found))
            continue
        k = max(mine, key=lambda i: scores[i])
        score, signature = float(scores[k]), shown[k]
        absent = effect.neutral()[effect.amount]
        smallest = absent + (signature.size - absent) * (critical + 0.84) / signature.length
        reach = physical(state.model, name)[0][1 if signature.sign > 0 else 0]
        visible_size = float(smallest) if abs(smallest - absent) <= abs(reach - absent) else None
        rival = fitted.get(name)
        value, interval, drop, p_left, note, wide, gained = {}, None, 0.0, None, "", {}, None
        if rival is not None:
            own = rival.fit.values[base:]
            value = dict(zip(effect.parameters, map(float, own), strict=True))
            unit = 1.0 if cells.scale_known else reduced_chi2(state, rival.fit)
            drop = max(0.0, (state.fit.chi2 - rival.fit.chi2) / unit)
            se = float(np.sqrt(covariance(rival.fit)[base, base] * reduced_chi2(state, rival.fit)))
            low, high = rival.fit.problem.low[base], rival.fit.problem.high[base]
            interval = (float(max(low, own[0] - 2 * se)), float(min(high, own[0] + 2 * se)))
            p_left = lack_of_fit(rival.fit, cells)
            if name in beyond:
                better = rival.fit.chi2 - beyond[name].chi2
                if better > PLAUSIBLE * reduced_chi2(state, beyond[name]):
                    note = "implausible size"
                    gained = float((state.fit.chi2 - beyond[name].chi2) / unit)
                    wide = dict(zip(effect.parameters, map(float, beyond[name].values[base:]), strict=True))
        if score <= 0 and drop < 1.0:
            note = "wrong sign" if effect.sides == 1 else ""
        p = special.stdtr(known, -score)
        ranking.append(
            Suspect(
                effect=name,
                score=score,
                p=float(min(1.0, p * effect.sides)),
                p_adjusted=exceedance(null, score),
                chi2_drop=float(drop),
                value=value or {effect.amount: float(absent)},
                interval=interval,
                visible_share=signature.visible_share,
                smallest_visible=visible_size,
                lack_of_fit_p=p_left,
                explains=bool(rival and rival.explains),
                note=note,
                beyond=wide,
                beyond_chi2_drop=gained,
            )
        )
    return tuple(sorted(ranking, key=lambda s: (bool(s.note), -s.chi2_drop, -(s.score or 0.0))))


def unsimulated(state: CalibratedStudy) -> set[str]:
    """Effects whose simulations failed in some row: what they would do is not known."""
    failed = [key for engine in state.model.engines.values() for key in engine.failed]
    return {key[1] for key in failed if isinstance(key, tuple)}


def _unjudged(state: CalibratedStudy, name: str, found: Sequence[Signature]) -> Suspect:
    effect = state.model.study.catalogue.effects[name]
    share = max((s.visible_share for s in found if s.effect == name), default=0.0)
    neutral = {effect.amount: float(effect.neutral()[effect.amount])}
    note = "these data cannot show it"
    return Suspect(name, None, None, None, 0.0, neutral, None, share, None, None, False, note, {})
