"""The heaps of a powder calibration: how many, with which seeds, simulated or from the store."""

import hashlib
import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.doe.factors import Factor
from pellet_study.errors import SimulationError
from pellet_study.files import opening, writing
from pellet_study.powder.plan import OBSERVABLE, OTHER_READINGS, RIG, SYMBOLS, Plan
from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch

FIRST_SEED = {"screening": 10_000, "climb": 20_000, "surface": 30_000, "validation": 50_000}
OF_SETTINGS = 10**9  # seeds of each stage that belong to settings; the first digit is that of FIRST_SEED
SEEDS_A_TRY = 1_000  # of each box of the surface and of each attempt of the validation, within their stage
SEEDS_OF_READ = 8_000  # first of the validation where the setting was read: the chain that found it used those before
TOO_FLAT = "too flat for a line through its flanks; measured as repose_triangle_deg it would have a number"
KEEP_GRAINS = "PELLET_STUDY_GRAINS"  # where the rig leaves the grains of its heaps


@dataclass(frozen=True)
class Sizes:
    """How many heaps: at each point of a design and of the climb, at its centre, at least and at most in the validation."""

    repeats: int
    centre_points: int
    fewest: int
    most: int
    wanted_error: float = 0.25  # deg, standard error of the validation's mean
    attempts: int = 2  # settings that are validated: the optimum, and the one corrected by its validation


FULL, QUICK = Sizes(3, 5, 10, 200), Sizes(1, 3, 4, 4, attempts=1)


def point_at(factors: Sequence[Factor], coded: np.ndarray) -> dict[str, float]:
    """{factor: physical level} of a point in coded units."""
    return {f.name: float(f.physical(x)) for f, x in zip(factors, coded, strict=True)}


def repeated(points: list[dict[str, float]], coded: np.ndarray, repeats: int) -> list[dict[str, float]]:
    """The points of a design, then those beside its centre again until each has `repeats`."""
    beside = [point for point, row in zip(points, coded, strict=True) if np.any(row)]
    return points + (repeats - 1) * beside


def seeds_by_setting(stage: str, levels: Sequence[Mapping[str, float]], first: int = 0) -> list[int]:
    """Seeds that belong to what each heap is, wherever it stands: to its stage, its levels, and which of those there it is.

    A hash of these among the seeds of the stage; the levels to six digits, as later ones of a setting that is searched
    for are those of the machine.
    """
    found, times = [], Counter[str]()
    for level in levels:
        setting = " ".join([stage, str(first), *(f"{name}={level[name]:.6g}" for name in sorted(level))])
        digest = hashlib.sha256(f"{setting} {times[setting]}".encode()).digest()
        found.append(FIRST_SEED[stage] // 10_000 * OF_SETTINGS + int.from_bytes(digest[:8], "big") % OF_SETTINGS)
        times[setting] += 1
    return found


def lost_of(runs: pd.DataFrame) -> int:
    """How many heaps gave no angle."""
    return int((runs["verdict"] != "ok").sum())


@dataclass(frozen=True)
class Heaps:
    """What gives the heaps of a plan: its store of finished ones, YADE for the others.

    `say` gets a line for every heap that gave no angle.
    """

    plan: Plan
    store: Path
    sizes: Sizes = FULL
    workers: int | None = None
    quiet: bool = False
    say: Callable[[str], object] = lambda line: None

    def at(self, stage: str, points: Sequence[Mapping[str, float]], first: int = 0) -> pd.DataFrame:
        """A heap at each point ({factor: physical level}; the others at the middle of their range).

        Parameters
        ----------
        stage : whose seeds they take
        first : of them, counted from the stage's own first: tells one try from another at the same points

        Returns
        -------
        Columns `stage`, `seed`, the factors, `repose_angle_deg` (the reading that was measured; missing where there is none),
        `direction_error_deg`, `bond_number`, the other readings of the same heaps (`OTHER_READINGS`), `verdict`, `id`.
        """
        levels = [self.levels(point) for point in points]
        self.say(f"  {stage}: {len(levels)} heaps; what the store has of them is not simulated again")
        if self.plan.seeds_by == "place":
            return self._simulated(stage, levels, [FIRST_SEED[stage] + first + k for k in range(len(levels))])
        return self._simulated(stage, levels, seeds_by_setting(stage, levels, first))

    def levels(self, point: Mapping[str, float]) -> dict[str, float]:
        """{factor: physical level} of all factors."""
        middle = {factor.name: factor.centre for factor in self.plan.factors}
        return {name: round(float(x), 10) for name, x in {**middle, **point}.items()}

    def _simulated(self, stage: str, levels: Sequence[Mapping[str, float]], seeds: Sequence[int]) -> pd.DataFrame:
        cases = [
            on_yade.case(
                RIG,
                contact_law=self.plan.contact_law,
                seed=seed,
                parameters=self.plan.fixed | {SYMBOLS[name]: value for name, value in level.items()},
                conditions=self.plan.conditions,
                numerics=self.plan.numerics,
            )
            for level, seed in zip(levels, seeds, strict=True)
        ]
        found = dispatch.run(cases, self.store, workers=self.workers, quiet=self.quiet)
        table = pd.DataFrame(levels)
        table.insert(0, "seed", seeds)
        table.insert(0, "stage", stage)
        others = ("direction_error_deg", "bond_number", *OTHER_READINGS)
        read = {OBSERVABLE: self.plan.observable} | {name: name for name in others}
        for name, observable in read.items():
            table[name] = pd.to_numeric(found[observable], errors="coerce").to_numpy()
        unread = (found["status"] == "ok").to_numpy() & table[OBSERVABLE].isna()
        table["verdict"] = found["status"].mask(unread, f"no {self.plan.observable}: {TOO_FLAT}").to_numpy()
        table["id"] = found["id"].to_numpy()
        return table

    def good(self, runs: pd.DataFrame, stage: str, least: int) -> pd.DataFrame:
        """The heaps that gave an angle; says which did not.

        Raises
        ------
        SimulationError : fewer than the analysis needs
        """
        good = runs[runs["verdict"] == "ok"]
        lost = runs[runs["verdict"] != "ok"]
        for _, row in lost.iterrows():
            self.say(f"  {stage}: the heap of seed {row['seed']} gave no angle: {row['verdict']}")
        if len(good) < least:
            raise SimulationError(
                f"{stage}: only {len(good)} of {len(runs)} heaps gave an angle, {least} are needed; "
                f"first reason: {lost['verdict'].iloc[0]}"
            )
        return good

    def keep_grains(self, point: Mapping[str, float], seed: int, file: Path) -> None:
        """A heap of the validation once more, its grains kept in `file`; stored by itself, so simulated once only."""
        folder = self.store.resolve() / "grains"
        writing.folder(folder)
        os.environ[KEEP_GRAINS] = str(folder)
        try:
            again = replace(self, store=folder)._simulated("validation", [self.levels(point)], [seed]).iloc[0]
        finally:
            del os.environ[KEEP_GRAINS]
        left = folder / f"{again['id']}.csv"
        if left.exists():
            writing.data(file, opening.content(left))
