"""The analysis of a screening in words and tables."""

from pellet_study.doe.cautions import screening_cautions
from pellet_study.doe.plackett_burman import Screening
from pellet_study.doe.published_designs import design_of
from pellet_study.doe.text import (
    EQUAL_REPLICATES,
    anova_text,
    block_confounding_text,
    exactly_equal,
    grid,
    head,
    heading_of_terms,
    loss,
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
    return "Two-level design" if screening.interactions else "Plackett-Burman"


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

MOST_CONTRASTS = 8
"""Left-over contrasts that are spelt out, the largest first."""


def _alias_text(screening: Screening) -> str:
    """Each effect with the interactions it carries."""
    names = screening.table.names
    size = "interactions that are not fitted" if screening.interactions else "two-factor interactions"
    carried = {name: shares for name, shares in screening.aliases.items() if shares}
    if screening.interactions and not carried:
        order = "two- and three-factor interactions" if len(names) > 2 else "interactions"
        return f"aliases: no effect carries another; all {order} are told apart or left to the blocks"
    if len(names) * (len(names) - 1) / 2 > MANY_INTERACTIONS:
        shares = [abs(share) for found in screening.aliases.values() for share in found.values()]
        most = max(len(found) for found in screening.aliases.values())
        return f"aliases: each effect carries up to {most} {size}, shares up to {max(shares, default=0):.3g}"
    lines = [f"aliases: each effect also carries these shares of {size}"]
    for name, of_others in screening.aliases.items():
        groups: dict[str, list[str]] = {}
        for other, share in of_others.items():
            groups.setdefault(f"{share:+.3g}", []).append(other)
        words = "; ".join(f"{share} of {', '.join(others)}" for share, others in groups.items())
        lines.append(f"  {name}: {words or 'none'}")
    return "\n".join(lines)


def screening_warnings(screening: Screening) -> list[str]:
    """What a reader of the screening must know."""
    found = list(screening.table.notes)
    found += screening_cautions(screening)
    if screening.saturated:
        found.append(
            "the design is saturated: as many terms as runs, no residual, so no p values; judge the effects "
            "by Lenth's margin of error and the half-normal plot"
        )
    if not screening.orthogonal:
        found.append(loss(screening.standard_error_inflation, "in an orthogonal design with as many runs"))
    if not screening.pure_error_df and not screening.saturated:
        found.append("there are no replicated runs, so lack of fit cannot be tested and the residual holds both")
    elif exactly_equal(screening):
        found.append(EQUAL_REPLICATES)
    return found
