"""What the model explains and where it fails: the facts of the answers, laid out as parts of the page."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pellet_study.criticism import facts, figures, fit_facts
from pellet_study.criticism.curves import CURVE, LEVELS, ROWS
from pellet_study.criticism.grades import RULE
from pellet_study.output import style
from pellet_study.output.style import declared
from pellet_study.output.words import number, probability
from pellet_study.report.parts import Picture, Table, picture, table
from pellet_study.study.study import Study

DRAWN = {
    CURVE: "Lines: what each calibrated model predicts",
    LEVELS: "Dots, joined: what each calibrated model predicts at the measured levels, and only there",
    ROWS: "Dashes and crosses: what each calibrated model predicts for the row",
}
MOST_WORST = 8  # rows of the table of those predicted worst


@dataclass(frozen=True)
class ModelPart:
    """The present model: how well it fits, its constants, what it predicts."""

    fit: str
    parameters: Table
    pictures: list[Picture]


@dataclass(frozen=True)
class FailsPart:
    """Where the first and the last model fail, and the rows that the last one predicts worst."""

    words: list[str]
    pictures: list[Picture]
    rows: Table


@dataclass(frozen=True)
class LadderPart:
    """The error falling step by step."""

    pictures: list[Picture]
    steps: Table


def fit_sentence(comparison: dict[str, Any], held_out: bool = True) -> str:
    """How well a model fits, and how the rows held out stand to it."""
    judged = fit_facts.fit_words(comparison)
    if judged is None:
        return (
            "There are neither standard deviations nor replicates: how well it fits cannot be judged from these data."
        )
    beside = fit_facts.held_out_words(comparison) if held_out else ""
    said = [
        f"Rows held out: {beside}" if beside else "",
        f"Error of a row: {noise}" if (noise := fit_facts.noise_words(comparison)) else "",
        *(f"Scatter: {one['words']}" for one in comparison.get("scatter") or []),
    ]
    return " ".join(
        [
            f"chi² = {number(comparison['chi2'])} on {comparison['dof']}; {judged}.",
            *(f"{line}." for line in said if line),
        ]
    )


def model(
    study: Study, comparison: dict[str, Any], steps: Sequence[dict[str, Any]], diagnoses: Sequence[dict[str, Any]]
) -> ModelPart:
    """The model that was compared, with the models before it and those that the last diagnosis names."""
    rows = []
    units = comparison.get("units") or {}
    for constant in fit_facts.constants(comparison):
        text, unit = style.words(constant.name, units.get(constant.name, ""))
        interval = "fixed" if constant.interval is None else " to ".join(map(number, constant.interval))
        rows.append([text.replace(".", ": "), unit, number(constant.value), interval, ", ".join(constant.remarks)])
    return ModelPart(
        fit=f"Model: {facts.model_name(comparison['effects'])}. {fit_sentence(comparison)} Rule: {RULE}.",
        parameters=table(("constant", "unit", "value", "95 % interval", "remark"), rows, (2, 3)),
        pictures=[
            *readings(study, comparison, steps, diagnoses),
            picture(
                figures.predictions(comparison["rows"], comparison["effects"], study.acting()),
                "predicted against measured values, a panel for each observable",
                f"Each point a row of measurements.csv, predicted by {facts.model_name(comparison['effects'])}; on the line, "
                "prediction and measurement are equal."
                + (" Bars: ± 2 standard uncertainties of the row." if any(r["z"] for r in comparison["rows"]) else ""),
            ),
        ],
    )


def readings(
    study: Study, comparison: dict[str, Any], steps: Sequence[dict[str, Any]], diagnoses: Sequence[dict[str, Any]]
) -> list[Picture]:
    """The readings and the models through them; none where an older version left no curves."""
    told = [*steps, comparison, *diagnoses[-1:]]
    curves = [c for part in told for c in part.get("curves", []) if _same_rows(c, comparison)]
    if not curves:
        return []
    panels = curves[0]["panels"]
    held = any(row["split"] == "holdout" for row in comparison["rows"])
    repeated = any(len(set(panel["levels"])) < len(panel["levels"]) for panel in panels)
    known = any(u is not None for panel in panels for u in panel["uncertainties"])
    caption = (
        "Points: the readings of measurements.csv"
        + (", those held out from the fit open" if held else "")
        + (", with ± 2 standard uncertainties" if known else "")
        + ("; those of one level stand side by side. " if repeated else ". ")
        + "; ".join(dict.fromkeys(DRAWN[panel["drawn"]] for panel in panels))
        + ". The other conditions stand above each panel."
    )
    figure = figures.readings(comparison["rows"], curves, study.acting())
    return [picture(figure, "readings against the condition, and each model through them", caption)]


def _same_rows(curves: dict[str, Any], comparison: dict[str, Any]) -> bool:
    """Whether curves are of as many rows, rig by rig, as a comparison has now."""
    rows = comparison["rows"]
    places = [(k, panel) for panel in curves["panels"] for k in panel["rows"]]
    return len(places) == len(rows) and all(
        k < len(rows) and rows[k]["rig"] == panel["rig"] and rows[k]["observable"] == panel["observable"]
        for k, panel in places
    )


def fails(study: Study, steps: Sequence[dict[str, Any]], diagnoses: Sequence[dict[str, Any]]) -> FailsPart:
    """Where the models fail, of one comparison or more, the first and the last in words."""
    words = []
    for step in dict.fromkeys((0, len(steps) - 1)):
        failing = "; ".join(fit_facts.where_words(steps[step]))
        words.append(f"Model {facts.model_name(steps[step]['effects'])}: {failing}.")
    known = all(row["z"] is not None for step in (steps[0], steps[-1]) for row in step["rows"])
    scale, band = (
        ", over the standard uncertainty of the row",
        "In the band the uncertainty of a row, by readings and simulations, explains it. ",
    )
    pictures = [
        picture(
            figures.residuals(steps, study.acting()),
            "residual against every condition",
            f"Measured minus predicted{scale if known else ''}. {band if known else ''}"
            "A model that lacks nothing scatters about 0 without a trend.",
        )
    ]
    drawn = next((d["by_level"] for d in diagnoses if d.get("by_level")), None)
    if drawn:
        pictures.append(
            picture(
                figures.constants(drawn, study.acting()),
                f"{drawn['parameter']} refitted at each level of {drawn['condition']}",
                "A constant of nature does not change with a condition of the test. Points: what each level alone would "
                "make of it, ± 2 standard errors."
                + (" Lines: what a missing effect would make of it." if drawn["rivals"] else ""),
            )
        )
    return FailsPart(words, pictures, worst_rows(steps[-1]))


def worst_rows(comparison: dict[str, Any]) -> Table:
    """The rows that a model predicts worst."""
    varying, known = facts.varying(comparison["rows"]), comparison.get("units") or {}
    worst = sorted(comparison["rows"], key=facts.misfit, reverse=True)[:MOST_WORST]
    rows = [
        [
            row["rig"],
            "; ".join(
                f"{declared(c, row.get('units') or known)} {number(v)}"
                for c, v in row["conditions"].items()
                if c in varying[row["rig"]]
            ),
            {"fit": "", "holdout": "held out"}[row["split"]],
            number(row["value"]),
            number(row["predicted"]),
            "-" if row["z"] is None else f"{row['z']:.1f}",
        ]
        for row in worst
    ]
    head = ("rig", "conditions", "split", "measured", "predicted", "residual / uncertainty")
    return table(head, rows, (3, 4, 5), f"The rows that {facts.model_name(comparison['effects'])} predicts worst")


def ladder(study: Study, steps: Sequence[dict[str, Any]], diagnoses: Sequence[dict[str, Any]]) -> LadderPart:
    """The error falling step by step."""
    rows = [
        [
            step.number,
            facts.model_name(step.effects),
            number(step.chi2),
            step.dof,
            probability(step.lack_of_fit_p),
            number(step.rms_error, 3),
            number(step.holdout_rms_error, 3),
            number(step.noise_floor, 3),
        ]
        for step in facts.ladder(steps)
    ]
    unit = style.unit_in_words(steps[-1]["rms_error_unit"])
    last = [d for d in diagnoses[-1:] if d["effects"] == steps[-1]["effects"]]
    tied = [rival for diagnosis in last for rival in figures.tied_errors(diagnosis)]
    return LadderPart(
        pictures=[
            picture(
                figures.ladder(steps, tied, study.acting()),
                "rms error after each step",
                _ladder_caption(steps, bool(tied)),
            )
        ],
        steps=table(
            ("step", "model", "chi²", "dof", "lack of fit p", f"rms error ({unit})", "held out", "noise floor"),
            rows,
            (0, 2, 3, 4, 5, 6, 7),
        ),
    )


def _ladder_caption(steps: Sequence[dict[str, Any]], tied: bool) -> str:
    """How to read the ladder: of the curves that are drawn."""
    unseen = any(s["holdout_rms_error"] is not None or s.get("level_out_rms_error") for s in steps)
    words = [
        "The error of each model on the rows it was fitted to" + (" and on rows it has not seen." if unseen else ".")
    ]
    if steps[-1].get("noise_floor") is not None:
        words.append(
            "In the band, below the median uncertainty of a row, a model would only follow the scatter of readings and simulations."
        )
    if tied:
        words.append("Right of the line: what each of the tied explanations alone would make of it.")
    return " ".join(words)
