"""Numbers that contradict the model, said in words with what to do: curvature, lack of fit, a fit worse than the mean."""

import shlex
from collections.abc import Sequence
from itertools import combinations
from math import floor

import numpy as np

from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.confounding import hidden
from pellet_study.doe.design_table import DesignTable
from pellet_study.doe.factors import Factor
from pellet_study.doe.fitted_response import FittedResponse
from pellet_study.doe.fold_over import resolution
from pellet_study.doe.plackett_burman import Screening
from pellet_study.doe.published_designs import misplaced_level, recognise
from pellet_study.doe.screening_designs import default_runs
from pellet_study.doe.standard_order import Departures, departures
from pellet_study.doe.steepest_climb import Climb, significant_terms
from pellet_study.doe.terms import interaction_terms
from pellet_study.doe.transformation import advised

SMALL_CURVATURE = 0.25
"""Share of what the slopes give from the centre to the best corner, below which a curvature does not turn a climb."""


def p_in_words(p: float) -> str:
    """p to four decimals, or below what they show."""
    return "p < 0.0001" if p < 1e-4 else f"p {p:.4f}"


def aliasing_cautions(names: Sequence[str], coded) -> list[str]:
    """A main effect that is wholly mixed with an interaction of two others, in a two-level design to be run."""
    coded = np.asarray(coded, dtype=float)
    runs = coded[np.abs(coded).max(axis=1) > 0.5]
    for i, j in combinations(range(len(names)), 2):
        shares = np.abs(runs.T @ (runs[:, i] * runs[:, j])) / len(runs)
        if shares.max() > 1 - 1e-6:
            return [
                f"in these {len(runs)} runs main effects are wholly mixed with interactions of two others, as "
                f"{names[int(shares.argmax())]} with {names[i]}*{names[j]}: take --runs {default_runs(len(names))}, which mix them "
                "in shares, or fold the design over afterwards (design fold)"
            ]
    return []


def axial_cautions(factors: Sequence[Factor], distance: float) -> list[str]:
    """Axial points below zero of factors that are above it at both levels, as a time or a dose must be.

    `distance` of the points from the centre, in coded units; the most that stays at zero or above is named.
    """
    found, most = [], distance
    for factor in factors:
        least = min(float(factor.physical(x)) for x in (-distance, distance))
        if not factor.levels and least < 0 <= min(factor.low, factor.high):
            found.append(f"{factor.name} {least:.6g}")
            most = min(most, abs(factor.centre / factor.half_range))
    if not found:
        return []
    inside = f", --axial {floor(100 * most) / 100:g} at zero or above" if most > 1 else ""
    return [
        f"an axial point lies below zero where all other runs do not: {', '.join(found)}; if there is no such level, --axial face "
        f"keeps it within the levels given{inside}"
    ]


def level_cautions(table: DesignTable) -> list[str]:
    """The cells whose levels are not those of the design: of the one that the runs are numbered by, else of a known one.

    Without numbers it is the one cell that keeps the runs from being a known design; of runs that are alike, each of them.
    """
    numbered = departures(table)
    if numbered is not None:
        return _numbered_cautions(table, numbered)
    factors = [factor for factor in table.factors if not factor.levels] or table.factors
    coded = table.coded[[factor.name for factor in factors]].to_numpy()
    cells = misplaced_level(coded)
    if not cells:
        return []
    run, column, level = cells[0]
    factor, right = factors[column], coded.copy()
    right[run, column] = level
    rows = " or ".join(f"row {table.lines[run]}" for run, _, _ in cells)
    there = ", ".join(dict.fromkeys(factor.word(coded[run, column]) for run, _, _ in cells))
    expected = ", ".join(dict.fromkeys(factor.word(level) for *_, level in cells))
    return [
        f"column {factor.name!r}, {rows}: {there} where {expected} is expected: with that one cell so the table would be exactly "
        f"a known design ({recognise(right)}); compare with your notes whether the level was typed wrong or the run made so"
    ]


