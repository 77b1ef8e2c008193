"""Compare, diagnose, add, again: until the model explains the data, or nothing more can be said.

Forward by whole explanations (a single effect, else a pair), each followed by a backward check and by swaps, in which a
rival of the same rigs takes the place of an effect added earlier; at most three effects.
Nothing is added because it merely lowers chi2: an explanation must leave neither lack of fit nor a drifting constant,
and no rival may explain as well. A near miss, whose amount drifts, is named and not added.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, fit_study, reduced_chi2
from pellet_study.criticism.compare import Comparison, compare
from pellet_study.criticism.diagnose import GATE, GATE_AGAIN, Diagnosis, diagnose
from pellet_study.criticism.explanations import TIE
from pellet_study.criticism.lack_of_fit import absorbed_basis
from pellet_study.criticism.least_squares import fit_many, problem_of
from pellet_study.criticism.noise import limit_of, limited, more_seeds, spent_s
from pellet_study.criticism.possible import needs_simulation
from pellet_study.criticism.rivals import refits
from pellet_study.criticism.robustness import examined
from pellet_study.criticism.score_tests import VISIBLE
from pellet_study.criticism.signatures import signatures
from pellet_study.criticism.verdicts import Verdict
from pellet_study.model.model import Engine, Model
from pellet_study.study.study import Study

MOST_EFFECTS = 3  # no trial hides more than two


@dataclass(frozen=True)
class Refinement:
    """What refine did: `steps[0]` is the model as it came, `first` its fit; `study`, `state` as it is left."""

    verdict: Verdict
    added: tuple[str, ...]
    tied: tuple[tuple[str, ...], ...]
    steps: tuple[Comparison, ...]
    diagnoses: tuple[Diagnosis, ...]
    study: Study
    first: CalibratedStudy
    state: CalibratedStudy

    @property
    def last(self) -> Diagnosis:
        """The diagnosis the verdict comes from."""
        return self.diagnoses[-1]

    def best_of_tie(self) -> Study:
        """The study with the best of the tied explanations added, which `refine` does not do; the study as it is left
        where nothing is tied."""
        study = self.study
        for name in self.tied[0] if self.tied else ():
            best = self.last.rivals[0].fit.point
            study = study.with_effect(name, _values(study, name, best, self.state.model.column))
        return study


class _Steps:
    """The model as it grows: a study and its fit, and every comparison on the way."""

    def __init__(self, study: Study, state: CalibratedStudy, level_out: bool) -> None:
        self.study, self.state, self.level_out = study, state, level_out
        self.added: list[str] = []
        self.comparisons = [compare(study, state, level_out=level_out)]

    def to(self, study: Study, extra_starts: int, start: np.ndarray | None = None) -> None:
        """Go on with another model of the same rows, whose fit begins at a point too."""
        cells = None if self.state.model.scatters else self.state.cells  # gathered anew where the model scatters too
        model = Model(study, engines=self.state.model.engines)
        self.study, self.state = study, fit_study(study, model, cells, extra_starts, start)
        self.comparisons.append(compare(study, self.state, level_out=self.level_out))

    def again(self) -> None:
        """Calibrate the same model anew, as there are more simulations behind it now."""
        self.state = fit_study(self.study, Model(self.study, engines=self.state.model.engines), extra_starts=1)
        self.comparisons[-1] = compare(self.study, self.state, level_out=self.level_out)

    def add(self, found: Diagnosis) -> None:
        """Add what a diagnosis names, one after the other, the first of the ranking first."""
        order = {s.effect: k for k, s in enumerate(found.ranking)}
        point, column = found.rivals[0].fit.point, self.state.model.column
        for name in sorted(found.missing, key=order.__getitem__):
            self.added.append(name)
            self.to(self.study.with_effect(name, _values(self.study, name, point, column)), extra_starts=1, start=point)

    def look_back(self) -> None:
        """Leave out what is needless by now; exchange what was added for rivals that fit better."""
        for name in needless(self.study, self.state, self.added):
            self.added.remove(name)
            self.to(self.study.without_effect(name), extra_starts=3)
        while (trade := swap(self.study, self.state, self.added)) is not None:
            old, new, values = trade
            self.added[self.added.index(old)] = new
            self.to(self.study.without_effect(old).with_effect(new, values), extra_starts=1)


def _values(study: Study, name: str, point: np.ndarray, column: Mapping[str, int]) -> dict[str, float]:
    """Values of an effect's parameters at a point of a model."""
    return {p: point[column[f"{name}.{p}"]] for p in study.catalogue.effects[name].parameters}


