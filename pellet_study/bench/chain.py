"""The three seed bench tests, calibrated one after the other as the source paper does.

Each stage sweeps one contact parameter over the paper's six levels, fits a parabola to the means, takes the parameter at
which it meets the measurement, fixes it for the stages that follow, and simulates once more there to verify.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.bench import parabola
from pellet_study.errors import InputError, SimulationError
from pellet_study.rigs import on_yade
from pellet_study.simulate import dispatch
from yade_scripts.particles import ORIENTATIONS_PER_BLOCK


@dataclass(frozen=True)
class Stage:
    """One bench test: what is swept, what is read, how many seeds a level and for the verification."""

    rig: str
    parameter: str
    symbol: str
    observable: str
    levels: tuple[float, ...]
    seeds: int
    verification_seeds: int
    table: int | None  # of the paper, where it is printed
    resolution: float = 0.0  # half-width of the interval in which a single reading lies


STAGES = (
    Stage(
        "rebound",
        "seed_powder_restitution",
        "a1",
        "rebound_height_mm",
        (0.10, 0.15, 0.20, 0.25, 0.30, 0.35),
        256,
        2048,
        3,
    ),
    Stage(
        "slope_slip",
        "seed_powder_static_friction",
        "a2",
        "slip_angle_deg",
        (0.60, 0.65, 0.70, 0.75, 0.80, 0.85),
        8,
        16,
        None,
        resolution=0.025,  # half the bracket of 0.02 deg, and the tilt at which sliding is told from creaking
    ),
    Stage(
        "inclined_roll",
        "seed_powder_rolling_friction",
        "a3",
        "roll_distance_mm",
        (0.20, 0.22, 0.24, 0.26, 0.28, 0.30),
        64,
        256,
        5,
    ),
)


LEAST_BLOCKS = 8
SEED_RANGE = 256 * ORIENTATIONS_PER_BLOCK


@dataclass(frozen=True)
class Reading:
    """A bench measurement: mean of n readings with their standard deviation (None where unknown), and its conditions."""

    value: float
    sd: float | None
    n: int
    conditions: dict


@dataclass(frozen=True)
class Mean:
    """Mean of an observable over seeds, its standard error, how many seeds answered and how many failed."""

    value: float
    standard_error: float
    n: int
    failed: int


@dataclass(frozen=True)
class Calibrated:
    """What a stage found.

    `sweep` has a row a level (level, mean, standard_error, n, failed); `value` is None where the curve does not meet
    the measurement inside the sweep; `joint` is the rig predicted with every calibrated parameter switched on.
    """

    stage: Stage
    reading: Reading
    sweep: pd.DataFrame
    curve: parabola.Quadratic
    value: float | None
    interval: tuple[float, float]
    verification: Mean | None
    joint: Mean | None = None

    @property
    def verification_error_percent(self) -> float | None:
        """|simulated - measured| / measured at the calibrated value, %."""
        if self.verification is None:
            return None
        return abs(self.verification.value - self.reading.value) / self.reading.value * 100


def readings(rows) -> dict[str, Reading]:
    """The reading of each bench rig: the mean over its fit rows, which must share their conditions.

    Parameters
    ----------
    rows : measurements.Measurement, any number

    Raises
    ------
    InputError : rows of one rig under different conditions
    """
    found = {}
    for stage in STAGES:
        mine = [r for r in rows if r.rig == stage.rig and r.observable == stage.observable and r.split == "fit"]
        if not mine:
            continue
        if any(dict(row.conditions) != dict(mine[0].conditions) for row in mine):
            raise InputError(
                f"measurements, lines {', '.join(str(row.line) for row in mine)}: bench calibrates at one setting, but these "
                f"{stage.rig} rows differ in their conditions; use `compare` for several, or leave one setting"
            )
        if any(row.parameters for row in mine):
            raise InputError(
                f"measurements, line {mine[0].line}: bench calibrates the parameters itself; leave the parameter columns of "
                f"the {stage.rig} rows blank, or use `compare`"
            )
        n = sum(row.n for row in mine)
        value = sum(row.n * row.value for row in mine) / n
        sds = [row.sd for row in mine]
        sd = None if None in sds else float(np.sqrt(sum(row.n * row.sd**2 for row in mine) / n))
        if sd is None and len(mine) > 1:
            sd = float(np.std([row.value for row in mine], ddof=1))
        found[stage.rig] = Reading(value, sd, n, dict(mine[0].conditions))
    return found


def mean_over_seeds(values: Sequence[float], failed: int = 0, resolution: float = 0.0) -> Mean:
    """Mean over seeds in their order; the standard error from the scatter of whole blocks of seeds.

    Seeds of one block of 64 fill the orientations evenly and are not independent of each other; blocks are. Fewer than
    eight whole blocks: the scatter of the seeds themselves, which overstates the error of an even set.

    Parameters
    ----------
    values : one a seed, in the order of the seeds
    failed : how many seeds gave none
    resolution : half-width of the interval in which each reading may lie (a bracket); its variance is added
    """
    values = np.asarray(values, dtype=float)
    blocks = len(values) // ORIENTATIONS_PER_BLOCK
    if blocks >= LEAST_BLOCKS:
        means = values[: blocks * ORIENTATIONS_PER_BLOCK].reshape(blocks, -1).mean(axis=1)
        error = means.std(ddof=1) / np.sqrt(blocks)
    else:
        error = values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else float("nan")
    error = np.hypot(error, resolution / np.sqrt(3))
    return Mean(float(values.mean()), float(error), len(values), failed)


class Bench:
    """The bench of one study: its contact law, its fixed parameters, its store.

    Parameters
    ----------
    parameters : the study's parameters; one that is calibrated here counts only where its own test has no reading
    effort : share of the seeds of `STAGES` that is simulated, for a quick look
    """

    def __init__(self, contact_law: str, parameters: dict, store: Path, effort: float = 1.0, quiet: bool = False):
        self.contact_law, self.parameters = contact_law, dict(parameters)
        self.store, self.effort, self.quiet = Path(store), effort, quiet
        self.runs: list[pd.DataFrame] = []  # every row asked for, call after call

    def seeds(self, number: int) -> int:
        """A number of seeds at the chosen effort, at least 4."""
        return max(4, round(number * self.effort))

    def means(self, stage: Stage, reading: Reading, settings: Sequence[dict], seeds: int, first: int) -> list[Mean]:
        """Mean of a rig's observable at each setting of the parameters, each in a range of seeds of its own.

        Range number k starts at k SEED_RANGE, whatever the number of seeds: a larger effort reuses a smaller one's runs.
        """
        known = on_yade.rig(stage.rig).parameters
        cases = [
            on_yade.case(
                stage.rig,
                contact_law=self.contact_law,
                seed=(first + k) * SEED_RANGE + seed,
                parameters={**{k: v for k, v in self.parameters.items() if k in known}, **setting},
                conditions=reading.conditions,
            )
            for k, setting in enumerate(settings)
            for seed in range(seeds)
        ]
        rows = dispatch.run(cases, self.store, quiet=self.quiet)
        self.runs.append(rows)
        answers = []
        for k, setting in enumerate(settings):
            part = rows.iloc[k * seeds : (k + 1) * seeds]
            good = part.loc[part["status"] == "ok", stage.observable].astype(float)
            if len(good) < 0.9 * seeds:
                reasons = part.loc[part["status"] != "ok", "status"].value_counts()
                raise SimulationError(
                    f"{stage.rig} at {setting}: only {len(good)} of {seeds} runs gave a result; "
                    f"most common reason: {reasons.index[0]} ({reasons.iloc[0]} runs)"
                )
            answers.append(mean_over_seeds(good, seeds - len(good), stage.resolution))
        return answers

    def calibrate(self, stage: Stage, reading: Reading, fixed: dict) -> Calibrated:
        """Sweep, fit, invert, verify: one stage, with the parameters of the stages before it fixed."""
        seeds = self.seeds(stage.seeds)
        settings = [{**fixed, stage.parameter: level} for level in stage.levels]
        means = self.means(stage, reading, settings, seeds, 0)
        sweep = pd.DataFrame(
            [(x, m.value, m.standard_error, m.n, m.failed) for x, m in zip(stage.levels, means, strict=True)],
            columns=[stage.parameter, stage.observable, "standard_error", "n", "failed"],
        )
        curve = parabola.fit(stage.levels, sweep[stage.observable])
        value = curve.root(reading.value)
        measured = reading.sd / np.sqrt(reading.n) if reading.sd is not None else 0.0
        interval = curve.interval(reading.value, float(np.hypot(measured, stage.resolution / np.sqrt(3))))
        verification = None
        if value is not None:
            there = [{**fixed, stage.parameter: value}]
            after = len(stage.levels)  # seeds no level has seen
            verification = self.means(stage, reading, there, self.seeds(stage.verification_seeds), after)[0]
        return Calibrated(stage, reading, sweep, curve, value, interval, verification)

    def run(self, readings: dict[str, Reading]) -> list[Calibrated]:
        """All stages that have a reading, in the paper's order; then each rig with all calibrated parameters at once.

        Raises
        ------
        InputError : no reading of a bench rig
        SimulationError : more than a tenth of a setting's runs failed
        """
        stages = [stage for stage in STAGES if stage.rig in readings]
        if not stages:
            raise InputError(
                f"the measurements have no row of a bench rig ({', '.join(s.rig for s in STAGES)}); nothing to calibrate"
            )
        found: list[Calibrated] = []
        swept = [stage.parameter for stage in stages]
        fixed = {s.parameter: self.parameters[s.parameter] for s in STAGES if s.parameter in self.parameters}
        fixed |= {name: 0.0 for name in swept if name != STAGES[0].parameter}  # as the paper: off until its own stage
        for stage in stages:
            result = self.calibrate(
                stage, readings[stage.rig], {k: v for k, v in fixed.items() if k != stage.parameter}
            )
            found.append(result)
            if result.value is None:
                return found
            fixed[stage.parameter] = result.value
        joint = [
            self.means(r.stage, r.reading, [fixed], self.seeds(r.stage.seeds), len(r.stage.levels) + 1)[0]
            for r in found
        ]
        return [replace(r, joint=mean) for r, mean in zip(found, joint, strict=True)]
