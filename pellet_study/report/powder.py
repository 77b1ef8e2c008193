"""What `calibrate` left in a study folder, stage by stage, as parts of the report: analysed anew from its files of runs."""

from itertools import combinations
from math import isclose
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.doe import box_behnken, figures, optimum, plackett_burman
from pellet_study.doe.factors import Factor
from pellet_study.errors import InputError
from pellet_study.files import opening
from pellet_study.output.words import number, probability
from pellet_study.powder.decisions import (
    Climb,
    Optimum,
    Screening,
    Surface,
    Validation,
    command,
    decided,
    read_decision,
)
from pellet_study.powder.figures import climb, corner, heaps
from pellet_study.powder.identified import heaps_in, posteriors
from pellet_study.powder.plan import NAMES, OBSERVABLE, RIG, SYMBOLS, Reading, differences, steering
from pellet_study.powder.tables import errors_of, surface_of, table_of
from pellet_study.powder.text import (
    anywhere,
    contradiction,
    curvature,
    levels,
    next_words,
    or_unknown,
    percent,
    selection,
)
from pellet_study.report.parts import Stage, Table, picture, table
from pellet_study.study.study import Study

UNITS = {"G": "J/m²"}
Measured = tuple[float, float | None] | None  # the angle and its standard deviation, deg


def measured_angle(study: Study) -> Measured:
    """The mean of the study's angle that steers and the root of its mean variance (deg), None where none was measured."""
    rows = [row for row in study.rows if row.rig == RIG and row.split == "fit"]
    angle = steering(row.observable for row in rows)
    angles = [row for row in rows if row.observable == angle]
    if not angles:
        return None
    value = sum(row.n * row.value for row in angles) / sum(row.n for row in angles)
    sds = [row.sd for row in angles if row.sd is not None]
    return value, (sum(sd**2 for sd in sds) / len(sds)) ** 0.5 if sds else None


def powder_stages(folder: Path, measured: Measured) -> list[Stage]:
    """The stages done in a folder, in the source paper's order, each beside the angle it was decided for.

    Parameters
    ----------
    measured : the study's repose angle and its standard deviation (deg), None where none was measured

    Raises
    ------
    InputError : a file is not what `calibrate` wrote
    """
    found: list[Stage] = []
    first = None
    for stage, part_of in SHOWN.items():
        if not (folder / stage / "decision.json").exists():
            continue
        try:
            plan = decided(folder, stage).get("plan")
            part = part_of(folder, (plan["target_deg"], plan["sd_deg"]) if plan else measured)
            if part is None:
                continue
            first = first or plan
            other = differences(plan, first) if plan and first else []
            if plan and measured and not other and not isclose(plan["target_deg"], measured[0]):
                other.append(f"target_deg {plan['target_deg']:g} there, {measured[0]:g} in the study now")
            if other:
                part.words.append(
                    f"This stage was decided for another plan ({'; '.join(other)}): run `{command(folder)}` again."
                )
            found.append(part)
        except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
            raise InputError(
                f"{folder / stage}: is not what `calibrate` wrote ({type(error).__name__}: {error}); "
                f"run `pellet-study calibrate {folder} --only {stage}` again"
            ) from None
    return found


def _good(folder: Path, stage: str) -> tuple[pd.DataFrame, str]:
    """The heaps of a stage that gave an angle, and a sentence on all of them."""
    runs = pd.read_csv(opening.stream(folder / stage / "runs.csv"))
    good = runs[runs["verdict"] == "ok"]
    lost = runs.loc[runs["verdict"] != "ok", "verdict"]
    words = f"{len(runs)} heaps"
    if len(lost):
        words += f"; {len(lost)} gave no angle: " + ", ".join(f"{n} {why}" for why, n in lost.value_counts().items())
    return good, words + "."


def _screening(folder: Path, measured: Measured) -> Stage:
    good, words = _good(folder, "screening")
    decision: Screening = read_decision(folder, "screening")
    names = [name for name in SYMBOLS if name in good]
    factors = [Factor(n, float(good[n].min()), float(good[n].max()), UNITS.get(n, "-")) for n in names]
    found = plackett_burman.analyse(table_of(good, factors), interactions=False)
    return Stage(
        kind="screening",
        heading="Powder: screening",
        words=[f"Plackett-Burman with centre points: {words} Effects {selection(decision)}{curvature(decision)}."],
        pictures=[
            picture(
                figures.pareto(found, "deg"),
                "effects of the factors in order of size",
                "Change of the repose angle from the low to the high level of each factor, with the margins beyond which "
                "it is more than scatter.",
            ),
            picture(
                figures.half_normal(found.effects, found.lenth, "deg", found.noise_contrasts),
                "half-normal plot of the effects",
                "What is only scatter lies on a line through the origin; what acts stands to its right.",
            ),
        ],
        tables=[_effects(folder, found, factors)],
        short=f"Powder screening, {len(good)} heaps: effects {selection(decision)}.",
    )


