"""Many noise draws on stored YADE predictions of the bench demonstration: the surfaces are the truth, noise is drawn.

Readings come from the surface with the hidden effect, moved by a draw of the surface's own uncertainty; the answers
from `refine`, whose predictions are the same stored surfaces without the effect.
"""

import zlib
from collections.abc import Mapping
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from pellet_study.challenge.demonstration import Demonstration
from pellet_study.challenge.resume import Show, read, resume
from pellet_study.challenge.seeds import BENCH
from pellet_study.criticism.calibration import fit_study
from pellet_study.criticism.cell_means import CellMeans
from pellet_study.criticism.least_squares import fit, problem_of
from pellet_study.criticism.refine import Refinement, refine
from pellet_study.errors import InputError
from pellet_study.model.engine import Engine
from pellet_study.model.model import Model
from pellet_study.model.surrogate import Surrogate
from pellet_study.rigs.catalogue import Catalogue

LAMBDAS = (4.0, 6.0, 8.0)
SHARES = (1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12)  # of its physical range at which an effect is tried
TRUE = {name: value for name, (value, _, _) in BENCH.ranges.items()}


class Stored:
    """A demonstration's model on its stored surfaces."""

    def __init__(
        self,
        store: Path,
        workers: int | None = None,
        catalogue: Catalogue | None = None,
        of: Demonstration = BENCH,
    ):
        self.of = of
        self.study = of.study(of.rows([np.array([1.0, 2.0])] * len(of.conditions)), catalogue)
        self.engine = Surrogate(self.study, store, workers)
        self.engines: dict[str, Engine] = dict.fromkeys(of.observables, self.engine)
        self.model = Model(self.study, engines=self.engines)
        self._sizes: dict[tuple, float | None] = {}

    def point(self, parameters: Mapping[str, float], effects: Mapping[str, float]) -> np.ndarray:
        """Parameters and amounts as a point of the model."""
        point = self.model.base.copy()
        for name, value in parameters.items():
            point[self.model.column[name]] = value
        for name, amount in effects.items():
            point[self.model.column[f"{name}.{self.model.study.catalogue.effects[name].amount}"]] = amount
        return point

    def readings(self, parameters: Mapping[str, float], effects: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """(n,) means of the rows and the variances of these means."""
        found = self.model.predict(self.point(parameters, effects))
        return found.mean[0], found.variance[0]

    @cached_property
    def repeats(self) -> np.ndarray:
        """(n,) readings a row."""
        return np.array([self.of.repeats[case.rig] for case in self.model.cases])

    def strength(
        self,
        parameters: Mapping[str, float],
        effects: Mapping[str, float],
        shown: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> float:
        """Lambda: root of the chi2 the base model, calibrated, leaves on noise-free readings.

        What the uncertainty of the effect's own surfaces is expected to give is taken out of it.

        Parameters
        ----------
        shown : what the effects make of each row, (n,) factors and the variances of these; by default the surfaces'
        """
        misfit, by_chance = self.misses(parameters, effects, shown)
        return float(np.sqrt(max(0.0, np.square(misfit).sum() - by_chance)))

    def misses(
        self,
        parameters: Mapping[str, float],
        effects: Mapping[str, float],
        shown: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> tuple[np.ndarray, float]:
        """Standard errors by which the base model, calibrated to noise-free readings with the effects, misses each row it is fitted to.

        Parameters
        ----------
        shown : as in `strength`

        Returns
        -------
        (n,) misses, and what the uncertainty of the effects is expected to add to the sum of their squares
        """
        base, without = self.readings(parameters, {})
        if shown is None:
            mean, variance = self.readings(parameters, effects)
            chance = np.maximum(variance - without, 0.0)
        else:
            factor, uncertain = shown
            mean, variance, chance = factor * base, factor**2 * without, base**2 * uncertain
        sd = np.array([self.of.reading_sd(case.rig, y) for case, y in zip(self.model.cases, mean, strict=True)])
        sd = np.sqrt(sd**2 / self.repeats + variance)
        fitted = np.array([k for k in range(len(mean)) if k not in self.of.held_out])
        cells = CellMeans(fitted, mean[fitted], sd[fitted], 1 / sd[fitted], 1000, 0.0)
        start = self.point(parameters, {})
        residual = fit(self.model, cells, problem_of(self.model, 0, start)).residual
        return residual, float((chance / sd**2)[fitted].sum())

    def size(self, parameters: Mapping[str, float], effect: str, lam: float, sign: int = 1) -> float | None:
        """The amount that shows with a strength; None where the physical range does not reach it.

        Some effects show most well inside their range: one that yields everywhere is like a lower restitution.
        """
        quantity = self.model.study.catalogue.effects[effect].parameters
        name = next(iter(quantity))
        low, high = quantity[name].get("physical", (quantity[name]["min"], quantity[name]["max"]))
        absent, limit = quantity[name]["absent"], high if sign > 0 else low
        if limit == absent:
            return None
        for share in SHARES:
            if self.strength(parameters, {effect: absent + share * (limit - absent)}) >= lam:
                break
        else:
            return None
        below, over = absent, absent + share * (limit - absent)
        for _ in range(14):
            middle = 0.5 * (below + over)
            weak = self.strength(parameters, {effect: middle}) < lam
            below, over = (middle, over) if weak else (below, middle)
        return float(over)


def sizes(stored: Stored) -> list[tuple[str, float, int, float]]:
    """(effect, lambda, sign, amount) of every strength that an effect reaches within its physical range.

    One that reaches none stands there once, at its physical limit and the strength it has there.
    """
    found = []
    for name in stored.model.effects:
        sides = stored.study.catalogue.effects[name].sides
        for lam in LAMBDAS:
            for sign in (1, -1) if sides == 2 else (1,):
                amount = stored.size(TRUE, name, lam, sign)
                if amount is not None:
                    found.append((name, lam, sign, amount))
        if name not in {entry[0] for entry in found}:
            effect = stored.study.catalogue.effects[name]
            limit = effect.parameters[effect.amount]["physical"][1]
            found.append((name, round(stored.strength(TRUE, {name: limit}), 1), 1, limit))
    return found


def noisy(mean: np.ndarray, variance: np.ndarray, rng: np.random.Generator) -> list[np.ndarray]:
    """Single readings of every row: Gaussian about the mean, that moved by a draw of its uncertainty."""
    centre = mean + np.sqrt(variance) * rng.standard_normal(len(mean))
    found = []
    for (rig, _), value in zip(BENCH.conditions, centre, strict=True):
        found.append(value + BENCH.reading_sd(rig, value) * rng.standard_normal(BENCH.repeats[rig]))
    return found


def draw(stored: Stored, name: str, lam: float, sign: int, amount: float, number: int) -> dict:
    """One draw as a row of the trials' table."""
    rng = np.random.default_rng((zlib.crc32(f"{name}|{lam:g}|{sign}".encode()), number))
    effects = {name: amount} if name else {}
    mean, variance = stored.readings(TRUE, effects)
    study = BENCH.study(BENCH.rows(noisy(mean, variance, rng)))
    state = fit_study(study, Model(study, engines=stored.engines), extra_starts=1)
    answer = refine(study, state, propose=False)
    return {
        "kind": "one" if name else "nothing",
        "hidden": name,
        "lambda": f"{lam:g}",
        "sign": sign,
        "amount": f"{amount:.6g}",
        "number": number,
        **described(answer, TRUE, effects),
    }


def described(answer: Refinement, truth: Mapping[str, float], effects: Mapping[str, float]) -> dict:
    """What was answered, as cells of a row: verdicts, effects, cover of the true parameters, fitted over hidden size."""
    last = answer.steps[-1]
    inside = [low <= truth[name] <= high for name, (low, high) in last.intervals.items() if name in truth]
    ratio = ""
    for name, amount in effects.items():
        key = f"{name}.{answer.study.catalogue.effects[name].amount}" if name in answer.study.catalogue.effects else ""
        if name in answer.added and key in last.parameters:
            absent = answer.study.catalogue.effects[name].neutral()[answer.study.catalogue.effects[name].amount]
            ratio = f"{(last.parameters[key] - absent) / (amount - absent):.3f}"
    gate = answer.diagnoses[0].gate_p
    return {
        "verdict": answer.verdict,
        "first": answer.diagnoses[0].verdict,
        "added": "+".join(answer.added),
        "tied": "|".join("+".join(names) for names in answer.tied),
        "gate_p": "" if gate is None else f"{gate:.4f}",
        "rms_before": f"{answer.steps[0].rms_error:.4f}",
        "rms_after": f"{last.rms_error:.4f}",
        "covered": sum(inside),
        "constants": len(inside),
        "size_ratio": ratio,
    }


COLUMNS = (
    "kind",
    "hidden",
    "lambda",
    "sign",
    "amount",
    "number",
    "verdict",
    "first",
    "added",
    "tied",
    "gate_p",
    "rms_before",
    "rms_after",
    "covered",
    "constants",
    "size_ratio",
)


def plan(stored: Stored, scale: float = 1.0) -> list[tuple[str, float, int, float, int]]:
    """(effect or "", lambda, sign, amount, how many): 500 draws an effect at its largest strength, 200 at others."""
    reached = sizes(stored)
    found = [("", 0.0, 1, 0.0, 1000)]
    for name in dict.fromkeys(name for name, *_ in reached):
        mine = [entry for entry in reached if entry[0] == name]
        most = max(lam for _, lam, _, _ in mine)
        for _, lam, sign, amount in mine:
            signs = sum(1 for _, other, _, _ in mine if other == lam)
            found.append((name, lam, sign, amount, (500 if lam == most else 200) // signs))
    return [(name, lam, sign, amount, max(1, round(scale * n))) for name, lam, sign, amount, n in found]


def run(stored: Stored, file: Path, scale: float = 1.0, seconds: float = np.inf, show: Show | None = None) -> int:
    """Do the draws that are missing from a table, all kinds growing alike; returns how many were done.

    Raises
    ------
    InputError : the table's amounts are not those of these surfaces
    """
    planned = plan(stored, scale)
    amounts = {(name, f"{lam:g}", sign): amount for name, lam, sign, amount, _ in planned}
    rows = read(file)
    for row in rows:
        amount = amounts.get((row["hidden"], row["lambda"], int(row["sign"])), np.nan)
        if not np.isclose(float(row["amount"]), amount, rtol=1e-3, atol=0):
            raise InputError(
                f"{file}: a draw of {row['hidden']} at lambda {row['lambda']} hides {row['amount']}, where the present surfaces "
                f"ask for {amount:.6g}; its draws belong to other surfaces: move it away"
            )
    done = {(r["hidden"], float(r["lambda"]), int(r["sign"]), int(r["number"])) for r in rows}
    waiting = [(k / n, (name, lam, sign, amount, k)) for name, lam, sign, amount, n in planned for k in range(n)]
    jobs = [job for _, job in sorted(waiting, key=lambda entry: entry[0]) if (*job[:3], job[4]) not in done]
    return resume(file, COLUMNS, jobs, partial(draw, stored), seconds, show)
