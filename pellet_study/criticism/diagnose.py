"""Which absent effects would explain the misfit.

1. Signature of each candidate: the change of the predictions at the size that shows with three standard errors after
   the calibration has absorbed what it can (a small step misleads where the shape changes with the size).
2. Gate: the largest taken score of all candidates against its null distribution by Monte Carlo (max-T), in units of
   the residual scatter where that exceeds the replicates' (Birge).
3. Refit of every candidate within its physical range; ranking by chi2; a candidate explains where neither lack of fit
   nor a drifting constant is left, and where its own fitted size is one number over all sizes, conditions and rigs.
   All that explain and lie within TIE of the best are tied, or as much farther off as the scatter of their own
   simulations may have put them; pairs are looked at where no single effect explains, and single effects whose
   amount drifts (`near_misses`), which are simpler than a pair that explains no better.
4. The next measurement, which would separate the rivals (`next_measurement`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, fit_study, reduced_chi2
from pellet_study.criticism.compare import Comparison, compare
from pellet_study.criticism.constancy import freed
from pellet_study.criticism.explanations import DOUBTFUL, TIE, explanations, penalised, tied
from pellet_study.criticism.lack_of_fit import absorbed_basis
from pellet_study.criticism.least_squares import ROUNDS, Fit
from pellet_study.criticism.near_misses import Drifting, near_misses
from pellet_study.criticism.next_measurement import NextMeasurement, next_measurement
from pellet_study.criticism.outcomes import Outcome, nearest_miss, outcome_of
from pellet_study.criticism.possible import FEW_LEVELS
from pellet_study.criticism.ranking import PLAUSIBLE, Scores, Suspect, ranking_of, unjudged, unsimulated, with_faint
from pellet_study.criticism.rivals import Rival, failing_rigs, judge, objection_to, refits
from pellet_study.criticism.score_tests import VISIBLE, exceedance, largest_null, standardised
from pellet_study.criticism.signatures import Signature, signatures
from pellet_study.criticism.time_drift import TimeDrift, direction_of, unordered
from pellet_study.criticism.verdicts import FittedToo, Limited, Note, Undone, Verdict
from pellet_study.output.words import probability
from pellet_study.study.study import Study

# p below which a candidate is needed
GATE = 0.035  # for the first effect; lack of fit, drift and what sds found from readings cost spend the rest of 5 %
GATE_AGAIN = 0.004  # for each further one: the same data were searched before, and a look-alike leaves a misfit behind


@dataclass(frozen=True)
class Diagnosis:
    """The answer to "which effect is missing?"; `missing` names what stands out, `tied` what explains alike.

    `gate_p` is that of the largest score of all candidates, `gate` the p below which one is needed. `outcomes` say
    what each explanation would do to the error, `miss` what comes nearest where nothing explains; `undone` and `fitted_too`
    what would change the verdict, as far as it was looked for (`robustness`). `drifting` says of each effect named how its
    amount drifts, where that is what it takes to explain the data; empty where one amount does. `by_time` are drifts of
    readings with time that explain it as well, `unordered` says that no row tells when it was taken;
    `limited` where the scatter of the simulations leaves it undecided. `faint` are those named that show by too small a share
    to be seen by themselves.
    """

    verdict: Verdict
    missing: tuple[str, ...]
    tied: tuple[tuple[str, ...], ...]
    ranking: tuple[Suspect, ...]
    next_measurement: NextMeasurement | None
    gate_p: float | None
    comparison: Comparison
    rivals: tuple[Rival, ...]
    warnings: tuple[str, ...]
    gate: float = GATE
    outcomes: tuple[Outcome, ...] = ()
    miss: Outcome | None = None
    undone: Undone | None = None
    undone_tested: bool = False
    fitted_too: FittedToo | None = None
    drifting: tuple[Drifting, ...] = ()
    by_time: tuple[TimeDrift, ...] = ()
    unordered: bool = False
    limited: Limited | None = None
    faint: tuple[str, ...] = ()

    @property
    def named(self) -> tuple[tuple[str, ...], ...]:
        """The explanations that the verdict names: the one that is missing, or those tied."""
        return (self.missing,) if self.missing else self.tied

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


@dataclass(frozen=True)
class Prepared:
    """What a diagnosis starts from.

    Parameters
    ----------
    names, lost : the candidates, and those whose simulations failed
    signatures : all signatures of the candidates
    basis : what the calibrated constants absorb
    hopeless : too few different cases beyond the constants for any effect to show
    least : length of a signature that reaches the scatter of the readings, which without sd is that about the fit
    """

    comparison: Comparison
    names: tuple[str, ...]
    lost: tuple[str, ...]
    signatures: tuple[Signature, ...]
    basis: np.ndarray
    hopeless: bool
    warnings: tuple[str, ...]
    least: float = 1.0

    @cached_property
    def shown(self) -> list[Signature]:
        """Signatures that the calibration does not absorb, of an effect that may become large enough to be seen."""
        return [s for s in self.signatures if s.visible_share >= VISIBLE and s.length >= self.least]

    @cached_property
    def faint(self) -> list[Signature]:
        """Those of effects that show by too small a share for the gate, but may reach the scatter of the readings."""
        shown = {s.effect for s in self.shown}
        return [s for s in self.signatures if s.effect not in shown and s.length >= self.least]


@dataclass(frozen=True)
class Gate:
    """Is any candidate needed?

    Parameters
    ----------
    p : of the largest score over all candidates; None where no signature shows
    raw : the scores, (shown,), in units of the readings' scatter; `scores` has them in standard errors
    open : whether p is below the level of the gate
    """

    p: float | None
    raw: np.ndarray
    scores: Scores
    open: bool

    def closed_words(self, level: float) -> str:
        """Why nothing may be added; empty where something may."""
        if self.open:
            return ""
        return (
            f"the misfit has no candidate's shape: p {probability(self.p)} over all candidates (needed below {level:g})"
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

    Without `rank` the candidates are refitted only where the verdict needs it; without `propose` neither a next measurement
    nor what the rivals do to the error is looked for, with `ties_only` no measurement that separates the only explanation
    from the next best.
    """
    state = state or fit_study(study)
    prepared = prepare(study, state, comparison or compare(study, state))
    if prepared.hopeless:
        return replace(hopeless(study, state, prepared), gate=gate)
    gated = gate_of(state, prepared, gate)
    needed = gated.open or not prepared.comparison.fits
    singles, beyond = refits(state, prepared.shown, gated.raw) if needed or rank else ({}, {})
    if needed:
        rivals = judge(state, singles.values(), prepared.shown)
    else:
        rivals = [Rival((name,), fit, False) for name, fit in singles.items()]
    ranking = ranking_of(state, prepared.names, prepared.signatures, gated.scores, rivals, beyond)
    ranking += tuple(unjudged(state, name, [], Note.NOT_SIMULATED) for name in prepared.lost)
    chosen: list[Rival] = []
    pairs: list[Rival] = []
    drifting: tuple[Drifting, ...] = ()
    if gated.open:
        plausible = {s.effect for s in ranking if not s.note}
        singles_in_range = [r for r in rivals if set(r.effects) <= plausible]
        chosen, pairs = explanations(state, singles_in_range, prepared.shown, gated.raw, plausible)
        if not chosen or len(chosen[0].effects) > 1:  # one effect by another law is simpler than two
            below = chosen[0].fit.chi2 + TIE * reduced_chi2(state, chosen[0].fit) if chosen else np.inf
            near, drifting = near_misses(state, singles_in_range, prepared.shown, plausible, below)
            chosen = near or chosen
    faint: list[Rival] = []
    if chosen and not drifting:
        best = min(chosen, key=lambda r: penalised(r, state))
        faint = tied(state, faint_rivals(state, prepared), best)
        chosen = sorted([*chosen, *faint], key=lambda r: penalised(r, state))
        ranking = with_faint(state, ranking, faint)
    by_time = time_alike(state, prepared, chosen) if needed else ()
    named = {r.effects for r in chosen}
    rest = sorted((r for r in rivals if r.effects not in named), key=lambda r: r.fit.chi2)
    proposal = None
    if propose and len(chosen) > (1 if ties_only else 0):
        pool = chosen if len(chosen) > 1 else [*chosen, *_runner_up(rest, beyond)]
        proposal = next_measurement(state, {r.effects: r.fit for r in pool})
    unended = unended_fits(state, chosen, needed)
    verdict = verdict_of(needed, chosen, unended, by_time)
    miss = None
    if propose and verdict == Verdict.UNEXPLAINED:
        miss = nearest_miss(state, [*rivals, *pairs], beyond, gated.closed_words(gate))
    return Diagnosis(
        verdict=verdict,
        missing=chosen[0].effects if verdict == Verdict.MISSING else (),
        tied=tuple(r.effects for r in chosen) if verdict == Verdict.TIED else (),
        ranking=ranking,
        next_measurement=proposal,
        gate_p=gated.p,
        comparison=prepared.comparison,
        rivals=(*chosen, *rest),
        warnings=(
            *prepared.warnings,
            *_warnings(study, prepared, gated, verdict, propose and proposal is None),
            *_unended(unended),
        ),
        outcomes=tuple(outcome_of(state, rival) for rival in chosen) if propose else (),
        miss=miss,
        gate=gate,
        drifting=drifting,
        by_time=by_time,
        unordered=unordered(study),
        faint=tuple(r.effects[0] for r in faint),
    )


