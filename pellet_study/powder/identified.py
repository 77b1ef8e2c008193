"""What the readings tell of the parameters: the posterior on the surfaces in words and numbers, and what to read next."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.special import chdtrc

from pellet_study.doe import coded_box
from pellet_study.doe.factors import Factor
from pellet_study.errors import SimulationError
from pellet_study.files import opening
from pellet_study.powder.decisions import Gain, Joint, Known, Met, Surface
from pellet_study.powder.gains import Further, expected_share
from pellet_study.powder.plan import OBSERVABLE, OTHER_READINGS, Plan, Reading
from pellet_study.powder.posterior import Block, Posterior, posterior
from pellet_study.powder.responses import Responses, fit, widening
from pellet_study.powder.results import Results

IDENTIFIED, NARROWED = 1 / 3, 3 / 4  # shares of a factor's range that its 95 % interval takes at most
OUT_OF_REACH = 3.0  # standard errors between a reading and the nearest value of the box
CONTRADICTED = 0.01  # p of the readings' distance from the surfaces
AT_END = 0.01  # of a factor's range: an interval that comes so near to its end ends at the box
MORE = 3  # times the readings that there are, of one that is repeated
LEAST_SHARE = 0.8  # of the heaps that must have a reading for it to be proposed


@dataclass(frozen=True)
class Identified:
    """The posterior of all readings, that of the first alone, and what was decided of it."""

    all: Posterior
    first: Posterior
    joint: Joint


def identify(plan: Plan, results: Results) -> Identified:
    """What the measured readings tell of the factors of the surface.

    Raises
    ------
    SimulationError : too few heaps have all of the readings
    """
    runs, factors = _heaps(plan, results)
    readings = plan.readings
    found, alone = posteriors(runs, factors, readings)
    without = (
        [] if len(readings) == 1 else [_distance_without(runs, factors, readings, k) for k in range(len(readings))]
    )
    p = float(chdtrc(max(1, len(readings) - len(factors)), found.distance))
    doubtful = readings[int(np.argmin(without))].observable if without and p < CONTRADICTED else None
    joint = Joint(
        readings=_met(found, readings),
        known=_known(found),
        share_of_box=found.share(),
        share_of_box_first=alone.share(),
        distance=found.distance,
        distance_p=p,
        doubtful=doubtful,
        gains=_gains(runs, factors, readings, found),
        heaps=found.blocks[0].responses.heaps,
    )
    return Identified(found, alone, joint)


def corrected_setting(
    plan: Plan, results: Results, point: Mapping[str, float], means: Sequence[float]
) -> dict[str, float]:
    """{factor: level} recommended once the surfaces are raised to the means of heaps at a point, in the order of the readings."""
    runs, factors = _heaps(plan, results)
    block = _block(runs, factors, plan.readings)
    coded = np.array([[f.coded(point[f.name]) for f in factors]])
    raised = block.responses.moved(np.asarray(means) - block.responses.predict(coded)[0])
    found = posterior([replace(block, responses=raised)])
    return {f.name: float(f.physical(x)) for f, x in zip(factors, found.recommended, strict=True)}


def posteriors(runs: pd.DataFrame, factors: list[Factor], readings: Sequence[Reading]) -> tuple[Posterior, Posterior]:
    """What heaps say of the factors by all readings, and by the first alone."""
    found = posterior([_block(runs, factors, readings)])
    return found, found if len(readings) == 1 else posterior([_block(runs, factors, readings[:1])])


def _heaps(plan: Plan, results: Results) -> tuple[pd.DataFrame, list[Factor]]:
    """The heaps of the box that counts, and its factors."""
    decision: Surface = results.decision("surface")
    return heaps_in(
        results.home("surface") or results.folder, decision, plan.observable, {f.name: f.unit for f in plan.factors}
    )


def heaps_in(
    folder: Path, decision: Surface, steering: str, units: Mapping[str, str]
) -> tuple[pd.DataFrame, list[Factor]]:
    """The heaps of a folder in the box that its surface chose, with the angle that steers under its own name; the factors."""
    runs = pd.read_csv(opening.stream(folder / "surface" / "runs.csv"))
    chosen = runs["box"].max() if decision.chosen_box is None else decision.chosen_box
    runs = runs[(runs["box"] == chosen) & (runs["verdict"] == "ok")]
    factors = [Factor(name, low, high, units.get(name, "-")) for name, (low, high) in decision.box.items()]
    return runs.drop(columns=OBSERVABLE).assign(**{steering: runs[OBSERVABLE]}), factors


def _responses(runs: pd.DataFrame, factors: list[Factor], names: Sequence[str]) -> Responses:
    """The surfaces of readings over the heaps that have all of them."""
    missing = [name for name in names if name not in runs]
    if missing:
        raise SimulationError(
            f"the heaps of the surface were kept without {', '.join(missing)}; do the surface again: --only surface"
        )
    whole = runs[runs[list(names)].notna().all(axis=1)]
    coded = np.column_stack([f.coded(whole[f.name].to_numpy(float)) for f in factors])
    return fit(factors, names, coded, whole[list(names)].to_numpy(float))


def _block(runs: pd.DataFrame, factors: list[Factor], readings: Sequence[Reading]) -> Block:
    """Readings with their surfaces, and how they were measured together."""
    responses = _responses(runs, factors, [one.observable for one in readings])
    return Block(responses, np.array([one.value for one in readings]), measured_covariance(readings, responses.scatter))


def measured_covariance(readings: Sequence[Reading], scatter: np.ndarray) -> np.ndarray:
    """Covariance (m, m) of measured means of the same pourings.

    The readings of one pouring go together as those of simulated heaps do (`scatter`, their covariance); of means of n_i and n_j
    pourings the smaller number were read in both ways.
    """
    sd = np.sqrt(np.diag(scatter))
    alike = scatter / np.outer(sd, sd)
    n = np.array([one.n for one in readings], dtype=float)
    error = np.array([one.sd * np.sqrt(widening(one.freedom) / one.n) for one in readings])
    return alike * np.outer(error, error) * np.minimum.outer(n, n) / np.sqrt(np.outer(n, n))


def _distance_without(runs: pd.DataFrame, factors: list[Factor], readings: Sequence[Reading], k: int) -> float:
    """Distance of the readings from the surfaces were one of them not there."""
    return posterior([_block(runs, factors, [one for i, one in enumerate(readings) if i != k])]).distance


def _met(found: Posterior, readings: Sequence[Reading]) -> list[Met]:
    """How each reading is met at the recommended setting, and what the box gives of it."""
    block = found.blocks[0]
    predicted = block.responses.predict(found.recommended[None, :])[0]
    errors = np.sqrt(np.diag(block.responses.covariance(found.recommended[None, :])[0]))
    measured = np.sqrt(np.diag(block.covariance))
    box = np.vstack([coded_box.sample(len(found.factors)), found.best])
    told = block.responses.predict(box)
    met = []
    for i, one in enumerate(readings):
        nearest = float(np.clip(one.value, told[:, i].min(), told[:, i].max()))
        gap = abs(one.value - nearest) / np.hypot(measured[i], errors[i])
        met.append(
            Met(
                observable=one.observable,
                measured=one.value,
                sd=one.sd,
                n=one.n,
                freedom=one.freedom,
                standard_error=float(measured[i]),
                predicted=float(predicted[i]),
                predicted_standard_error=float(errors[i]),
                lowest=float(told[:, i].min()),
                highest=float(told[:, i].max()),
                nearest=nearest,
                out_of_reach=bool(gap > OUT_OF_REACH),
            )
        )
    return met


def _known(found: Posterior) -> list[Known]:
    """What is known of each factor."""
    known = []
    for i, factor in enumerate(found.factors):
        low, high = found.interval(i)
        width = factor.high - factor.low
        share = (high - low) / width
        word = "identified" if share <= IDENTIFIED else "narrowed" if share <= NARROWED else "not identified"
        ends = []
        if share <= NARROWED:
            ends = [end for end in (factor.low, factor.high) if min(abs(low - end), abs(high - end)) < AT_END * width]
        known.append(Known(factor=factor.name, low=low, high=high, share_of_range=share, word=word, at_end=ends))
    return known


def _gains(runs: pd.DataFrame, factors: list[Factor], readings: Sequence[Reading], found: Posterior) -> list[Gain]:
    """What would shrink the set most: the other readings of the same pourings, or more of those there are; best first."""
    measured = [one.observable for one in readings]
    gains = []
    for name in OTHER_READINGS:
        if name in measured or name not in runs or runs[name].notna().mean() < LEAST_SHARE:
            continue
        if any(runs[name].equals(runs[other]) for other in measured):
            continue
        responses = _responses(runs, factors, [*measured, name])
        sd = float(np.sqrt(responses.scatter[-1, -1]))
        more = [*readings, Reading(name, np.nan, sd, readings[0].n, 0)]
        block = Block(responses, np.array([one.value for one in more]), measured_covariance(more, responses.scatter))
        gains.append(
            Gain(observable=name, n=readings[0].n, sd=sd, share_of_box=expected_share(found, Further(block, 0)))
        )
    for one in readings:
        responses = _responses(runs, factors, measured).of([*measured, one.observable])
        known = measured_covariance(readings, responses.of(measured).scatter)
        again = np.zeros((len(measured) + 1, len(measured) + 1))
        again[:-1, :-1] = known
        again[-1, -1] = one.sd**2 / (MORE * one.n)
        block = Block(responses, np.append([each.value for each in readings], np.nan), again)
        gains.append(
            Gain(
                observable=one.observable,
                n=MORE * one.n,
                sd=one.sd,
                share_of_box=expected_share(found, Further(block, 0)),
            )
        )
    return sorted(gains, key=lambda gain: gain.share_of_box)
