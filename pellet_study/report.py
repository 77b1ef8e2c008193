"""One self-contained HTML page about a study, made of the files in its folder alone: nothing is simulated or fitted.

Figures are drawn anew from the answers the commands left there; what is not there yet is named with its command.
"""

import json
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

import pellet_study
from pellet_study import pictured, stages
from pellet_study.criticism import figures
from pellet_study.criticism.text import fit_words
from pellet_study.errors import InputError
from pellet_study.output import style
from pellet_study.output.style import label
from pellet_study.output.words import number, probability
from pellet_study.parts import picture, table
from pellet_study.powder import decisions
from pellet_study.study import history
from pellet_study.study.load import load
from pellet_study.study.study import Study

FILE = "report.html"
MOST_ROWS = 20
SECTIONS = (
    ("measured", "What was measured"),
    ("model", "What the model says"),
    ("fails", "Where it fails"),
    ("missing", "What is missing"),
    ("error", "What adding it did to the error"),
    ("next", "What to measure next"),
    ("stages", "The calibration stage by stage"),
    ("repeat", "How to repeat each number"),
)


def write(folder: Path) -> Path:
    """Write the page of a study; returns its absolute path.

    Raises
    ------
    InputError : no study, or a file in it is not what a command wrote
    """
    file = Path(folder) / FILE
    text = page(Path(folder))
    temporary = file.with_suffix(".new")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(file)
    return file.resolve()


