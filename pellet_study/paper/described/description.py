"""What a folder says of a paper: its analyses with their printed numbers, target, optimum, validation, climb and claims.

docs/audit_a_paper.md documents the format.
"""

from dataclasses import dataclass, field
from pathlib import Path

from pellet_study.doe.factors import Factor
from pellet_study.errors import InputError
from pellet_study.paper.described.entries import Entry, read

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


def read_description(folder: Path) -> Description:
    """The description in a folder.

    Raises
    ------
    InputError
        Naming file, key and what is expected there.
    """
    entry = read(folder / FILE)
    title = entry.text("title", "the paper's title")
    source = entry.text("source", "author, year, DOI or URL, and where each number was read")
    note = entry.text("note", default="")
    analyses = [_analysis(below, folder) for below in entry.tables("analysis")]
    if not analyses:
        entry.fail("analysis", "one table [[analysis]] or more")
    names = [analysis.name for analysis in analyses]
    if len(set(names)) < len(names):
        raise InputError(f"{entry.file}: two [[analysis]] have the same name; expected a name of its own for each")
    found = Description(
        folder,
        title,
        source,
        note,
        analyses,
        _goal(entry, names),
        _optimum(entry),
        _validation(entry),
        [_climb(below, folder, names) for below in entry.tables("climb")],
        [_claim(below, names) for below in entry.tables("claim")],
    )
    entry.close()
    for key, value in (("optimum", found.optimum), ("validation", found.validation)):
        if value is not None and found.goal is None:
            raise InputError(f"{entry.file}, [{key}]: expected a table [target] beside it that says what is wanted")
    if found.validation and found.goal.value is None:
        raise InputError(
            f"{entry.file}, [validation]: expected [target] with a value, which the check is compared with"
        )
    return found


def _analysis(entry: Entry, folder: Path) -> Analysis:
    name = entry.text("name", "what the paper calls this analysis, such as 'Table 12'")
    entry.place += f" ({name})"
    model = entry.choice("model", MODELS)
    centre_points = entry.choice("centre_points", CENTRE_POINTS, None)
    if centre_points is not None and model != "first order":
        entry.fail("centre_points", "this key in a first-order model only: a quadratic one has squares for the centre")
    if model == "first order" and centre_points != "residual" and entry.content.get("drop"):
        entry.fail(
            "drop", 'no such key beside centre_points = "curvature"; name the factor\'s column under ignore instead'
        )
    found = Analysis(
        name,
        _table(entry, folder),
        model,
        centre_points or "curvature",
        entry.choice("design", DESIGNS, None),
        _factors(entry.table("factors")),
        entry.words("ignore"),
        entry.words("block", 'the column of the blocks, such as "Block"'),
        entry.text("intercept_in_block", "the block of the printed constant", None),
        entry.words("drop"),
        entry.number("rounded_to", "the last digit of the printed responses, such as 0.01", None),
        entry.number("levels_rounded_to", "the last digit of the printed axial levels, such as 0.01", None),
        _printed(entry.table("printed")),
    )
    entry.close()
    return found


def _table(entry: Entry, folder: Path) -> Path:
    path = folder / entry.text("table", "the CSV file of the runs, in this folder")
    if not path.is_file():
        entry.fail("table", f"a file in {folder}")
    return path


def _factors(entry: Entry) -> list[Factor]:
    found = []
    for name in entry.content:
        below = entry.table(name)
        low, high = below.number("low", "the physical level of -1"), below.number("high", "the physical level of +1")
        if low == high:
            below.fail("high", f"another level than low = {low:g}")
        found.append(Factor(name, low, high, below.text("unit", default="")))
        below.close()
    return found


