"""The screening: a Plackett-Burman design with centre points says which parameters move the angle."""

import pandas as pd

from pellet_study.doe import plackett_burman, screening_designs
from pellet_study.errors import SimulationError
from pellet_study.powder.decisions import Screening
from pellet_study.powder.heaps import Heaps, lost_of, point_at, repeated
from pellet_study.powder.plan import RIG, Plan
from pellet_study.powder.results import Results
from pellet_study.powder.tables import effects_table, errors_of, readings_table, scatter, table_of
from pellet_study.rigs import on_yade

GO_ON = 3  # factors, as in the source paper


def screen(heaps: Heaps, results: Results) -> tuple[Screening, plackett_burman.Screening]:
    """Simulate and analyse the design; the decision, and the analysis for the figures."""
    factors, sizes = heaps.plan.factors, heaps.sizes
    coded = screening_designs.coded_matrix(len(factors), centre_points=sizes.centre_points)
    points = [point_at(factors, row) for row in coded]
    results.write_table("screening", "design", pd.DataFrame(points).round(10))
    runs = heaps.at("screening", repeated(points, coded, sizes.repeats))
    results.write_table("screening", "runs", runs)
    terms = 1 + len(factors) + (sizes.centre_points > 0)  # mean, factors, curvature
    good = heaps.good(runs, "screening", terms + 1)  # one more, or nothing tells their scatter
    refuse_unread(good, heaps.plan)
    found = plackett_burman.analyse(table_of(good, factors), interactions=False)
    errors = {name: 2 * error for name, error in errors_of(found.model).items() if name in found.effects}
    results.write_table("screening", "effects", effects_table(heaps.plan, found, errors))
    results.write_table("screening", "readings", readings_table(good, factors, heaps.plan.observable, terms + 1))
    decision = Screening(
        factors=sorted(largest(found, heaps.plan)),
        clear=[name for name in found.effects if abs(found.effects[name]) > 2 * errors[name]],
        coefficients={name: found.model.coefficients[name] for name in found.effects},
        curvature_deg=found.curvature.estimate if found.curvature else None,
        curvature_standard_error_deg=float(found.model.results.bse[-1]) if found.curvature else None,
        scatter_deg=scatter(good),
        lost=lost_of(runs),
        heaps=len(runs),
        repeats=sizes.repeats,
    )
    results.write_decision("screening", decision)
    return decision, found


def refuse_unread(good: pd.DataFrame, plan: Plan) -> None:
    """A reading that was measured and that no heap has cannot be met.

    Raises
    ------
    SimulationError : names it, with what it is
    """
    for one in plan.others:
        if good[one.observable].isna().all():
            raise SimulationError(
                f"{one.observable} was measured, but none of the {len(good)} heaps has it "
                f"({on_yade.rig(RIG).observables[one.observable]}); take its row out of the measurements"
            )


def largest(found: plackett_burman.Screening, plan: Plan) -> list[str]:
    """The factors of the largest effects, largest first, without those that the contact law cannot represent."""
    return sorted((n for n in found.effects if n not in plan.idle), key=lambda name: -abs(found.effects[name]))[:GO_ON]
