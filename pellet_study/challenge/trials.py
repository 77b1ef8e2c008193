"""Trials on the twins: hide an effect of a stated strength, make noisy readings, let refine answer, compare.

Strength is lambda, the square root of the chi2 that the base model, calibrated, leaves on noise-free data that hold
the effect: how many standard errors of misfit remain once the free constants have absorbed what they can.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from pellet_study.challenge import twins
from pellet_study.criticism.calibration import fit_study
from pellet_study.criticism.cell_means import CellMeans
from pellet_study.criticism.compare import compare
from pellet_study.criticism.diagnose import diagnose
from pellet_study.criticism.least_squares import fit, problem_of
from pellet_study.criticism.refine import Refinement, refine
from pellet_study.model.closed_form import ClosedForm
from pellet_study.model.engine import Request
from pellet_study.model.model import Model
from pellet_study.rigs.declared import Acting
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Study

Seed = int | Sequence[int]  # of numpy's default_rng


@dataclass(frozen=True)
class Truth:
    """What is hidden: effects with their amounts, and what the rigs then read without noise."""

    effects: Mapping[str, float]
    lam: float
    readings: np.ndarray


@dataclass(frozen=True)
class Outcome:
    """One trial's answer; `first` is the verdict on the base model."""

    verdict: str
    first: str
    added: tuple[str, ...]
    tied: tuple[tuple[str, ...], ...]
    gate_p: float
    rms_before: float
    rms_after: float
    covered: int
    constants: int
    size_ratio: float


class Together(ClosedForm):
    """The twins' answers to all points at once: their formulas hold with an effect at zero too."""

    def _means(self, request: Request) -> np.ndarray:
        acting = {name: Acting(None, values) for name, values in request.effects.items()}
        return self.catalogue.rigs[request.rig].predict(request.parameters, request.conditions, acting)[
            request.observable
        ]


def model_of(study: Study) -> Model:
    """The model of a study of the twins."""
    return Model(study, engines=dict.fromkeys(study.catalogue.rigs, Together(study.catalogue)))


@cache
def _base() -> Model:
    rows = [twins.measurement(*c, [1.0, 2.0]) for c in twins.conditions()]
    return model_of(twins.study(rows, outside=True))


def readings_of(effects: Mapping[str, float]) -> np.ndarray:
    """Noise-free readings of the campaign with some effects present."""
    model = _base()
    point = model.base.copy()
    for name, value in twins.TRUTH.items():
        point[model.column[name]] = value
    for name, amount in effects.items():
        point[model.column[f"{name}.{model.study.catalogue.effects[name].amount}"]] = amount
    return model.predict(point).mean[0]


def true_sd(readings: np.ndarray) -> np.ndarray:
    """Standard deviation of one reading under each condition of the campaign."""
    return np.array([twins.reading_sd(rig, y) for (rig, _, _), y in zip(twins.conditions(), readings, strict=True)])


def strength(effects: Mapping[str, float], kept: tuple[int, ...] | None = None) -> float:
    """Lambda of some hidden effects (over the kept conditions)."""
    model = _base()
    readings = readings_of(effects)
    index = np.arange(len(readings)) if kept is None else np.array(kept)
    sd = true_sd(readings)[index] / np.sqrt(twins.REPEATS)
    cells = CellMeans(index, readings[index], sd, 1 / sd, 1000, 0.0)
    point = model.base.copy()
    for name, value in twins.TRUTH.items():
        point[model.column[name]] = value
    return float(np.sqrt(fit(model, cells, problem_of(model, 0, point)).chi2))


@cache
def hidden(names: tuple[str, ...], lam: float, sign: int = 1, kept: tuple[int, ...] | None = None) -> Truth | None:
    """Effects at amounts that give each the strength `lam` alone; None where the physical range does not reach it."""
    amounts = {}
    for name in names:
        effect = twins.catalogue(True).effects[name]
        low, high = effect.parameters[effect.amount]["physical"]
        reach = high if sign > 0 else low
        sizes = reach * np.geomspace(1e-3, 1, 25)
        lams = [strength({name: s}, kept) for s in sizes]
        above = [k for k, v in enumerate(lams) if v >= lam]
        if not above:
            return None
        k = above[0]
        below, over = (sizes[k - 1] if k else 0.0), sizes[k]
        for _ in range(18):
            middle = 0.5 * (below + over)
            below, over = (middle, over) if strength({name: middle}, kept) < lam else (below, middle)
        amounts[name] = over
    return Truth(amounts, lam, readings_of(amounts))


