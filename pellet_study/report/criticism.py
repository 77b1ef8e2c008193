"""What the model explains and what it lacks, as parts of the page."""

from collections.abc import Sequence

from pellet_study.criticism import figures
from pellet_study.criticism.facts import fit_words
from pellet_study.output import style
from pellet_study.output.style import label
from pellet_study.output.words import number, probability
from pellet_study.report.parts import picture, table
from pellet_study.study.study import Study


def _fit_words(told: dict) -> str:
    judged = fit_words(told)
    if judged is None:
        return (
            "There are neither standard deviations nor replicates: how well it fits cannot be judged from these data."
        )
    return (
        f"chi² = {number(told['chi2'])} on {told['dof']}, lack of fit p {probability(told['lack_of_fit_p'])}: {judged}."
    )


def _model(told: dict | None) -> dict | None:
    if told is None:
        return None
    rows = []
    for name, value in told["parameters"].items():
        text, unit = style.words(name.replace(".", ": "))
        limits = told["intervals"].get(name)
        remark = [
            w
            for w, names in (("not identified", "not_identified"), ("at its bound", "at_bound"))
            if name in told[names]
        ]
        rows.append(
            [
                text,
                unit,
                number(value),
                "fixed" if limits is None else " to ".join(map(number, limits)),
                ", ".join(remark),
            ]
        )
    shown = told["rows"]
    return {
        "fit": f"Model: {figures.model_name(told['effects'])}. {_fit_words(told)}",
        "parameters": table(("constant", "unit", "value", "95 % interval", "remark"), rows, (2, 3)),
        "pictures": [
            picture(
                figures.predictions(shown),
                "predicted against measured values, a panel for each observable",
                "Each point a row of measurements.csv; on the line, prediction and measurement are equal.",
            )
        ],
    }


def _fails(compared: dict | None, steps: Sequence[dict], diagnoses: Sequence[dict]) -> dict | None:
    shown = list(steps) or ([compared] if compared else [])
    if not shown:
        return None
    found = []
    for step in dict.fromkeys((0, len(shown) - 1)):
        told = shown[step]
        failing = [d["words"] for d in told["where"] if d["p"] < 0.01]
        name = f"Model {figures.model_name(told['effects'])}: "
        found.append(
            name + ("; ".join(failing) + "." if failing else "no calibrated constant drifts with a condition.")
        )
    pictures = [
        picture(
            figures.residuals(shown),
            "residual over its uncertainty against every condition",
            "Measured minus predicted, over the standard uncertainty of the row. In the band the scatter of the readings "
            "explains it. A model that lacks nothing scatters about 0 without a trend.",
        )
    ]
    drawn = next((d["by_level"] for d in diagnoses if d.get("by_level")), None)
    if drawn:
        pictures.append(
            picture(
                figures.constants(drawn),
                f"{drawn['parameter']} refitted at each level of {drawn['condition']}",
                "A constant of nature does not change with a condition of the test. Points: what each level alone would "
                "make of it. Lines: what a missing effect would make of it.",
            )
        )
    last = shown[-1]["rows"]
    worst = sorted(last, key=lambda r: -abs(r["z"] if r["z"] is not None else r["residual"]))[:8]
    rows = [
        [
            r["rig"],
            "; ".join(f"{label(c)} {number(v)}" for c, v in r["conditions"].items() if _changes(last, r["rig"], c)),
            number(r["value"]),
            number(r["predicted"]),
            "-" if r["z"] is None else f"{r['z']:.1f}",
        ]
        for r in worst
    ]
    head = ("rig", "conditions", "measured", "predicted", "residual / uncertainty")
    caption = f"The rows that {figures.model_name(shown[-1]['effects'])} predicts worst"
    return {"words": found, "pictures": pictures, "rows": table(head, rows, (2, 3, 4), caption)}


def _changes(rows: Sequence[dict], rig: str, condition: str) -> bool:
    return len({r["conditions"].get(condition) for r in rows if r["rig"] == rig}) > 1


def _names(told: dict) -> list[str]:
    """Effects a diagnosis names, tied ones as they stand."""
    return list(told["missing"]) or [
        n for names in told["tied"] for n in ([names] if isinstance(names, str) else names)
    ]