def _numbered_cautions(table: DesignTable, found: Departures) -> list[str]:
    """What differs from the design whose runs the column `standard_order` numbers."""
    said = []
    if found.columns:
        names = table.names
        words = ", ".join(f"{names[planned]!r} under {names[factor]!r}" for factor, planned in found.columns)
        said.append(
            f"by their standard_order the columns stand under each other's headers ({words}): if you moved them together with "
            "their headers nothing is amiss, else put each header above its own levels again"
        )
    words = "; ".join(
        f"column {table.names[factor]!r}, row {table.lines[run]}: {table.factors[factor].word(table.coded.iloc[run, factor])} where "
        f"{table.factors[factor].word(level)} is expected"
        for run, factor, level in found.cells
    )
    if words:
        said.append(
            f"{words}: by their standard_order the runs have other levels in the design; compare with your notes whether a level "
            "was typed wrong or the run made so"
        )
    return said


def suspect_cautions(analysis: Screening | Surface) -> list[str]:
    """The runs that the others do not explain, to be checked before any advice that costs runs."""
    found = analysis.model.suspects(analysis.alpha)
    if not found:
        return []
    words = "; ".join(f"row {analysis.table.lines[place]}: R-student {value:.3g}" for place, value in found)
    them = "it" if len(found) == 1 else "them"
    sizes = [f"{abs(value):.3g}" for _, value in found]
    alike = (
        ""
        if len(set(sizes)) == len(sizes)
        else "; runs with R-student alike in size the model cannot tell apart, one alone may be wrong"
    )
    return [
        f"{words}; check {them} before anything else: beyond what one of {len(analysis.model.response)} runs reaches by chance "
        f"(Bonferroni, level {analysis.alpha:g}){alike}; compare with your notes for a slip of the pen or a run that went wrong, and "
        f"correct {them}, repeat {them}, or leave the response empty{_scale_first(analysis)}"
    ]


def _scale_first(analysis: Screening | Surface) -> str:
    """That a transformation is indicated, on whose scale the same runs may be no suspects."""
    word = advised(analysis.box_cox) if isinstance(analysis, Surface) else None
    if not word:
        return ""
    return (
        f"; or it is the scale, as Box-Cox advises another: see first whether they stay suspect with --transform {word}"
    )


def suspects_first(analysis: Screening | Surface, cautions: list[str]) -> list[str]:
    """Cautions, each of them naming the suspect runs, which may be all their cause, before it advises anything else."""
    rows = [str(analysis.table.lines[place]) for place, _ in analysis.model.suspects(analysis.alpha)]
    if not rows:
        return cautions
    head = f"check row{'s' if len(rows) > 1 else ''} {', '.join(rows)} first: "
    return [head + caution for caution in cautions]


def rules_out_a_climb(screening: Screening) -> bool:
    """Whether the curvature is significant, and no small share of what the slopes give from the centre to the best corner."""
    curvature = screening.curvature
    if not curvature or curvature.p is None or curvature.p >= screening.alpha:
        return False
    return abs(curvature.estimate) > SMALL_CURVATURE * _reach(screening)


def _reach(screening: Screening) -> float:
    """What the main effects give from the centre to the best corner."""
    return sum(abs(screening.effects[name]) for name in screening.table.names if name in screening.effects) / 2


def screening_cautions(screening: Screening) -> list[str]:
    """What speaks against the straight line of a screening."""
    found = []
    curvature = screening.curvature
    if curvature and curvature.p is not None and curvature.p < screening.alpha and not rules_out_a_climb(screening):
        found.append(
            f"the curvature is significant (F {curvature.f:.4g}, {p_in_words(curvature.p)}) and small: {curvature.estimate:+.5g} at the "
            f"centre, where the slopes give {_reach(screening):.5g} from there to the best corner; a climb goes the right way, but "
            "what it predicts does not hold: make its runs in their order and stop where they turn"
        )
    elif curvature and curvature.p is not None and curvature.p < screening.alpha:
        found.append(
            f"the curvature is significant (F {curvature.f:.4g}, {p_in_words(curvature.p)}): the centre runs read "
            f"{curvature.estimate:+.5g} away from the straight line, so it predicts nothing between the corners; do not "
            "climb by it, but add axial points to these runs (design axial), or run a three-level design here (bbd "
            "--design), with the factors that act"
        )
    elif curvature and curvature.p is None:
        found.append(
            f"the centre runs read {curvature.estimate:+.5g} away from the straight line, which cannot be tested without "
            "a residual: replicate the centre point before you climb"
        )
    if screening.lack_of_fit_p is not None and screening.lack_of_fit_p < screening.alpha:
        found.append(f"the lack of fit is significant ({p_in_words(screening.lack_of_fit_p)}): {_lacking(screening)}")
    missing = [name for name in interaction_terms(screening.table.names) if name not in screening.model.terms]
    found += _worse_than_mean(
        screening, "the factors that act may not be among these" + (", or they interact" if missing else "")
    )
    return level_cautions(screening.table) + suspect_cautions(screening) + suspects_first(screening, found)


