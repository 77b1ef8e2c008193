"""Designs made, judged and mended, in words; nothing is computed here."""

from pellet_study.doe.augment import Augmented
from pellet_study.doe.categorical import LevelAnalysis
from pellet_study.doe.confounding import hidden
from pellet_study.doe.fold_over import FoldOver
from pellet_study.doe.power import Power
from pellet_study.doe.repair import Repair
from pellet_study.doe.run_sheet import RunSheet
from pellet_study.doe.score import Score
from pellet_study.doe.text import anova_text, block_confounding_text, grid, number, probability

ROMAN = {3: "III", 4: "IV", 5: "V or more"}


def blocks_text(sheet: RunSheet) -> str | None:
    """Whether the blocks of a sheet are orthogonal, or what they cost; None without blocks."""
    if sheet.n_blocks == 1:
        return None
    if sheet.orthogonal_blocks:
        which = "main effects" if sheet.confounded else "effects"
        text = f"{sheet.n_blocks} orthogonal blocks: differences between them do not touch the {which}"
        return "\n".join(filter(None, [text, block_confounding_text(sheet.confounded)]))
    if sheet.worst_inflation == float("inf"):
        return (
            f"{sheet.n_blocks} blocks, and some effect cannot be told from a difference between them: take fewer blocks "
            "or more runs"
        )
    return (
        f"{sheet.n_blocks} blocks, not orthogonal (with these runs the design has no such blocks; another number of --centre may give "
        f"them): fitted with the blocks, a standard "
        f"error is up to {100 * (sheet.worst_inflation - 1):.1f} % larger than without"
    )


def fold_text(found: FoldOver) -> str:
    """What a fold-over adds and frees."""
    what = "all factors" if found.full else ", ".join(found.folded)
    lines = [f"fold-over on {what}: {len(found.added)} runs with these signs reversed, as a block of their own"]
    freed = {name: pairs for name, pairs in found.freed.items() if pairs}
    if found.full and freed and not any(found.after.values()):
        lines.append("every main effect becomes clear of every two-factor interaction:")
    elif freed:
        lines.append("main effects freed from two-factor interactions:")
    lines += [f"  {name}: no longer carries {', '.join(pairs)}" for name, pairs in freed.items()]
    still = {name: shares for name, shares in found.after.items() if shares}
    if still:
        lines.append("main effects that still carry some:")
        lines += [
            f"  {name}: {', '.join(f'{share:+.3g} {pair}' for pair, share in shares.items())}"
            for name, shares in still.items()
        ]
    if found.interactions_freed:
        lines.append(f"interactions now clear of everything up to two factors: {', '.join(found.interactions_freed)}")
    elif not freed:
        lines.append("nothing is freed: the main effects are clear already, and the interactions stay mixed")
    return "\n".join(lines)


def axial_text(found: Augmented, n_centre: int) -> str:
    """What axial points add."""
    lines = [
        f"{2 * len(found.names)} axial points of {', '.join(found.names)} at +-{found.distance:.4g} (coded), and {n_centre} "
        "centre points, as a block of their own"
    ]
    if found.lost:
        lines.append(
            f"the quadratic model is not separated: {', '.join(found.lost)} are mixed; keep fewer factors (--factors), or "
            "fold the screening over first"
        )
    elif found.block_inflation < 1 + 1e-6:
        lines.append("all terms of the quadratic model are separated; the blocks are orthogonal")
    else:
        lines.append(
            "all terms of the quadratic model are separated; the second block makes a standard error up to "
            f"{100 * (found.block_inflation - 1):.1f} % larger (--axial orthogonal makes none)"
        )
    return "\n".join(lines)


def repair_text(found: Repair, lines_of: list[int], runs: list[str]) -> str:
    """Which runs to repeat."""
    now = f"now: {number(found.efficiency[0], 4)} % of the complete design's information (D-efficiency)"
    parts = [
        f"{len(found.lost)} of {len(runs)} runs are lost (rows {', '.join(str(lines_of[i]) for i in found.lost)})",
        now,
    ]
    if found.confounded_now:
        parts.append(
            f"the runs at hand do not separate {', '.join(found.confounded_now)}; {found.needed} run"
            f"{'s' if found.needed != 1 else ''} at least must be repeated"
        )
    else:
        parts.append(
            f"all terms are separated as it is; a standard error is up to {found.worst_inflation[0]:.3g} times that of the "
            "complete design"
        )
    rows = [
        [str(lines_of[i]), runs[i], number(d, 4), "-" if e == float("inf") else f"{e:.3f}"]
        for i, d, e in zip(found.repeated, found.efficiency[1:], found.worst_inflation[1:], strict=True)
    ]
    parts.append("repeat, in this order:\n" + grid(["row", "run", "D-efficiency %", "worst standard error"], rows))
    return "\n".join(parts)


