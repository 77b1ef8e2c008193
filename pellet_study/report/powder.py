"""What `calibrate` left in a study folder, stage by stage, as parts of the report: analysed anew from its files of runs."""

from itertools import combinations
from math import isclose
from pathlib import Path

import pandas as pd

from pellet_study.doe import figures, optimum, plackett_burman
from pellet_study.doe.factors import Factor
from pellet_study.errors import InputError
from pellet_study.output.words import number, probability
from pellet_study.powder.decisions import command, read_decision
from pellet_study.powder.figures import climb, heaps
from pellet_study.powder.plan import NAMES, OBSERVABLE, SYMBOLS, differences
from pellet_study.powder.tables import surface_of, table_of
from pellet_study.powder.text import curvature, known, levels, selection
from pellet_study.report.parts import picture, table

UNITS = {"G": "J/m²"}


def powder(folder: Path, measured: tuple[float, float | None] | None) -> list[dict]:
    """The stages done in a folder, in the source paper's order, each beside the angle it was decided for.

    Parameters
    ----------
    measured : the study's repose angle and its standard deviation (deg), None where none was measured

    Raises
    ------
    InputError : a file is not what `calibrate` wrote
    """
    found, first = [], None
    for stage, told in (
        ("screening", _screening),
        ("climb", _climb),
        ("surface", _surface),
        ("validation", _validation),
    ):
        if not (folder / stage / "decision.json").exists():
            continue
        try:
            plan = read_decision(folder, stage).get("plan")
            part = told(folder, (plan["target_deg"], plan["sd_deg"]) if plan else measured)
            first = first or plan
            other = differences(plan, first) if plan and first else []
            if plan and measured and not other and not isclose(plan["target_deg"], measured[0]):
                other.append(f"target_deg {plan['target_deg']:g} there, {measured[0]:g} in the study now")
            if other:
                part["words"].append(
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
    runs = pd.read_csv(folder / stage / "runs.csv")
    good = runs[runs["verdict"] == "ok"]
    lost = runs.loc[runs["verdict"] != "ok", "verdict"]
    words = f"{len(runs)} heaps"
    if len(lost):
        words += f"; {len(lost)} gave no angle: " + ", ".join(f"{n} {why}" for why, n in lost.value_counts().items())
    return good, words + "."


def _screening(folder: Path, measured) -> dict:
    good, words = _good(folder, "screening")
    decision = read_decision(folder, "screening")
    names = [name for name in SYMBOLS if name in good]
    factors = [Factor(n, float(good[n].min()), float(good[n].max()), UNITS.get(n, "-")) for n in names]
    found = plackett_burman.analyse(table_of(good, factors))
    errors = found.model.standard_errors
    rows = [
        [
            n,
            f"{NAMES[n]} ({UNITS.get(n, '-')})",
            f"{f.low:g} to {f.high:g}",
            f"{found.effects[n]:+.2f} ± {2 * errors[n]:.2f}",
            probability(found.p[n]),
        ]
        for n, f in zip(names, factors, strict=True)
    ]
    file = folder / "screening" / "effects.csv"
    head = ["symbol", "factor", "range", "effect (deg)", "p"]
    if file.exists():
        beside = pd.read_csv(file).set_index("factor")
        head += ["source paper (deg)", "sign"]
        for row in rows:
            row += [f"{beside.loc[row[0], 'paper_effect_deg']:+.2f}", beside.loc[row[0], "sign"]]
    return {
        "heading": "Powder: screening",
        "words": [f"Plackett-Burman with centre points: {words} Effects {selection(decision)}{curvature(decision)}."],
        "pictures": [
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
        "tables": [table(head, rows, range(3, len(head) - (len(head) > 5)))],
    }


def _climb(folder: Path, measured) -> dict:
    good, words = _good(folder, "climb")
    decision = read_decision(folder, "climb")
    centre = ", ".join(f"{name} {value:.4g}" for name, value in decision["centre"].items())
    meets = "meets the measured angle" if decision["reached"] else "comes nearest to the measured angle"
    return {
        "heading": "Powder: the climb",
        "words": [f"Along the direction of the screening's effects: {words} The path {meets} near {centre}."],
        "pictures": [
            picture(
                climb(good, decision["factors"], measured),
                "repose angle along the path",
                "Each point a heap, its error that over the silhouettes; dashed: the measured angle with its scatter.",
            )
        ],
        "tables": [],
    }


def _surface(folder: Path, measured) -> dict:
    good, words = _good(folder, "surface")
    decision = read_decision(folder, "surface")
    found = surface_of(good, decision, UNITS)
    factors = found.table.factors
    target = optimum.target_set(found, measured[0], measured[1] or 0.0) if measured else None
    lines = [
        f"Box-Behnken: {words} R² {found.r2:.4f}, predicted {known(found.r2_predicted, '.4f')}; lack of fit p {probability(found.lack_of_fit_p)}."
    ]
    if target is not None and target.reachable:
        lines.append(
            f"{100 * target.fraction:.1f} % of the box meets {measured[0]:g} deg within its scatter; recommended "
            f"({target.rule_in_words}): {_setting(folder, target)}."
        )
    elif target is not None:
        lines.append(
            f"{measured[0]:g} deg is not reachable in this box: it gives {target.lowest:.1f} to {target.highest:.1f} deg; "
            f"nearest: {_setting(folder, target)}."
        )
    rows = [
        [term, f"{value:+.4g}", number(found.model.standard_errors.get(term), 2)]
        for term, value in found.coefficients.items()
    ]
    return {
        "heading": "Powder: the surface and what meets the angle",
        "words": lines,
        "pictures": [
            *(
                picture(
                    figures.surface_contours(found, target, "deg", [pair]),
                    f"response surface of {factors[pair[0]].name} and {factors[pair[1]].name} with the measured angle",
                    "Black: where the surface meets the measured angle; hatched: within its scatter; star: the setting named "
                    "above. The factor that is not shown stays there.",
                )
                for pair in combinations(range(len(factors)), 2)
            ),
            picture(
                figures.predicted_observed(found, "deg"),
                "fitted against simulated angles",
                "Each point a heap of the design.",
            ),
        ],
        "tables": [table(("term, coded", "coefficient (deg)", "standard error (deg)"), rows, (1, 2))],
    }


def _setting(folder: Path, target) -> str:
    """The setting of a surface, with a word where it lies outside the range of the screening."""
    file = folder / "optimum" / "decision.json"
    outside = read_decision(folder, "optimum").get("outside", {}) if file.exists() else {}
    return levels({"point": target.physical, "factors": list(target.physical), "outside": outside})


def _validation(folder: Path, measured) -> dict:
    d = read_decision(folder, "validation")
    attempts = d.get("attempts", [d])
    good, words = _good(folder, "validation")
    if len(attempts) > 1:
        good = good[good["attempt"] == good["attempt"].max()]
        words = (
            f"{words} The first setting gave {attempts[0]['mean_deg']:.2f} ± {attempts[0]['standard_error_deg']:.2f} deg and was "
            f"corrected to {levels(d)}; the {attempts[-1]['heaps']} heaps with other seeds there count."
        )
    if d.get("nothing_nearer"):
        words += " The setting is not corrected, as along the gradient the box has nothing nearer."
    low, high = d["error_interval_percent"]
    return {
        "heading": "Powder: validation",
        "words": [
            f"At the setting found, with seeds nobody has used: {words} Mean {d['mean_deg']:.2f} ± "
            f"{d['standard_error_deg']:.2f} deg over the {len(good)} heaps there that gave an angle, measured {d['measured_deg']:g}: error {d['error_percent']:.2f} % "
            f"(95 % {low:+.2f} to {high:+.2f} %); {'equivalent' if d['equivalent'] else 'not shown equivalent'} within "
            f"{d['margin_deg']:g} deg, stated beforehand (two one-sided tests, p {probability(d['p_tost'])})."
        ],
        "pictures": [
            picture(
                heaps(
                    good[OBSERVABLE].to_numpy(), d["mean_deg"], d["interval_deg"], d["measured_deg"], d["margin_deg"]
                ),
                "angles of the validation heaps beside the measured one",
                "Points: one heap each. Blue band: mean with its 95 % interval. Grey: the margin that was stated beforehand.",
            )
        ],
        "tables": [],
    }
