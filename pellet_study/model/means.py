"""Means over seeds of simulated points, remembered beside the store: asked again, nothing is read but a small table."""

import csv
import hashlib
import json
import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from pellet_study.errors import SimulationError
from pellet_study.files import opening, writing
from pellet_study.model.sites import Point
from pellet_study.rigs.on_yade import case
from pellet_study.simulation import dispatch, settings, yade
from pellet_study.simulation.local import TOOK_LONGER
from pellet_study.simulation.store import Store
from pellet_study.study.study import RESTITUTION_AT, SCALINGS, Study

COLUMNS = ("key", "observable", "mean", "sd", "n", "lost", "reason")
Key = tuple[str, str]  # hash of what the mean depends on, observable


class Mean(NamedTuple):
    """Over the seeds of a point: mean, standard deviation and number of observables, how many failed, the first reason."""

    mean: float
    sd: float
    n: int
    lost: int
    reason: str


class Means:
    """The simulations of a study's points, and what is remembered of them in STORE/means.csv.

    Parameters
    ----------
    study : its rigs with the user's own effects, contact law and scaling of the surface energy
    store : folder of finished simulations
    workers : YADE processes at once; default one a core
    quiet : no progress bar
    """

    def __init__(self, study: Study, store: Path, workers: int | None = None, quiet: bool = False):
        self.rigs, self.law = study.catalogue.rigs, study.contact_law
        self.numerics = {
            "surface_energy_exponent": SCALINGS[study.surface_energy_scaling],
            "damping_at_contact": RESTITUTION_AT[study.restitution_at],
        }
        self.store, self.workers, self.quiet = Path(store), workers, quiet
        self.simulated, self.spent_s = 0, 0.0  # so far: simulations, seconds of all processors
        self._each: dict[str, list[float]] = {}  # of a rig: seconds of processors, simulations
        self._kept: dict[Key, Mean] | None = None

    def of(self, points: Sequence[Point], needed: bool = True) -> list[Mean]:
        """Means of some points; all simulations that are missing go to the dispatcher at once.

        An observable that does not apply under some conditions is NaN there, or refused where it is `needed`.

        Raises
        ------
        SimulationError : a rig does not give the observable
        """
        kept, keys = self._remembered(), []
        missing: dict[Key, list[dict]] = {}
        for point in points:
            first = self._case(point)
            key = self._key(point, first)
            keys.append(key)
            if key not in kept:
                missing[key] = [{**first, "seed": point.first_seed + k} for k in range(point.seeds)]
        if missing:
            kept |= self._simulated(missing, needed)
            self._remember(key for key in missing if TOOK_LONGER not in kept[key].reason)
        return [kept[key] for key in keys]

    def _case(self, point: Point) -> dict:
        """The case of a point's first seed."""
        rig = self.rigs[point.site.rig]
        return case(
            rig,
            contact_law=self.law if self.law in rig.contact_laws else None,
            seed=point.first_seed,
            parameters={**dict(point.site.fixed), **dict(point.factors)},
            conditions=dict(point.site.conditions),
            effects={name: dict(values) for name, values in point.effects},
            numerics={k: v for k, v in self.numerics.items() if k in rig.numerics},
        )

    def _key(self, point: Point, first: Mapping) -> Key:
        rig = self.rigs[point.site.rig]
        text = json.dumps([first, point.seeds, rig.fingerprint, yade.version()], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:20], point.site.observable

    def _simulated(self, missing: Mapping[Key, Sequence[dict]], needed: bool) -> dict[Key, Mean]:
        """Means of groups of cases that are simulated together."""
        cases = [case for group in missing.values() for case in group]
        self.simulated += len(cases)
        began = time.perf_counter()
        table = dispatch.run(cases, self.store, rigs=self.rigs, workers=self.workers, quiet=self.quiet)
        spent = (time.perf_counter() - began) * (self.workers or settings.workers() or dispatch.cores())
        self.spent_s += spent
        for rig, number in Counter(one["rig"] for one in cases).items():  # of several at once, each by its number
            known = self._each.setdefault(rig, [0.0, 0.0])
            known[0], known[1] = known[0] + spent * number / len(cases), known[1] + number
        found, place = {}, 0
        for key, group in missing.items():
            rows = table.iloc[place : place + len(group)]
            place += len(group)
            found[key] = _mean(rows, key[1])
            if (
                needed
                and found[key].n
                and not np.isfinite(rows.loc[rows["status"] == "ok", key[1]].to_numpy(float)).all()
            ):
                raise SimulationError(f"{group[0]['rig']} gives no {key[1]} under these conditions")
        return found

    def seconds_each(self, rig: str) -> float:
        """Seconds of a processor that a simulation of a rig took, as stored, else as seen; 0 where nothing is known."""
        file = self.store / "timings.csv"
        if file.exists():
            timed = pd.read_csv(
                opening.stream(file), names=["id", "seconds"], header=0, dtype={"id": str}, on_bad_lines="skip"
            )
            mine = timed[timed["id"].isin(set(Store(self.store).rows(self.rigs[rig]).index))]
            seconds = pd.to_numeric(mine["seconds"], errors="coerce").mean()
            if np.isfinite(seconds):
                return float(seconds)
        spent, number = self._each.get(rig, (0.0, 0.0))
        return spent / number if number else 0.0

    def _remembered(self) -> dict[Key, Mean]:
        """Means that stand beside the store."""
        if self._kept is None:
            self._kept = {}
            file = self.store / "means.csv"
            if file.exists():
                for row in csv.reader(opening.content(file).decode(errors="replace").splitlines()):
                    try:
                        key, observable, mean, sd, n, lost, reason = row
                        self._kept[key, observable] = Mean(float(mean), float(sd), int(n), int(lost), reason)
                    except ValueError:  # the header, or a torn line: simulated again from stored cases
                        continue
        return self._kept

    def _remember(self, keys: Iterable[Key]) -> None:
        kept, file = self._remembered(), self.store / "means.csv"
        new = not file.exists()
        with writing.appending(file) as stream:
            writer = csv.writer(stream)
            if new:
                writer.writerow(COLUMNS)
            writer.writerows([*key, *kept[key]] for key in keys)


def _mean(rows: pd.DataFrame, observable: str) -> Mean:
    """The mean over the seeds of one point."""
    fine = (rows["status"] == "ok").to_numpy()
    values = rows[observable].to_numpy(float)[fine]
    return Mean(
        float(values.mean()) if len(values) else np.nan,
        float(values.std(ddof=1)) if len(values) > 1 else np.nan,
        len(values),
        int((~fine).sum()),
        "" if fine.all() else str(rows["status"].to_numpy()[~fine][0]),
    )