def faint_rivals(state: CalibratedStudy, prepared: Prepared) -> list[Rival]:
    """Effects that show too little for the gate and explain the data all the same, where something else is named.

    They cannot raise an alarm, but what they explain as well may not be named without them.
    """
    if not prepared.faint:
        return []
    scores = np.array([s.unit for s in prepared.faint]) @ state.fit.residual
    fits, beyond = refits(state, prepared.faint, scores)
    possible = {
        name: fitted
        for name, fitted in fits.items()
        if name not in beyond or fitted.chi2 - beyond[name].chi2 <= PLAUSIBLE * reduced_chi2(state, beyond[name])
    }
    return [r for r in judge(state, possible.values(), prepared.shown) if r.explains]


def time_alike(state: CalibratedStudy, prepared: Prepared, chosen: Sequence[Rival]) -> tuple[TimeDrift, ...]:
    """Drifts of readings with time that explain the data as well as what is chosen, or where nothing does at all."""
    best = min((rival.fit.chi2 for rival in chosen), default=np.inf)
    found = []
    for drift in prepared.comparison.time_drifts:
        if drift.p >= DOUBTFUL:
            continue
        fitted, _ = freed(state.fit, direction_of(state, drift))
        alike = fitted.chi2 < best + TIE * reduced_chi2(state, fitted)
        if alike and not objection_to(state, fitted, (), failing_rigs(state), prepared.shown):
            found.append(drift)
    return tuple(found)