def refine(
    study: Study,
    state: CalibratedStudy | None = None,
    most: int = MOST_EFFECTS,
    propose: bool = True,
    rank: bool = True,
    engines: Mapping[str, Engine] | None = None,
    budget_s: float | None = None,
) -> Refinement:
    """Add the effects the measurements show to be missing.

    `propose` says whether the next measurement is to be looked for (where simulations must tell, only if explanations are
    tied), `rank` whether the candidates are to be ranked where nothing is missing. `budget_s` are the seconds of a processor
    that may go into more simulations where a verdict hangs on their scatter; None: that is not looked at.

    Raises
    ------
    InputError : the study gives nothing to fit
    """
    first = state or fit_study(study, Model(study, engines=engines))
    steps, ties_only = _Steps(study, first, level_out=propose), needs_simulation(study)

    left_s = budget_s

    def diagnosis() -> Diagnosis:
        nonlocal left_s
        level = GATE_AGAIN if steps.added else GATE
        found = diagnose(steps.study, steps.state, level, steps.comparisons[-1], propose, rank, ties_only)
        while left_s is not None and limited(steps.study, steps.state, found, level):
            before = spent_s(steps.state)
            if not more_seeds(steps.state, found, left_s):
                found = replace(found, verdict=Verdict.UNDECIDED, limited=limit_of(steps.state, found))
                break
            steps.again()
            left_s -= spent_s(steps.state) - before
            found = diagnose(steps.study, steps.state, level, steps.comparisons[-1], propose, rank, ties_only)
        return examined(steps.study, steps.state, found, level) if propose else found

    diagnoses = [diagnosis()]
    while (
        len(steps.added) < most
        and diagnoses[-1].verdict == Verdict.MISSING
        and not diagnoses[-1].drifting
        and len(steps.added) + len(diagnoses[-1].missing) <= most
    ):
        steps.add(diagnoses[-1])
        steps.look_back()
        diagnoses.append(diagnosis())
    study = steps.study
    for name in steps.added:
        study = study.with_effect(name, _values(study, name, steps.state.fit.point, steps.state.model.column))
    last = diagnoses[-1]
    return Refinement(
        last.verdict,
        tuple(steps.added),
        last.tied,
        tuple(steps.comparisons),
        tuple(diagnoses),
        study,
        first,
        steps.state,
    )


def needless(study: Study, state: CalibratedStudy, added: list[str]) -> list[str]:
    """The added effect that can be left out at the least loss, if that is less than a tie allows; the last one is always kept."""
    if len(added) < 2:
        return []
    problems = []
    for name in added[:-1]:
        smaller = Model(study.without_effect(name), engines=state.model.engines)
        point = state.fit.point.copy()
        for parameter, value in study.catalogue.effects[name].neutral().items():
            point[state.model.column[f"{name}.{parameter}"]] = value
        problems.append(problem_of(smaller, 1, point))
    losses = [f.chi2 - state.fit.chi2 for f in fit_many(state.model, state.cells, problems)]
    least = min(losses)
    return [added[losses.index(least)]] if least < TIE * reduced_chi2(state, state.fit) else []


def swap(study: Study, state: CalibratedStudy, added: list[str]) -> tuple[str, str, dict[str, float]] | None:
    """The effect added earlier, the absent one in its place that fits best, and its values, if that gains more than a tie allows.

    The last one added is left alone: it has just been chosen among its rivals.
    """
    catalogue, engines, trades = study.catalogue, state.model.engines, []
    for old in added[:-1]:
        smaller = study.without_effect(old)
        without = fit_study(smaller, Model(smaller, engines=engines), state.cells, extra_starts=1)
        names = [
            n
            for n in smaller.absent()
            if n != old and set(catalogue.effects[n].rigs) & set(catalogue.effects[old].rigs)
        ]
        basis = absorbed_basis(without.fit.jacobian[:, ~without.fit.at_bound])
        shown = [s for s in signatures(without, names, basis) if s.visible_share >= VISIBLE and s.length >= 1.0]
        if not shown:
            continue
        fits, _ = refits(without, shown, np.array([s.unit for s in shown]) @ without.fit.residual)
        trades += [(f.chi2, old, new, f) for new, f in fits.items()]
    best = min(trades, key=lambda trade: trade[0], default=None)
    if best is None or best[0] > state.fit.chi2 - TIE * reduced_chi2(state, best[3]):
        return None
    _, old, new, fitted = best
    return old, new, _values(study, new, fitted.point, state.model.column)
