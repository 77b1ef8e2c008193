"""The candidates in order, with what each would do and how large it would have to be to be seen."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from pellet_study.criticism.calibration import CalibratedStudy, covariance, reduced_chi2
from pellet_study.criticism.lack_of_fit import lack_of_fit
from pellet_study.criticism.least_squares import Fit
from pellet_study.criticism.rivals import Rival
from pellet_study.criticism.score_tests import exceedance
from pellet_study.criticism.signatures import Signature
from pellet_study.criticism.verdicts import Note
from pellet_study.criticism.ways import physical
from pellet_study.model.model import Model

PLAUSIBLE = (
    4.0  # chi2, two standard errors, by which a fit beyond the physical range must be better to be called implausible
)
CRITICAL = 2.6  # the usual 5 % point of the largest score, where no draws tell it
POWER = 0.84  # standard errors beyond the critical value, seen in 80 of 100 data sets


@dataclass(frozen=True)
class Suspect:
    """One absent effect against the data.

    `score` is signed, in standard errors; `value` the fitted parameters; `note` what speaks against it, if anything;
    `smallest_visible` is the amount that would be noticed in 80 of 100 such data sets. `beyond` are the values a fit
    without the physical limit takes, and `beyond_chi2_drop` what they would gain.
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
    note: Note
    beyond: dict[str, float]
    beyond_chi2_drop: float | None = None


@dataclass(frozen=True)
class Scores:
    """Scores of the signatures that show, in standard errors, and the sorted draws of the largest of them by chance."""

    shown: Sequence[Signature]
    values: np.ndarray
    null: np.ndarray

    @property
    def critical(self) -> float:
        """The largest score that chance exceeds in 5 of 100 data sets."""
        return self.null[int(0.95 * len(self.null))] if len(self.null) else CRITICAL


def ranking_of(
    state: CalibratedStudy,
    names: Sequence[str],
    signatures: Sequence[Signature],
    scores: Scores,
    rivals: Iterable[Rival],
    beyond: Mapping[str, Fit],
) -> tuple[Suspect, ...]:
    """The candidates, best first: by the drop of chi2, those with a note last.

    Parameters
    ----------
    names, signatures : the candidates and all their signatures
    scores : of the signatures that show
    rivals, beyond : candidates fitted within their physical range, and without that limit
    """
    fitted = {r.effects[0]: r for r in rivals if len(r.effects) == 1}
    ranking = []
    for name in names:
        own = [k for k, s in enumerate(scores.shown) if s.effect == name]
        if own:
            best = max(own, key=lambda k: scores.values[k])
            ranking.append(suspect_of(state, scores, best, fitted.get(name), beyond.get(name)))
        else:
            ranking.append(unjudged(state, name, signatures, Note.NOT_SHOWN))
    return tuple(sorted(ranking, key=lambda s: (bool(s.note), -s.chi2_drop, -(s.score or 0.0))))


def with_faint(state: CalibratedStudy, ranking: Sequence[Suspect], faint: Sequence[Rival]) -> tuple[Suspect, ...]:
    """A ranking in which effects that show too little to be scored stand with their fits."""
    fitted = {r.effects[0]: r for r in faint}
    told = [
        _fitted(state, replace(s, note=Note.NONE), fitted[s.effect], None) if s.effect in fitted else s for s in ranking
    ]
    return tuple(sorted(told, key=lambda s: (bool(s.note), -s.chi2_drop, -(s.score or 0.0))))


def suspect_of(state: CalibratedStudy, scores: Scores, best: int, rival: Rival | None, beyond: Fit | None) -> Suspect:
    """A candidate by the best of its signatures and, where it was fitted, by its fit."""
    cells, free = state.cells, len(state.fit.problem.free)
    score, signature = float(scores.values[best]), scores.shown[best]
    effect = state.model.study.catalogue.effects[signature.effect]
    absent = effect.neutral()[effect.amount]
    dof = cells.dof or max(len(cells.case) - free - 1, 1)
    suspect = Suspect(
        effect=signature.effect,
        score=score,
        p=float(min(1.0, special.stdtr(dof, -score) * effect.sides)),
        p_adjusted=exceedance(scores.null, score),
        chi2_drop=0.0,
        value={effect.amount: float(absent)},
        interval=None,
        visible_share=signature.visible_share,
        smallest_visible=_smallest_visible(state.model, signature, absent, scores.critical),
        lack_of_fit_p=None,
        explains=False,
        note=Note.NONE,
        beyond={},
    )
    if rival is not None:
        suspect = _fitted(state, suspect, rival, beyond)
    if score <= 0 and suspect.chi2_drop < 1.0:
        suspect = replace(suspect, note=Note.WRONG_SIGN if effect.sides == 1 else Note.NONE)
    return suspect


def _smallest_visible(model: Model, signature: Signature, absent: float, critical: float) -> float | None:
    """The amount that is noticed in 80 of 100 data sets; None beyond the physical range."""
    smallest = absent + (signature.size - absent) * (critical + POWER) / signature.length
    limit = physical(model, signature.effect)[0][1 if signature.sign > 0 else 0]
    return float(smallest) if abs(smallest - absent) <= abs(limit - absent) else None


def _fitted(state: CalibratedStudy, suspect: Suspect, rival: Rival, beyond: Fit | None) -> Suspect:
    """A candidate with what its fits say: size, interval, drop of chi2, and what it would need without physical limit."""
    effect = state.model.study.catalogue.effects[suspect.effect]
    amount = len(state.fit.problem.free)  # place of the effect's amount in the fit, behind the constants
    fit, unit = rival.fit, 1.0 if state.cells.scale_known else reduced_chi2(state, rival.fit)
    size = fit.values[amount:]
    error = float(np.sqrt(covariance(fit)[amount, amount] * reduced_chi2(state, fit)))
    low, high = fit.problem.low[amount], fit.problem.high[amount]
    suspect = replace(
        suspect,
        value=dict(zip(effect.parameters, map(float, size), strict=True)),
        interval=(float(max(low, size[0] - 2 * error)), float(min(high, size[0] + 2 * error))),
        chi2_drop=float(max(0.0, (state.fit.chi2 - fit.chi2) / unit)),
        lack_of_fit_p=lack_of_fit(fit, state.cells),
        explains=bool(rival.explains),
    )
    if beyond is None or fit.chi2 - beyond.chi2 <= PLAUSIBLE * reduced_chi2(state, beyond):
        return suspect
    return replace(
        suspect,
        note=Note.IMPLAUSIBLE_SIZE,
        beyond=dict(zip(effect.parameters, map(float, beyond.values[amount:]), strict=True)),
        beyond_chi2_drop=float((state.fit.chi2 - beyond.chi2) / unit),
    )


def unjudged(state: CalibratedStudy, name: str, signatures: Sequence[Signature], note: Note) -> Suspect:
    """A candidate that these data, or its simulations, do not tell."""
    effect = state.model.study.catalogue.effects[name]
    return Suspect(
        effect=name,
        score=None,
        p=None,
        p_adjusted=None,
        chi2_drop=0.0,
        value={effect.amount: float(effect.neutral()[effect.amount])},
        interval=None,
        visible_share=max((s.visible_share for s in signatures if s.effect == name), default=0.0),
        smallest_visible=None,
        lack_of_fit_p=None,
        explains=False,
        note=note,
        beyond={},
    )


def unsimulated(state: CalibratedStudy) -> set[str]:
    """Effects whose simulations failed in some row: what they would do is not known."""
    failed = [key for engine in state.model.engines.values() for key in engine.failed]
    return {key[1] for key in failed if isinstance(key, tuple)}
