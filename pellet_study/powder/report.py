"""What `calibrate` found, as figures, text and JSON."""

import io
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from pellet_study.doe import figures
from pellet_study.doe.answers import plain
from pellet_study.files import opening, writing
from pellet_study.heap import render
from pellet_study.output.words import probability
from pellet_study.powder import few_heaps
from pellet_study.powder import figures as powder_figures
from pellet_study.powder.chain import Chain
from pellet_study.powder.decisions import STAGES, Climb, Optimum, PathSetting, Surface
from pellet_study.powder.plan import NAMES, RIG, Plan
from pellet_study.powder.results import Results
from pellet_study.powder.text import joint_lines, levels, summary
from pellet_study.rigs import on_yade
from pellet_study.rigs.declared import Condition
from pellet_study.rigs.known import ON_A_BASE
from yade_scripts import heap

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def answer(results: Results) -> dict[str, Any]:
    """The stages as JSON, each as it stands in its file."""
    decided = results.as_written()
    return plain(
        {
            "stages": [{"stage": stage, **decision} for stage, decision in decided.items()],
            "optimum": decided.get("optimum"),
            "validation": decided.get("validation"),
        }
    )


def path_answer(setting: PathSetting) -> dict[str, Any]:
    """A calibration in few heaps as JSON."""
    decided = asdict(setting)
    validation = decided.pop("validation")
    return plain({"stages": [{"stage": "path", **decided}], "optimum": decided, "validation": validation})


def text_of_path(plan: Plan, setting: PathSetting) -> str:
    """A calibration in few heaps in words, the verdict first."""
    tested, screened = setting.validation, setting.heaps - setting.path_heaps
    low, high = tested.interval_deg
    lost = f"; {setting.lost} of them gave no angle" if setting.lost else ""
    stay = [f.name for f in plan.factors if f.name not in setting.factors]
    lines = [
        path_verdict(plan, setting),
        f"setting      {levels(setting.point, setting.factors, setting.outside)}; Bond number {tested.bond_number:.2f}"
        + (f"; {', '.join(stay)} in the middle of their ranges" if stay else ""),
        f"heaps        {setting.heaps}: {screened} of the screening, {setting.path_heaps} on the path{lost}",
        f"{plan.observable} there {setting.predicted_deg:.2f} +- {setting.standard_error_deg:.2f} deg (95 % {low:.2f} to {high:.2f}) by the line "
        f"through the heaps on the path, which scatter by {setting.scatter_deg:.2f} deg; measured {plan.target:g}",
        f"two one-sided tests: p {probability(tested.p_tost)}, each at {few_heaps.LEVEL:g}, as the heaps that are tested have placed the setting; contact law "
        f"{plan.contact_law}",
    ]
    if plan.others:
        unused = ", ".join(one.observable for one in plan.others)
        lines.append(f"{unused} was measured too and is not used here; calibrate without --few meets all readings")
    return "\n".join([*lines, *plan.remarks])


def path_verdict(plan: Plan, setting: PathSetting) -> str:
    """Whether the setting is shown equivalent, and why not: the first sentence."""
    tested = setting.validation
    within = f"{plan.target:g} deg within {tested.margin_deg:g} deg"
    if tested.equivalent:
        return f"Few heaps: shown equivalent to {within}, by the heaps that placed the setting."
    no = f"Few heaps: not shown equivalent to {within}: "
    if not setting.met:
        return (
            no
            + f"the path ends before it meets the target, at {setting.predicted_deg:.2f} deg; this is its nearest point."
        )
    if not tested.attainable:
        return no + "the measured angle is of so few readings that no number of heaps could show it."
    if setting.needed_heaps > few_heaps.MOST:
        return no + (
            f"heaps at one point differ by {setting.scatter_deg:.2g} deg, with which that takes {setting.needed_heaps} heaps or more, and --few "
            f"has {few_heaps.MOST} at most."
        )
    return no + f"it has stopped at the most heaps it takes, {few_heaps.MOST}."


def write_path(results: Results, setting: PathSetting) -> str:
    """Draw the path of a calibration in few heaps, write its summary; returns it."""
    plan, folder = results.plan, results.folder / "path"
    runs = pd.read_csv(opening.stream(folder / "runs.csv"))
    path = runs[(runs["stage"] == "path") & (runs["verdict"] == "ok")]
    figures.save({"path": powder_figures.path(path, setting, (plan.target, plan.sd))}, folder)
    text = text_of_path(plan, setting)
    writing.text(folder / "summary.txt", text + "\n")
    return text + f"\n\nresults in {folder}"