def _lacking(screening: Screening) -> str:
    """What the model of a screening lacks, and what to do: never what the table is already."""
    names, coded = screening.table.names, screening.table.coded.to_numpy()
    pairs = interaction_terms(names)
    missing = [name for name in pairs if name not in screening.model.terms]
    blocked = [name for name in hidden(screening.block_confounded) if name in missing]
    if not missing:
        return (
            "main effects and two-factor interactions do not describe these runs to within what replicates differ; look for a "
            "run that went wrong, analyse the logarithm of the response (--transform log), and check that the replicates are "
            "runs of their own"
        )
    if blocked == missing:
        return (
            f"these runs cannot show {', '.join(blocked)}, which the blocks hide; repeat the design with its runs parted into "
            "blocks in another way (pb --design ... --blocks), or in one block"
        )
    what = (
        "main effects alone do not describe these runs"
        if not screening.interactions
        else "the terms fitted do not describe these runs"
    )
    corners = np.sign(coded[np.abs(coded).max(axis=1) > 0.5])
    if len(np.unique(corners, axis=0)) == 2 ** len(names):
        return f"{what}, some factors interact; leave out --main-effects, so that the interactions are fitted"
    if resolution(corners) == 3 or any(screening.aliases[name] for name in names):
        return f"{what}, some factors interact; fold the design over (design fold), or run a full factorial of the factors that act"
    return (
        f"{what}, some factors interact, and their interactions share contrasts; set those of one factor apart (design fold --on "
        f"{shlex.quote(names[0])}, or another), or run a full factorial of the factors that act"
    )


def surface_cautions(surface: Surface) -> list[str]:
    """What speaks against a fitted surface."""
    found = []
    helps = surface.box_cox is not None and surface.box_cox.transformation_needed
    transform = ", transform the response (--transform)" if helps else ""
    if _lacks(surface):
        found.append(
            f"the lack of fit is significant ({p_in_words(surface.lack_of_fit_p)}): the surface misses the runs by more "
            f"than replicates differ, so its intervals are too narrow; look for a run that went wrong (Cook's D){transform}, "
            "or make the region smaller; check that the replicates are runs of their own"
        )
    found += _worse_than_mean(surface, "leave terms out (--reduce), or run more")
    found += _far_stationary(surface)
    return level_cautions(surface.table) + suspect_cautions(surface) + suspects_first(surface, found)


def reduction_cautions(full: Surface, reduced: Surface, option: str) -> list[str]:
    """What speaks against a model whose terms an option (`--select`, `--reduce` or `--drop`) left out."""
    found = []
    if len(reduced.model.terms) == 1 and option == "--select":
        found.append(
            f"--select left no term: with {len(reduced.model.response)} runs AICc holds none worth its price, and the "
            "selected model is the mean of all runs, which no setting changes; predict with the full model (without "
            "--select), or run more"
        )
    if not _lacks(reduced):
        return found
    head = f"the lack of fit of the reduced model is significant ({p_in_words(reduced.lack_of_fit_p)})"
    if _lacks(full):
        return [
            *found,
            f"{head}, as that of the full model is: leaving terms out mends no surface that misses its runs",
        ]
    less = {
        "--select": " or --reduce, which leaves out by p values",
        "--reduce": ", or leave out less (--reduce with a larger P)",
    }
    return [
        *found,
        f"{head}, and that of the full model is not (p {full.lack_of_fit_p:.4f}): {option} left out what acts; use the full "
        f"model (without {option}){less.get(option, '')}",
    ]


def _lacks(surface: Surface) -> bool:
    """Whether the lack of fit is significant."""
    return surface.lack_of_fit_p is not None and surface.lack_of_fit_p < surface.alpha