def _verdict(told: dict) -> str:
    model = figures.model_name(told["effects"])
    if told["verdict"] == "missing":
        return f"Missing in {model}: {' and '.join(told['missing'])}."
    if told["verdict"] == "tied":
        alike = [n if isinstance(n, str) else " + ".join(n) for n in told["tied"]]
        return f"Tied in {model}: {' or '.join(alike)} explain it alike; these data cannot tell them apart."
    if told["verdict"] == "unexplained":
        return f"Unexplained: {model} fails, and no candidate of a plausible size repairs it."
    return f"Adequate: nothing that {model} lacks is supported by these data."


def _missing(study: Study, told: dict) -> dict:
    known = study.catalogue.effects
    effects = [
        {"name": n, "means": e.means, "formula": e.formula, "source": e.source, "rigs": list(e.rigs.items())}
        for n, e in ((n, known[n]) for n in dict.fromkeys(_names(told)) if n in known)
    ]
    rows = []
    for s in told["ranking"]:
        size = ", ".join(
            f"{style.words(n)[0]} {number(v, 3)} {style.words(n)[1]}".removesuffix(" -") for n, v in s["value"].items()
        )
        remark = s["note"] or ("explains" if s["explains"] else "does not explain")
        if s["beyond"]:
            remark += f"; would need {', '.join(f'{style.words(k)[0]} {number(v, 3)}' for k, v in s['beyond'].items())}"
        if s["smallest_visible"] is not None and s["note"] in ("wrong sign", "these data cannot show it"):
            remark += f"; from {number(s['smallest_visible'], 3)} on it would be noticed"
        score = "-" if s["score"] is None else f"{s['score']:.1f}"
        rows.append(
            [
                s["effect"],
                f"{100 * s['visible_share']:.0f} %",
                score,
                probability(s["p_adjusted"]),
                f"{s['chi2_drop']:.1f}",
                size,
                remark,
            ]
        )
    pictures = []
    if any(s["chi2_drop"] > 1 for s in told["ranking"]):
        pictures.append(
            picture(
                figures.ranking(told),
                "candidate effects ranked by the drop of chi²",
                "How much each candidate improves the fit. Everything that reaches into the band explains as well as the "
                "best: a tie, and then nothing is added. Hatched bars would need a size no material has.",
            )
        )
    return {
        "heading": f"Model {figures.model_name(told['effects'])}",
        "verdict": _verdict(told) + f" Is any candidate needed? p {probability(told['gate_p'])}, over all candidates together.",
        "effects": effects,
        "pictures": pictures,
        "ranking": table(
            ("effect", "visible", "score", "p adjusted", "chi² drop", "fitted size", "remark"), rows, (1, 2, 3, 4),
            "visible: share of the effect's signature that the calibration does not absorb; score: in standard errors",
        ) if rows else None,
    }  # fmt: skip


def _ladder(steps: Sequence[dict]) -> dict | None:
    if not steps:
        return None
    rows = [
        [
            k,
            figures.model_name(s["effects"]),
            number(s["chi2"]),
            s["dof"],
            probability(s["lack_of_fit_p"]),
            number(s["rms_error"], 3),
            number(s["holdout_rms_error"], 3),
            number(s["noise_floor"], 3),
        ]
        for k, s in enumerate(steps)
    ]
    unit = style.unit_in_words(steps[-1]["rms_error_unit"])
    return {
        "pictures": [
            picture(
                figures.ladder(steps),
                "rms error after each step, fitted and held out, above the noise floor",
                "The error of each model on the rows it was fitted to and on rows it has not seen. Below the noise floor "
                "a model would only follow the scatter of the readings.",
            )
        ],
        "steps": table(
            ("step", "model", "chi²", "dof", "lack of fit p", f"rms error ({unit})", "held out", "noise floor"),
            rows,
            (0, 2, 3, 4, 5, 6, 7),
        ),
    }


def _next(diagnoses: Sequence[dict]) -> dict | None:
    told = next((d["next_measurement"] for d in diagnoses[::-1] if d["next_measurement"]), None)
    if told is None:
        return None
    where = ", ".join(f"{label(c)} {number(v)}" for c, v in told["conditions"].items())
    rivals = "; ".join(
        f"{name} predicts {number(value, 3)} ± {number(told['uncertainties'][name], 2)}"
        for name, value in told["predictions"].items()
    )
    return {
        "words": f"{told['rig']}, {label(told['observable'])}, at {where}: {rivals}. "
        f"The two best differ there by {told['separation']:.1f} standard uncertainties.",
        "pictures": [
            picture(
                figures.next_measurement(told),
                "what each explanation predicts for the proposed measurement",
                "One such reading tells the explanations apart that these data leave alike.",
            )
        ],
    }
