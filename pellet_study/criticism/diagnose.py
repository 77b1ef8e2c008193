"""Which absent effects would explain the misfit.

1. Signature of each candidate: the change of the predictions at the size that shows with three standard errors after
   the calibration has absorbed what it can (a small step misleads where the shape changes with the size).
2. Gate: the largest signed score of all candidates against its null distribution by Monte Carlo (max-T), in units of
   the residual scatter where that exceeds the replicates' (Birge).
3. Refit of every candidate within its physical range; ranking by chi2; a candidate explains where neither lack of fit
   nor a drifting constant is left, and where its own fitted size is one number over all sizes, conditions and rigs.
   All that explain and lie within TIE of the best are tied, or as much farther off as the scatter of their own
   simulations may have put them; pairs are looked at where no single effect explains.
4. The next measurement, which would separate the rivals (`next_measurement`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, fit_study
from pellet_study.criticism.compare import Comparison, compare
from pellet_study.criticism.least_squares import Fit
from pellet_study.criticism.next_measurement import FEW_LEVELS, NextMeasurement, next_measurement
from pellet_study.criticism.ranking import Suspect, _ranking, _unjudged, unsimulated
from pellet_study.criticism.rivals import TIE, Rival, explanations, judge, refits
from pellet_study.criticism.score_tests import VISIBLE, absorbed_basis, exceedance, largest_null, standardised
from pellet_study.criticism.signatures import signatures
from pellet_study.study.study import Study

GATE = 0.035  # for the first effect; lack of fit, drift and what sds found from readings cost spend the rest of 5 %
GATE_AGAIN = 0.004  # for each further one


@dataclass(frozen=True)
class Diagnosis:
    """The answer to "which effect is missing?"; `missing` names what stands out, `tied` what explains alike."""

    verdict: str
    missing: tuple[str, ...]
    tied: tuple[tuple[str, ...], ...]
    ranking: tuple[Suspect, ...]
    next_measurement: NextMeasurement | None
    gate_p: float | None
    comparison: Comparison
    rivals: tuple[Rival, ...]
    warnings: tuple[str, ...]

    @property
    def alike_but_implausible(self) -> tuple[str, ...]:
        """Effects that would explain as well as what is named, at a size beyond their physical range."""
        drops = {s.effect: s.chi2_drop for s in self.ranking}
        named = [e for names in (self.missing, *self.tied) for e in names]
        best = max((drops[e] for e in named), default=None)
        if best is None:
            return ()
        return tuple(
            s.effect for s in self.ranking if s.beyond_chi2_drop is not None and s.beyond_chi2_drop > best - TIE
        )


def diagnose(
    study: Study,
    state: CalibratedStudy | None = None,
    gate: float = GATE,
    comparison: Comparison | None = None,
    propose: bool = True,
    rank: bool = True,
    ties_only: bool = False,
) -> Diagnosis:
    """Rank the effects a study's model lacks; changes nothing.

    Without `rank` the candidates are refitted only where the verdict needs it; without `propose` no next measurement is
    looked for, with `ties_only` none that separates the only explanation from the next best.
    """
    state = state or fit_study(study)
    comparison = comparison or compare(study, state)
    cells, fitted = state.cells, state.fit
    warnings = list(comparison.warnings)
    names = [name for name in study.absent() if name in state.model.effects]
    basis = absorbed_basis(fitted.jacobian[:, ~fitted.at_bound])  # a constant that sticks at its bound absorbs nothing
    spare = len(cells.case) - absorbed_basis(fitted.jacobian).shape[1]
    hopeless = spare < 1 or (spare < 2 and not cells.scale_known)
    dear = state.model.levels <= FEW_LEVELS
    found = [] if hopeless and dear else signatures(state, names, basis)
    lost = [name for name in names if name in unsimulated(state)]
    names = [name for name in names if name not in lost]
    found = [s for s in found if s.effect not in lost]
    warnings += [text for text in state.model.warnings if text not in warnings]
    shown = [s for s in found if s.visible_share >= VISIBLE and s.length >= 1.0]
    if hopeless:
        warnings.append(
            "too few different cases beyond the free parameters: no effect can be shown by these data; "
            f"measure each rig under other conditions too: {what_varies(study)}"
        )
        ranking = tuple(_unjudged(state, name, found) for name in names)
        return Diagnosis(
            "adequate" if comparison.fits else "unexplained",
            (),
            (),
            ranking,
            None,
            None,
            comparison,
            (),
            tuple(warnings),
        )
    gate_p, scores, errors, null = None, np.zeros(0), np.zeros(0), np.zeros(0)
    if shown:
        unit = np.array([s.unit for s in shown])
        scores = unit @ fitted.residual
        errors = standardised(fitted.residual[None], unit, basis, cells, two_sided=False)[0]
        null = largest_null(unit, basis, cells, two_sided=False)
        gate_p = exceedance(null, errors.max())
    open_gate = gate_p is not None and gate_p < gate
    if not names:
        warnings.append("no absent effect acts in the rigs used: there is nothing to rank")
    needed = open_gate or not comparison.fits
    singles, beyond = refits(state, names, shown, scores) if shown and (needed or rank) else ({}, {})
    rivals = judge(state, singles.values(), shown) if needed else [Rival(k, f, False) for k, f in singles.items()]
    ranking = _ranking(state, names, found, shown, errors, null, rivals, beyond)
    ranking += tuple(replace(_unjudged(state, name, []), note="its simulations failed: not judged") for name in lost)
    plausible = {s.effect for s in ranking if not s.note}
    verdict, chosen = "adequate", []
    if needed:
        verdict = "unexplained"
        if open_gate:
            chosen = explanations(state, [r for r in rivals if set(r.effects) <= plausible], shown, scores, plausible)
    missing: tuple[str, ...] = ()
    tied: tuple[tuple[str, ...], ...] = ()
    if len(chosen) == 1:
        verdict, missing = "missing", chosen[0].effects
    elif len(chosen) > 1:
        verdict, tied = "tied", tuple(r.effects for r in chosen)
    rest = sorted((r for r in rivals if r.effects not in {c.effects for c in chosen}), key=lambda r: r.fit.chi2)
    proposal = None
    if propose and len(chosen) > (1 if ties_only else 0):
        pool = chosen if len(chosen) > 1 else [*chosen, *_runner_up(rest, beyond)]
        proposal = next_measurement(state, {r.effects: r.fit for r in pool})
        if proposal is None and len(chosen) > 1:
            warnings.append("no measurement within the possible conditions separates the tied explanations")
    if needed and not open_gate:
        warnings.append("the model fails, but in no way that one of the candidates would make it fail")
    return Diagnosis(
        verdict,
        missing,
        tied,
        ranking,
        proposal,
        gate_p,
        comparison,
        tuple([*chosen, *rest]),
        tuple(warnings),
    )


def _runner_up(rest: Sequence[Rival], beyond: dict[str, Fit]) -> list[Rival]:
    """The next best single effect, at the size it would need even if that is implausible."""
    if not rest:
        return []
    pool = [
        Rival(r.effects, min((r.fit, beyond.get(r.effects[0], r.fit)), key=lambda f: f.chi2), False)
        for r in rest
        if len(r.effects) == 1
    ]
    return sorted(pool, key=lambda r: r.fit.chi2)[:1]


def what_varies(study: Study) -> str:
    """The conditions of a study's rigs that can be set otherwise, with their ranges, in words."""
    parts = []
    for rig in study.rigs:
        ranges = study.catalogue.rigs[rig].conditions.items()
        names = [f"{name} ({q['min']:g} to {q['max']:g})" for name, q in ranges if q["min"] < q["max"]]
        parts.append(f"{rig} at other {' or '.join(names)}")
    return "; ".join(parts)