def prepare(study: Study, state: CalibratedStudy, comparison: Comparison) -> Prepared:
    """The candidates and their signatures."""
    fitted, cells = state.fit, state.cells
    names = [name for name in study.absent() if name in state.model.effects]
    basis = absorbed_basis(fitted.jacobian[:, ~fitted.at_bound])  # a constant that sticks at its bound absorbs nothing
    spare = len(cells.case) - absorbed_basis(fitted.jacobian).shape[1]
    too_few = spare < 1 or (spare < 2 and not cells.scale_known)
    costly = state.model.levels <= FEW_LEVELS
    taken = [] if too_few and costly else signatures(state, names, basis)
    lost = unsimulated(state)
    return Prepared(
        comparison=comparison,
        names=tuple(name for name in names if name not in lost),
        lost=tuple(name for name in names if name in lost),
        signatures=tuple(s for s in taken if s.effect not in lost),
        basis=basis,
        hopeless=too_few,
        least=1.0 if cells.scale_known else min(1.0, float(np.sqrt(reduced_chi2(state, fitted)))),
        warnings=tuple(dict.fromkeys([*comparison.warnings, *state.model.warnings])),
    )


def hopeless(study: Study, state: CalibratedStudy, prepared: Prepared) -> Diagnosis:
    """The answer where the cases are too few for any effect to show."""
    others = what_varies(study)
    warning = "too few different cases beyond the free parameters: no effect can be shown by these data; " + (
        f"measure each rig under other conditions too: {others}"
        if others
        else "these rigs have no condition to vary: fix a parameter in study.toml that you know from elsewhere"
    )
    return Diagnosis(
        verdict=Verdict.ADEQUATE if prepared.comparison.fits else Verdict.UNEXPLAINED,
        missing=(),
        tied=(),
        ranking=tuple(unjudged(state, name, prepared.signatures, Note.NOT_SHOWN) for name in prepared.names),
        next_measurement=None,
        gate_p=None,
        comparison=prepared.comparison,
        rivals=(),
        warnings=(*prepared.warnings, warning),
    )


