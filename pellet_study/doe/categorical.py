"""Factors at three or more named levels: main effects by least squares, each factor's partial F test, adjusted means.

Reference
---------
Montgomery, Design and Analysis of Experiments, 8th ed., Wiley 2013, ch. 5 and 15: effects that sum to zero over the
levels, type III sums of squares where the runs are unbalanced.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.doe.anova import anova_row, near_zero, pure_error
from pellet_study.doe.blocks import Block, columns_of_blocks
from pellet_study.doe.columns import read_columns
from pellet_study.doe.design_table import code_design
from pellet_study.doe.factors import Factor
from pellet_study.errors import InputError
from pellet_study.tables.headers import found_in


@dataclass(frozen=True)
class LevelAnalysis:
    """Main effects of factors, some of them at three or more named levels; None where undefined.

    Attributes
    ----------
    effects : dict
        {factor: change from -1 to +1}, and {factor[level]: adjusted mean minus the mean of the levels}.
    means : dict
        {factor: {level: (adjusted mean, standard error)}} of the named levels, the other factors at their middle and the
        mean of their levels.
    anova : list of dict
        Blocks, model, each factor (levels - 1 degrees of freedom), residual, lack of fit, pure error, total.
    coefficients, standard_errors : dict
        Of the intercept `1` and the columns fitted, coded -1 to 1 or summing to zero over the levels.
    """

    factors: list[Factor]
    response: str
    runs: int
    alpha: float
    effects: dict[str, float]
    means: dict[str, dict[str, tuple[float, float | None]]]
    anova: list[dict]
    coefficients: dict[str, float]
    standard_errors: dict[str, float | None]
    r2: float
    r2_adjusted: float | None
    r2_predicted: float | None
    cv_percent: float | None
    lack_of_fit_p: float | None
    notes: list[str]


def contrasts(name: str, values, levels: tuple[str, ...]) -> dict[str, np.ndarray]:
    """{`name[level]`: column (n_runs,)}: 1 at that level, -1 at the last, for all levels but the last."""
    codes = np.round(np.asarray(values)).astype(int)
    last = len(levels) - 1
    return {f"{name}[{level}]": (codes == k) * 1.0 - (codes == last) for k, level in enumerate(levels[:-1])}


def read_levels(path: Path, factors, ignore=(), blocks=(), alpha: float = 0.05, response=None) -> LevelAnalysis:
    """Analyse a table with factors at three or more named levels.

    Parameters
    ----------
    path : Path
        See `design_table.read_design`.
    factors : list of Factor
        The categorical ones with their levels, others where their levels must be named.
    ignore, blocks, response
        See `design_table.read_design`.

    Raises
    ------
    InputError
        As `read_design`; also where a level was never run, or the runs do not separate the factors.
    """
    categories = {factor.name: factor.levels for factor in factors if factor.levels}
    found = read_columns(path, ignore, blocks, [factor.name for factor in factors], categories, response=response)
    many = {found_in(f.name, list(found.frame.columns)): f for f in factors if len(f.levels) > 2}
    others = [f for f in factors if len(f.levels) <= 2]
    rest = found.frame.drop(columns=list(many))
    if rest.shape[1] > 1:
        table = code_design(rest, others, found.lines, found.notes, 3, str(path))
        coded, named, notes = table.coded, table.factors, table.notes
    else:
        coded, named, notes = pd.DataFrame(index=rest.index), [], found.notes
    return analyse_levels(
        coded, named, {name: found.frame[name] for name in many}, {name: f.levels for name, f in many.items()},
        found.frame.iloc[:, -1], found.blocks, alpha, notes,
    )  # fmt: skip


def analyse_levels(
    coded: pd.DataFrame,
    factors: list[Factor],
    codes: dict[str, pd.Series],
    levels: dict[str, tuple[str, ...]],
    response: pd.Series,
    blocks: Sequence[Block] = (),
    alpha: float = 0.05,
    notes: Sequence[str] = (),
) -> LevelAnalysis:
    r"""Main-effects model :math:`y = \mu + \sum b_i x_i + \sum \tau_{j,l(j)}`, :math:`\sum_l \tau_{jl} = 0`.

    Parameters
    ----------
    coded : DataFrame (n_runs, n_numeric)
        Factors coded -1 to 1.
    codes : {factor: column (n_runs,)}
        Categorical ones as 0, 1, 2, ..., the places of their levels.
    levels : {factor: names of its levels}

    Raises
    ------
    InputError
        See `read_levels`.
    """
    for name, column in codes.items():
        absent = [level for k, level in enumerate(levels[name]) if not (np.round(column) == k).any()]
        if absent:
            raise InputError(
                f"level {absent[0]!r} of {name!r} was never run: expected runs at each level that is named"
            )
    groups = {name: {name: coded[name].to_numpy()} for name in coded}
    groups |= {name: contrasts(name, column, levels[name]) for name, column in codes.items()}
    between = columns_of_blocks(blocks)
    columns = {"1": np.ones(len(response)), **{k: v for group in groups.values() for k, v in group.items()}, **between}
    matrix, y = np.column_stack(list(columns.values())), response.to_numpy(dtype=float)
    runs, size = matrix.shape
    if np.linalg.matrix_rank(matrix) < size:
        raise InputError(
            f"the {runs} runs do not separate the {size} columns {', '.join(columns)}: expected levels that vary "
            "independently; leave a factor out with --ignore, or run the combinations that are missing"
        )
    inverse = np.linalg.inv(matrix.T @ matrix)
    estimates = inverse @ matrix.T @ y
    residuals = y - matrix @ estimates
    df, squares = runs - size, float(residuals @ residuals) if runs > size else 0.0
    variance = squares / df if df else None
    places = {name: i for i, name in enumerate(columns)}
    rows, lack = _anova(groups, between, matrix, y, places, squares, df, coded, codes, blocks)
    total = float(np.sum((y - y.mean()) ** 2))
    leverage = np.einsum("ij,jk,ik->i", matrix, inverse, matrix)
    press = float(np.sum((residuals / (1 - leverage)) ** 2)) if df and (leverage < 1 - 1e-9).all() else None
    means, effects = _means(groups, levels, places, estimates, inverse, variance)
    errors = np.sqrt(variance * np.diag(inverse)) if variance is not None else [None] * size
    return LevelAnalysis(
        factors=[*factors, *(Factor(name, levels=levels[name]) for name in codes)],
        response=str(response.name),
        runs=runs,
        alpha=alpha,
        effects=effects,
        means=means,
        anova=rows,
        coefficients={name: float(value) for name, value in zip(columns, estimates, strict=True)},
        standard_errors={n: None if e is None else float(e) for n, e in zip(columns, errors, strict=True)},
        r2=1 - squares / total,
        r2_adjusted=None if variance is None else 1 - variance / (total / (runs - 1)),
        r2_predicted=None if press is None else 1 - press / total,
        cv_percent=None if variance is None or near_zero(y.mean(), y) else 100 * float(np.sqrt(variance) / y.mean()),
        lack_of_fit_p=lack,
        notes=list(notes),
    )


def _means(groups, levels, places, estimates, inverse, variance):
    """Adjusted means with standard errors, and effects."""
    means: dict = {}
    effects: dict = {}
    for name, group in groups.items():
        if name not in levels:
            effects[name] = float(2 * estimates[places[name]])
            continue
        means[name] = {}
        for k, level in enumerate(levels[name]):
            row = np.zeros(len(estimates))
            for j, column in enumerate(group):
                row[places[column]] = 1.0 if j == k else -1.0 if k == len(group) else 0.0
            effects[f"{name}[{level}]"] = float(row @ estimates)
            row[0] = 1.0
            error = None if variance is None else float(np.sqrt(variance * row @ inverse @ row))
            means[name][level] = (float(row @ estimates), error)
    return means, effects


def _anova(groups, between, matrix, y, places, squares, df, coded, codes, blocks):
    """ANOVA rows, and p of the lack of fit."""
    variance = squares / df if df else None

    def without(names) -> float:
        kept = [i for name, i in places.items() if name not in names]
        left = y - matrix[:, kept] @ np.linalg.lstsq(matrix[:, kept], y, rcond=None)[0]
        return max(float(left @ left) - squares, 0.0)

    fitted = {column for group in groups.values() for column in group}
    rows = [anova_row("blocks", without(set(between)), len(between), variance, df)] if between else []
    rows.append(anova_row("model", without(fitted), len(fitted), variance, df))
    rows += [anova_row(name, without(set(group)), len(group), variance, df) for name, group in groups.items()]
    rows.append(anova_row("residual", squares, df))
    cells = np.column_stack([coded.to_numpy(), *codes.values(), *between.values()])
    pure_ss, pure_df = pure_error(cells, y)
    lack = None
    if 0 < pure_df:
        row = anova_row("lack of fit", max(squares - pure_ss, 0.0), df - pure_df, pure_ss / pure_df, pure_df)
        lack = row["p"]
        rows += [row, anova_row("pure error", pure_ss, pure_df)]
    total = float(np.sum((y - y.mean()) ** 2))
    rows.append({**anova_row("total", total, len(y) - 1), "mean_square": None})
    return rows, lack
