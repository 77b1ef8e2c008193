<<<<<<< HEAD
"""Figures, in one look: colour-blind safe, readable in grey, units on every axis."""

from pathlib import Path

import numpy as np

COLOURS = {"model": "#0072B2", "measured": "#D55E00", "paper": "#555555"}  # Okabe & Ito's palette
LABELS = {
    "rebound_height_mm": "rebound height (mm)",
    "slip_angle_deg": "slip angle (deg)",
    "roll_distance_mm": "rolling distance (mm)",
    "seed_powder_restitution": "restitution seed-powder $a_1$ (-)",
    "seed_powder_static_friction": "static friction seed-powder $a_2$ (-)",
    "seed_powder_rolling_friction": "rolling friction seed-powder $a_3$ (-)",
}


def axes(width: float = 5.2, height: float = 3.8):
    """A figure with one pair of axes in the project's look."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    ax = figure.add_subplot()
    ax.spines[["top", "right"]].set_visible(False)
    return figure, ax


def save(figure, file: Path) -> Path:
    """Write a figure as PNG, the same bytes for the same content."""
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=150, metadata={"Software": None})
    return file


def sweep(result, paper_x=None, paper_y=None, paper_curve=None):
    """A bench sweep: level means, parabola with its 95 % band, measurement and root, the paper's curve beside.

    Parameters
    ----------
    result : bench.Calibrated
    paper_x, paper_y : the paper's printed rows, where there are any
    paper_curve : quadratic.Quadratic through them
    """
    from scipy.stats import t

    stage, curve = result.stage, result.curve
    figure, ax = axes()
    x = np.linspace(curve.low, curve.high, 200)
    band = t.ppf(0.975, curve.residual_df) * curve.standard_error(x)
    ax.fill_between(x, curve.at(x) - band, curve.at(x) + band, color=COLOURS["model"], alpha=0.2, lw=0)
    ax.plot(x, curve.at(x), color=COLOURS["model"], label=f"fit, $R^2$ = {curve.r2:.4f} (band 95 %)")
    ax.errorbar(
        result.sweep[stage.parameter],
        result.sweep[stage.observable],
        2 * result.sweep["standard_error"],
        fmt="o",
        color=COLOURS["model"],
        capsize=2,
        label="YADE, mean over seeds $\\pm$ 2 s.e.",
    )
    if paper_curve is not None:
        ax.plot(paper_x, paper_y, "s", mfc="none", color=COLOURS["paper"], label="source paper (EDEM)")
        ax.plot(x, paper_curve.at(x), ":", color=COLOURS["paper"])
    ax.axhline(
        result.reading.value, color=COLOURS["measured"], ls="--", lw=1.2, label=f"measured {result.reading.value:g}"
    )
    if result.value is not None:
        ax.axvline(result.value, color=COLOURS["measured"], lw=0.8)
        ax.axvspan(*result.interval, color=COLOURS["measured"], alpha=0.12, lw=0)
        ax.plot([result.value], [result.reading.value], "*", ms=13, color=COLOURS["measured"], mec="black", mew=0.5,
                label=f"root {stage.symbol} = {result.value:.4f}")  # fmt: skip
    ax.set_xlabel(LABELS[stage.parameter])
    ax.set_ylabel(LABELS[stage.observable])
    ax.legend(fontsize=7.5, frameon=False)
    return figure
=======
"""Figures of model criticism; drawn only when asked for."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from pellet_study.compare import Calibrated, Comparison
from pellet_study.diagnose import Diagnosis
from pellet_study.pages import number


def ladder(steps: Sequence[dict], file: Path) -> None:
    """The error after each step, down to what the scatter of the readings leaves."""
    figure, axis = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
    at = np.arange(len(steps))
    for key, label, marker in (
        ("rms_error", "fitted rows", "o"),
        ("holdout_rms_error", "held-out rows", "s"),
    ):
        values = [np.nan if s[key] is None else s[key] for s in steps]
        if not np.all(np.isnan(values)):
            axis.plot(at, values, marker=marker, label=label)
    unit = steps[-1].get("rms_error_unit", "")
    if unit == "standard uncertainties":
        axis.axhline(1.0, color="0.5", linestyle=":", label="noise floor")
    names = ["base" if not s["effects"] else "+ " + "\n+ ".join(s["effects"]) for s in steps]
    axis.set_xticks(at, names, fontsize=8)
    axis.set_xlim(-0.4, len(steps) - 0.6)
    axis.set_ylim(bottom=0)
    axis.set_ylabel(f"rms error ({unit})")
    axis.legend(frameon=False)
    figure.savefig(file, dpi=150)
    plt.close(figure)


