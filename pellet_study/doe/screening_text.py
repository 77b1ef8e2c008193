"""The analysis of a screening in words and tables."""

from collections.abc import Sequence
from math import prod

from pellet_study.doe.cautions import screening_cautions
from pellet_study.doe.plackett_burman import Screening
from pellet_study.doe.published_designs import design_of
from pellet_study.doe.terms import interaction_terms
from pellet_study.doe.text import (
    EQUAL_REPLICATES,
    SATURATED,
    anova_text,
    block_confounding_text,
    exactly_equal,
    grid,
    head,
    heading_of_terms,
    loss,
    no_replicates,
    number,
    percent,
    probability,
    sparsity,
    summary_line,
)


def screening_text(screening: Screening) -> str:
    """The analysis of a two-level table."""
    s = screening
    order = sorted(s.effects, key=lambda name: -abs(s.effects[name]))
    least = 1e-12 * abs(s.model.response).max()  # below it an effect is the rounding of its computation
    rows = [
        [
            name,
            number(s.effects[name] if abs(s.effects[name]) > least else 0.0),
            number(s.sums_of_squares[name], 6),
            f"{s.contributions[name]:.2f}",
            probability(s.p[name]),
            probability(s.p_adjusted[name]),
            number(s.detectable_effects[name], 4),
        ]
        for name in order
    ]
    header = [
        heading_of_terms(s),
        "effect",
        "sum of squares",
        "contribution %",
        "p",
        "p (Holm)",
        f"found {100 * s.power:.0f} %",
    ]
    parts = [
        head(s, _kind(s)),
        grid(header, rows) + f"\n(last column: the smallest effect this design finds with probability {s.power:g})",
        anova_text(s.anova),
        summary_line(s),
        _lenth_text(s, order),
    ]
    if s.curvature:
        parts.append(
            f"curvature: centre points minus the {'model' if s.interactions else 'straight line'} {s.curvature.estimate:+.5g}, F "
            f"{number(s.curvature.f)}, p {probability(s.curvature.p)}"
        )
    parts += [block_confounding_text(s.block_confounded, s.effects), _alias_text(s)]
    return "\n\n".join(filter(None, parts))


def _kind(screening: Screening) -> str:
    """What the analysis is of."""
    if design_of(screening.table).startswith("full"):
        return "Full factorial"
    if screening.contrasts:
        return "Fractional factorial"
    plain = screening.interactions or "orthogonal two-level design" not in design_of(screening.table)
    return "Two-level design" if plain else "Plackett-Burman"


def _lenth_text(screening: Screening, order: list[str]) -> str:
    """Lenth's margins, what lies beyond them, and the contrasts that no term has."""
    if not screening.lenth:
        return ""
    lenth, margin = screening.lenth, screening.lenth.margin_of_error
    beyond = [name for name in order if abs(screening.effects[name]) > margin]
    left_over = sorted(screening.contrasts.items(), key=lambda item: -abs(item[1]))
    beyond += [f"{word} ({value:.4g})" for word, value in left_over if abs(value) > margin]
    text = (
        f"Lenth, {lenth.contrasts} contrasts: pseudo standard error {number(lenth.pseudo_standard_error)}, "
        f"{percent(1 - screening.alpha)} margin of error {number(margin)}, simultaneous "
        f"{number(lenth.simultaneous_margin_of_error)}; beyond the margin: {', '.join(beyond) or 'none'}{sparsity(lenth)}"
    )
    if left_over:
        words = ", ".join(f"{word} {value:.4g}" for word, value in left_over[:MOST_CONTRASTS])
        more = f" and {len(left_over) - MOST_CONTRASTS} smaller" if len(left_over) > MOST_CONTRASTS else ""
        text += f"\ncontrasts that no term above has, as effects (they make the residual): {words}{more}"
    return text


MANY_INTERACTIONS = 28
"""Beyond this number (8 factors) the aliases are summed up; the JSON answer has them all."""

MOST_ALIASES = 6
"""Interactions named of each main effect."""
MOST_CONTRASTS = 8
"""Left-over contrasts that are spelt out, the largest first."""


def _alias_text(screening: Screening) -> str:
    """Each effect with the interactions it carries."""
    names = screening.table.names
    size = "interactions that are not fitted" if screening.interactions else "two-factor interactions"
    carried = {name: shares for name, shares in screening.aliases.items() if shares}
    if screening.interactions and not carried:
        order = "two- and three-factor interactions" if len(names) > 2 else "interactions"
        left = " or left to the blocks" if screening.table.blocks else ""
        return f"aliases: no effect carries another; all {order} are told apart{left}"
    if len(names) * (len(names) - 1) / 2 > MANY_INTERACTIONS:
        shares = [abs(share) for found in screening.aliases.values() for share in found.values()]
        most = max(len(found) for found in screening.aliases.values())
        return f"aliases: each effect carries up to {most} {size}, shares up to {max(shares, default=0):.3g}"
    lines = [f"aliases: each effect also carries these shares of {size}"]
    if max(map(len, screening.aliases.values())) > MOST_ALIASES:
        lines[0] += f" ({MOST_ALIASES} of each, those of the factors with the largest effects; --json has all)"
    return "\n".join([*lines, *(f"  {name}: {_alias_words(screening, name)}" for name in screening.aliases)])


def _alias_words(screening: Screening, name: str) -> str:
    """The interactions that one effect carries, by their shares; of many those whose own factors act most."""
    names = screening.table.names
    parents = interaction_terms(names)
    of_pairs = screening.aliases[name]

    def size(pair: str) -> float:  # 0 of more than two factors
        return prod(abs(screening.effects[names[place]]) for place in parents[pair]) if pair in parents else 0.0

    told = sorted(of_pairs, key=size, reverse=True)[:MOST_ALIASES]
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
        margin = "Lenth's margin of error and " if screening.lenth and screening.lenth.assumption_met else ""
        found.append(f"{SATURATED}; judge the effects by {margin}the half-normal plot")
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
                f"borderline for {s.table.response.name}: {words}; of {len(s.p)} {heading_of_terms(s)}s without effect one or more has a p below "
                f"{s.alpha:g} in about {100 * (1 - (1 - s.alpha) ** len(s.p)):.0f} % of screenings, so judge whether the next design "
                "needs it"
            )
    return lines
