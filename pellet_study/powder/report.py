"""What `calibrate` found, as figures, text and JSON."""

from dataclasses import replace
from pathlib import Path

import pandas as pd

from pellet_study.doe import figures
from pellet_study.doe.answers import plain
from pellet_study.heap import render
from pellet_study.powder import figures as powder_figures
from pellet_study.powder.chain import Chain
from pellet_study.powder.decisions import STAGES
from pellet_study.powder.plan import NAMES, RIG, Plan
from pellet_study.powder.text import levels, summary
from pellet_study.rigs import on_yade


def answer(decisions: dict[str, dict]) -> dict:
    """The stages as JSON."""
    return plain(
        {
            "stages": [{"stage": stage, **decision} for stage, decision in decisions.items()],
            "optimum": decisions.get("optimum"),
            "validation": decisions.get("validation"),
        }
    )


def path_answer(decision: dict) -> dict:
    """A calibration in few heaps as JSON."""
    return plain({"stages": [{"stage": "path", **decision}], "optimum": decision, "validation": None})


def text_of_path(plan: Plan, decision: dict) -> str:
    """A calibration in few heaps in words."""
    lost = f", {decision['lost']} of them gave no angle" if decision["lost"] else ""
    lines = [
        f"Powder calibration in few heaps, contact law {plan.contact_law}, target {plan.target:g} deg",
        f"{levels(decision)}: {decision['predicted_deg']:.2f} +- {decision['standard_error_deg']:.2f} deg by a straight line through "
        f"{decision['path_heaps'] - decision['path_lost']} heaps on the path ({decision['heaps']} in all{lost})",
    ]
    lines += plan.remarks
    if not decision["enough"]:
        lines.append(
            f"stopped at the most heaps it takes on the path, {decision['path_heaps']}: the standard error is above the "
            f"{decision['wanted_error_deg']:g} deg wanted"
        )
    if not decision["met"]:
        lines.append("the path ends before it meets the target: this is its nearest point")
    lines.append("nothing is validated by heaps of its own here; `calibrate` without --few does that")
    return "\n".join(lines)


def write_path(chain: Chain, decision: dict) -> str:
    """Draw the path of a calibration in few heaps, write its summary; returns it."""
    folder = chain.folder / "path"
    runs = pd.read_csv(folder / "runs.csv")
    path = runs[(runs["stage"] == "path") & (runs["verdict"] == "ok")]
    figures.save({"path": powder_figures.path(path, decision, (chain.plan.target, chain.plan.sd))}, folder)
    text = text_of_path(chain.plan, decision)
    (folder / "summary.txt").write_text(text + "\n", encoding="utf-8")
    return text + f"\n\nresults in {folder}"


def write(chain: Chain, decisions: dict[str, dict]) -> str:
    """Draw what was analysed in this call, write the summary; returns it."""
    drawn: dict[str, dict] = {}
    if hasattr(chain, "screened"):
        drawn["screening"] = {
            "pareto": figures.pareto(chain.screened, "deg"),
            "half_normal": figures.half_normal(chain.screened.effects, chain.screened.lenth, "deg"),
        }
    if chain.done("climb"):
        runs = pd.read_csv(chain.folder / "climb" / "runs.csv")
        good = runs[runs["verdict"] == "ok"]
        measured = (chain.plan.target, chain.plan.sd)
        drawn["climb"] = {"climb": powder_figures.climb(good, decisions["climb"]["factors"], measured)}
    if hasattr(chain, "targeted"):
        surface = chain.targeted.surface
        drawn["optimum"] = {"surface": figures.surface_contours(surface, chain.targeted, "deg")}
        drawn["surface"] = {"predicted_observed": figures.predicted_observed(surface, "deg")}
    for stage, pictures in drawn.items():
        figures.save(pictures, chain.folder / stage)
    if chain.grains.exists() and chain.done("validation"):
        draw_heap(chain.grains, chain.folder / "figures")
    return write_summary(chain, decisions) + f"\n\nresults in {chain.folder}"