def write(chain: Chain) -> str:
    """Draw what was analysed in the chain's last call, write the summary; returns it."""
    results = chain.results
    for stage, pictures in drawn(chain).items():
        figures.save(pictures, results.folder / stage)
    if results.grains.exists() and results.done("validation"):
        draw_heap(results.grains, results.folder / "figures", base_radius(results.plan.conditions))
    return write_summary(results) + f"\n\nresults in {results.folder}"


def drawn(chain: Chain) -> dict[str, dict[str, "Figure"]]:
    """{stage: {name: figure}} of the stages analysed in the chain's last call, and of the climb."""
    results = chain.results
    found: dict[str, dict[str, Figure]] = {}
    if screened := chain.screened:
        found["screening"] = {
            "pareto": figures.pareto(screened, "deg"),
            "half_normal": figures.half_normal(screened.effects, screened.lenth, "deg"),
        }
    if results.done("climb"):
        runs = pd.read_csv(opening.stream(results.folder / "climb" / "runs.csv"))
        good = runs[runs["verdict"] == "ok"]
        climbed: Climb = results.decision("climb")
        measured = (results.plan.target, results.plan.sd)
        found["climb"] = {"climb": powder_figures.climb(good, climbed.factors, measured)}
    if target := chain.targeted:
        found["optimum"] = {"surface": figures.surface_contours(target.surface, target, "deg")}
        found["surface"] = {"predicted_observed": figures.predicted_observed(target.surface, "deg")}
    if identified := chain.identified:
        found["optimum"]["corner"] = powder_figures.corner(
            identified.all, identified.first, results.plan.observable, identified.setting
        )
    return found


def write_summary(results: Results) -> str:
    """Write summary.txt, and laws.csv where both contact laws have an answer; returns the summary."""
    text = text_of(results)
    both = laws(results)
    if both is None:
        writing.remove(results.folder / "laws.csv")
    else:
        writing.table(results.folder / "laws.csv", both)
        text += "\n\nboth contact laws, effects in deg:\n" + both.to_string(index=False, na_rep="")
    writing.text(results.folder / "summary.txt", text + "\n")
    return text


def text_of(results: Results) -> str:
    """The chain in words: each stage, what the law cannot do, the paper beside."""
    plan = results.plan
    lines = [
        f"Powder calibration on the repose rig, contact law {plan.contact_law}, target {plan.observable} {plan.target:g} +- {plan.sd:g} deg"
    ]
    lines += stage_lines(results)
    lines += plan.remarks
    if results.done("optimum") and (joint := results.decision("optimum").joint):
        lines += joint_lines(joint)
    lines += [f"{name} ({NAMES[name]}): {why}" for name, why in plan.idle.items()]
    if results.done("screening"):
        table = pd.read_csv(opening.stream(results.folder / "screening" / "effects.csv"))
        lines += effects_lines(table, plan.observable)
        readings = results.folder / "screening" / "readings.csv"  # release 0.1 wrote none
        lines += readings_lines(pd.read_csv(opening.stream(readings))) if readings.exists() else []
    if results.done("surface"):
        lines += coefficients_lines(pd.read_csv(opening.stream(results.folder / "surface" / "coefficients.csv")))
    if "surface" in results.counting():
        surface: Surface = results.decision("surface")
        words = [", ".join(f"{k} {low:g} to {high:g}" for k, (low, high) in box.items()) for box in surface.boxes]
        lines += ["", f"box{'es, in order' if len(words) > 1 else ''}: " + "; ".join(words)]
    return "\n".join(lines)


def stage_lines(results: Results) -> list[str]:
    """A line a stage: what it decided and where that was read, or why there is nothing."""
    decisions, lines = results.decisions(), []
    for stage in STAGES:
        home = results.home(stage)
        if stage in decisions:
            read = "" if home == results.folder else f" (read from {results.decisions_from})"
            lines.append(f"{stage:11s}{read} {summary(decisions[stage])}")
        elif home:
            lines.append(f"{stage:11s} not done for this plan; left out: {results.differs(home, stage)}")
        else:
            lines.append(f"{stage:11s} not done yet")
    return lines