LEAST_SHARE = 5e-4
"""The least share of the box, 0.05 %, of which it is said that predictions are beyond the scale there."""


def scale_cautions(response: FittedResponse, coded) -> list[str]:
    """What is to be said where a prediction, or an end of its intervals, is none that the response's scale has."""
    scale = response.transformation
    if scale is None or scale.power == 0:
        return []
    fitted, end = response.surface.table.response.name, "infinite" if scale.power < 0 else "0"
    if response.beyond_scale(coded)[0]:
        value = float(response.surface.model.predict(coded)[0])
        return [
            f"{fitted} is predicted as {value:.4g} there, which is that of no {response.name}, and stands as {end}: it is no "
            f"prediction; stay nearer to the runs, or use {_logarithm(response)}, whose predictions are all positive"
        ]
    found = response.interval(coded)
    ends = {value for pair in (found.confidence, found.prediction) for value in pair or ()}
    if not ends & {0.0, np.inf}:
        return []
    side = "upper end is none, it stands as inf" if scale.power < 0 else "lower end is cut off at 0"
    return [
        f"an interval of {response.name} there runs beyond what {fitted} can be: its {side}; {_logarithm(response)} has no such end"
    ]


def box_scale_cautions(response: FittedResponse, points) -> list[str]:
    """The share of the box, by points spread over it, in which a response has no prediction on its scale."""
    share = float(response.beyond_scale(points).mean())
    if share < LEAST_SHARE:
        return []
    return [
        f"in {100 * share:.1f} % of the box {response.surface.table.response.name} is predicted where no {response.name} has it, and "
        f"its prediction stands as {'infinite' if response.transformation.power < 0 else '0'}: do not rest a goal on it there; "
        f"use {_logarithm(response)}, whose predictions are all positive, or a smaller box"
    ]


def _logarithm(response: FittedResponse) -> str:
    return shlex.join(["--transform", f"{response.name}=log"])


def _worse_than_mean(analysis: Screening | Surface, advice: str) -> list[str]:
    if analysis.r2_predicted is None or analysis.r2_predicted >= 0:
        return []
    return [
        f"the predicted R2 is negative ({analysis.r2_predicted:.3f}): a run left out is predicted worse by this model than "
        f"by the mean of the other runs, so do not predict with it; {advice}"
    ]


def _far_stationary(surface: Surface) -> list[str]:
    """Where the stationary point lies farther out than any run."""
    if surface.stationary is None:
        return []
    reach = np.abs(surface.table.coded.to_numpy()).max(axis=0)
    places = zip(surface.table.factors, surface.stationary.coded, reach, strict=True)
    beyond = [(f, float(x)) for f, x, most in places if abs(x) > most + 1e-9]
    if not beyond:
        return []
    words = ", ".join(f"{f.name} {float(f.physical(x)):.4g}, coded {x:.3g}" for f, x in beyond)
    return [
        f"the stationary point ({surface.stationary.kind}) lies outside the runs ({words}): no run supports it, and it is "
        "no optimum to use; look along the edge of the region, or run the next design in that direction"
    ]


def climb_cautions(climb: Climb, screening: Screening) -> list[str]:
    """Where the path starts from a prediction that the centre runs contradict."""
    found = []
    strong = [name for name in significant_terms(screening) if name in screening.interactions]
    moved = {factor.name for factor in climb.factors}
    terms, names = screening.model.terms, screening.table.names
    strong = [name for name in strong if {names[i] for i in terms[name]} & moved]
    if strong:
        found.append(
            f"the path is that of the main effects alone, and {', '.join(strong)} {'is' if len(strong) == 1 else 'are'} significant: "
            "the slopes change along it; make its first runs before you trust its direction, or go on with a three-level design"
        )
    curvature = screening.curvature
    if curvature is None or curvature.p is None or curvature.p >= screening.alpha:
        return found
    centre = (np.round(screening.table.coded.to_numpy()) == 0).all(axis=1)
    mean = float(screening.table.response[centre].mean())
    straight = mean - curvature.estimate
    return [
        *found,
        f"the path is that of the straight line, which predicts {straight:.5g} at the centre where the runs read "
        f"{mean:.5g}: its predictions are not to be trusted",
    ]