def _effects(folder: Path, found: plackett_burman.Screening, factors: list[Factor]) -> Table:
    """The effects with their 95 % margins; beside the source paper's where `calibrate` left that table."""
    errors = errors_of(found.model)
    rows = [
        [
            f.name,
            f"{NAMES[f.name]} ({UNITS.get(f.name, '-')})",
            f"{f.low:g} to {f.high:g}",
            f"{found.effects[f.name]:+.2f} ± {2 * errors[f.name]:.2f}",
            probability(found.p[f.name]),
        ]
        for f in factors
    ]
    head = ["symbol", "factor", "range", "effect (deg)", "p"]
    numbers = range(3, 5)
    file = folder / "screening" / "effects.csv"
    if file.exists():
        beside = pd.read_csv(opening.stream(file)).set_index("factor")
        head += ["source paper (deg)", "sign"]
        numbers = range(3, 6)
        for row in rows:
            row += [f"{beside.loc[row[0], 'paper_effect_deg']:+.2f}", beside.loc[row[0], "sign"]]
    return table(head, rows, numbers)


def _climb(folder: Path, measured: Measured) -> Stage:
    good, words = _good(folder, "climb")
    decision: Climb = read_decision(folder, "climb")
    centre = ", ".join(f"{name} {value:.4g}" for name, value in decision.centre.items())
    meets = "meets the measured angle" if decision.reached else "comes nearest to the measured angle"
    return Stage(
        kind="climb",
        heading="Powder: the climb",
        words=[f"Along the direction of the screening's effects: {words} The path {meets} near {centre}."],
        pictures=[
            picture(
                climb(good, decision.factors, measured),
                "repose angle along the path",
                "Each point a heap, its error that over the silhouettes; dashed: the measured angle with its scatter.",
            )
        ],
    )


def _surface(folder: Path, measured: Measured) -> Stage:
    good, words = _good(folder, "surface")
    decision: Surface = read_decision(folder, "surface")
    found = surface_of(good, decision, UNITS)
    factors = found.table.factors
    target = optimum.target_set(found, measured[0], measured[1] or 0.0) if measured else None
    lines = [
        f"Box-Behnken: {words} R² {found.r2:.4f}, predicted {or_unknown(found.r2_predicted, '.4f')}; "
        f"lack of fit p {probability(found.lack_of_fit_p)}."
    ]
    if measured and target is not None:
        lines.append(_meets(folder, target, measured[0]))
    pictures = [
        picture(
            figures.surface_contours(found, target, "deg", [pair]),
            f"response surface of {factors[pair[0]].name} and {factors[pair[1]].name} with the measured angle",
            "Black: where the surface meets the measured angle; hatched: within its scatter; star: the setting named "
            "above. The factor that is not shown stays there.",
        )
        for pair in combinations(range(len(factors)), 2)
    ]
    pictures.append(
        picture(
            figures.predicted_observed(found, "deg"),
            "fitted against simulated angles",
            "Each point a heap of the design.",
        )
    )
    return Stage(
        kind="surface",
        heading="Powder: the surface and what meets the angle",
        words=lines,
        pictures=pictures,
        tables=[_coefficients(found)],
    )


def _meets(folder: Path, target: optimum.TargetSet, angle: float) -> str:
    """How much of the surface's box meets an angle, and the setting that does it best."""
    file = folder / "optimum" / "decision.json"
    outside = {}
    if file.exists():
        decision: Optimum = read_decision(folder, "optimum")
        outside = decision.outside
    setting = levels(target.physical, list(target.physical), outside)
    if target.reachable:
        return (
            f"{100 * target.fraction:.1f} % of the box meets {angle:g} deg within its scatter; recommended "
            f"({target.rule_in_words}): {setting}."
        )
    return (
        f"{angle:g} deg is not reachable in this box: it gives {target.lowest:.1f} to {target.highest:.1f} deg; "
        f"nearest: {setting}."
    )


