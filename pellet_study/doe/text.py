"""What the words about every analysis share: numbers, tables, equations, predictions; nothing is computed here."""

from collections.abc import Collection, Iterable

from pellet_study.doe.anova import pure_error
from pellet_study.doe.blocks import offsets
from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.coded_box import Extent
from pellet_study.doe.confounding import hidden
from pellet_study.doe.fitted_response import FittedResponse
from pellet_study.doe.intervals import Interval
from pellet_study.doe.lenth import Lenth
from pellet_study.doe.plackett_burman import Screening
from pellet_study.doe.published_designs import UNKNOWN, design_of
from pellet_study.doe.terms import INTERCEPT


def number(value, digits: int = 5) -> str:
    """A number for reading; `-` where undefined."""
    return "-" if value is None else f"{value:.{digits}g}"


def probability(value) -> str:
    """A p value to four decimals, as ANOVA tables print it."""
    if value is None:
        return "-"
    return "<0.0001" if value < 1e-4 else f"{value:.4f}"


def grid(header: list[str], rows: list[list[str]]) -> str:
    """Left-aligned first column, right-aligned others."""
    table = [header, *rows]
    widths = [max(len(row[i]) for row in table) for i in range(len(header))]
    lines = []
    for row in table:
        cells = [
            cell.ljust(w) if i == 0 else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def anova_text(rows: list[dict]) -> str:
    """An ANOVA table."""
    header = ["source", "sum of squares", "df", "mean square", "F", "p"]
    cells = [
        [
            row["source"],
            number(row["sum_of_squares"], 6),
            str(row["df"]),
            number(row["mean_square"], 6),
            number(row["f"]),
            probability(row["p"]),
        ]
        for row in rows
    ]
    return grid(header, cells)


def summary_line(analysis: Screening | Surface) -> str:
    return (
        f"R2 {number(analysis.r2)}, adjusted {number(analysis.r2_adjusted)}, predicted "
        f"{number(analysis.r2_predicted)}; C.V. {number(analysis.cv_percent, 4)} %; lack of fit p "
        f"{probability(analysis.lack_of_fit_p)}"
    )


def equation(coefficients: dict[str, float], digits: int = 6) -> str:
    """A polynomial in words of its terms."""
    parts = []
    for name, value in coefficients.items():
        size = f"{abs(value):.{digits}g}" + ("" if name == INTERCEPT else f" {name}")
        parts.append((" - " if value < 0 else " + ") + size)
    text = "".join(parts)
    return text[3:] if text.startswith(" + ") else "-" + text[3:]


def head(analysis: Screening | Surface, kind: str) -> str:
    levels = "; ".join(f"{f.label} {f.word(-1)} to {f.word(1)}" for f in analysis.table.factors)
    return (
        f"{kind}: {len(analysis.table.response)} runs, {len(analysis.table.factors)} "
        f"factor{'s' if len(analysis.table.factors) > 1 else ''}, response "
        f"{analysis.table.response.name}{_design_text(analysis)}\nlevels -1 to +1: {levels}{_blocks_text(analysis)}"
    )


def _design_text(analysis: Screening | Surface) -> str:
    """What design the runs are, where it is a known one."""
    name = design_of(analysis.table)
    return "" if UNKNOWN in name else f"\ndesign: {name}"


def _blocks_text(analysis: Screening | Surface) -> str:
    """Each block's level beside the mean of the blocks, for which the equation holds."""
    extra = dict(zip(analysis.model.columns, analysis.model.results.params, strict=True))
    lines = []
    least = 1e-12 * abs(analysis.model.response).max()  # below it an offset is the rounding of its computation
    for name, levels in offsets(analysis.table.blocks, extra).items():
        words = ", ".join(f"{level} {value if abs(value) > least else 0:+.5g}" for level, value in levels.items())
        lines.append(f"\nblocks of {name}: {words} (beside the mean of the blocks, which all predictions are for)")
    return "".join(lines)


def sparsity(lenth: Lenth) -> str:
    """A sentence where Lenth's method cannot be relied on."""
    if lenth.assumption_met:
        return ""
    return (
        "\nLenth's assumption that most contrasts are noise is not met here (too few contrasts beyond the factors): "
        "do not judge by this margin"
    )


FOLLOWS_SELECTION = (
    "the terms were chosen by the same runs that now test them, so R2, p values and intervals follow that selection and look "
    "better than they are"
)
"""Of any model whose terms were left out after the runs were seen."""


def selection_cautions(responses: Iterable[FittedResponse]) -> list[str]:
    """That the intervals of these responses follow a selection, where they do."""
    names = [response.name for response in responses if response.reduced]
    return [f"caution: in the model of {', '.join(names)} {FOLLOWS_SELECTION}"] if names else []


SATURATED = "the design is saturated: as many terms as runs, no residual, so no p values"
"""Of any fit that leaves no residual; what to judge by instead follows."""

EQUAL_REPLICATES = (
    "the replicated runs are exactly equal, so the pure error is 0 and the lack of fit cannot be tested; check that "
    "they are runs of their own and not copies"
)


MANY_CONFOUNDED = 6
"""Effects mixed in part with blocks that are spelt out; of more their number and largest share is said."""


def block_confounding_text(confounded: dict[str, float], fitted: Collection[str] = ()) -> str:
    """What the blocks are mixed with; empty where nothing is known to be. Centre runs may have let some be `fitted` all the same."""
    if not confounded:
        return ""
    whole = hidden(confounded)
    by_centre = [name for name in whole if name in fitted]
    part = {name: share for name, share in confounded.items() if name not in whole}
    lines = []
    if whole:
        lines.append(
            f"the blocks are confounded with {', '.join(whole)}: a difference between blocks cannot be told from such an effect"
            + (f"; of {', '.join(by_centre)} the centre runs alone tell it" if by_centre else "")
        )
    if part and len(part) <= MANY_CONFOUNDED:
        words = ", ".join(f"{name} {share:.3g}" for name, share in part.items())
        lines.append(f"shares that lie between the blocks: {words}")
    elif part:
        lines.append(f"{len(part)} effects lie between the blocks in part, with shares up to {max(part.values()):.3g}")
    return "\n".join(lines)


def heading_of_terms(screening: Screening) -> str:
    """The heading of a column of effects."""
    return "term" if screening.interactions else "factor"


def exactly_equal(analysis: Screening | Surface) -> bool:
    """Whether there are replicates, and no difference within them."""
    return any(row["source"] == "pure error" and row["sum_of_squares"] == 0 for row in analysis.anova)


def no_replicates(analysis: Screening | Surface) -> str:
    """That there is no pure error, and whether runs were repeated all the same."""
    table = analysis.table
    if table.blocks and pure_error(table.coded, table.response)[1]:
        return "runs are repeated in different blocks only, where their scatter cannot be told from the blocks"
    return "there are no replicated runs"


def loss(inflation: dict[str, float], than: str) -> str:
    """What is lost where the runs are not orthogonal."""
    worst = max(inflation, key=inflation.get)
    return (
        "the runs that are there are not orthogonal: effects are least-squares estimates and share information; the "
        f"standard error of {worst} is {100 * (inflation[worst] - 1):.1f} % larger than {than}"
    )


def extent_text(extent: Extent) -> str:
    """The range of a factor on the settings that meet a target; what is not said by it where that is its whole range."""
    low, high = extent.coded
    text = f"{extent.name}: {between(extent.physical)} (coded {low:.3f} to {high:.3f})"
    if not extent.unidentified:
        return text
    text += "  not identified: by this model both ends of its range will do"
    if extent.alone == extent.physical:
        return text + ", and all between them with the others as recommended"
    text += ", the others set to suit"
    return text if extent.alone is None else f"{text}; with the others as recommended {between(extent.alone)} will"


def between(ends: tuple[float, float]) -> str:
    """Two ends as `1 to 2`."""
    return f"{number(ends[0])} to {number(ends[1])}"


def percent(level: float) -> str:
    """A level as `95 %`."""
    return f"{100 * level:.6g} %"


def prediction_text(physical: dict[str, float], found: Interval) -> str:
    """A prediction at a point."""
    place = ", ".join(f"{name} {value:.5g}" for name, value in physical.items())
    text = f"predicted {number(found.predicted, 6)} at {place}"
    if found.confidence:
        text += (
            f"; {percent(found.level)} confidence interval of the mean {number(found.confidence[0])} to "
            f"{number(found.confidence[1])}, {run_interval_text(found)}"
        )
    return text


def run_interval_text(found: Interval) -> str:
    """The prediction interval of one run; of runs made in blocks, of one in a new block and of one in those run."""
    low, high = found.prediction
    words = f"{percent(found.level)} prediction interval of one run {number(low)} to {number(high)}"
    if not found.block_scatter:
        return words
    words = words.replace("of one run", "of one run in a new block")
    between = ", ".join(
        f"{one.name}: sd {one.variance**0.5:.3g} from {one.n_blocks} blocks, {one.df} degree{'s' if one.df > 1 else ''} of freedom"
        for one in found.block_scatter
    )
    low, high = found.within_block
    return f"{words} (the scatter between blocks included, {between}), in an average one of those run {number(low)} to {number(high)}"
