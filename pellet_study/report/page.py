"""One self-contained HTML page about a study, made of the files in its folder alone: nothing is simulated or fitted.

Figures are drawn anew from the answers the commands left there; what is not there yet is named with its command.
"""

import json
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

import pellet_study
from pellet_study.criticism import figures
from pellet_study.errors import InputError
from pellet_study.output import style
from pellet_study.output.words import number
from pellet_study.powder import decisions
from pellet_study.report import bench
from pellet_study.report.criticism import _fails, _fit_words, _ladder, _missing, _model, _next, _verdict
from pellet_study.report.measured import _counts, _measured
from pellet_study.report.parts import table
from pellet_study.study import history
from pellet_study.study.load import load
from pellet_study.study.study import Study

FILE = "report.html"
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
        done = bench.stages(study, folder)
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
            "joint": bench.joint(folder),
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
        loader=PackageLoader("pellet_study.report", "template"),
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