def _optimum(folder: Path, measured: Measured) -> Stage | None:
    """What the readings tell of the factors; None where an older version decided."""
    decision: Optimum = read_decision(folder, "optimum")
    joint = decision.joint
    if joint is None:
        return None
    several = len(joint.readings) > 1
    names = [one.observable for one in joint.readings]
    words = [
        f"On the surfaces of {joint.heaps} heaps{anywhere(joint)}, the settings that hold 95 % of the posterior take {percent(joint.share_of_box)} of "
        f"the box"
        + (f"; of {names[0]} alone {percent(joint.share_of_box_first)}." if several else f" ({names[0]} alone).")
        + f" {next_words(joint)}"
    ]
    if against := contradiction(joint):
        words.insert(0, f"But {against.removeprefix('; but ')}.")
    rows = [
        [
            k.factor,
            f"{NAMES[k.factor]} ({UNITS.get(k.factor, '-')})",
            f"{number(k.low, 3)} to {number(k.high, 3)}",
            percent(k.share_of_range),
            k.word + (", ends at the box" if k.at_end else ""),
        ]
        for k in joint.known
    ]
    told = [
        [
            one.observable,
            number(one.measured),
            number(one.standard_error, 2),
            f"{number(one.predicted)} ± {number(one.predicted_standard_error, 2)}",
            f"{number(one.lowest)} to {number(one.highest)}",
        ]
        for one in joint.readings
    ]
    pictures = []
    if all((folder / stage / "runs.csv").exists() for stage in ("screening", "surface")):
        box = heaps_in(folder, folder, read_decision(folder, "surface"), names[0], UNITS)
        readings = [Reading(one.observable, one.measured, one.sd, one.n, one.freedom) for one in joint.readings]
        found, first = posteriors(box, readings)
        pictures = [
            picture(
                corner(found, first, names[0], np.array([f.coded(decision.point[f.name]) for f in found.factors])),
                "what the readings tell of each pair of factors",
                "Regions that hold 95 % of the posterior; star: the setting recommended.",
            )
        ]
    return Stage(
        kind="optimum",
        heading="Powder: what the readings tell of the parameters",
        words=words,
        pictures=pictures,
        tables=[
            table(["symbol", "factor", "95 % interval", "of its range", ""], rows, range(2, 4)),
            table(["reading", "measured", "standard error", "at the setting", "in the box"], told, range(1, 5)),
        ],
    )


def _coefficients(found: box_behnken.Surface) -> Table:
    """The terms of a surface with their standard errors."""
    rows = [
        [term, f"{value:+.4g}", number(found.model.standard_errors.get(term), 2)]
        for term, value in found.coefficients.items()
    ]
    return table(("term, coded", "coefficient (deg)", "standard error (deg)"), rows, (1, 2))


def _validation(folder: Path, measured: Measured) -> Stage:
    d: Validation = read_decision(folder, "validation")
    first, last = d.attempts[0], d.attempts[-1]
    good, words = _good(folder, "validation")
    if len(d.attempts) > 1:
        good = good[good["attempt"] == good["attempt"].max()]
        words = (
            f"{words} The first setting gave {first.mean_deg:.2f} ± {first.standard_error_deg:.2f} deg and was "
            f"corrected to {levels(d.point, d.factors, d.outside)}; the {last.heaps} heaps with other seeds there count."
        )
    if d.nothing_nearer:
        words += " The setting is not corrected, as along the gradient the box has nothing nearer."
    low, high = d.error_interval_percent
    equivalent = "equivalent" if d.equivalent else "not shown equivalent"
    beside = "".join(
        f" {one.observable} {number(one.mean)} ± {number(one.standard_error, 2)}, measured {number(one.measured)}: "
        f"{'equivalent' if one.equivalent else 'not shown equivalent'} within {number(one.margin, 2)}, its sd."
        for one in d.others
    )
    failed = [one.observable for one in d.others if not one.equivalent]
    but = f", but {', '.join(failed)} not" if failed and d.equivalent else ""
    return Stage(
        kind="validation",
        heading="Powder: validation",
        words=[
            f"At the setting found, with seeds nobody has used: {words} Mean {d.mean_deg:.2f} ± "
            f"{d.standard_error_deg:.2f} deg over the {len(good)} heaps there that gave an angle, measured {d.measured_deg:g}: error {d.error_percent:.2f} % "
            f"(95 % {low:+.2f} to {high:+.2f} %); {equivalent} within "
            f"{d.margin_deg:g} deg, stated beforehand (two one-sided tests, p {probability(d.p_tost)}){but}.{beside}"
        ],
        short=(
            f"Powder: {d.mean_deg:.2f} ± {d.standard_error_deg:.2f} deg at the setting found ({len(good)} heaps), measured {d.measured_deg:g}: "
            f"error {d.error_percent:.2f} % (95 % {low:+.2f} to {high:+.2f} %), {equivalent} within {d.margin_deg:g} deg{but}."
        ),
        pictures=[
            picture(
                heaps(good[OBSERVABLE].to_numpy(), d.mean_deg, d.interval_deg, d.measured_deg, d.margin_deg),
                "angles of the validation heaps beside the measured one",
                "Points: one heap each. Blue band: mean with its 95 % interval. Grey: the margin that was stated beforehand.",
            )
        ],
    )


SHOWN = {
    "screening": _screening, "climb": _climb, "surface": _surface, "optimum": _optimum, "validation": _validation,
}  # fmt: skip
