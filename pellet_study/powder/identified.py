"""What the readings tell of the parameters: the posterior on the surfaces in words and numbers, and what to read next.

The surfaces have the three factors that went on; the others of the screening may lie anywhere in their ranges, which moves
the readings by their effects there.
"""

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
from pellet_study.powder.decisions import CONTRADICTED, Gain, Joint, Known, Met, Surface
from pellet_study.powder.gains import expected_share
from pellet_study.powder.plan import OBSERVABLE, OTHER_READINGS, SYMBOLS, Plan, Reading
from pellet_study.powder.posterior import Block, Posterior, log_density, posterior
from pellet_study.powder.responses import Responses, fit, widening
from pellet_study.powder.results import Results

IDENTIFIED, NARROWED = 1 / 3, 3 / 4  # shares of a factor's range that its 95 % interval takes at most
OUT_OF_REACH = 3.0  # standard errors between a reading and the nearest value of the box
AT_END = 0.01  # of a factor's range: an interval that comes so near to its end ends at the box
MORE = 3  # times the readings that there are, of one that is repeated
MOST_ALIKE = 0.95  # correlation of readings of one pouring
LEAST_GAIN = 0.1  # share of the squared distance below which a correction is not worth new heaps
STEP = 0.01  # of half a range, for slopes
LEAST_SHARE = 0.8  # of the heaps that must have a reading for it to be proposed


@dataclass(frozen=True)
class Identified:
    """The posterior of all readings, that of the first alone, the setting recommended (coded), and what was decided of it."""

    all: Posterior
    first: Posterior
    setting: np.ndarray
    joint: Joint


@dataclass(frozen=True)
class SurfaceHeaps:
    """The heaps of a surface with all their readings, and those of the screening before it.

    `factors` span the surface, `screened` are all of the screening; `runs` and `screening` have a column a factor and reading.
    """

    factors: list[Factor]
    runs: pd.DataFrame
    screened: list[Factor]
    screening: pd.DataFrame

    @property
    def others(self) -> list[Factor]:
        """The factors that are not on the surface."""
        return [f for f in self.screened if f.name not in {one.name for one in self.factors}]

    def moved_by_others(self, names: Sequence[str]) -> np.ndarray:
        """Covariance (m, m) of readings by the factors that are not on the surface, each anywhere in its range.

        A factor that moves the readings by b a coded unit moves them by b u, u uniform in -1 to 1: b b'/3. The effects are
        those of the screening; what their own error makes of the squares is taken off, and an effect below it is none.
        """
        if not self.others:
            return np.zeros((len(names), len(names)))
        slopes = np.column_stack([self._slopes(name) for name in names])
        return slopes.T @ slopes / 3

    def _slopes(self, name: str) -> np.ndarray:
        """What each factor that is not on the surface moves a reading by, a coded unit (factors,).

        Raises
        ------
        SimulationError : the screening has too few heaps with this reading
        """
        known = self.screening[self.screening[name].notna()] if name in self.screening else self.screening[:0]
        coded = np.column_stack([f.coded(known[f.name].to_numpy(float)) for f in self.screened])
        terms = np.column_stack([np.ones(len(coded)), coded, np.all(np.abs(coded) < 0.5, axis=1)])
        freedom = len(terms) - (np.linalg.matrix_rank(terms) if len(terms) else 0)
        if freedom < 1:
            raise SimulationError(
                f"{len(known)} heaps of the screening were kept with {name}: too few to say what the factors off the surface do to "
                "it; do the screening again: --only screening"
            )
        inverse, reading = np.linalg.pinv(terms.T @ terms), known[name].to_numpy(float)
        effects = inverse @ terms.T @ reading
        variance = np.square(reading - terms @ effects).sum() / freedom
        squared = np.maximum(effects**2 - np.diag(inverse) * variance, 0)
        mine = [1 + k for k, factor in enumerate(self.screened) if factor in self.others]
        return (np.sign(effects) * np.sqrt(squared))[mine]


def identify(plan: Plan, results: Results, of_angle: np.ndarray) -> Identified:
    """What the measured readings tell of the factors of the surface.

    The setting recommended is `of_angle` (coded) where the angle alone was measured; else it agrees with all readings, the other
    factors being where the heaps have them.

    Raises
    ------
    SimulationError : too few heaps have all of the readings
    """
    heaps, readings = surface_heaps(plan, results), plan.readings
    found, alone = posteriors(heaps, readings)
    setting = posterior(_block(heaps, readings, others=False)).recommended if plan.others else of_angle
    joint = Joint(
        readings=_met(found, readings, setting),
        known=_known(found),
        varied=[f.name for f in heaps.others],
        share_of_box=found.share(),
        share_of_box_first=alone.share(),
        distance=found.distance,
        distance_p=_contradiction(found),
        doubtful=None,
        gains=_gains(heaps, readings, found),
        heaps=found.block.responses.heaps,
    )
    if joint.contradictory:
        joint = replace(joint, doubtful=_doubtful(heaps, readings))
    return Identified(found, alone, setting, joint)