def write_summary(chain: Chain, decisions: dict[str, dict]) -> str:
    """Write summary.txt, and laws.csv where both contact laws have an answer; returns the summary."""
    text = text_of(chain, decisions)
    both = laws(chain)
    if both is None:
        (chain.folder / "laws.csv").unlink(missing_ok=True)
    else:
        both.to_csv(chain.folder / "laws.csv", index=False, lineterminator="\n")
        text += "\n\nboth contact laws, effects in deg:\n" + both.to_string(index=False, na_rep="")
    (chain.folder / "summary.txt").write_text(text + "\n", encoding="utf-8")
    return text


def text_of(chain: Chain, decisions: dict[str, dict]) -> str:
    """The chain in words: each stage, what the law cannot do, the paper beside."""
    plan = chain.plan
    lines = [
        f"Powder calibration on the repose rig, contact law {plan.contact_law}, target {plan.target:g} +- {plan.sd:g} deg"
    ]
    for stage in STAGES:
        if stage in decisions:
            read = "" if chain.home(stage) == chain.folder else f" (read from {chain.decisions_from})"
            lines.append(f"{stage:11s}{read} {summary(stage, decisions[stage])}")
        elif home := chain.home(stage):
            lines.append(f"{stage:11s} not done for this plan; left out: {chain.differs(home, stage)}")
        else:
            lines.append(f"{stage:11s} not done yet")
    lines += plan.remarks
    for name, why in plan.idle.items():
        lines.append(f"{name} ({NAMES[name]}): {why}")
    if chain.done("screening"):
        file = chain.folder / "screening" / "effects.csv"
        lines += ["", "effects (change of the angle from the low to the high level) beside the paper's Table 8, deg:"]
        for row in pd.read_csv(file).itertuples():
            lines.append(
                f"  {row.factor} {NAMES[row.factor]:33s} {row.effect_deg:+6.2f} +- {row.standard_error_deg:.2f}   paper "
                f"{row.paper_effect_deg:+6.2f}   {row.sign}"
            )
    if chain.done("surface"):
        file = chain.folder / "surface" / "coefficients.csv"
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


def laws(chain: Chain) -> pd.DataFrame | None:
    """The answers of both contact laws side by side; None where the other's, for the same plan, are not in FOLDER/LAW.

    Returns
    -------
    A row a factor: effect and standard error of each law and the paper's effect (deg), then each law's setting that
    meets the target, and whether an effect is beyond two standard errors.
    """
    other = next(law for law in on_yade.rig(RIG).contact_laws if law != chain.plan.contact_law)
    beside = replace(chain, plan=replace(chain.plan, contact_law=other), folder=chain.folder / other)
    if not (chain.done("screening") and beside.done("screening")):
        return None
    table = pd.DataFrame({"factor": list(NAMES)})
    for one in (chain, beside):
        law = one.plan.contact_law
        effects = pd.read_csv(one.folder / "screening" / "effects.csv").set_index("factor").loc[table["factor"]]
        table[f"{law}_effect"] = effects["effect_deg"].round(2).to_numpy()
        table[f"{law}_error"] = effects["standard_error_deg"].round(2).to_numpy()
        table[f"{law}_sign"] = effects["sign"].to_numpy()
        if one.done("optimum"):
            point = one.decision("optimum")["point"]
            table[f"{law}_optimum"] = [round(point[name], 4) for name in table["factor"]]
    table["paper_effect"] = effects["paper_effect_deg"].to_numpy()
    return table


def draw_heap(grains: Path, folder: Path) -> None:
    """A picture of a heap and one of its profile fit, as the source paper's Figures 9 and 10."""
    from matplotlib.image import imsave

    centres, radii = render.read_grains(grains)
    folder.mkdir(parents=True, exist_ok=True)
    imsave(folder / "heap.png", render.picture(*render.without_strays(centres, radii), width=1000))
    figures.save({"heap_profile": render.profile(centres, radii)}, folder)
