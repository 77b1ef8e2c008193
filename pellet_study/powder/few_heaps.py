"""A powder calibration in few heaps: a saturated screening, then heaps where its path meets the target, until the interval fits.

Eight heaps of a Plackett-Burman design give the path. Then two heaps at a time stand where the line through the heaps on the path
so far meets the measured angle, and it is fitted anew. They stop once the interval of the angle there is within the margin, and
are tested then, once. No heap of the screening counts in the level, and each batch has seeds of its own at a setting fixed before.

What the test is. The same heaps place the setting and judge it, so that their difference from the target is nil by construction
wherever the path meets it, and what the two one-sided tests ask is whether the interval of a setting so placed lies within the
margin. For that each of them has `LEVEL` = 2 % instead of 5: a setting is called equivalent and is not with 4 % at most where the
number of heaps is fixed, and below 5 % as heaps are added until the interval fits, which stops a little too early where they happen
to scatter little (10,000 draws a scatter: `benchmarks/few_heaps.py`).

References
----------
Chow, Robbins, On the asymptotic theory of fixed-width sequential confidence intervals for the mean, Ann. Math. Stat. 36
(1965) 457, doi:10.1214/aoms/1177700156. Schuirmann 1987: see `doe/validation.py`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from pellet_study.doe import screening_designs, validation
from pellet_study.errors import InputError
from pellet_study.powder.decisions import Attempt, PathSetting, Screening
from pellet_study.powder.heaps import Heaps, lost_of, point_at
from pellet_study.powder.path_line import Line, fit_line
from pellet_study.powder.plan import OBSERVABLE, Plan
from pellet_study.powder.results import Results
from pellet_study.powder.uphill import Uphill, uphill
from pellet_study.powder.validation import attempt_at

FIRST_SEED = 5_000  # of the path, within the climb's
SCREENED = 8  # heaps of the screening
MAY_BE_LOST = 2  # of these
BATCH = 2  # heaps at once
FEWEST = 8  # heaps on the path
MOST = 60  # heaps in all
LEVEL = 0.02  # of each of the two one-sided tests


@dataclass(frozen=True)
class Search:
    """What the heaps on a path told: where they stood, the line through those that gave an angle, the place it ends at."""

    places: list[float]
    line: Line
    place: float


def search(
    path: Uphill,
    plan: Plan,
    pour: Callable[[list[float]], np.ndarray],
    after: Callable[[Search], object] = lambda so_far: None,
) -> Search:
    """Heaps on the path, two at a time where the line meets the target, until one of `settled`'s reasons, or `MOST`.

    Parameters
    ----------
    pour : gives the angles (deg; nan where there is none) of the heaps at all places so far; raises where none has one
    after : told after each batch
    """
    t = path.within((plan.target - path.level) / path.slope if path.slope else 0.0)
    places: list[float] = []
    while True:
        places += [t] * BATCH
        angle = pour(places)
        good = np.isfinite(angle)
        if good.sum() < 2:
            continue
        line = fit_line(path, np.array(places)[good], angle[good])
        t = path.within(line.meets(plan.target))
        found = Search(list(places), line, t)
        after(found)
        if SCREENED + len(places) >= MOST or (good.sum() >= FEWEST and settled(found, plan)):
            return found


def settled(found: Search, plan: Plan) -> bool:
    """Whether the interval fits in the margin, or lies outside of it, or needs more heaps than there may be."""
    half, miss = half_width(found, plan), abs(found.line.at(found.place) - plan.target)
    return half < plan.margin or miss - half > plan.margin or not fits(found.line.scatter, MOST - SCREENED, plan)


def half_width(found: Search, plan: Plan) -> float:
    """Half the interval, deg, of the angle at the place found less that measured: its scatter counts where heaps can make up for it."""
    error, freedom = validation.welch(sample_at(found), counted(plan))
    return float(stdtrit(freedom, 1 - LEVEL) * error)


def sample_at(found: Search) -> validation.Sample:
    """As many heaps at the place found as would have its mean, its standard error and its degrees of freedom."""
    line, heaps = found.line, found.line.freedom + 1
    return validation.Sample(line.at(found.place), line.error(found.place) * heaps**0.5, heaps)


def counted(plan: Plan) -> validation.Sample:
    """The measured angle; as if known where it is of so few readings that no number of heaps could show equivalence."""
    return plan.angle.sample if plan.angle.attainable(LEVEL) else validation.Sample(plan.target)


def fits(scatter: float, number: int, plan: Plan) -> bool:
    """Whether the interval of so many heaps at one setting lies within the margin, at a scatter of a heap (deg)."""
    error, freedom = validation.welch(validation.Sample(plan.target, scatter, number), counted(plan))
    return bool(stdtrit(freedom, 1 - LEVEL) * error < plan.margin)


def needed(scatter: float, plan: Plan) -> int:
    """The least heaps on the path whose interval can lie within the margin, at a scatter of a heap (deg); 1000 stands for more."""
    return next((n for n in range(2, 1000) if fits(scatter, n, plan)), 1000)


def calibrate(heaps: Heaps, results: Results) -> PathSetting:
    """The setting whose heaps have the measured angle, found and tested in few heaps; files in FOLDER/path.

    Raises
    ------
    InputError : the scatter is known, and more heaps would be needed than there may be; another margin was declared
    SimulationError : too few heaps gave an angle
    """
    plan = heaps.plan
    refuse_dear(results)
    results.declare_margin("path")
    screened, path = screen(heaps, results)
    tables = [screened]

    def pour(places: list[float]) -> np.ndarray:
        runs = heaps.at("climb", [path.point(t) for t in places], first=FIRST_SEED)
        tables[1:] = [runs.assign(stage="path", place=places)]
        results.write_table("path", "runs", pd.concat(tables, ignore_index=True))
        if len(places) >= FEWEST:
            heaps.good(runs, "path", 2)
        return runs[OBSERVABLE].where(runs["verdict"] == "ok").to_numpy(float)

    def say(so_far: Search) -> None:
        angle, half = so_far.line.at(so_far.place), half_width(so_far, plan)
        heaps.say(f"  {len(so_far.places)} heaps on the path: {angle:.2f} +- {half:.2f} deg at the best place so far")

    heaps.say(f"path: it moves {', '.join(path.moved)}; {FEWEST} to {MOST - SCREENED} heaps ...")
    found = search(path, plan, pour, say)
    setting = setting_of(found, path, plan, screened, tables[1])
    results.write_decision("path", setting)
    return setting


def refuse_dear(results: Results) -> None:
    """Before any heap: a scatter that is known from a screening of the same plan, with which no interval could fit.

    Raises
    ------
    InputError : says how many heaps it needs
    """
    if not results.done("screening"):
        return
    known: Screening = results.decision("screening")
    plan = results.plan
    if known.scatter_deg and (least := SCREENED + needed(known.scatter_deg, plan)) > MOST:
        raise InputError(
            f"--few: heaps at one point differ by {known.scatter_deg:.2g} deg ({results.folder / 'screening'}), with which it takes "
            f"{least} heaps or more to know {plan.observable} within {plan.margin:g} deg; --few has {MOST} at most: leave it away, or measure a "
            "reading that scatters less"
        )


def screen(heaps: Heaps, results: Results) -> tuple[pd.DataFrame, Uphill]:
    """The heaps of a saturated screening, and the path along its effects."""
    factors = heaps.plan.factors
    coded = screening_designs.coded_matrix(len(factors), SCREENED)
    heaps.say(f"screening: {len(coded)} heaps ...")
    screened = heaps.at("screening", [point_at(factors, row) for row in coded])
    results.write_table("path", "runs", screened)
    good = heaps.good(screened, "screening", SCREENED - MAY_BE_LOST)
    return screened, uphill(factors, coded[good.index], good[OBSERVABLE].to_numpy(float), list(heaps.plan.idle))


def setting_of(found: Search, path: Uphill, plan: Plan, screened: pd.DataFrame, runs: pd.DataFrame) -> PathSetting:
    """What was found, as it is written."""
    line, t = found.line, found.place
    point = path.point(t)
    checked = tested(found, path, plan, runs)
    return PathSetting(
        point=point,
        factors=path.moved,
        outside=plan.outside(point),
        place=t,
        predicted_deg=line.at(t),
        standard_error_deg=line.error(t),
        wanted_error_deg=plan.margin / float(stdtrit(line.freedom, 1 - LEVEL)),
        enough=half_width(found, plan) < plan.margin,
        scatter_deg=line.scatter,
        slope_deg=float(line.estimates[1]),
        met=bool(path.low < t < path.high),
        heaps=len(screened) + len(runs),
        path_heaps=len(runs),
        path_lost=lost_of(runs),
        lost=lost_of(screened) + lost_of(runs),
        needed_heaps=SCREENED + needed(line.scatter, plan),
        validation=checked,
    )


def tested(found: Search, path: Uphill, plan: Plan, runs: pd.DataFrame) -> Attempt:
    """The angle at the setting found against that measured."""
    point = path.point(found.place)
    judged = attempt_at(plan, sample_at(found), point, LEVEL, path.moved, heaps=len(runs), lost=lost_of(runs))
    return replace(judged, sd_deg=found.line.scatter)