def corrected_setting(
    plan: Plan, results: Results, point: Mapping[str, float], means: Sequence[float]
) -> dict[str, float] | None:
    """{factor: level} recommended once the surfaces are raised to the means of heaps at a point, in the order of the readings.

    None where no setting of the box agrees clearly better than the point.
    """
    heaps = surface_heaps(plan, results)
    block = _block(heaps, plan.readings, others=False)
    coded = np.array([[f.coded(point[f.name]) for f in heaps.factors]])
    raised = block.responses.moved(np.asarray(means) - block.responses.predict(coded)[0])
    found = posterior(replace(block, responses=raised))
    here = float(log_density(found.block, coded)[1][0])
    there = float(log_density(found.block, found.recommended[None, :])[1][0])
    if here - there < LEAST_GAIN * here:
        return None
    return {f.name: float(f.physical(x)) for f, x in zip(heaps.factors, found.recommended, strict=True)}


def posteriors(heaps: SurfaceHeaps, readings: Sequence[Reading]) -> tuple[Posterior, Posterior]:
    """What heaps say of the factors by all readings, and by the first alone."""
    found = posterior(_block(heaps, readings))
    return found, found if len(readings) == 1 else posterior(_block(heaps, readings[:1]))


def surface_heaps(plan: Plan, results: Results) -> SurfaceHeaps:
    """The heaps of the surface and the screening of a plan."""
    units = {f.name: f.unit for f in plan.factors}
    decision: Surface = results.decision("surface")
    home, screened = results.home("surface") or results.folder, results.home("screening") or results.folder
    return heaps_in(home, screened, decision, plan.observable, units)


def heaps_in(folder: Path, screened: Path, decision: Surface, steering: str, units: Mapping[str, str]) -> SurfaceHeaps:
    """The heaps of a folder in the box that its surface chose, and those of a screening.

    Parameters
    ----------
    steering : name of the angle that steers the chain, which the tables have under one name for all
    units : {factor: unit}
    """
    runs = pd.read_csv(opening.stream(folder / "surface" / "runs.csv"))
    chosen = runs["box"].max() if decision.chosen_box is None else decision.chosen_box
    factors = [Factor(name, low, high, units.get(name, "-")) for name, (low, high) in decision.box.items()]
    screening = pd.read_csv(opening.stream(screened / "screening" / "runs.csv"))
    screened_factors = [
        Factor(name, float(screening[name].min()), float(screening[name].max()), units.get(name, "-"))
        for name in SYMBOLS
        if name in screening
    ]

    def good(table: pd.DataFrame) -> pd.DataFrame:
        table = table[table["verdict"] == "ok"]
        return table.drop(columns=OBSERVABLE).assign(**{steering: table[OBSERVABLE]})

    return SurfaceHeaps(factors, good(runs[runs["box"] == chosen]), screened_factors, good(screening))


def _responses(heaps: SurfaceHeaps, names: Sequence[str]) -> Responses:
    """The surfaces of readings over the heaps that have all of them."""
    runs = heaps.runs
    missing = [name for name in names if name not in runs]
    if missing:
        raise SimulationError(
            f"the heaps of the surface were kept without {', '.join(missing)}; do the surface again: --only surface"
        )
    whole = runs[runs[list(names)].notna().all(axis=1)]
    coded = np.column_stack([f.coded(whole[f.name].to_numpy(float)) for f in heaps.factors])
    return fit(heaps.factors, names, coded, whole[list(names)].to_numpy(float))


def _block(
    heaps: SurfaceHeaps, readings: Sequence[Reading], measured: np.ndarray | None = None, others: bool = True
) -> Block:
    """Readings with their surfaces, and how they were measured together (`measured`, where that is told).

    The covariance holds what the factors that are not on the surface may do, unless these are known (`others` False).
    """
    names = [one.observable for one in readings]
    responses = _responses(heaps, list(dict.fromkeys(names))).of(names)
    if measured is None:
        measured = measured_covariance(readings, responses.scatter)
    if others:
        measured = measured + heaps.moved_by_others(names)
    return Block(responses, np.array([one.value for one in readings]), measured)


