"""From a study to predictions: many points (parameters and effects) times all rows at once.

A point is a row of a matrix; `Model.names` says what its columns are: the parameters of the rigs used, then
`effect.parameter` of every effect that acts in them, absent ones at their neutral values. An engine turns requests
into means and variances; the closed-form engine is here, one on YADE has the same two members.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from pellet_study.errors import InputError
from pellet_study.model.closed_form import ClosedForm
from pellet_study.model.engine import Engine, Request
from pellet_study.rigs.declared import Condition
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Study


def engines_of(study: Study, rigs: Iterable[str]) -> dict[str, Engine]:
    """The engine that answers for each rig; those that run on YADE share one."""
    closed: Engine = ClosedForm(study.catalogue)
    simulated: Engine | None = None
    found: dict[str, Engine] = {}
    for rig in rigs:
        if study.catalogue.rigs[rig].predict is not None:
            found[rig] = closed
            continue
        if simulated is None:
            from pellet_study.model.surrogate import Surrogate

            simulated = Surrogate(study, (study.folder or Path()) / ".store")
        found[rig] = simulated
    return found


@dataclass(frozen=True)
class Prediction:
    """Means and variances of the means, (points, cases) arrays."""

    mean: np.ndarray
    variance: np.ndarray


@dataclass(frozen=True)
class Case:
    """What is asked of a rig: an observable under conditions, with the parameters known there."""

    rig: str
    observable: str
    conditions: Mapping[str, Condition]
    parameters: Mapping[str, float]


def key(row: Measurement | Case) -> tuple:
    """What makes two rows the same case."""
    return (row.rig, row.observable, tuple(row.conditions.items()), tuple(sorted(row.parameters.items())))


class Model:
    """Predictions of a study's rigs for a fixed list of cases.

    Parameters
    ----------
    study : Study
    cases : distinct cases; default: those of the study's rows
    engines : {rig: engine}; default: by the rig's kind
    """

    def __init__(self, study: Study, cases: Sequence[Case] | None = None, engines: Mapping[str, Engine] | None = None):
        self.study = study
        if cases is None:
            distinct = {key(row): row for row in study.rows}
            cases = [Case(row.rig, row.observable, row.conditions, row.parameters) for row in distinct.values()]
        self.cases = tuple(cases)
        rigs = dict.fromkeys([*study.rigs, *(case.rig for case in self.cases)])
        catalogue = study.catalogue
        self.parameters = dict.fromkeys(p for rig in rigs for p in catalogue.rigs[rig].parameters)
        self.acting = {rig: catalogue.acting(rig) for rig in rigs}
        acting = {e for names in self.acting.values() for e in names}
        self.effects = [e for e in catalogue.effects if e in acting]
        self.names = [
            *self.parameters,
            *(f"{e}.{p}" for e in self.effects for p in catalogue.effects[e].parameters),
        ]
        self.column = {name: k for k, name in enumerate(self.names)}
        self._amount = {e: self.column[f"{e}.{catalogue.effects[e].amount}"] for e in self.effects}
        self._absent = {e: catalogue.effects[e].neutral()[catalogue.effects[e].amount] for e in self.effects}
        self.amounts = frozenset(self._amount.values())
        given = engines or {}
        self.engines = {**engines_of(study, [rig for rig in rigs if rig not in given]), **given}
        self._groups = self._grouped()

    def _grouped(self) -> list[tuple[str, str, np.ndarray, dict, dict]]:
        """Cases by rig, observable and known parameters' names, as arrays."""
        groups: dict[tuple, list[int]] = {}
        for k, case in enumerate(self.cases):
            groups.setdefault((case.rig, case.observable, tuple(sorted(case.parameters))), []).append(k)
        median = median_normal_stress(self.study)
        found = []
        for (rig, observable, known), indices in groups.items():
            cases = [self.cases[k] for k in indices]
            conditions: dict[str, Any] = {
                c: np.array([case.conditions[c] for case in cases]) for c in cases[0].conditions
            }
            conditions["median_normal_stress_pa"] = median
            overrides = {p: np.array([case.parameters[p] for case in cases]) for p in known}
            found.append((rig, observable, np.array(indices), conditions, overrides))
        return found

    @cached_property
    def base(self) -> np.ndarray:
        """The point the study describes: defaults, settings, present effects; absent effects neutral."""
        point = np.empty(len(self.names))
        catalogue = self.study.catalogue
        for rig in self.engines:
            for name, quantity in catalogue.rigs[rig].parameters.items():
                point[self.column[name]] = quantity["default"]
        for effect in self.effects:
            for name, value in catalogue.effects[effect].neutral().items():
                point[self.column[f"{effect}.{name}"]] = value
        for name, setting in self.settings.items():
            point[self.column[name]] = setting.value
        return point

    @cached_property
    def settings(self) -> dict:
        """Settings of the study by column name; parameters that no rig used has are left out."""
        found = {name: s for name, s in self.study.parameters.items() if name in self.column}
        for effect, values in self.study.effects.items():
            found |= {f"{effect}.{name}": s for name, s in values.items() if f"{effect}.{name}" in self.column}
        return found

    def predict(self, points: np.ndarray) -> Prediction:
        """Predictions at (m, columns) points for all cases, each engine asked once."""
        return self._asked(np.atleast_2d(points), lambda engine, requests: engine.predict(requests))

    def directly(self, point: np.ndarray) -> Prediction:
        """Predictions at one point, not by way of an engine's surfaces where it has any."""
        return self._asked(np.atleast_2d(point), lambda engine, requests: engine.directly(requests))

    def spread(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Relative standard deviation of one simulation of each case at one point, and its degrees of freedom, 0 where unknown."""
        found = self._asked(np.atleast_2d(point), lambda engine, requests: engine.spread(requests))
        return found.mean[0], found.variance[0]

    def alike(self, one: Case, other: Case) -> float:
        """Correlation of two readings of one simulation from seed to seed; 0 where they are not of one. Predictions come first."""
        if one.observable == other.observable or replace(one, observable="") != replace(other, observable=""):
            return 0.0
        return self.engines[one.rig].alike(one.rig, one.observable, other.observable)

    def _asked(self, points: np.ndarray, ask: Callable) -> Prediction:
        present = {
            e: {p: points[:, self.column[f"{e}.{p}"], None] for p in self.study.catalogue.effects[e].parameters}
            for e in self.effects
            if np.any(points[:, self._amount[e]] != self._absent[e])
        }
        shared = {name: points[:, self.column[name], None] for name in self.parameters}
        asked: dict[int, tuple[Engine, list[Request], list[np.ndarray]]] = {}
        for rig, observable, indices, conditions, known in self._groups:
            effects = {e: values for e, values in present.items() if e in self.acting[rig]}
            engine = self.engines[rig]
            kind = id(engine) if engine.simulates else 0  # closed forms are asked together
            _, requests, places = asked.setdefault(kind, (engine, [], []))
            own = {name: shared[name] for name in self.study.catalogue.rigs[rig].parameters}
            requests.append(Request(rig, observable, conditions, {**own, **known}, effects))
            places.append(indices)
        mean, variance = np.empty((len(points), len(self.cases))), np.zeros((len(points), len(self.cases)))
        for engine, requests, places in asked.values():
            for (value, spread), indices in zip(ask(engine, requests), places, strict=True):
                mean[:, indices] = value
                variance[:, indices] = spread
        return Prediction(mean, variance)

    @property
    def step(self) -> float:
        """Finite-difference step that every engine used can resolve."""
        return max(engine.step for engine in self.engines.values())

    @property
    def scatters(self) -> bool:
        """Whether some predictions have a scatter of their own."""
        return any(engine.simulates for engine in self.engines.values())

    @property
    def levels(self) -> int:
        """Values of a condition that every engine used can bear to be asked for."""
        return min(engine.levels for engine in self.engines.values())

    @property
    def warnings(self) -> list[str]:
        """What the engines say."""
        return list(dict.fromkeys(text for engine in self.engines.values() for text in engine.warnings))


def median_normal_stress(study: Study) -> float:
    """Median normal stress over a study's rows, Pa; 1 where no rig used has one."""
    stresses = []
    for row in study.rows:
        of_rig = study.catalogue.rigs[row.rig].normal_stress
        if of_rig is not None:
            stresses.append(of_rig(row.conditions, row.value))
    return float(np.median(stresses)) if stresses else 1.0


def refuse_too_few(rows: int, free: int) -> None:
    """No fit without at least as many rows as free parameters.

    Raises
    ------
    InputError : says both numbers
    """
    if rows == 0:
        raise InputError("every row is held out: at least some rows of measurements.csv need split `fit`")
    if free > rows:
        raise InputError(
            f"{free} free parameters, but only {rows} different cases to fit them to; fix some in study.toml "
            "(a number instead of min and max) or measure under more conditions"
        )
