"""The analysis of a screening in words and tables."""

from collections.abc import Sequence

from pellet_study.doe.cautions import screening_cautions
from pellet_study.doe.linear_model import interaction_terms
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
    no_replicates,
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

MOST_ALIASES = 6
"""Interactions named of each main effect."""


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
    if max(map(len, screening.aliases.values())) > MOST_ALIASES:
        lines[0] += f" ({MOST_ALIASES} of each, those of the factors with the largest effects; --json has all)"
    return "\n".join([*lines, *(f"  {name}: {_alias_words(screening, name)}" for name in names)])


def _alias_words(screening: Screening, name: str) -> str:
    """The interactions that one effect carries, by their shares; of many those whose own factors act most."""
    sizes = [abs(effect) for effect in screening.effects.values()]
    parents = interaction_terms(screening.table.names)
    of_pairs = screening.aliases[name]
    told = sorted(of_pairs, key=lambda pair: -sizes[parents[pair][0]] * sizes[parents[pair][1]])[:MOST_ALIASES]
    groups: dict[str, list[str]] = {}
    for pair in filter(told.__contains__, of_pairs):
        groups.setdefault(f"{of_pairs[pair]:+.3g}", []).append(pair)
    words = "; ".join(f"{share} of {', '.join(pairs)}" for share, pairs in groups.items()) or "none"
    return words + (f" and {len(of_pairs) - len(told)} more" if len(of_pairs) > len(told) else "")


def screening_warnings(screening: Screening) -> list[str]:
    """What a reader of the screening must know."""
    found = list(screening.table.notes)
    found += screening_cautions(screening)
    if screening.saturated:
        found.append(f"{SATURATED}; judge the effects by Lenth's margin of error and the half-normal plot")
    if not screening.orthogonal:
        found.append(loss(screening.standard_error_inflation, "in an orthogonal design with as many runs"))
    if not screening.pure_error_df and not screening.saturated:
        found.append(f"{no_replicates(screening)}, so lack of fit cannot be tested and the residual holds both")
    elif exactly_equal(screening):
        found.append(EQUAL_REPLICATES)
    return found


def borderline_lines(screenings: Sequence[Screening]) -> list[str]:
    """The factors that a next design takes on the strength of a p value which Holm's count of the factors does not bear."""
    lines = []
    clear = {name for s in screenings for name, p in s.p_adjusted.items() if p is not None and p < s.alpha}
    for s in screenings:
        found = [name for name, p in s.p.items() if p is not None and p < s.alpha and name not in clear]
        if found:
            words = ", ".join(
                f"{name} (p {probability(s.p[name])}, Holm {probability(s.p_adjusted[name])})" for name in found
            )
            lines.append(
                f"borderline for {s.table.response.name}: {words}; of {len(s.p)} factors without effect one or more has a p below "
                f"{s.alpha:g} in about {100 * (1 - (1 - s.alpha) ** len(s.p)):.0f} % of screenings, so judge whether the next design "
                "needs it"
            )
    return lines
