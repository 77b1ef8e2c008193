"""The fit of a described analysis, and every number that a paper may print of it."""

from dataclasses import replace
from itertools import permutations

import numpy as np

from pellet_study.doe import box_behnken, plackett_burman
from pellet_study.doe.anova import anova_row
from pellet_study.doe.blocks import columns_of_blocks
from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.design_table import DesignTable, read_design
from pellet_study.doe.linear_model import LinearFit
from pellet_study.doe.plackett_burman import Screening
from pellet_study.doe.terms import INTERCEPT, interaction_terms, linear_terms, quadratic_terms, resolve_terms
from pellet_study.paper.described.description import Analysis
from pellet_study.paper.verdicts import LEVEL

Fit = Screening | Surface
Key = tuple[str, ...]
GROUPS = ("linear", "interactions", "squares")
"""Terms of one kind together, each fitted after those before it and after the blocks."""


def read_table(analysis: Analysis) -> DesignTable:
    """The runs of an analysis."""
    return read_design(analysis.table, analysis.factors, 5, analysis.ignore, analysis.blocks)


def fitted(analysis: Analysis, table: DesignTable) -> Fit:
    """The analysis made again.

    Raises
    ------
    InputError
        If the runs do not support the model, or a term to drop is none of it.
    """
    if analysis.model == "first order" and analysis.centre_points == "curvature":
        return plackett_burman.analyse(table, LEVEL, interactions=False)
    terms = {
        "first order": linear_terms(table.names),
        "interactions": {**linear_terms(table.names), **interaction_terms(table.names)},
        "quadratic": quadratic_terms(table.names),
    }[analysis.model]
    if analysis.model == "quadratic":
        box_behnken.analyse(table, LEVEL)  # says which factor has no third level
    dropped = resolve_terms(",".join(analysis.drop), terms)
    return box_behnken.fit_surface(table, {k: v for k, v in terms.items() if k not in dropped}, LEVEL)


def contrasts(analysis: Analysis, fit: Fit) -> dict[str, np.ndarray]:
    """{name: weights of the fitted columns}: the terms, and the differences between blocks, `Block 2 - 1`."""
    model, table = fit.model, fit.table
    unit = dict(zip(model.columns, np.eye(len(model.columns)), strict=True))
    found = {term: unit[term] for term in model.terms}
    for block in table.blocks:
        levels = {}
        for level in block.levels:
            run = block.labels.index(level)
            levels[level] = sum(column[run] * unit[name] for name, column in columns_of_blocks([block]).items())
        for one, other in permutations(block.levels, 2):
            found[f"{block.name} {one} - {other}"] = levels[one] - levels[other]
        if analysis.intercept_in_block in levels:
            found[INTERCEPT] = found[INTERCEPT] + levels[analysis.intercept_in_block]
    return found


def rows_of(fit: Fit) -> dict[str, dict]:
    """{source: row} of the analysis of variance, with the groups of terms fitted one after the other."""
    rows = {row["source"]: row for row in fit.anova}
    model = fit.model
    kinds: dict[str, list] = {"linear": [], "interactions": [], "squares": []}
    for name, indices in model.terms.items():
        if len(indices) == 1:
            kinds["linear"].append(name)
        elif len(indices) == 2:
            kinds["squares" if indices[0] == indices[1] else "interactions"].append(name)
    columns = [0, *range(len(model.terms), len(model.columns))]
    before = _residual(model, columns)
    for group in GROUPS:
        if not kinds[group]:
            continue
        columns = [*columns, *(model.columns.index(name) for name in kinds[group])]
        after = _residual(model, columns)
        error = model.mean_square_error, model.df_residual
        rows[group] = anova_row(group, before - after, len(kinds[group]), *error)
        before = after
    return rows


def _residual(model: LinearFit, columns: list[int]) -> float:
    """Residual sum of squares of some of the fitted columns."""
    matrix = model.matrix[:, columns]
    left = model.response - matrix @ np.linalg.lstsq(matrix, model.response, rcond=None)[0]
    return float(left @ left)


