"""The surface: a Box-Behnken design around the climb's best place, and the setting on it that meets the target."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from pellet_study.doe import box_behnken, optimum
from pellet_study.doe.factors import Factor
from pellet_study.doe.intervals import interval
from pellet_study.files import opening
from pellet_study.powder.box import MOVES, moved
from pellet_study.powder.decisions import Climb, Optimum, Surface
from pellet_study.powder.heaps import SEEDS_A_TRY, Heaps, lost_of, point_at, repeated
from pellet_study.powder.identified import Identified, identify
from pellet_study.powder.plan import RIG, SYMBOLS, Plan, bond
from pellet_study.powder.results import Results
from pellet_study.powder.tables import coefficients_table, surface_of, table_of
from pellet_study.rigs import on_yade

RULE = "nearest to the middle of the box among the settings that agree best with all readings"
LEAST_HEAPS = 12  # that must have given an angle; the surface has ten terms


@dataclass(frozen=True)
class Fitted:
    """A box whose heaps were simulated: its design, its heaps, its surface, by how much that misses the target (deg)."""

    factors: list[Factor]
    design: pd.DataFrame
    runs: pd.DataFrame
    surface: box_behnken.Surface
    target: optimum.TargetSet
    gap: float

    @property
    def box(self) -> dict[str, list[float]]:
        """{factor: [low, high]}."""
        return {f.name: [f.low, f.high] for f in self.factors}


def surface(heaps: Heaps, results: Results) -> Surface:
    """Simulate and fit the box; it moves where the target lies outside.

    Where no box has the target, the one whose surface comes nearest to it counts.
    """
    climbed: Climb = results.decision("climb")
    units = {f.name: f.unit for f in heaps.plan.factors}
    factors = [Factor(name, low, high, units[name]) for name, (low, high) in climbed.box.items()]
    tried: list[Fitted] = []
    while True:
        tried.append(fit_box(heaps, results, factors, tried))
        last = tried[-1]
        if last.target.reachable or len(tried) == MOVES:
            break
        heaps.say(
            f"  surface: the box gives {last.target.lowest:.1f} to {last.target.highest:.1f} deg, not "
            f"{heaps.plan.target:g}; it moves"
        )
        factors = towards_target(last, heaps.plan.target)
    chosen = int(np.argmin([box.gap for box in tried]))
    best, model = tried[chosen], tried[chosen].surface.model
    if chosen != len(tried) - 1:
        heaps.say(f"  surface: box {chosen + 1} of {len(tried)} comes nearest to {heaps.plan.target:g} deg and counts")
        results.write_table("surface", "design", best.design)
    results.write_table("surface", "coefficients", coefficients_table(best.surface))
    decision = Surface(
        box=best.box,
        boxes=[box.box for box in tried],
        chosen_box=chosen,
        coefficients=model.coefficients,
        standard_errors=model.standard_errors,
        r2=best.surface.r2,
        r2_adjusted=best.surface.r2_adjusted,
        r2_predicted=best.surface.r2_predicted,
        r2_predicted_ceiling=best.surface.r2_predicted_ceiling,
        lack_of_fit_p=best.surface.lack_of_fit_p,
        reachable=bool(best.gap == 0),
        heaps=sum(len(box.runs) for box in tried),
        lost=sum(lost_of(box.runs) for box in tried),
        box_runs=len(best.runs),
        repeats=heaps.sizes.repeats,
    )
    results.write_decision("surface", decision)
    return decision


def fit_box(heaps: Heaps, results: Results, factors: list[Factor], before: list[Fitted]) -> Fitted:
    """Simulate the design in a box and fit its surface; the tables have the boxes before it too."""
    coded = box_behnken.coded_matrix(len(factors), heaps.sizes.centre_points)
    points = [point_at(factors, row) for row in coded]
    design = pd.DataFrame(points).round(10)
    results.write_table("surface", "design", design)
    runs = heaps.at("surface", repeated(points, coded, heaps.sizes.repeats), first=SEEDS_A_TRY * len(before))
    runs["box"] = len(before)
    results.write_table("surface", "runs", pd.concat([*(box.runs for box in before), runs], ignore_index=True))
    fitted = box_behnken.analyse(table_of(heaps.good(runs, "surface", LEAST_HEAPS), factors))
    wanted = heaps.plan.target
    target = optimum.target_set(fitted, wanted, heaps.plan.sd)
    return Fitted(factors, design, runs, fitted, target, max(target.lowest - wanted, wanted - target.highest, 0.0))


def towards_target(box: Fitted, target: float) -> list[Factor]:
    """The factors of the next box: moved along the surface's linear terms, as far as the rig takes the levels."""
    known = on_yade.rig(RIG).parameters
    slopes = np.array([box.surface.model.coefficients[f.name] for f in box.factors])
    up = 1 if box.target.highest < target else -1
    shift = up * slopes / np.abs(slopes).max()
    return [moved(f, x, known[SYMBOLS[f.name]]) for f, x in zip(box.factors, shift, strict=True)]


def refitted(results: Results) -> box_behnken.Surface:
    """The surface that counts, fitted again from its file of runs, that beside its decision."""
    decision: Surface = results.decision("surface")
    home = results.home("surface") or results.folder
    runs = pd.read_csv(opening.stream(home / "surface" / "runs.csv"))
    return surface_of(runs, decision, {f.name: f.unit for f in results.plan.factors})


def meet_target(plan: Plan, results: Results) -> tuple[Optimum, optimum.TargetSet, Identified]:
    """The settings of the surface's box that meet the target, and the one recommended among them, else the nearest.

    Where more than the angle was measured, the one recommended is the setting that agrees best with all readings.
    """
    fitted = refitted(results)
    target = optimum.target_set(fitted, plan.target, plan.sd)
    found = identify(plan, results, target.coded)
    physical, prediction, rule = target.physical, target.prediction, target.rule_in_words
    if plan.others:
        physical = {f.name: float(f.physical(x)) for f, x in zip(found.all.factors, found.setting, strict=True)}
        prediction, rule = interval(fitted.model, found.setting), RULE
    point = {f.name: f.centre for f in plan.factors} | physical
    decision = Optimum(
        point=point,
        factors=list(physical),
        outside=plan.outside(point),
        predicted_deg=prediction.predicted,
        prediction_standard_error_deg=prediction.standard_error,
        reachable=bool(target.reachable),
        rule=rule,
        fraction_of_box=target.fraction,
        lowest=target.lowest,
        highest=target.highest,
        unidentified=target.unidentified,
        extents={e.name: list(e.physical) for e in target.extents},
        bond_number=bond(plan, plan.energy(point)),
        box={f.name: [f.low, f.high] for f in fitted.table.factors},
        joint=found.joint,
    )
    results.write_decision("optimum", decision)
    return decision, target, found
