"""The three seed bench tests, calibrated one after the other as the source paper does.

Each stage sweeps one contact parameter over the paper's six levels, fits a parabola to the means, takes the parameter at
which it meets the measurement, fixes it for the stages that follow, and simulates once more there to verify.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from pellet_study.bench.parabola import Parabola, fit_parabola
from pellet_study.bench.readings import Reading
from pellet_study.bench.seeds import Mean, Seeds
from pellet_study.bench.stages import STAGES, Stage
from pellet_study.errors import InputError


@dataclass(frozen=True)
class BenchResult:
    """What a stage found.

    `sweep` has a row a level (level, mean, standard_error, n, failed); `value` is None where the curve does not meet
    the measurement inside the sweep; `joint` is the rig predicted with every calibrated parameter switched on.
    """

    stage: Stage
    reading: Reading
    sweep: pd.DataFrame
    curve: Parabola
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


def calibrate(seeds: Seeds, readings: Mapping[str, Reading]) -> list[BenchResult]:
    """All stages that have a reading, in the paper's order; then each rig with all calibrated parameters at once.

    A stage whose curve does not meet its reading is the last.

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
    results: list[BenchResult] = []
    fixed = at_first(seeds.parameters, stages)
    for stage in stages:
        others = {name: value for name, value in fixed.items() if name != stage.parameter}
        results.append(calibrate_stage(seeds, stage, readings[stage.rig], others))
        value = results[-1].value
        if value is None:
            return results
        fixed[stage.parameter] = value
    return [replace(result, joint=joint(seeds, result, fixed)) for result in results]


def at_first(parameters: Mapping[str, float], stages: list[Stage]) -> dict[str, float]:
    """The calibrated parameters before the first stage: the study's where their test has no reading, else off, as in the paper."""
    fixed = {s.parameter: parameters[s.parameter] for s in STAGES if s.parameter in parameters}
    return fixed | {s.parameter: 0.0 for s in stages if s.parameter != STAGES[0].parameter}


def calibrate_stage(seeds: Seeds, stage: Stage, reading: Reading, fixed: Mapping[str, float]) -> BenchResult:
    """Sweep, fit, invert, verify: one stage, with the parameters of the other stages fixed."""
    settings = [{**fixed, stage.parameter: level} for level in stage.levels]
    means = seeds.means(stage, reading, settings, seeds.number(stage.seeds), 0)
    sweep = pd.DataFrame(
        [(x, m.value, m.standard_error, m.n, m.failed) for x, m in zip(stage.levels, means, strict=True)],
        columns=[stage.parameter, stage.observable, "standard_error", "n", "failed"],
    )
    curve = fit_parabola(stage.levels, sweep[stage.observable])
    value = curve.root(reading.value)
    measured = reading.sd / np.sqrt(reading.n) if reading.sd is not None else 0.0
    interval = curve.interval(reading.value, float(np.hypot(measured, stage.resolution / np.sqrt(3))))
    verification = None
    if value is not None:
        there = [{**fixed, stage.parameter: value}]
        after = len(stage.levels)  # seeds no level has seen
        verification = seeds.means(stage, reading, there, seeds.number(stage.verification_seeds), after)[0]
    return BenchResult(stage, reading, sweep, curve, value, interval, verification)


def joint(seeds: Seeds, result: BenchResult, fixed: Mapping[str, float]) -> Mean:
    """The rig of a stage with every calibrated parameter at once, of seeds that neither sweep nor verification has seen."""
    stage = result.stage
    return seeds.means(stage, result.reading, [fixed], seeds.number(stage.seeds), len(stage.levels) + 1)[0]
