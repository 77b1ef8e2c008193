"""Two-level designs: the analysis of a screening, or of a factorial with its interactions, that was run.

References
----------
Lenth, Quick and easy analysis of unreplicated factorials, Technometrics 31
(1989) 469, doi:10.1080/00401706.1989.10488595. Holm, A simple sequentially rejective multiple test procedure,
Scand. J. Statist. 6 (1979) 65.
"""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe.anova import anova_row, block_rows, near_zero, pure_error, type_three
from pellet_study.doe.blocks import block_labels, columns_of_blocks
from pellet_study.doe.confounding import confounded_with
from pellet_study.doe.design_table import DesignTable
from pellet_study.doe.interactions import aliases, clear_interactions
from pellet_study.doe.lenth import Lenth, _unused_contrasts, left_over_contrasts, lenth
from pellet_study.doe.linear_model import CURVATURE, LinearFit, fit, press, variance_inflation
from pellet_study.doe.terms import linear_terms
from pellet_study.errors import InputError


@dataclass(frozen=True)
class Curvature:
    """Mean of the centre points minus that of the other runs, with its F test (None: no error)."""

    estimate: float
    sum_of_squares: float
    f: float | None
    p: float | None


@dataclass(frozen=True)
class Screening:
    """What a two-level table says.

    Attributes
    ----------
    table : DesignTable
    model : LinearFit
        Main effects and the two-factor interactions that the runs tell apart (see `interactions.clear_interactions`), the
        centre points absorbed by a curvature column.
    effects : dict
        {term: change of the response from -1 to +1}, response unit.
    sums_of_squares, contributions : dict
        Partial sums of squares, and these in percent of the total of all runs.
    p, p_adjusted : dict
        Raw and Holm-adjusted for the number of terms; None where the design is saturated.
    detectable_effects : dict
        {term: effect found with probability `power` at level `alpha`}, response unit; None where saturated.
    aliases : dict
        {term: {interaction not fitted: share of it that the effect carries}}, see `interactions.aliases`.
    contrasts : dict
        {word: contrast} of what no term has, in a complete regular design: `AC+BD`, `ABC`; response unit.
    noise_contrasts : list of float
        All contrasts of the design's unused columns, response unit; empty where they are not known.
    block_confounded : dict
        {effect: share of it that lies between the blocks}, 1 where it cannot be told from them.
    pure_error_df : int
    orthogonal : bool
    standard_error_inflation : dict
        {term: standard error relative to an orthogonal design with as many runs at -1 and +1}.
    """

    table: DesignTable
    model: LinearFit
    alpha: float
    power: float
    effects: dict[str, float]
    sums_of_squares: dict[str, float]
    contributions: dict[str, float]
    p: dict[str, float | None]
    p_adjusted: dict[str, float | None]
    anova: list[dict]
    lenth: Lenth | None
    contrasts: dict[str, float]
    noise_contrasts: list[float]
    block_confounded: dict[str, float]
    pure_error_df: int
    curvature: Curvature | None
    detectable_effects: dict[str, float | None]
    aliases: dict[str, dict[str, float]]
    orthogonal: bool
    standard_error_inflation: dict[str, float]
    r2: float | None
    r2_adjusted: float | None
    r2_predicted: float | None
    cv_percent: float | None
    lack_of_fit_p: float | None

    @property
    def saturated(self) -> bool:
        return self.model.df_residual == 0

    @property
    def interactions(self) -> list[str]:
        """The two-factor interactions that are fitted."""
        return [name for name, indices in self.model.terms.items() if len(indices) == 2]


