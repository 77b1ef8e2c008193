"""Read the description of a paper: paper.toml, checked key by key."""

from pathlib import Path

from pellet_study.doe.factors import Factor
from pellet_study.errors import InputError
from pellet_study.paper.described.description import (
    ANOVA_COLUMNS,
    BY_TERM,
    CENTRE_POINTS,
    CLAIMS,
    DESIGNS,
    FILE,
    LENTH,
    MODELS,
    STATIONARY,
    SUMMARY,
    WANTED,
    Analysis,
    Claim,
    Climb,
    Description,
    Goal,
    Optimum,
    Printed,
    Validation,
)
from pellet_study.paper.described.entries import Entry, read
from pellet_study.paper.verdicts import printed_number


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
    _check_zero(entry, found)
    if found.validation and found.goal.value is None:
        raise InputError(
            f"{entry.file}, [validation]: expected [target] with a value, which the check is compared with"
        )
    return found


def _check_zero(entry: Entry, found: Description) -> None:
    """A relative error needs a target other than 0."""
    check = found.validation
    if check and found.goal.value is not None and printed_number(found.goal.value) == 0:
        if check.relative_error_percent is not None or check.less_than_percent is not None:
            raise InputError(
                f"{entry.file}, [validation]: expected no relative error beside a target of 0, of which nothing is a percentage"
            )


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
    predicted = stationary.exact("predicted", None)
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
    value = below.exact("value", None)
    if value is None and want == "target":
        below.fail("value", 'the response wanted, as printed, such as "41.69"')
    found = Goal(
        _one_of(below, names),
        want,
        value,
        below.exact("sd", None),
        _count(below),
        below.text("unit", default=""),
    )
    below.close()
    return found


def _optimum(entry: Entry) -> Optimum | None:
    below = entry.table("optimum")
    if not below.content:
        return None
    point = below.table("point")
    found = Optimum(
        {name: point.exact(name) for name in point.content},
        below.exact("predicted", None),
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
        below.exact("mean"),
        below.exact("sd", None),
        _count(below),
        below.exact("relative_error_percent", None),
        below.exact("less_than_percent", None),
        below.exact("p", None),
    )
    if found.p is not None and not 0 < printed_number(found.p) < 1:
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
