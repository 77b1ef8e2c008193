"""What a folder says of a paper: its analyses with their printed numbers, target, optimum, validation, climb and claims.

docs/audit_a_paper.md documents the format.
"""

from dataclasses import dataclass, field
from pathlib import Path

from pellet_study.doe.factors import Factor

FILE = "paper.toml"
MODELS = ("first order", "interactions", "quadratic")
CENTRE_POINTS = ("curvature", "residual")
DESIGNS = ("Plackett-Burman", "factorial", "Box-Behnken", "central composite")
ANOVA_COLUMNS = ("sum_of_squares", "df", "mean_square", "f", "p")
SUMMARY = (
    "mean", "root_mean_square_error", "r2", "r2_adjusted", "r2_predicted", "press", "cv_percent", "adequate_precision",
    "lack_of_fit_p",
)  # fmt: skip
LENTH = ("pseudo_standard_error", "margin_of_error", "simultaneous_margin_of_error")
BY_TERM = ("coefficients", "standard_errors", "t", "p", "effects", "contributions_percent", "physical_coefficients")
"""Printed numbers of which there is one a term."""
STATIONARY = ("maximum", "minimum", "saddle")
CLAIMS = ("significant", "not significant", "positive", "negative", "order", "stationary point", "lack of fit")
WANTED = ("target", "maximum", "minimum")


@dataclass(frozen=True)
class Printed:
    """Numbers as printed, each a text.

    Attributes
    ----------
    by_term : dict
        {one of `BY_TERM`: {term: number}}.
    anova : dict
        {source: {one of `ANOVA_COLUMNS`: number}}.
    summary, lenth : dict
        {one of `SUMMARY`, `LENTH`: number}.
    stationary : dict
        {"coded", "physical": {factor: number}}, {"predicted": {"": number}}, {"eigenvalues": {"1": number, ...}}.
    kind : str or None
        Of the stationary point.
    steepest : dict
        {"coded", "physical": {factor: number}}: the direction of steepest ascent, of length 1 in coded units.
    """

    by_term: dict[str, dict[str, str]]
    anova: dict[str, dict[str, str]]
    summary: dict[str, str]
    lenth: dict[str, str]
    stationary: dict[str, dict[str, str]]
    kind: str | None
    steepest: dict[str, dict[str, str]]


@dataclass(frozen=True)
class Analysis:
    """A table that was run, the model fitted to it, and what is printed of the fit.

    Attributes
    ----------
    name : str
        As the paper calls it; the section of its items.
    centre_points : str
        Of a first-order model: `curvature` gives them a column of their own, `residual` leaves them in the error.
    rounded_to : float or None
        The last digit of the printed responses where the paper analysed unrounded ones.
    levels_rounded_to : float or None
        The same of the axial levels: 92.07 may stand for 85 + 5 sqrt(2).
    intercept_in_block : str or None
        The block whose level the printed constant is; else that of the mean of the blocks.
    """

    name: str
    table: Path
    model: str
    centre_points: str
    design: str | None
    factors: list[Factor]
    ignore: list[str]
    blocks: list[str]
    intercept_in_block: str | None
    drop: list[str]
    rounded_to: float | None
    levels_rounded_to: float | None
    printed: Printed


@dataclass(frozen=True)
class Goal:
    """What the response is to be."""

    analysis: str
    want: str
    value: str | None
    sd: str | None
    n: int | None
    unit: str


@dataclass(frozen=True)
class Optimum:
    """The printed setting, the response printed for it, and whether it is called unique."""

    point: dict[str, str]
    predicted: str | None
    unique: bool


@dataclass(frozen=True)
class Validation:
    """The printed check of the optimum."""

    mean: str
    sd: str | None
    n: int | None
    relative_error_percent: str | None
    less_than_percent: str | None
    p: str | None


@dataclass(frozen=True)
class Climb:
    """A printed path: factors, then the response or its error from the target; `best` is the row it went on from."""

    name: str
    table: Path
    analysis: str
    holds: str
    best: int | None


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper that a recomputed number decides."""

    says: str
    analysis: str
    kind: str
    of: list[str]
    level: float


@dataclass(frozen=True)
class Description:
    """A paper."""

    folder: Path
    title: str
    source: str
    note: str
    analyses: list[Analysis]
    goal: Goal | None = None
    optimum: Optimum | None = None
    validation: Validation | None = None
    climbs: list[Climb] = field(default_factory=list)
    claims: list[Claim] = field(default_factory=list)