def analyse(table: DesignTable, alpha: float = 0.05, power: float = 0.8, interactions: bool = True) -> Screening:
    """Analyse the two-level table that was run, whatever its row order, with runs missing or replicated.

    The model is y = b0 + sum b_i x_i + sum b_ij x_i x_j over the interactions that the runs tell apart, and a column of its
    own for the centre points (the curvature), so that they test it without moving its error; an effect is 2 b.

    Parameters
    ----------
    table : DesignTable
        Levels -1 and +1, centre points at 0 in every factor.
    alpha : float
        Level of the margins and of the detectable effects.
    power : float
        Probability with which a detectable effect is found; 0.8 is 4 times in 5.
    interactions : bool
        Whether interactions are fitted where they can be; else main effects alone.

    Raises
    ------
    InputError
        If a run is neither at the corners nor at the centre, there are fewer runs than terms, or terms are
        not separated by the runs.
    """
    centre = _centre_points(table)
    coded, between = table.coded.to_numpy(), columns_of_blocks(table.blocks)
    extra = {CURVATURE: centre.astype(float)} if centre.any() else {}
    terms = linear_terms(table.names)
    if interactions:
        terms |= clear_interactions(table.names, coded, centre, list(between.values()))
    model = fit(table.names, terms, table.coded, table.response, extra, table.blocks, table.rounding_variance)
    named = list(terms)[1:]
    sums = type_three(model)
    rows, lack_of_fit_p = _anova(table, model, sums)
    p = {row["source"]: row["p"] for row in rows if row["source"] in named}
    total = float(np.sum((model.response - model.response.mean()) ** 2))
    effects = {name: 2 * model.coefficients[name] for name in named}
    inflation = _inflation(model, centre)
    left_over = left_over_contrasts(table, centre, terms)
    noise = list(left_over.values()) or ([] if table.blocks else _unused_contrasts(table, centre, terms))
    return Screening(
        table=table,
        model=model,
        alpha=alpha,
        power=power,
        effects=effects,
        sums_of_squares={name: sums[name] for name in named},
        contributions={name: 100 * sums[name] / total for name in named},
        p=p,
        p_adjusted=_holm(p),
        anova=rows,
        lenth=lenth(list(effects.values()) + noise, alpha, bool(noise) or model.df_residual == 0),
        contrasts=left_over,
        noise_contrasts=noise,
        block_confounded=confounded_with(table.names, coded[~centre], block_labels(table.blocks, ~centre)),
        pure_error_df=pure_error(table.coded, table.response, table.blocks)[1],
        curvature=_curvature(model, rows),
        detectable_effects=_detectable(model, alpha, power),
        aliases=aliases(table.names, coded[~centre], terms),
        orthogonal=max(inflation.values()) < 1 + 1e-9,
        standard_error_inflation=inflation,
        lack_of_fit_p=lack_of_fit_p,
        **_summary(model, sums.get(CURVATURE, 0.0), total),
    )


def _centre_points(table: DesignTable) -> np.ndarray:
    """Which runs are centre points."""
    numeric = [factor.name for factor in table.factors if not factor.levels]
    if not numeric:
        return np.zeros(len(table.response), dtype=bool)
    nearest = np.round(table.coded[numeric].to_numpy())
    centre = (nearest == 0).all(axis=1)
    mixed = (nearest == 0).any(axis=1) & ~centre
    if mixed.any():
        row = int(np.argmax(mixed))
        name = numeric[int(np.argmax(nearest[row] == 0))]
        raise InputError(
            f"column {name!r}, row {table.lines[row]}: the middle level, while other factors of that run are "
            "low or high; a two-level design has its centre points at the middle of every factor. Analyse a "
            "three-level table (Box-Behnken, central composite) with bbd"
        )
    if centre.all():
        raise InputError("every run is a centre point: not a design; expected runs at the low and high levels")
    return centre