def residuals(found: Comparison, file: Path) -> None:
    """Residual of every row over each condition that varies."""
    panels = []
    for rig in dict.fromkeys(r.row.rig for r in found.rows):
        mine = [r for r in found.rows if r.row.rig == rig]
        for condition in mine[0].row.conditions:
            if len({r.row.conditions[condition] for r in mine}) > 1:
                panels.append((rig, condition, mine))
    if not panels:
        return
    columns = min(3, len(panels))
    lines = -(-len(panels) // columns)
    figure, axes = plt.subplots(
        lines, columns, figsize=(3.4 * columns, 2.8 * lines), squeeze=False, layout="constrained"
    )
    known = all(r.z is not None for r in found.rows)
    for axis in axes.flat[len(panels) :]:
        axis.set_visible(False)
    for axis, (rig, condition, mine) in zip(axes.flat, panels, strict=False):
        for split, fill in (("fit", "C0"), ("holdout", "none")):
            rows = [r for r in mine if r.row.split == split]
            axis.scatter(
                [r.row.conditions[condition] for r in rows], [r.z if known else r.residual for r in rows],
                facecolors=fill, edgecolors="C0", s=22, label="fitted" if split == "fit" else "held out",
            )  # fmt: skip
        axis.axhline(0, color="0.5", linewidth=0.8)
        if known:
            axis.axhspan(-2, 2, color="0.92", zorder=0)
        axis.set_xlabel(condition)
        axis.set_ylabel("residual / standard uncertainty" if known else "residual", fontsize=8)
        axis.set_title(rig, fontsize=9)
    figure.savefig(file, dpi=150)
    plt.close(figure)


def ranking(found: Diagnosis, file: Path) -> None:
    """chi2 that each candidate takes away; hatched where its size is implausible, grey where the data cannot show it."""
    suspects = [s for s in found.ranking][::-1]
    if not suspects:
        return
    figure, axis = plt.subplots(figsize=(6.4, 0.8 + 0.36 * len(suspects)), layout="constrained")
    for k, s in enumerate(suspects):
        hidden = s.score is None
        axis.barh(
            k,
            s.chi2_drop,
            color="0.8" if hidden or s.note else "C0",
            hatch="//" if s.note == "implausible size" else None,
        )
        size = ", ".join(f"{n} = {number(v, 3)}" for n, v in s.value.items())
        axis.text(s.chi2_drop, k, f"  {s.note or size}", va="center", fontsize=7)
    best = max(s.chi2_drop for s in suspects)
    axis.axvspan(best - 4, best, color="C1", alpha=0.2, label="ties with the best")
    axis.set_yticks(range(len(suspects)), [s.effect for s in suspects], fontsize=8)
    axis.set_xlim(0, 1.6 * max(best, 1.0))
    axis.set_xlabel("chi2 drop on refitting")
    axis.legend(frameon=False, fontsize=8, loc="lower right")
    figure.savefig(file, dpi=150)
    plt.close(figure)


def constants(state: Calibrated, found: Diagnosis, file: Path) -> None:
    """The most drifting constant refitted level by level, with what each of the best rivals makes of it."""
    if not found.comparison.drifts:
        return
    worst = next((d for d in found.comparison.drifts if d.condition != "rig"), None)
    if worst is None:
        return
    model, evidence, fitted = state.model, state.evidence, state.fit
    column = [model.names[c] for c in fitted.problem.free].index(worst.parameter)
    cells = [model.cases[c] for c in evidence.case]
    mine = np.array([c.rig == worst.rig for c in cells])
    level = np.array([c.conditions.get(worst.condition, np.nan) for c in cells])
    slope = fitted.jacobian[:, column]
    levels = np.unique(level[mine])

    def by_level(residual):
        """Constant at each level: one Gauss-Newton step from the fitted value, and its standard error."""
        values, errors = [], []
        for x in levels:
            here = mine & (level == x)
            weight = (slope[here] ** 2).sum()
            values.append(fitted.values[column] + (slope[here] * residual[here]).sum() / weight)
            errors.append(1 / np.sqrt(weight))
        return np.array(values), np.array(errors)

    figure, axis = plt.subplots(figsize=(6.0, 3.8), layout="constrained")
    values, errors = by_level(fitted.residual)
    axis.errorbar(levels, values, errors, fmt="ko", capsize=3, label="measured")
    axis.axhline(fitted.values[column], color="0.5", linestyle=":", label="present model")
    base = model.predict(fitted.point).mean[0, evidence.case]
    singles = [r for r in found.rivals if r.fit.chi2 < fitted.chi2 - 4][:4]
    for rival in singles:
        there = model.predict(rival.fit.point).mean[0, evidence.case]
        axis.plot(levels, by_level(evidence.whitened(there - base))[0], label=" + ".join(rival.effects))
    axis.set_xlabel(worst.condition)
    axis.set_ylabel(worst.parameter)
    axis.set_title(f"{worst.rig}: one constant, refitted level by level", fontsize=9)
    axis.legend(frameon=False, fontsize=8)
    figure.savefig(file, dpi=150)
    plt.close(figure)
>>>>>>> effects
