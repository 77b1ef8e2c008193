"""What `calibrate` found, as figures, text and JSON."""

from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.doe import figures
from pellet_study.doe.answers import plain
from pellet_study.powder_chain import OBSERVABLE, STAGES, Chain, summary
from yade_scripts import heap

NAMES = {
    "A": "restitution powder-powder",
    "B": "static friction powder-powder",
    "C": "rolling friction powder-powder",
    "D": "restitution powder-steel",
    "E": "static friction powder-steel",
    "F": "rolling friction powder-steel",
    "G": "surface energy, J/m2",
}


def answer(decisions: dict[str, dict]) -> dict:
    """The stages as JSON."""
    return plain(
        {
            "stages": [{"stage": stage, **decision} for stage, decision in decisions.items()],
            "optimum": decisions.get("optimum"),
            "validation": decisions.get("validation"),
        }
    )


def write(chain: Chain, decisions: dict[str, dict]) -> str:
    """Draw what was analysed in this call, write the summary; returns it."""
    drawn: dict[str, dict] = {}
    if hasattr(chain, "screened"):
        drawn["screening"] = {
            "pareto": figures.pareto(chain.screened, "deg"),
            "half_normal": figures.half_normal(chain.screened.effects, chain.screened.lenth, "deg"),
        }
    if "climb" in decisions and (chain.folder / "climb" / "runs.csv").exists():
        drawn["climb"] = {"climb": climb_figure(chain)}
    if hasattr(chain, "targeted"):
        surface = chain.targeted.surface
        drawn["optimum"] = {"surface": figures.surface_contours(surface, chain.targeted, "deg")}
        drawn["surface"] = {"predicted_observed": figures.predicted_observed(surface, "deg")}
    for stage, pictures in drawn.items():
        figures.save(pictures, chain.folder / stage)
    text = text_of(chain, decisions)
    (chain.folder / "summary.txt").write_text(text + "\n", encoding="utf-8")
    return text + f"\n\nresults in {chain.folder}"


def text_of(chain: Chain, decisions: dict[str, dict]) -> str:
    """The chain in words: each stage, what the law cannot do, the paper beside."""
    plan = chain.plan
    lines = [
        f"Powder calibration on the repose rig, contact law {plan.contact_law}, target {plan.target:g} +- {plan.sd:g} deg"
    ]
    for stage in STAGES:
        if stage in decisions:
            read = "" if (chain.folder / stage / "decision.json").exists() else f" (read from {chain.decisions_from})"
            lines.append(f"{stage:11s}{read} {summary(stage, decisions[stage])}")
        else:
            lines.append(f"{stage:11s} not done yet")
    for name, why in plan.idle.items():
        lines.append(f"{name} ({NAMES[name]}): {why}")
    file = chain.folder / "screening" / "effects.csv"
    if file.exists():
        lines += ["", "effects (change of the angle from the low to the high level) beside the paper's Table 8, deg:"]
        for row in pd.read_csv(file).itertuples():
            lines.append(
                f"  {row.factor} {NAMES[row.factor]:33s} {row.effect_deg:+6.2f} +- {row.standard_error_deg:.2f}   paper "
                f"{row.paper_effect_deg:+6.2f}   {row.sign}"
            )
    file = chain.folder / "surface" / "coefficients.csv"
    if file.exists():
        lines += [
            "",
            "coefficients of the surface (coded in our box; the paper's in its own, B reversed), deg:",
        ]
        for row in pd.read_csv(file).itertuples():
            theirs = "" if pd.isna(row.paper_coefficient_deg) else f"   paper {row.paper_coefficient_deg:+7.3f}"
            clear = "" if row.beyond_two_errors else "   below two standard errors"
            lines.append(f"  {row.term:3s} {row.coefficient_deg:+8.3f} +- {row.standard_error_deg:.3f}{theirs}{clear}")
    if "surface" in decisions:
        boxes = decisions["surface"]["boxes"]
        words = [", ".join(f"{k} {low:g} to {high:g}" for k, (low, high) in box.items()) for box in boxes]
        lines += ["", f"box{'es, in order' if len(boxes) > 1 else ''}: " + "; ".join(words)]
    return "\n".join(lines)


def climb_figure(chain: Chain):
    """Angles along the path, with the target."""
    runs = pd.read_csv(chain.folder / "climb" / "runs.csv")
    design = pd.read_csv(chain.folder / "climb" / "design.csv")
    figure, axes = figures.new_axes()
    good = runs["verdict"] == "ok"
    first = design.columns[-1]
    axes.errorbar(
        runs.loc[good, first], runs.loc[good, OBSERVABLE], runs.loc[good, "direction_error_deg"],
        fmt="o", color=figures.DARK, capsize=3, label="a heap, error over its silhouettes",
    )  # fmt: skip
    axes.axhspan(chain.plan.target - chain.plan.sd, chain.plan.target + chain.plan.sd, color=figures.LIGHT, alpha=0.5)
    axes.axhline(
        chain.plan.target, color=figures.ACCENT, label=f"measured {chain.plan.target:g} +- {chain.plan.sd:g} deg"
    )
    axes.set_xlabel(f"{NAMES[first]} (the others of the path move along)")
    axes.set_ylabel("repose angle / deg")
    axes.legend()
    return figure


def heap_figures(grains: Path, folder: Path) -> list[Path]:
    """A picture of a heap and one of its profile fit, from the file of its grains (x, y, z, radius in m)."""
    from matplotlib.collections import EllipseCollection

    x, y, z, radius = np.loadtxt(grains, delimiter=",", skiprows=1).T * 1e3
    figure, axes = figures.new_axes((6.4, 3.6))
    order = np.argsort(-y)  # the far ones first
    shade = (y - y.min()) / np.ptp(y)
    axes.add_collection(
        EllipseCollection(
            2 * radius[order], 2 * radius[order], np.zeros(len(x)), units="xy",
            offsets=np.column_stack([x, z])[order], transOffset=axes.transData,
            facecolors=[str(0.35 + 0.55 * (1 - s)) for s in shade[order]], edgecolors="black", linewidths=0.2,
        )
    )  # fmt: skip
    wide = 1.05 * np.percentile(np.hypot(x, y), 99)
    axes.set_ylim(-1, 1.25 * (z + radius).max())
    profile, profile_axes = figures.new_axes((6.4, 3.6))
    place, height = heap.silhouette(np.column_stack([x, y, z]), radius, 0.0)
    flanks = heap.fit_flanks(place, height)
    profile_axes.plot(place, height, color=figures.DARK, label="silhouette")
    for flank in flanks:
        ends = np.array([flank.start, flank.end])
        profile_axes.plot(
            ends, flank.height_at_0 + flank.slope * ends, color=figures.ACCENT, linewidth=2.5,
            label=f"straight line, {flank.angle_deg:.1f} deg",
        )  # fmt: skip
    profile_axes.legend()
    for each in (axes, profile_axes):
        each.set_xlim(-wide, wide)
        each.set_aspect("equal")
        each.set_xlabel("x / mm")
        each.set_ylabel("height / mm")
    return figures.save({"heap": figure, "heap_profile": profile}, folder)