def noisy_rows(
    truth: np.ndarray,
    rng: np.random.Generator,
    tau: float = 0.0,
    held_out: frozenset[int] = frozenset(),
    stated: bool = False,
) -> list[Measurement]:
    """Rows of a campaign: five readings a condition, and a set-up scatter of `tau` standard errors that they share.

    The sd of a row is that of its five readings; with `stated`, it follows the known rule (share of the reading and
    floor) with one scale found from all the readings together.
    """
    sd = true_sd(truth)
    centre = truth + tau * sd / np.sqrt(twins.REPEATS) * rng.standard_normal(len(truth))
    readings = centre[:, None] + sd[:, None] * rng.standard_normal((len(truth), twins.REPEATS))
    rule = true_sd(readings.mean(axis=1))
    scale = np.sqrt(np.mean(readings.var(axis=1, ddof=1) / rule**2))
    rows = [
        twins.measurement(*c, readings[k], line=k + 2, split="holdout" if k in held_out else "fit")
        for k, c in enumerate(twins.conditions())
    ]
    return [replace(row, sd=float(scale * s)) for row, s in zip(rows, rule, strict=True)] if stated else rows


def outcome(answer: Refinement, truth: Truth | None) -> Outcome:
    """Open the envelope: what was answered beside what was hidden."""
    first, last = answer.steps[0], answer.steps[-1]
    covered = constants = 0
    for name, value in twins.TRUTH.items():
        low, high = last.intervals[name]
        covered, constants = covered + (low <= value <= high), constants + 1
    ratio = np.nan
    if truth and len(truth.effects) == 1:
        name, amount = next(iter(truth.effects.items()))
        if name in answer.added:
            ratio = last.parameters[f"{name}.{twins.catalogue(True).effects[name].amount}"] / amount
    return Outcome(
        verdict=answer.verdict,
        first=answer.diagnoses[0].verdict,
        added=tuple(twins.SAME.get(n, n) for n in answer.added),
        tied=tuple(dict.fromkeys(tuple(sorted(twins.SAME.get(n, n) for n in names)) for names in answer.tied)),
        gate_p=answer.diagnoses[0].gate_p if answer.diagnoses[0].gate_p is not None else 1.0,
        rms_before=first.holdout_rms_error or np.nan,
        rms_after=last.holdout_rms_error or np.nan,
        covered=covered,
        constants=constants,
        size_ratio=float(ratio),
    )


def trial(
    truth: Truth, seed: Seed, tau: float = 0.0, held_out: frozenset[int] = frozenset(), stated: bool = False
) -> Outcome:
    """One sealed trial."""
    rows = noisy_rows(truth.readings, np.random.default_rng(seed), tau, held_out, stated)
    study = twins.study(rows)
    answer = refine(study, fit_study(study, model_of(study), extra_starts=1), propose=False, rank=False)
    found = outcome(answer, truth)
    if answer.tied and held_out:  # a tie adds nothing: what would the best of it do?
        found = replace(found, rms_after=compare(answer.best_of_tie()).holdout_rms_error or np.nan)
    return found


NOTHING = Truth({}, 0.0, readings_of({}))


def trial_next(truth: Truth, seed: Seed, at_random: bool = False) -> tuple[Outcome, str]:
    """A trial with the one measurement proposed (or one drawn from the same list) added, and that measurement's rig.

    Where none is proposed, the trial without it.
    """
    from pellet_study.challenge.twins import measurement
    from pellet_study.criticism.possible import possible_cases

    rng = np.random.default_rng(seed)
    rows = noisy_rows(truth.readings, rng)
    study = twins.study(rows)
    state = fit_study(study, model_of(study))
    first = diagnose(study, state)
    proposal = first.next_measurement
    if proposal is None:
        return outcome(refine(study, state, propose=False, rank=False), truth), ""
    if at_random:
        cases = possible_cases(study)
        case = cases[rng.integers(len(cases))]
        rig, observable, given = case.rig, case.observable, dict(case.conditions)
    else:
        rig, observable, given = proposal.rig, proposal.observable, proposal.conditions
    model = model_of(twins.study([*rows, measurement(rig, observable, given, [1.0, 2.0])], outside=True))
    point = model.base.copy()
    for name, value in twins.TRUTH.items():
        point[model.column[name]] = value
    for name, amount in truth.effects.items():
        point[model.column[f"{name}.{model.study.catalogue.effects[name].amount}"]] = amount
    value = model.predict(point).mean[0, -1]
    readings = value + twins.reading_sd(rig, value) * rng.standard_normal(twins.REPEATS)
    more = [*rows, measurement(rig, observable, given, readings, line=len(rows) + 2)]
    study = twins.study(more)
    return outcome(refine(study, fit_study(study, model_of(study)), propose=False, rank=False), truth), rig
