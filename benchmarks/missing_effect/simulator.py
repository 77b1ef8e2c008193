"""The simulator as the benchmark has it: the means of its simulations in simulations.csv, and the response surfaces through them.

No YADE is needed where simulations.csv is there; `simulate` makes it anew.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import cached_property
from pathlib import Path

import numpy as np

from pellet_study.challenge.demonstration import Demonstration
from pellet_study.challenge.predictions import Stored
from pellet_study.challenge.seeds import BENCH
from pellet_study.errors import InputError
from pellet_study.model.means import Mean
from pellet_study.model.sites import Point, Site
from pellet_study.rigs.catalogue import Catalogue, standard
from pellet_study.rigs.declarations import effect_from
from yade_scripts.case import load

AIR_DRAG = Path(__file__).with_name("air_drag.py")
COLUMNS = ("row", "effect", "amount", *BENCH.ranges, "first_seed", "n", "failed", "mean", "sd")
CLOSE = 1e-9  # of a place that this machine plans to the one that was simulated
Key = tuple[int, str, int, int]  # row, effect, first seed, seeds


def candidates() -> Catalogue:
    """The rigs and effects of the sealed sets: today's, but air drag by the law by which it was hidden."""
    air = effect_from(load(AIR_DRAG), AIR_DRAG, AIR_DRAG)
    known = standard()
    rigs = {**known.rigs, **{name: known.rigs[name].with_effects([air]) for name in air.rigs}}
    return Catalogue(rigs, {**known.effects, air.name: air}).within(list(BENCH.observables))


class _Sealed(Demonstration):
    @cached_property
    def catalogue(self) -> Catalogue:
        """The rigs and effects of the sealed sets."""
        return candidates()


SEALED = _Sealed(**{field.name: getattr(BENCH, field.name) for field in fields(BENCH)})


def row_of(site: Site) -> int:
    """Which of the rows of a set, 1 the first, a site is."""
    there = dict(site.conditions)
    for k, (rig, given) in enumerate(SEALED.conditions, start=1):
        if rig == site.rig and all(there[name] == value for name, value in given.items()):
            return k
    raise InputError(f"{site}: is none of the conditions of the sealed sets")


class Told:
    """Means of simulated points as simulations.csv tells them, in the place of a surrogate's `Means`.

    Raises
    ------
    InputError : the file lacks a point, or has it at another place
    """

    simulated, spent_s = 0, 0.0

    def __init__(self, file: Path):
        self.file = file
        self.rows: dict[Key, Mapping[str, str]] = {}
        with file.open(encoding="utf-8", newline="") as stream:
            for row in csv.DictReader(stream):
                key = int(row["row"]), row["effect"], int(row["first_seed"]), int(row["n"]) + int(row["failed"])
                self.rows[key] = row

    def of(self, points: Sequence[Point], needed: bool = True) -> list[Mean]:
        """Means of some points."""
        return [self._mean(point) for point in points]

    def _mean(self, point: Point) -> Mean:
        name, amount = amount_of(point)
        key = row_of(point.site), name, point.first_seed, point.seeds
        row = self.rows.get(key)
        places = {**dict(point.factors), **({"amount": amount} if name else {})}
        if row is None or any(abs(float(row[n]) - v) > CLOSE * max(1, abs(v)) for n, v in places.items()):
            raise InputError(
                f"{self.file}: {'has no' if row is None else 'has another place for the'} simulation of row {key[0]} with "
                f"{name or 'no effect'} from seed {key[2]} on; it was made by another version: make it anew with --simulate"
            )
        mean, sd = (float(row[n] or "nan") for n in ("mean", "sd"))
        failed = int(row["failed"])
        return Mean(mean, sd, int(row["n"]), failed, "as simulations.csv says" if failed else "")

    def seconds_each(self, rig: str) -> float:
        """Nothing is simulated."""
        return 0.0


def amount_of(point: Point) -> tuple[str, float]:
    """The effect of a point and its amount; none: "" and 0."""
    for name, values in point.effects:
        return name, dict(values)[next(iter(dict(values)))]
    return "", 0.0


def as_stored(file: Path) -> Stored:
    """The model of the sealed sets on the simulations of a file."""
    stored = Stored(file.parent, of=SEALED)
    stored.engine.means = Told(file)  # type: ignore[assignment]
    everything(stored)
    return stored


def everything(stored: Stored) -> None:
    """Make all surfaces at once: every row, every candidate."""
    point = stored.model.base.copy()
    for name in stored.model.effects:
        quantity = stored.study.catalogue.effects[name].parameters
        amount = next(iter(quantity))
        point[stored.model.column[f"{name}.{amount}"]] = quantity[amount]["physical"][1]
    stored.model.predict(point)


def simulate(file: Path, store: Path, workers: int | None = None) -> None:
    """Simulate all that the surfaces need on YADE, as far as the store lacks it, and write simulations.csv."""
    stored = Stored(store, workers, of=SEALED)
    of_store, asked = stored.engine.means.of, {}

    def noted(points: Sequence[Point], needed: bool = True) -> list[Mean]:
        found = of_store(points, needed)
        asked.update(zip(points, found, strict=True))
        return found

    stored.engine.means.of = noted  # type: ignore[method-assign]
    everything(stored)
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        lines = {}
        for point, mean in asked.items():
            name, amount = amount_of(point)
            key = row_of(point.site), name, point.first_seed, point.seeds
            factors = dict(point.factors)
            known = [f"{v:.9g}" if np.isfinite(v) else "" for v in (mean.mean, mean.sd)]
            places = [repr(float(factors[n])) if n in factors else "" for n in BENCH.ranges]
            lines[key] = [
                key[0],
                name,
                repr(float(amount)) if name else "",
                *places,
                point.first_seed,
                mean.n,
                mean.lost,
                *known,
            ]
        writer.writerows(lines[key] for key in sorted(lines))