def measured_covariance(readings: Sequence[Reading], scatter: np.ndarray) -> np.ndarray:
    """Covariance (m, m) of measured means of the same pourings.

    What scatters in a pouring goes together as in simulated heaps (`scatter`, their covariance), `MOST_ALIKE` at most; what a
    measured sd has beyond a simulated one is that reading's own. Of means of n_i and n_j pourings the smaller number were
    read in both ways.
    """
    simulated = np.sqrt(np.diag(scatter))
    n, sd = np.array([[one.n, one.sd] for one in readings]).T
    shared = np.minimum(sd, simulated) / n
    together = MOST_ALIKE * scatter / np.outer(simulated, simulated) * np.outer(shared, shared) * np.minimum.outer(n, n)
    own = [one.sd**2 * widening(one.freedom) / one.n for one in readings]
    return together - np.diag(np.diag(together)) + np.diag(own)


def _doubtful(heaps: SurfaceHeaps, readings: Sequence[Reading]) -> str | None:
    """The one reading without which the others do not contradict each other; None where there is none, or several."""
    if len(readings) == 1:
        return None
    left = [[one for one in readings if one is not without] for without in readings]
    agree = [_contradiction(posterior(_block(heaps, few))) >= CONTRADICTED for few in left]
    return readings[agree.index(True)].observable if sum(agree) == 1 else None


def _contradiction(found: Posterior) -> float:
    """p of the readings' distance from the surfaces, by as many degrees of freedom as the box cannot move to meet them.

    A factor moves as many readings as the whitened predictions have directions that change by more than 1 over half its range.
    """
    block, best = found.block, found.best
    steps = np.vstack([best, best + STEP * np.eye(len(best)), best - STEP * np.eye(len(best))])
    white, _ = block.whitened(steps)
    slopes = (white[1 : 1 + len(best)] - white[1 + len(best) :]) / (2 * STEP)
    moved = int((np.linalg.svd(slopes, compute_uv=False) > 1).sum())
    return float(chdtrc(max(1, white.shape[1] - moved), found.distance))


def _met(found: Posterior, readings: Sequence[Reading], setting: np.ndarray) -> list[Met]:
    """How each reading is met at a setting (coded), and what the box gives of it."""
    block = found.block
    predicted = block.responses.predict(setting[None, :])[0]
    errors = np.sqrt(np.diag(block.responses.covariance(setting[None, :])[0]))
    measured = np.sqrt(np.diag(measured_covariance(readings, block.responses.scatter)))
    apart = np.sqrt(np.diag(block.covariance))
    box = np.vstack([coded_box.sample(len(found.factors)), found.best, setting])
    told = block.responses.predict(box)
    met = []
    for i, one in enumerate(readings):
        nearest = float(np.clip(one.value, told[:, i].min(), told[:, i].max()))
        gap = abs(one.value - nearest) / np.hypot(apart[i], errors[i])
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


def _gains(heaps: SurfaceHeaps, readings: Sequence[Reading], found: Posterior) -> list[Gain]:
    """What would shrink the set most: the other readings of the same pourings, or more of those there are; best first."""
    names, runs = [one.observable for one in readings], heaps.runs
    gains = []
    for name in OTHER_READINGS:
        if name in names or name not in runs or runs[name].notna().mean() < LEAST_SHARE:
            continue
        if any(runs[name].equals(runs[other]) for other in names):
            continue
        try:
            sd = float(np.sqrt(_responses(heaps, [*names, name]).scatter[-1, -1]))
            new = Reading(name, np.nan, sd, readings[0].n, 0)
            gains.append(_gain(new, found, _block(heaps, [*readings, new])))
        except SimulationError:  # too few heaps have it beside the others: it is not proposed
            continue
    known = measured_covariance(readings, found.block.responses.scatter)
    for one in readings:
        new = replace(one, value=np.nan, n=MORE * one.n)
        again = np.pad(known, (0, 1))
        again[-1, -1] = one.sd**2 / new.n  # of other pourings
        gains.append(_gain(new, found, _block(heaps, [*readings, new], again)))
    return sorted(gains, key=lambda gain: gain.share_of_box)


def _gain(new: Reading, found: Posterior, block: Block) -> Gain:
    """What a new reading, the last of a block, would leave."""
    share = expected_share(found, block)
    return Gain(observable=new.observable, n=new.n, sd=new.sd, share_of_box=share)
