"""A powder calibration in few heaps: screening without centre points, then every heap where the path meets the target.

The chain spends its heaps on a surface and then as many again on a validation. Here each heap after the screening does
both: it stands where the straight line through the heaps so far meets the measured angle, and so tells most about the
angle there. The line's slope has the screening's estimate as a prior, its scatter comes from the heaps on the path.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from pellet_study.doe import plackett_burman
from pellet_study.powder.chain import Chain
from pellet_study.powder.plan import OBSERVABLE, RIG, SYMBOLS
from pellet_study.powder.tables import table_of
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


def line(t, angle, slope: float, slope_error: float, scatter: float, freedom: int) -> Line:
    """Weighted least squares of a + b t with a normal prior on b.

    Parameters
    ----------
    t, angle : (n,) places and angles (deg) of the heaps on the path
    slope, slope_error : prior mean and standard deviation of b, deg
    scatter, freedom : of a heap (deg) as the screening has it, with its degrees of freedom; pooled with the path's own
    """
    t, angle = np.asarray(t, float), np.asarray(angle, float)
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


def calibrate(chain: Chain, wanted_error: float = WANTED_ERROR) -> dict:
    """The setting whose heaps have the measured angle, found in few heaps; files in FOLDER/path.

    Returns
    -------
    `point`, `place` (on the path), `predicted_deg`, `standard_error_deg`, `wanted_error_deg`, `heaps` (all), `path_heaps`,
    `path_lost`, `lost` (all), `factors`, `outside` (as `Plan.outside`), `slope_deg`, `met` (False where the path ends before the target),
    `enough` (False where `MOST` heaps do not give the wanted error)
    """
    plan = chain.plan
    chain.say(f"screening: {plackett_burman.coded_matrix(len(plan.factors), centre_points=0).shape[0]} heaps ...")
    coded = plackett_burman.coded_matrix(len(plan.factors), centre_points=0)
    points = [{f.name: float(f.physical(x)) for f, x in zip(plan.factors, row, strict=True)} for row in coded]
    screened = chain.heaps("screening", points)
    chain.write("path", "runs", screened)
    good = chain.good(screened, "screening", len(plan.factors) + 2)
    found = plackett_burman.analyse(table_of(good, plan.factors))
    slopes, errors = found.model.coefficients, found.model.standard_errors
    names = sorted((n for n in found.effects if n not in plan.idle), key=lambda n: -abs(slopes[n]))[:3]
    chain.say(f"path: the three largest effects are those of {', '.join(sorted(names))}; {FEWEST} to {MOST} heaps ...")
    factors = [f for f in plan.factors if f.name in names]
    uphill = np.array([slopes[f.name] for f in factors])
    uphill /= np.abs(uphill).max()
    slope = float(sum(slopes[f.name] * u for f, u in zip(factors, uphill, strict=True)))
    slope_error = float(np.sqrt(sum((errors[f.name] * u) ** 2 for f, u in zip(factors, uphill, strict=True))))
    low, high = _ends(chain, factors, uphill)
    scatter, freedom = float(np.sqrt(found.model.mean_square_error)), found.model.df_residual
    t = float(np.clip((plan.target - slopes["1"]) / slope, low, high))
    places: list[float] = []
    while True:
        places += [t] * BATCH
        points = [{f.name: float(f.physical(p * u)) for f, u in zip(factors, uphill, strict=True)} for p in places]
        runs = chain.heaps("climb", points, first=FIRST_SEED)
        chain.write("path", "runs", pd.concat([screened, runs.assign(stage="path", place=places)], ignore_index=True))
        kept = (runs["verdict"] == "ok").to_numpy()
        if kept.sum() >= 2:
            fitted = line(np.array(places)[kept], runs.loc[kept, OBSERVABLE], slope, slope_error, scatter, freedom)
            t = float(np.clip(fitted.meets(plan.target), low, high))
            chain.say(
                f"  {len(places)} heaps: {fitted.at(t):.2f} +- {fitted.error(t):.2f} deg at the best place so far"
            )
            if (kept.sum() >= FEWEST and fitted.error(t) <= wanted_error) or len(places) >= MOST:
                break
        elif len(places) >= FEWEST:
            chain.good(runs, "path", 2)  # says why
    middle = {f.name: f.centre for f in plan.factors}
    point = middle | {f.name: float(f.physical(t * u)) for f, u in zip(factors, uphill, strict=True)}
    decision = {
        "point": point,
        "factors": [f.name for f in factors],
        "outside": plan.outside(point),
        "place": t,
        "predicted_deg": fitted.at(t),
        "standard_error_deg": fitted.error(t),
        "wanted_error_deg": wanted_error,
        "enough": fitted.error(t) <= wanted_error,
        "scatter_deg": fitted.scatter,
        "slope_deg": float(fitted.estimates[1]),
        "met": bool(low < t < high),
        "heaps": len(screened) + len(runs),
        "path_heaps": len(runs),
        "path_lost": int((~kept).sum()),
        "lost": int((screened["verdict"] != "ok").sum() + (~kept).sum()),
    }
    chain.write("path", "decision", decision)
    return decision


def _ends(chain: Chain, factors, uphill) -> tuple[float, float]:
    """How far the path goes: twice the box, as far as the rig takes the levels."""
    known = on_yade.rig(RIG).parameters
    low, high = -2.0, 2.0
    for f, u in zip(factors, uphill, strict=True):
        if u:
            ends = sorted(f.coded(known[SYMBOLS[f.name]][side]) / u for side in ("min", "max"))
            low, high = max(low, ends[0]), min(high, ends[1])
    return low, high
