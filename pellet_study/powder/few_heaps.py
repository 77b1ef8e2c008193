"""A powder calibration in few heaps: screening without centre points, then every heap where the path meets the target.

The chain spends its heaps on a surface and then as many again on a validation. Here each heap after the screening does
both: it stands where the straight line through the heaps so far meets the measured angle, and so tells most about the
angle there. The line's slope has the screening's estimate as a prior, its scatter comes from the heaps on the path.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from pellet_study.doe import plackett_burman, screening_designs
from pellet_study.doe.factors import Factor
from pellet_study.powder.decisions import PathSetting
from pellet_study.powder.heaps import Heaps, lost_of, point_at
from pellet_study.powder.plan import OBSERVABLE, RIG, SYMBOLS, Plan
from pellet_study.powder.results import Results
from pellet_study.powder.screening import largest
from pellet_study.powder.tables import errors_of, table_of
from pellet_study.rigs import on_yade

FIRST_SEED = 5_000  # of the path, within the climb's
BATCH = 2  # heaps at once
FEWEST, MOST = 10, 60
WANTED_ERROR = 0.3  # deg, standard error of the angle at the setting found


@dataclass(frozen=True)
class Line:
    """Angle along the path, a + b t: estimates (2,), their covariance (2, 2), and the scatter of a heap, deg."""

    estimates: np.ndarray
    covariance: np.ndarray
    scatter: float

    def meets(self, target: float) -> float:
        """Where on the path the line meets an angle."""
        return float((target - self.estimates[0]) / self.estimates[1])

    def at(self, t: float) -> float:
        """The angle at t, deg."""
        return float(self.estimates @ [1, t])

    def error(self, t: float) -> float:
        """Standard error of the angle at t, deg."""
        return float(np.sqrt(np.array([1, t]) @ self.covariance @ np.array([1, t])))


@dataclass(frozen=True)
class Uphill:
    """The path of a screening: the point at t has the coded levels t `direction`, for t from `low` to `high`.

    What the screening knows of the angle (deg) along it: the `level` at t = 0, the `slope` with its standard error, the
    `scatter` of a heap with its degrees of `freedom`.
    """

    factors: list[Factor]
    direction: np.ndarray
    low: float
    high: float
    level: float
    slope: float
    slope_error: float
    scatter: float
    freedom: int

    def point(self, t: float) -> dict[str, float]:
        """{factor: physical level} at t."""
        return point_at(self.factors, t * self.direction)

    def within(self, t: float) -> float:
        """t, or the end of the path that is nearest to it."""
        return float(np.clip(t, self.low, self.high))


def fit_line(path: Uphill, t: np.ndarray, angle: np.ndarray) -> Line:
    """Weighted least squares of a + b t with a normal prior on b, the slope of the screening.

    Parameters
    ----------
    t, angle : (n,) places and angles (deg) of the heaps on the path; their scatter is pooled with the screening's
    """
    slope, slope_error, scatter, freedom = path.slope, path.slope_error, path.scatter, path.freedom
    terms = np.column_stack([np.ones_like(t), t])
    pooled = scatter
    for _ in range(20):  # the line and the scatter, in turn
        weights = np.r_[np.full(len(t), 1 / pooled), 1 / slope_error]
        rows = np.vstack([terms, [0, 1]]) * weights[:, None]
        covariance = np.linalg.inv(rows.T @ rows)
        estimates = covariance @ rows.T @ (np.r_[angle, slope] * weights)
        squares = freedom * scatter**2 + ((angle - terms @ estimates) ** 2).sum()
        pooled = float(np.sqrt(squares / (freedom + len(t) - 1)))
    return Line(estimates, covariance, pooled)


def calibrate(heaps: Heaps, results: Results, wanted_error: float = WANTED_ERROR) -> PathSetting:
    """The setting whose heaps have the measured angle, found in few heaps; files in FOLDER/path.

    Raises
    ------
    SimulationError : too few heaps gave an angle
    """
    plan = heaps.plan
    screened, path = screen(heaps, results)
    t = path.within((plan.target - path.level) / path.slope)
    places: list[float] = []
    while True:
        places += [t] * BATCH
        runs = heaps.at("climb", [path.point(place) for place in places], first=FIRST_SEED)
        both = pd.concat([screened, runs.assign(stage="path", place=places)], ignore_index=True)
        results.write_table("path", "runs", both)
        kept = (runs["verdict"] == "ok").to_numpy()
        if kept.sum() >= 2:
            line = fit_line(path, np.array(places)[kept], runs.loc[kept, OBSERVABLE].to_numpy(float))
            t = path.within(line.meets(plan.target))
            heaps.say(f"  {len(places)} heaps: {line.at(t):.2f} +- {line.error(t):.2f} deg at the best place so far")
            if (kept.sum() >= FEWEST and line.error(t) <= wanted_error) or len(places) >= MOST:
                break
        elif len(places) >= FEWEST:
            heaps.good(runs, "path", 2)  # says why
    point = {f.name: f.centre for f in plan.factors} | path.point(t)
    setting = PathSetting(
        point=point,
        factors=[f.name for f in path.factors],
        outside=plan.outside(point),
        place=t,
        predicted_deg=line.at(t),
        standard_error_deg=line.error(t),
        wanted_error_deg=wanted_error,
        enough=line.error(t) <= wanted_error,
        scatter_deg=line.scatter,
        slope_deg=float(line.estimates[1]),
        met=bool(path.low < t < path.high),
        heaps=len(screened) + len(runs),
        path_heaps=len(runs),
        path_lost=lost_of(runs),
        lost=lost_of(screened) + lost_of(runs),
    )
    results.write_decision("path", setting)
    return setting


def screen(heaps: Heaps, results: Results) -> tuple[pd.DataFrame, Uphill]:
    """The heaps of a screening without centre points, and the path along its largest effects."""
    plan = heaps.plan
    coded = screening_designs.coded_matrix(len(plan.factors), centre_points=0)
    heaps.say(f"screening: {len(coded)} heaps ...")
    screened = heaps.at("screening", [point_at(plan.factors, row) for row in coded])
    results.write_table("path", "runs", screened)
    good = heaps.good(screened, "screening", len(plan.factors) + 2)
    path = uphill(plackett_burman.analyse(table_of(good, plan.factors), interactions=False), plan)
    names = ", ".join(f.name for f in path.factors)
    heaps.say(f"path: the three largest effects are those of {names}; {FEWEST} to {MOST} heaps ...")
    return screened, path


def uphill(found: plackett_burman.Screening, plan: Plan) -> Uphill:
    """The path along the gradient in the factors of the largest effects, as far as twice the box and what the rig takes."""
    slopes, errors = found.model.coefficients, errors_of(found.model)
    chosen = largest(found, plan)
    factors = [f for f in plan.factors if f.name in chosen]
    direction = np.array([slopes[f.name] for f in factors])
    direction /= np.abs(direction).max()
    low, high = _ends(factors, direction)
    return Uphill(
        factors,
        direction,
        low,
        high,
        level=slopes["1"],
        slope=float(sum(slopes[f.name] * u for f, u in zip(factors, direction, strict=True))),
        slope_error=float(np.sqrt(sum((errors[f.name] * u) ** 2 for f, u in zip(factors, direction, strict=True)))),
        scatter=float(np.sqrt(found.model.ss_residual / found.model.df_residual)),
        freedom=found.model.df_residual,
    )


def _ends(factors: Sequence[Factor], direction: np.ndarray) -> tuple[float, float]:
    """How far the path goes: twice the box, as far as the rig takes the levels."""
    known = on_yade.rig(RIG).parameters
    low, high = -2.0, 2.0
    for f, u in zip(factors, direction, strict=True):
        if u:
            ends = sorted(f.coded(known[SYMBOLS[f.name]][side]) / u for side in ("min", "max"))
            low, high = max(low, ends[0]), min(high, ends[1])
    return low, high
