"""Compare, diagnose, add, again: until the model explains the data, or nothing more can be said.

Forward by whole explanations (a single effect, else a pair), each followed by a backward check and by swaps, in which a
rival of the same rigs takes the place of an effect added earlier; at most three effects.
Nothing is added because it merely lowers chi2: an explanation must leave neither lack of fit nor a drifting constant,
and no rival may explain as well.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, fit_study, reduced_chi2
from pellet_study.criticism.cell_means import CellMeans
from pellet_study.criticism.compare import Comparison, compare
from pellet_study.criticism.diagnose import GATE, GATE_AGAIN, Diagnosis, diagnose
from pellet_study.criticism.least_squares import fit_many, problem_of
from pellet_study.criticism.next_measurement import needs_simulation
from pellet_study.criticism.rivals import TIE, refits
from pellet_study.criticism.score_tests import VISIBLE, absorbed_basis
from pellet_study.criticism.signatures import signatures
from pellet_study.model.model import Engine, Model
from pellet_study.study.study import Study

MOST_EFFECTS = 3


@dataclass(frozen=True)
class Refinement:
    """What refine did: `steps[0]` is the model as it came, `first` its fit; `study`, `state` as it is left."""

    verdict: str
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
        study, best = self.study, self.last.rivals[0].fit.point if self.tied else None
        for name in self.tied[0] if self.tied else ():
            parameters = study.catalogue.effects[name].parameters
            study = study.with_effect(name, {p: best[self.state.model.column[f"{name}.{p}"]] for p in parameters})
        return study


def refine(
    study: Study,
    state: CalibratedStudy | None = None,
    most: int = MOST_EFFECTS,
    propose: bool = True,
    rank: bool = True,
    engines: Mapping[str, Engine] | None = None,
) -> Refinement:
    """Add the effects the measurements show to be missing.

    `propose` says whether the next measurement is to be looked for (where simulations must tell, only if explanations are
    tied), `rank` whether the candidates are to be ranked where nothing is missing.

    Raises
    ------
    InputError : the study gives nothing to fit
    """
    first = state = state or fit_study(study, Model(study, engines=engines))
    comparison = compare(study, state, level_out=propose)
    steps, diagnoses, added, ties_only = [comparison], [], [], needs_simulation(study)
    while True:
        found = diagnose(study, state, GATE if not added else GATE_AGAIN, comparison, propose, rank, ties_only)
        diagnoses.append(found)
        if found.verdict != "missing" or len(added) + len(found.missing) > most:
            break
        chosen = found.rivals[0]
        order = {s.effect: k for k, s in enumerate(found.ranking)}
        for name in sorted(found.missing, key=order.__getitem__):
            effect = study.catalogue.effects[name]
            values = {p: chosen.fit.point[state.model.column[f"{name}.{p}"]] for p in effect.parameters}
            study = study.with_effect(name, values)
            added.append(name)
            state = fit_study(study, Model(study, engines=state.model.engines), _kept(state), extra_starts=1)
            comparison = compare(study, state, level_out=propose)
            steps.append(comparison)
        for name in needless(study, state, added):
            study = study.without_effect(name)
            added.remove(name)
            state = fit_study(study, Model(study, engines=state.model.engines), _kept(state))
            comparison = compare(study, state, level_out=propose)
            steps.append(comparison)
        while (trade := swap(study, state, added)) is not None:
            old, new, values = trade
            study = study.without_effect(old).with_effect(new, values)
            added[added.index(old)] = new
            state = fit_study(study, Model(study, engines=state.model.engines), _kept(state), extra_starts=1)
            comparison = compare(study, state, level_out=propose)
            steps.append(comparison)
        if len(added) >= most:
            diagnoses.append(diagnose(study, state, GATE_AGAIN, comparison, propose, rank, ties_only))
            break
    for name in added:
        values = {
            p: state.fit.point[state.model.column[f"{name}.{p}"]] for p in study.catalogue.effects[name].parameters
        }
        study = study.with_effect(name, values)
    return Refinement(
        diagnoses[-1].verdict, tuple(added), diagnoses[-1].tied, tuple(steps), tuple(diagnoses), study, first, state
    )


def _kept(state: CalibratedStudy) -> CellMeans | None:
    """The cells for the next model of the same rows; gathered anew where the model's own scatter is part of it."""
    return None if state.model.scatters else state.cells


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
        fits, _ = refits(without, names, shown, np.array([s.unit for s in shown]) @ without.fit.residual)
        trades += [(f.chi2, old, new, f) for (new,), f in fits.items()]
    best = min(trades, key=lambda trade: trade[0], default=None)
    if best is None or best[0] > state.fit.chi2 - TIE * reduced_chi2(state, best[3]):
        return None
    _, old, new, fitted = best
    return old, new, {p: fitted.point[state.model.column[f"{new}.{p}"]] for p in catalogue.effects[new].parameters}