def _anova(table: DesignTable, model: LinearFit, sums: dict) -> tuple[list[dict], float | None]:
    """The ANOVA table and the p value of the lack of fit."""
    error = (model.mean_square_error, model.df_residual)
    corrected = float(np.sum((model.response - model.response.mean()) ** 2))
    rows, between = block_rows(table.blocks, model)
    model_ss = corrected - between - sums.get(CURVATURE, 0.0) - model.ss_residual
    named = list(model.terms)[1:]
    rows += [anova_row("model", model_ss, len(named), *error)]
    rows += [anova_row(name, sums[name], 1, *error) for name in named]
    if CURVATURE in sums:
        rows.append(anova_row(CURVATURE, sums[CURVATURE], 1, *error))
    rows.append(anova_row("residual", model.ss_residual, model.df_residual))
    pure_ss, pure_df = pure_error(table.coded, table.response, table.blocks)
    lack_of_fit_p = None
    if pure_df:
        lack_df = model.df_residual - pure_df
        lack_ss = max(model.ss_residual - pure_ss, 0.0) if lack_df else 0.0
        lack = anova_row("lack of fit", lack_ss, lack_df, pure_ss / pure_df, pure_df)
        lack_of_fit_p = lack["p"]
        rows += [lack, anova_row("pure error", pure_ss, pure_df)]
    rows.append({**anova_row("total", corrected, len(model.response) - 1), "mean_square": None})
    return rows, lack_of_fit_p


def _summary(model: LinearFit, curvature_ss: float, total: float) -> dict[str, float | None]:
    """R2 and its kin of the straight-line part: the curvature is taken out of the total first."""
    total -= curvature_ss
    df_total = len(model.response) - 1 - (CURVATURE in model.extra)
    variance, squares = model.mean_square_error, press(model)
    mean = float(model.response.mean())
    return {
        "r2": 1 - model.ss_residual / total,
        "r2_adjusted": None if variance is None else 1 - variance / (total / df_total),
        "r2_predicted": None if squares is None or variance is None else 1 - squares / total,
        "cv_percent": None
        if variance is None or near_zero(mean, model.response)
        else 100 * float(np.sqrt(variance)) / mean,
    }


def _holm(p: dict[str, float | None]) -> dict[str, float | None]:
    if any(value is None for value in p.values()):
        return dict.fromkeys(p)
    from statsmodels.stats.multitest import multipletests

    return dict(zip(p, map(float, multipletests(list(p.values()), method="holm")[1]), strict=True))


def _curvature(model: LinearFit, rows: list[dict]) -> Curvature | None:
    row = next((row for row in rows if row["source"] == CURVATURE), None)
    if row is None:
        return None
    place = model.columns.index(CURVATURE)
    return Curvature(float(model.results.params[place]), row["sum_of_squares"], row["f"], row["p"])


def _detectable(model: LinearFit, alpha: float, power: float) -> dict[str, float | None]:
    """Smallest effects found with the given power, by the noncentral F on 1 and residual df."""
    names = list(model.terms)[1:]
    if model.mean_square_error is None:
        return dict.fromkeys(names)
    from scipy.optimize import brentq
    from scipy.special import fdtri, ncfdtr

    df = model.df_residual
    critical = fdtri(1, df, 1 - alpha)

    def excess(noncentrality: float) -> float:
        return 1 - ncfdtr(1, df, noncentrality, critical) - power

    high = 1.0
    while excess(high) < 0:  # stepwise: far beyond the answer the noncentral F is not a number
        high *= 2
    noncentrality = brentq(excess, 1e-9, high)
    return {name: float(2 * np.sqrt(noncentrality) * model.standard_errors[name]) for name in names}


def _inflation(model: LinearFit, centre: np.ndarray) -> dict[str, float]:
    """Standard errors relative to an orthogonal design with the same runs at -1 and +1."""
    runs = int(np.sum(~centre))
    diagonal = np.sqrt(np.diag(model.inverse) * runs)
    return dict(zip(list(model.terms)[1:], map(float, diagonal[1 : len(model.terms)]), strict=True))


def vif(screening: Screening) -> dict[str, float]:
    """{term: variance inflation factor}."""
    inflation = variance_inflation(screening.model)
    return {name: inflation[name] for name in screening.effects}
