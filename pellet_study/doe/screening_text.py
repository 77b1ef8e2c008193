"""The analysis of a screening in words and tables."""

from pellet_study.doe.cautions import screening_cautions
from pellet_study.doe.plackett_burman import Screening
from pellet_study.doe.published_designs import design_of
from pellet_study.doe.text import (
    EQUAL_REPLICATES,
    SATURATED,
    anova_text,
    exactly_equal,
    grid,
    head,
    loss,
    number,
    percent,
    probability,
    sparsity,
    summary_line,
)


def screening_text(screening: Screening) -> str:
    """The analysis of a Plackett-Burman table."""
    s = screening
    order = sorted(s.effects, key=lambda name: -abs(s.effects[name]))
    rows = [
        [
            name,
            number(s.effects[name]),
            number(s.sums_of_squares[name], 6),
            f"{s.contributions[name]:.2f}",
            probability(s.p[name]),
            probability(s.p_adjusted[name]),
            number(s.detectable_effects[name], 4),
        ]
        for name in order
    ]
    header = [
        "factor",
        "effect",
        "sum of squares",
        "contribution %",
        "p",
        "p (Holm)",
        f"found {100 * s.power:.0f} %",
    ]
    parts = [
        head(s, "Full factorial" if design_of(s.table).startswith("full") else "Plackett-Burman"),
        grid(header, rows) + f"\n(last column: the smallest effect this design finds with probability {s.power:g})",
        anova_text(s.anova),
        summary_line(s),
    ]
    if s.lenth:
        parts.append(
            f"Lenth, {s.lenth.contrasts} contrasts: pseudo standard error "
            f"{number(s.lenth.pseudo_standard_error)}, {percent(1 - s.alpha)} margin of error {number(s.lenth.margin_of_error)}, "
            f"simultaneous {number(s.lenth.simultaneous_margin_of_error)}; beyond the margin: "
            f"{', '.join(n for n in order if abs(s.effects[n]) > s.lenth.margin_of_error) or 'none'}"
            f"{sparsity(s.lenth)}"
        )
    if s.curvature:
        parts.append(
            f"curvature: centre points minus the straight line {s.curvature.estimate:+.5g}, F "
            f"{number(s.curvature.f)}, p {probability(s.curvature.p)}"
        )
    parts.append(_alias_text(s))
    return "\n\n".join(parts)


MANY_INTERACTIONS = 28
"""Beyond this number (8 factors) the aliases are summed up; the JSON answer has them all."""


def _alias_text(screening: Screening) -> str:
    """Each main effect with the two-factor interactions it carries."""
    names = screening.table.names
    if len(names) * (len(names) - 1) / 2 > MANY_INTERACTIONS:
        shares = [abs(share) for found in screening.aliases.values() for share in found.values()]
        most = max(len(found) for found in screening.aliases.values())
        return (
            f"aliases: each effect carries up to {most} two-factor interactions, shares up to "
            f"{max(shares, default=0):.3g}"
        )
    lines = ["aliases: each effect also carries these shares of two-factor interactions"]
    for name, of_pairs in screening.aliases.items():
        groups: dict[str, list[str]] = {}
        for pair, share in of_pairs.items():
            groups.setdefault(f"{share:+.3g}", []).append(pair)
        words = "; ".join(f"{share} of {', '.join(pairs)}" for share, pairs in groups.items())
        lines.append(f"  {name}: {words or 'none'}")
    return "\n".join(lines)


def screening_warnings(screening: Screening) -> list[str]:
    """What a reader of the screening must know."""
    found = list(screening.table.notes)
    found += screening_cautions(screening)
    if screening.saturated:
        found.append(f"{SATURATED}; judge the effects by Lenth's margin of error and the half-normal plot")
    if not screening.orthogonal:
        found.append(loss(screening.standard_error_inflation, "in an orthogonal design with as many runs"))
    if not screening.pure_error_df and not screening.saturated:
        found.append("there are no replicated runs, so lack of fit cannot be tested and the residual holds both")
    elif exactly_equal(screening):
        found.append(EQUAL_REPLICATES)
    return found