def gate_of(state: CalibratedStudy, prepared: Prepared, level: float) -> Gate:
    """The largest score of all candidates against its distribution where nothing is hidden."""
    shown, residual = prepared.shown, state.fit.residual
    if not shown:
        return Gate(None, np.zeros(0), Scores(shown, np.zeros(0), np.zeros(0)), False)
    unit = np.array([s.unit for s in shown])
    scores = standardised(residual[None], unit, prepared.basis, state.cells, two_sided=False)[0]
    null = largest_null(unit, prepared.basis, state.cells, two_sided=False)
    p = exceedance(null, scores.max())
    return Gate(p, unit @ residual, Scores(shown, scores, null), p < level)


def unended_fits(state: CalibratedStudy, chosen: Sequence[Rival], needed: bool) -> list[str]:
    """The fits that decide a verdict other than `adequate` and did not end within their rounds, by their effects.

    A present model whose fit did not end has a chi2 above its least: it may fit after all. Where it fits all the same,
    nothing has to be decided.
    """
    present = [] if state.fit.settled or not needed else ["the present model"]
    return present + [" + ".join(rival.effects) for rival in chosen if not rival.fit.settled]


def verdict_of(
    needed: bool, chosen: Sequence[Rival], unended: Sequence[str] = (), by_time: Sequence[TimeDrift] = ()
) -> Verdict:
    """By what explains the data, a drift with time too, whether anything has to, and whether the fits behind it ended."""
    if unended:
        return Verdict.UNDECIDED
    if len(chosen) == 1 and not by_time:
        return Verdict.MISSING
    if chosen:
        return Verdict.TIED
    return Verdict.UNEXPLAINED if needed else Verdict.ADEQUATE


def _unended(names: Sequence[str]) -> list[str]:
    if not names:
        return []
    return [
        f"the verdict is undecided because the fit of {', of '.join(names)} did not end within {ROUNDS} rounds: in study.toml "
        "narrow min and max of the free parameters, or begin nearer to the answer with `value`"
    ]


def _warnings(study: Study, prepared: Prepared, gated: Gate, verdict: Verdict, nothing_to_measure: bool) -> list[str]:
    """What the reader must know beside the verdict."""
    warnings = []
    if not prepared.names:
        warnings.append(f"{study.why_none_absent()}; there is nothing to rank")
    if verdict == Verdict.TIED and nothing_to_measure:
        warnings.append("no measurement within the possible conditions separates the tied explanations")
    if not gated.open and not prepared.comparison.fits and prepared.names:
        warnings.append("the model fails, but in no way that one of the candidates would make it fail")
    return warnings


def _runner_up(rest: Sequence[Rival], beyond: Mapping[str, Fit]) -> list[Rival]:
    """The next best single effect, at the size it would need even if that is implausible."""
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
        names = []
        for name, declared in study.catalogue.rigs[rig].conditions.items():
            if "options" in declared:
                names.append(f"{name} ({' or '.join(declared['options'])})")
            elif declared["min"] < declared["max"]:
                names.append(f"{name} ({declared['min']:g} to {declared['max']:g})")
        parts += [f"{rig} at other {' or '.join(names)}"] if names else []
    return "; ".join(parts)