def _printed(entry: Entry) -> Printed:
    by_term = {key: entry.printed_table(key) for key in BY_TERM}
    anova = {}
    rows = entry.table("anova")
    for source in rows.content:
        row = rows.table(source)
        anova[source] = {key: row.printed(key) for key in ANOVA_COLUMNS if key in row.content}
        row.asked += ANOVA_COLUMNS
        row.close()
    groups = {key: entry.table(key) for key in ("summary", "lenth")}
    for key, known in (("summary", SUMMARY), ("lenth", LENTH)):
        groups[key].asked += known
        groups[key].close()
    stationary = entry.table("stationary")
    points = {key: stationary.printed_table(key) for key in ("coded", "physical")}
    predicted = stationary.printed("predicted", None)
    points["predicted"] = {"": predicted} if predicted else {}
    points["eigenvalues"] = {f"{k}": text for k, text in enumerate(stationary.printed_list("eigenvalues"), start=1)}
    kind = stationary.choice("kind", STATIONARY, None)
    stationary.close()
    steepest = entry.table("steepest")
    directions = {key: steepest.printed_table(key) for key in ("coded", "physical")}
    steepest.close()
    summary, lenth = ({key: below.printed(key) for key in below.content} for below in groups.values())
    entry.close()
    return Printed(by_term, anova, summary, lenth, points, kind, directions)


def _one_of(entry: Entry, names: list[str]) -> str:
    """The analysis a table speaks of; may be left out where there is only one."""
    return entry.choice("analysis", names, names[0] if len(names) == 1 else None) or entry.fail(
        "analysis", f"one of {', '.join(map(repr, names))}"
    )


def _count(entry: Entry) -> int | None:
    n = entry.take("n", int, "the number of readings, 1 or more", None)
    if n is not None and n < 1:
        entry.fail("n", "the number of readings, 1 or more")
    return n


def _goal(entry: Entry, names: list[str]) -> Goal | None:
    below = entry.table("target")
    if not below.content:
        return None
    want = below.choice("want", WANTED, "target")
    value = below.printed("value", None)
    if value is None and want == "target":
        below.fail("value", 'the response wanted, as printed, such as "41.69"')
    found = Goal(
        _one_of(below, names),
        want,
        value,
        below.printed("sd", None),
        _count(below),
        below.text("unit", default=""),
    )
    below.close()
    return found


def _optimum(entry: Entry) -> Optimum | None:
    below = entry.table("optimum")
    if not below.content:
        return None
    found = Optimum(
        below.printed_table("point"),
        below.printed("predicted", None),
        below.take("unique", bool, "true where the paper calls its setting the best one", False),
    )
    if not found.point:
        below.fail("point", 'the printed setting, such as { B = "0.887", C = "0.319" }')
    below.close()
    return found


def _validation(entry: Entry) -> Validation | None:
    below = entry.table("validation")
    if not below.content:
        return None
    found = Validation(
        below.printed("mean"),
        below.printed("sd", None),
        _count(below),
        below.printed("relative_error_percent", None),
        below.printed("less_than_percent", None),
        below.printed("p", None),
    )
    if found.p is not None and not 0 < float(found.p.lstrip("<= ").rstrip("*")) < 1:
        below.fail("p", "a probability between 0 and 1")
    below.close()
    return found


def _climb(entry: Entry, folder: Path, names: list[str]) -> Climb:
    found = Climb(
        entry.text("name", "what the paper calls this path, such as 'Table 10'"),
        _table(entry, folder),
        _one_of(entry, names),
        entry.choice("holds", ("response", "error"), "response"),
        entry.take("best", int, "the row that the paper goes on from, counted from 1", None),
    )
    entry.close()
    return found


def _claim(entry: Entry, names: list[str]) -> Claim:
    found = Claim(
        entry.text("says", "the sentence, in your own words"),
        _one_of(entry, names),
        entry.choice("kind", CLAIMS),
        entry.words("of", 'what it speaks of: terms such as ["A", "BC"], or "maximum", or "significant"'),
        entry.number("level", "a level such as 0.05", 0.05),
    )
    if not found.of:
        entry.fail("of", 'what it speaks of: terms such as ["A", "BC"], or "maximum", or "significant"')
    entry.close()
    return found