def effects_lines(effects: pd.DataFrame, observable: str) -> list[str]:
    """The table of effects on the angle that steers beside the paper's, which was read at flanks."""
    lines = [
        "",
        f"effects (change of {observable} from the low to the high level), deg; the paper's (Table 8) are of flanks:",
    ]
    for row in effects.itertuples():
        lines.append(
            f"  {row.factor} {NAMES[row.factor]:33s} {row.effect_deg:+6.2f} +- {row.standard_error_deg:.2f}   paper "
            f"{row.paper_effect_deg:+6.2f}   {row.sign}"
        )
    return lines


def readings_lines(readings: pd.DataFrame) -> list[str]:
    """The effects by each reading of the same heaps, a line a reading."""
    lines = [
        "",
        "the same heaps by each reading, in its unit: effects and their standard error, scatter of heaps at one point:",
    ]
    for reading, rows in readings.groupby("reading", sort=False):
        first = rows.iloc[0]
        digits = 2 if rows["standard_error"].max() > 0.1 else 4
        effects = "  ".join(f"{row.factor} {row.effect:+.{digits}f}" for row in rows.itertuples())
        scatter = "" if pd.isna(first["scatter"]) else f", scatter {first['scatter']:.{digits}f}"
        lines.append(f"  {reading:24s} {effects}  +- {rows['standard_error'].max():.{digits}f}{scatter}")
    return lines


def coefficients_lines(coefficients: pd.DataFrame) -> list[str]:
    """The table of the surface's coefficients beside the paper's."""
    lines = [
        "",
        "coefficients of the surface (coded in our box), deg; the paper's are of flanks in its own box, B reversed:",
    ]
    for row in coefficients.itertuples():
        theirs = "" if pd.isna(row.paper_coefficient_deg) else f"   paper {row.paper_coefficient_deg:+7.3f}"
        clear = "" if row.beyond_two_errors else "   below two standard errors"
        lines.append(f"  {row.term:3s} {row.coefficient_deg:+8.3f} +- {row.standard_error_deg:.3f}{theirs}{clear}")
    return lines


def laws(results: Results) -> pd.DataFrame | None:
    """The answers of two contact laws side by side; None where another's, for the same plan, are not in FOLDER/LAW.

    Returns
    -------
    A row a factor: effect and standard error of each law and the paper's effect (deg), then each law's setting that
    meets the target, and whether an effect is beyond two standard errors.
    """
    others = (law for law in on_yade.rig(RIG).contact_laws if law != results.plan.contact_law)
    each = (replace(results, plan=replace(results.plan, contact_law=o), folder=results.folder / o) for o in others)
    beside = next((one for one in each if one.done("screening")), None)
    if beside is None or not results.done("screening"):
        return None
    table = pd.DataFrame({"factor": [f.name for f in results.plan.factors]})
    for one in (results, beside):
        law = one.plan.contact_law
        effects = (
            pd.read_csv(opening.stream(one.folder / "screening" / "effects.csv"))
            .set_index("factor")
            .loc[table["factor"]]
        )
        table[f"{law}_effect"] = effects["effect_deg"].round(2).to_numpy()
        table[f"{law}_error"] = effects["standard_error_deg"].round(2).to_numpy()
        table[f"{law}_sign"] = effects["sign"].to_numpy()
        if one.done("optimum"):
            best: Optimum = one.decision("optimum")
            table[f"{law}_optimum"] = [round(best.point[name], 4) for name in table["factor"]]
    table["paper_effect"] = effects["paper_effect_deg"].to_numpy()
    return table


def base_radius(conditions: Mapping[str, Condition]) -> float | None:
    """Radius of the disc that the heaps of these conditions lie on, m; None for an endless plate."""
    return 0.5e-3 * float(conditions["base_diameter_mm"]) if conditions["protocol"] in ON_A_BASE else None


def draw_heap(grains: Path, folder: Path, base: float | None) -> None:
    """A picture of a heap and one of its profile fit, as the source paper's Figures 9 and 10; `base` as `base_radius` has it."""
    from matplotlib.image import imsave

    centres, radii = render.read_grains(grains)
    picture = io.BytesIO()
    imsave(picture, render.picture(*heap.body(centres, radii), width=1000), format="png")
    writing.data(folder / "heap.png", picture.getvalue(), ours=writing.is_picture)
    figures.save({"heap_profile": render.profile(centres, radii, base)}, folder)
