"""Means over seeds: a seed that is no sphere scatters with its orientation, so every number is a mean over many."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from pellet_study.bench.readings import Reading
from pellet_study.bench.stages import Stage
from pellet_study.errors import SimulationError
from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch
from yade_scripts.particles import ORIENTATIONS_PER_BLOCK

LEAST_BLOCKS = 8
SEED_RANGE = 256 * ORIENTATIONS_PER_BLOCK


@dataclass(frozen=True)
class Mean:
    """Mean of an observable over seeds, its standard error, how many seeds answered and how many failed."""

    value: float
    standard_error: float
    n: int
    failed: int


def mean_over_seeds(values: ArrayLike, failed: int = 0, resolution: float = 0.0) -> Mean:
    """Mean over seeds in their order; the standard error from the scatter of whole blocks of seeds.

    Seeds of one block of 64 fill the orientations evenly and are not independent of each other; blocks are. Fewer than
    eight whole blocks: the scatter of the seeds themselves, which overstates the error of an even set.

    Parameters
    ----------
    values : one a seed, in the order of the seeds
    failed : how many seeds gave none
    resolution : half-width of the interval in which each reading may lie (a bracket); its variance is added
    """
    readings = np.asarray(values, dtype=float)
    blocks = len(readings) // ORIENTATIONS_PER_BLOCK
    if blocks >= LEAST_BLOCKS:
        means = readings[: blocks * ORIENTATIONS_PER_BLOCK].reshape(blocks, -1).mean(axis=1)
        error = means.std(ddof=1) / np.sqrt(blocks)
    else:
        error = readings.std(ddof=1) / np.sqrt(len(readings)) if len(readings) > 1 else float("nan")
    error = np.hypot(error, resolution / np.sqrt(3))
    return Mean(float(readings.mean()), float(error), len(readings), failed)


@dataclass
class Seeds:
    """The seeds of one study: its contact law, its fixed parameters, its store.

    Attributes
    ----------
    parameters : the study's; one that is calibrated counts only where its own test has no reading
    effort : times the seeds of `STAGES` that are simulated
    damping_at_contact : 1 where the damper of the seed takes the mass effective at the contact, 0 its whole mass
    runs : every row asked for, call after call
    """

    contact_law: str
    parameters: Mapping[str, float]
    store: Path
    effort: float = 1.0
    quiet: bool = False
    damping_at_contact: float = 0.0
    runs: list[pd.DataFrame] = field(default_factory=list, init=False)

    def number(self, full: int) -> int:
        """A number of seeds at the chosen effort, at least 4."""
        return max(4, round(full * self.effort))

    def means(
        self, stage: Stage, reading: Reading, settings: Sequence[Mapping[str, float]], number: int, first: int
    ) -> list[Mean]:
        """Mean of a rig's observable at each setting of the parameters, each in a range of seeds of its own.

        Range number k starts at k SEED_RANGE, whatever the number of seeds: a larger effort reuses a smaller one's runs.

        Raises
        ------
        SimulationError : more than a tenth of a setting's runs failed
        """
        cases = [
            self.case(stage, reading, setting, (first + k) * SEED_RANGE + seed)
            for k, setting in enumerate(settings)
            for seed in range(number)
        ]
        rows = dispatch.run(cases, self.store, quiet=self.quiet)
        self.runs.append(rows)
        return [_mean(stage, setting, rows.iloc[k * number : (k + 1) * number]) for k, setting in enumerate(settings)]

    def case(self, stage: Stage, reading: Reading, setting: Mapping[str, float], seed: int) -> dict[str, Any]:
        """One seed in a rig, with the study's parameters but for those of the setting."""
        known = on_yade.rig(stage.rig).parameters
        return on_yade.case(
            stage.rig,
            contact_law=self.contact_law,
            seed=seed,
            parameters={**{k: v for k, v in self.parameters.items() if k in known}, **setting},
            conditions=reading.conditions,
            numerics={"damping_at_contact": self.damping_at_contact},
        )


def _mean(stage: Stage, setting: Mapping[str, float], rows: pd.DataFrame) -> Mean:
    good = rows.loc[rows["status"] == "ok", stage.observable].astype(float)
    if len(good) < 0.9 * len(rows):
        reasons = rows.loc[rows["status"] != "ok", "status"].value_counts()
        raise SimulationError(
            f"{stage.rig} at {dict(setting)}: only {len(good)} of {len(rows)} runs gave a result; "
            f"most common reason: {reasons.index[0]} ({reasons.iloc[0]} runs)"
        )
    return mean_over_seeds(good, len(rows) - len(good), stage.resolution)