def numbers(analysis: Analysis, fit: Fit) -> dict[Key, float | None]:
    """Every number that can be printed of the fit, by the keys of the description.

    Signs, units: coefficients per coded unit, effects from -1 to +1, response unit; `steepest` has length 1 in coded units.
    """
    model = fit.model
    found: dict[Key, float | None] = {}
    parameters, variance = np.asarray(model.results.params), model.mean_square_error
    from scipy.special import stdtr

    for name, weights in contrasts(analysis, fit).items():
        value = float(weights @ parameters)
        error = None if variance is None else float(np.sqrt(variance * weights @ model.inverse @ weights))
        t = value / error if error else None
        found["coefficients", name] = value
        found["standard_errors", name] = error
        found["t", name] = t
        found["p", name] = None if t is None else float(2 * stdtr(model.df_residual, -abs(t)))
    for name, value in fit.effects.items():
        found["effects", name] = value
    for name, value in getattr(fit, "contributions", {}).items():
        found["contributions_percent", name] = value
    for name, value in getattr(fit, "physical_coefficients", {}).items():
        found["physical_coefficients", name] = value
    for source, row in rows_of(fit).items():
        found |= {("anova", source, key): value for key, value in row.items() if key != "source"}
    higher = found["coefficients", INTERCEPT] - float(parameters[0])
    return found | _summary(fit) | _directions(fit, higher)


def _summary(fit: Fit) -> dict[Key, float | None]:
    """Numbers of the fit as a whole."""
    variance = fit.model.mean_square_error
    found: dict[Key, float | None] = {
        ("summary", "mean"): float(fit.model.response.mean()),
        ("summary", "root_mean_square_error"): None if variance is None else float(np.sqrt(variance)),
    }
    for key in ("r2", "r2_adjusted", "r2_predicted", "press", "cv_percent", "adequate_precision", "lack_of_fit_p"):
        found["summary", key] = getattr(fit, key, None)
    for key in ("pseudo_standard_error", "margin_of_error", "simultaneous_margin_of_error"):
        found["lenth", key] = getattr(fit.lenth, key, None)
    return found


def _directions(fit: Fit, higher: float) -> dict[Key, float | None]:
    """Stationary point, eigenvalues (largest first), and the direction of steepest ascent at the centre.

    `higher` is the level of the printed constant's block above the mean of the blocks.
    """
    factors, model = fit.table.factors, fit.model
    gradient = np.array([model.coefficients.get(factor.name, 0.0) for factor in factors])
    gradient = gradient / (np.linalg.norm(gradient) or 1.0)
    found: dict[Key, float | None] = {}
    for factor, x in zip(factors, gradient, strict=True):
        found["steepest", "coded", factor.name] = float(x)
        found["steepest", "physical", factor.name] = float(x * factor.half_range)
    point = getattr(fit, "stationary", None)
    if point is not None:
        for factor, x in zip(factors, point.coded, strict=True):
            found["stationary", "coded", factor.name] = float(x)
            found["stationary", "physical", factor.name] = float(factor.physical(x))
        found["stationary", "predicted", ""] = point.predicted + higher
        for k, value in enumerate(sorted(point.eigenvalues, reverse=True), start=1):
            found["stationary", "eigenvalues", f"{k}"] = float(value)
    return found


def spans(analysis: Analysis, table: DesignTable) -> dict[Key, tuple[float, float]]:
    """What each number can be while the printed responses and axial levels move within their last digit, to first order.

    Empty where the paper analysed both as printed.
    """
    moved = [*_moved_responses(analysis, table), *_moved_levels(analysis, table)]
    if not moved:
        return {}
    base = numbers(analysis, fitted(analysis, table))
    reach = dict.fromkeys((key for key, value in base.items() if value is not None), 0.0)
    for other in moved:
        there = numbers(analysis, fitted(analysis, other))
        for key in reach:
            if there.get(key) is not None:
                reach[key] += abs(there[key] - base[key])
    return {key: (base[key] - width, base[key] + width) for key, width in reach.items()}


def _moved_responses(analysis: Analysis, table: DesignTable) -> list[DesignTable]:
    """The table with one response after the other half a digit higher."""
    if not analysis.rounded_to:
        return []
    steps = np.eye(len(table.response)) * analysis.rounded_to / 2
    return [replace(table, response=table.response + step) for step in steps]


def _moved_levels(analysis: Analysis, table: DesignTable) -> list[DesignTable]:
    """The table with one level after the other that is neither -1, 0 nor 1 half a digit higher, wherever it was run."""
    if not analysis.levels_rounded_to:
        return []
    found = []
    for factor in table.factors:
        column = table.coded[factor.name]
        for level in np.unique(column):
            if min(abs(level - nominal) for nominal in (-1, 0, 1)) > 1e-6:
                step = analysis.levels_rounded_to / 2 / factor.half_range
                found.append(
                    replace(table, coded=table.coded.assign(**{factor.name: column + (column == level) * step}))
                )
    return found