def power_text(found: Power, screening: int | None) -> str:
    """Power of the terms of a design."""
    rows = [
        [name, "-" if value is None else f"{value:.3f}", number(found.detectable[name], 4)]
        for name, value in found.power.items()
    ]
    parts = [
        f"effect {found.effect:g} (from -1 to +1; of a square: from the middle to an end), sd of a run {found.sd:g}, level "
        f"{found.alpha:g}: {found.runs} runs, {found.df_residual} residual degrees of freedom",
        grid(["term", "power", f"found {100 * found.wanted:g} %"], rows),
    ]
    if not found.df_residual:
        parts.append("the design is saturated: no residual, so no test; add centre points or runs, or drop factors")
    if found.replicates == 1:
        parts.append(f"the {found.runs} runs are enough: every main effect is found with probability {found.wanted:g}")
    elif found.replicates:
        parts.append(f"for {found.wanted:g}: {found.replicates} replicates of the design, {found.runs_needed} runs")
    else:
        parts.append(
            f"1000 replicates of the design do not reach {found.wanted:g}: the effect is too small for this scatter"
        )
    if screening:
        parts.append(f"an orthogonal two-level design of these factors needs {screening} runs (a multiple of 4)")
    return "\n\n".join(parts[:2]) + "\n" + "\n".join(parts[2:])


def score_text(found: Score) -> str:
    """A design judged."""
    parts = [
        f"this is: {found.kind}\nmodel {found.model}: {found.terms} terms, {found.runs} runs, {found.df_residual} residual "
        f"degrees of freedom, {found.pure_error_df} of them pure error (replicates)"
    ]
    if found.confounded:
        parts.append(
            f"the runs do not separate {', '.join(found.confounded)}: this model cannot be fitted; {_separating(found)}"
        )
        return "\n".join(filter(None, [*parts, block_confounding_text(found.block_confounded)]))
    quantiles = ", ".join(f"{100 * float(q):g} % {v:.3f}" for q, v in found.variance_quantiles.items())
    parts.append(
        f"efficiency: D {found.d_efficiency:.2f} %, A {found.a_efficiency:.2f} %, G {found.g_efficiency:.2f} % (in the box "
        f"-1 to 1)\nprediction variance / run variance: mean {found.average_variance:.4f}, largest "
        f"{found.max_variance:.4f}; not exceeded in {quantiles} of the box"
    )
    rows = [[name, f"{value:.3f}", f"{found.relative_se[name]:.4f}"] for name, value in found.vif.items()]
    parts.append(grid(["term", "VIF", "standard error / sd"], rows))
    carried = {name: shares for name, shares in found.aliases.items() if shares}
    if not carried:
        parts.append("aliases with terms of the next order: none")
    else:
        lines = ["aliases: each coefficient also carries these shares of terms of the next order"]
        lines += [
            f"  {name}: {', '.join(f'{share:+.3g} {other}' for other, share in list(shares.items())[:8])}"
            + (f" and {len(shares) - 8} more" if len(shares) > 8 else "")
            for name, shares in carried.items()
        ]
        parts.append("\n".join(lines))
    return "\n\n".join(filter(None, [*parts, block_confounding_text(found.block_confounded, found.vif)]))


def _separating(found: Score) -> str:
    """What to do where the runs do not separate the terms of a model."""
    if set(hidden(found.block_confounded)) & set(found.confounded):
        return "take a smaller one, or part the runs into blocks in another way (pb --design ... --blocks)"
    verb = "design axial" if found.model == "quadratic" else "design fold --on FACTOR"
    return f"take a smaller one, or add runs ({verb})"


def levels_text(found: LevelAnalysis) -> str:
    """Main effects of factors at named levels."""
    parts = [
        f"main effects of {len(found.factors)} factors: {found.runs} runs, response {found.response}",
        anova_text(found.anova),
        f"R2 {number(found.r2)}, adjusted {number(found.r2_adjusted)}, predicted {number(found.r2_predicted)}; C.V. "
        f"{number(found.cv_percent, 4)} %; lack of fit p {probability(found.lack_of_fit_p)}",
    ]
    numeric = [(name, value) for name, value in found.effects.items() if name in {f.name for f in found.factors}]
    if numeric:
        parts.append(grid(["factor", "effect (-1 to +1)"], [[name, number(value)] for name, value in numeric]))
    for name, means in found.means.items():
        rows = [[level, number(mean), number(error, 4)] for level, (mean, error) in means.items()]
        parts.append(grid([name, "adjusted mean", "standard error"], rows))
    return "\n\n".join(parts)