def page(folder: Path) -> str:
    """The page as text."""
    study = load(folder)
    compared = _answer(folder, "compare")
    refined = _answer(folder, "refine")
    diagnoses = _diagnoses(refined, _answer(folder, "diagnose"))
    steps = _whole(folder, history.read_history(folder))
    try:
        done = stages.stages(study, folder)
        told = {
            "title": study.title,
            "place": folder.as_posix(),
            "rigs": study.rigs,
            "counts": _counts(study),
            "sections": SECTIONS,
            "short": _short(compared, diagnoses, steps, done),
            "notes": _notes(study, compared),
            "measured": _measured(study, folder),
            "model": _model(compared),
            "joint": stages.joint(folder),
            "fails": _fails(compared, steps, diagnoses),
            "missing": [_missing(study, d) for d in diagnoses],
            "ladder": _ladder(steps),
            "next": _next(diagnoses),
            "nothing_next": "No further measurement is proposed: nothing has to be told apart.",
            "stages": done,
            "repeat": _repeat(folder),
            "version": pellet_study.__version__,
        }
    except (KeyError, TypeError, AttributeError, IndexError) as error:
        raise InputError(
            f"{folder}: a result there is not what this version writes ({type(error).__name__}: {error}); "
            "run compare, diagnose or refine again"
        ) from None
    environment = Environment(
        loader=PackageLoader("pellet_study", "template"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(FILE).render(told)


def _answer(folder: Path, name: str) -> dict | None:
    """What a command left as NAME.json; None where it was not run."""
    file = folder / f"{name}.json"
    if not file.exists():
        return None
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        if not isinstance(found, dict):
            raise ValueError("no JSON object")
        return found
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: is damaged ({error}); run `pellet-study {name}` again") from None


def _whole(folder: Path, steps: Sequence[dict]) -> list[dict]:
    """The steps of the history, each with its rows."""
    if any("rows" not in step for step in steps):
        raise InputError(f"{folder / history.HISTORY}: was written by an older version; delete it and run refine again")
    return list(steps)


def _diagnoses(refined: dict | None, last: dict | None) -> list[dict]:
    """Every diagnosis known: those of `refine`, and the last of `diagnose` if it is of another model."""
    found = list(refined["diagnoses"]) if refined else []
    if last and last["effects"] not in [d["effects"] for d in found]:
        found.append(last)
    return found


def _counts(study: Study) -> str:
    held = sum(row.split == "holdout" for row in study.rows)
    return (
        f"{len(study.rows)} rows of measurements, {held} of them held out"
        if held
        else f"{len(study.rows)} rows of measurements"
    )


def _short(compared, diagnoses, steps, done) -> list[str]:
    """The answer in a few sentences."""
    if not (compared or done):
        return ["Measured, not calibrated yet."]
    found = []
    if steps and len(steps) > 1:
        first, last = steps[0], steps[-1]
        found.append(
            f"The model {figures.model_name(first['effects'])} leaves an rms error of {number(first['rms_error'], 3)} "
            f"{style.unit_in_words(first['rms_error_unit'])}; {figures.model_name(last['effects'])} leaves "
            f"{number(last['rms_error'], 3)}."
        )
        if last.get("noise_floor"):
            found.append(f"The scatter of the readings alone gives {number(last['noise_floor'], 3)}.")
    elif compared:
        found.append(f"The model is {figures.model_name(compared['effects'])}. {_fit_words(compared)}")
    if diagnoses:
        found.append(_verdict(diagnoses[-1]))
    if done:
        found.append(f"Calibrated stage by stage: {', '.join(s['heading'] for s in done if s['pictures'])}.")
    found += [line for s in done if s["heading"].endswith("validation") for line in s["words"]]
    return found


def _notes(study: Study, compared: dict | None) -> list[str]:
    """What does not belong together: results older than the files they are of."""
    if not compared:
        return []
    found = []
    if compared["effects"] != list(study.effects):
        found.append("The effects in study.toml are not those of the last comparison: run compare again.")
    if [r["value"] for r in compared["rows"]] != [row.value for row in study.rows]:
        found.append("measurements.csv is not what was compared: run compare again.")
    return found + compared["warnings"]


def _measured(study: Study, folder: Path) -> dict:
    summary = []
    for rig in study.rigs:
        mine = [row for row in study.rows if row.rig == rig]
        for observable in dict.fromkeys(row.observable for row in mine):
            rows = [row for row in mine if row.observable == observable]
            values = [row.value for row in rows]
            varied = _varied(rows)
            summary.append(
                [
                    rig,
                    label(observable),
                    len(rows),
                    sum(row.n for row in rows),
                    _span(values),
                    "; ".join(f"{label(c)} {_span([r.conditions[c] for r in rows])}" for c in varied) or "one setting",
                ]
            )
    conditions = list(dict.fromkeys(c for rig in study.rigs for c in _varied([r for r in study.rows if r.rig == rig])))
    head = ["rig", "observable", "value", "sd", "n", *(label(c) for c in conditions), "split", "note"]
    rows = [
        [
            row.rig,
            label(row.observable),
            number(row.value),
            number(row.sd, 3),
            f"{row.n:g}",
            *(number(row.conditions.get(c)) for c in conditions),
            row.split,
            row.note,
        ]
        for row in study.rows[:MOST_ROWS]
    ]
    always = ("rig", "observable", "value", "sd", "n")
    kept = [k for k in range(len(head)) if head[k] in always or len({r[k] for r in rows}) > 1]
    caption = "Every row" if len(rows) == len(study.rows) else f"The first {len(rows)} of {len(study.rows)} rows"
    return {
        "summary": table(
            ("rig", "observable", "rows", "readings", "from to", "conditions"),
            summary,
            (2, 3, 4),
            "By rig and observable",
        ),
        "rows": table(
            [head[k] for k in kept],
            [[row[k] for k in kept] for row in rows],
            [m for m, k in enumerate(kept) if 2 <= k < len(head) - 2],
            caption + " of measurements.csv (conditions, split and note are left out where they never change)",
        ),
        "pictures": pictured.particles(study, folder),
    }


def _varied(rows) -> list[str]:
    return [c for c in rows[0].conditions if len({r.conditions[c] for r in rows}) > 1]


def _span(values: Sequence[float]) -> str:
    low, high = min(values), max(values)
    return number(low) if low == high else f"{number(low)} to {number(high)}"


def _fit_words(told: dict) -> str:
    if told["chi2"] is None:
        return (
            "There are neither standard deviations nor replicates: how well it fits cannot be judged from these data."
        )
    judged = fit_words(told["fits"], told.get("holdout_p"))
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


def _repeat(folder: Path) -> dict:
    place = folder.as_posix()
    rows = [
        [what, ", ".join(f for f in files if (folder / f).exists()) or "not there yet", f"pellet-study {command}"]
        for what, files, command in (
            ("constants, residuals, where it fails", ("compare.json", "compare.txt"), f"compare {place}"),
            ("ranking, next measurement", ("diagnose.json", "diagnose.txt"), f"diagnose {place}"),
            ("effects added, error step by step", ("refine.json", "refine.txt"), f"refine {place}"),
            ("the error ladder", (history.HISTORY,), f"history {place}"),
            (
                "powder calibration",
                ("runs.csv", *(f"{stage}/decision.json" for stage in decisions.STAGES)),
                decisions.command(folder).removeprefix("pellet-study "),
            ),
            ("seed bench tests", ("calibration.csv",), f"bench {place}"),
        )
    ]
    return table(("numbers", "files", "command"), rows)
