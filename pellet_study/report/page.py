"""One self-contained HTML page about a study, made of the files in its folder alone: nothing is simulated or fitted.

Figures are drawn anew from the answers the commands left there; what is not there yet is named with its command.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

import pellet_study
from pellet_study.bench.readings import readings
from pellet_study.criticism import fit_facts, verdict_facts
from pellet_study.criticism.facts import model_name
from pellet_study.errors import InputError
from pellet_study.files import opening, writing
from pellet_study.output import style
from pellet_study.output.words import number, plain
from pellet_study.powder import decisions
from pellet_study.report import criticism, missing
from pellet_study.report.bench import bench_stages
from pellet_study.report.beside import powder_beside, study_beside
from pellet_study.report.measured import counts, measured
from pellet_study.report.parts import Stage, Table, table
from pellet_study.report.powder import measured_angle, powder_stages
from pellet_study.study import history
from pellet_study.study.load import load
from pellet_study.study.study import Study

Answer = dict[str, Any]  # the JSON that a command left

FILE = "report.html"
NOT_THERE = "not there yet"  # instead of files
UNEQUAL = 1.5  # times the middle uncertainty of a row, beyond which the root mean square is told too
COMPARED = ("value", "sd", "n", "split")  # of a row, beside its conditions
DAMAGED = (KeyError, TypeError, AttributeError, IndexError, ValueError)
POWDER_FILES = tuple(f"{stage}/decision.json" for stage in decisions.STAGES)
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

CRITICISM = ("model", "fails", "missing", "error", "next")


def write(folder: Path, library: Path | None = None) -> Path:
    """Write the page of a study, loaded with a library if one is given; returns its absolute path.

    Raises
    ------
    InputError : no study, or a file in it is not what a command wrote
    """
    file = Path(folder) / FILE
    text = page(Path(folder), library)
    return writing.text(file, plain(text)).resolve()


def page(folder: Path, library: Path | None = None) -> str:
    """The page as text.

    Raises
    ------
    InputError : no study, or a file in it is not what a command wrote
    """
    place = folder
    folder = study_beside(place)
    study = load(folder, library)
    steps = _whole(folder, history.read_history(folder))
    left = {name: _answer(folder, name) for name in ("compare", "diagnose", "refine")}
    stale = [name for name, answer in left.items() if answer and answer.get("basis", study.basis) != study.basis]
    left |= dict.fromkeys(stale)
    steps = steps if _of_study(steps, study) else []
    try:
        content = _of(study, folder, left, steps)
    except DAMAGED as error:
        raise _damaged(study, folder, left, steps, error) from None
    content["notes"] += [
        f"What {name} left is of other rows of measurements.csv, or of another rig, and is not shown: run `pellet-study {name} "
        f"{_named(study, folder)}` again."
        for name in stale
    ]
    if place != folder:
        content |= _around(load(place, library), place, content)
    environment = Environment(
        loader=PackageLoader("pellet_study.report", "template"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(FILE).render(content)


def _of_study(steps: Sequence[Answer], study: Study) -> bool:
    """Whether the history is of the rows and rigs that the study has now."""
    told = [{name: getattr(row, name) for name in history.ROW} for row in study.rows]
    now = {"basis": study.basis, "rows": [{**row, "conditions": dict(row["conditions"])} for row in told]}
    return not steps or history.same_basis(steps[-1], now)


def _of(study: Study, folder: Path, left: Mapping[str, Answer | None], steps: list[Answer]) -> dict[str, Any]:
    """What the template lays out, of the answers that the commands left."""
    return _content(study, folder, left["compare"], _diagnoses(left["refine"], left["diagnose"]), steps)


def _damaged(
    study: Study, folder: Path, left: Mapping[str, Answer | None], steps: list[Answer], error: Exception
) -> InputError:
    """Names the file without which the page could be made, and the command that writes it anew."""
    what = f"is not what this version writes ({type(error).__name__}: {error})"
    for name, answer in left.items():
        if answer is not None and _made(study, folder, {**left, name: None}, steps):
            return InputError(f"{folder / name}.json: {what}; run `pellet-study {name} {_named(study, folder)}` again")
    if steps and _made(study, folder, left, []):
        again = f"delete it, and run `pellet-study refine {_named(study, folder)}` again"
        return InputError(f"{folder / history.HISTORY}: {what}; {again}")
    files = ", ".join(f"{name}.json" for name, answer in left.items() if answer is not None) or "a table of a stage"
    return InputError(f"{folder}: {files} {what}; run the commands that wrote them again")


def _made(study: Study, folder: Path, left: Mapping[str, Answer | None], steps: list[Answer]) -> bool:
    """Whether the page can be made of these."""
    try:
        _of(study, folder, left, steps)
    except DAMAGED:
        return False
    return True


def _content(
    study: Study, folder: Path, compared: Answer | None, diagnoses: list[Answer], steps: list[Answer]
) -> dict[str, Any]:
    """What the template lays out; None for what is not there yet."""
    stages = _stages(study, folder)
    shown = steps or ([compared] if compared else [])
    criticised = bool(shown or diagnoses or not stages)  # a study that was only calibrated has no sections of it
    return {
        "title": study.title,
        "headline": _headline(study, shown),
        "simulates": any(study.catalogue.rigs[rig].on_yade for rig in study.rigs),
        "place": folder.as_posix(),
        "named": _named(study, folder),
        "rigs": study.rigs,
        "counts": counts(study),
        "criticised": criticised,
        "sections": [
            s
            for s in SECTIONS
            if (criticised or s[0] not in CRITICISM) and (s[0] != "stages" or stages or stage_commands(study))
        ],
        "todo_stages": stage_commands(study),
        "short": _short(compared, diagnoses, steps, stages),
        "notes": _notes(study, compared),
        "measured": measured(study, folder),
        "model": criticism.model(study, compared, shown, diagnoses) if compared else None,
        "of": "",
        "also_measured": None,
        "fails": criticism.fails(study, shown, diagnoses) if shown else None,
        "missing": [missing.missing(study, diagnosis) for diagnosis in diagnoses],
        "ladder": criticism.ladder(study, steps, diagnoses) if steps else None,
        "errors": missing.errors(diagnoses[-1]) if diagnoses else None,
        "next": missing.next_measurement(study, diagnoses),
        "nothing_next": verdict_facts.nothing_next(diagnoses[-1]) if diagnoses else "",
        "stages": stages,
        "repeat": _repeat(study, folder, {stage.kind for stage in stages}),
        "version": pellet_study.__version__,
    }


def _stages(study: Study, folder: Path) -> list[Stage]:
    """The calibrations stage by stage, the seeds' first."""
    return bench_stages(folder) + powder_stages(powder_beside(folder), measured_angle(study))


def _headline(study: Study, shown: Sequence[Answer]) -> str:
    """The title, with what the rows held out say against the model as it is left."""
    if shown and fit_facts.held_out_contradict(shown[-1]):
        return f"{study.title}: contradicted by the rows held out"
    return study.title


def _around(study: Study, folder: Path, inner: Mapping[str, Any]) -> dict[str, Any]:
    """What is said of a study whose folder holds the one that was criticised: its stages come first."""
    stages, model = _stages(study, folder), f"{inner['title']} ({inner['place']})"
    order = ("measured", "stages", "model", "fails", "missing", "error", "next", "repeat")
    repeat = _repeat(study, folder, {stage.kind for stage in stages})
    return {
        "title": study.title,
        "headline": study.title,
        "simulates": True,
        "place": folder.as_posix(),
        "named": _named(study, folder),
        "rigs": study.rigs,
        "counts": counts(study),
        "sections": [s for name in order for s in SECTIONS if s[0] == name],
        "short": [
            *(stage.short for stage in stages if stage.short),
            f"Missing effect, {inner['title']}:",
            *inner["short"],
        ],
        "measured": measured(study, folder),
        "also_measured": replace(inner["measured"].summary, caption=f"What was measured for {model}:"),
        "of": f"Of {model}, whose model was held against its measurements.",
        "stages": stages,
        "repeat": replace(repeat, rows=[row for row in (*repeat.rows, *inner["repeat"].rows) if row[1] != NOT_THERE]),
    }


def _answer(folder: Path, name: str) -> Answer | None:
    """What a command left as NAME.json; None where it was not run."""
    file = folder / f"{name}.json"
    if not file.exists():
        return None
    try:
        found = opening.json_in(file)
        if not isinstance(found, dict):
            raise ValueError("no JSON object")
        return found
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: is damaged ({error}); run `pellet-study {name}` again") from None


def _whole(folder: Path, steps: Sequence[Answer]) -> list[Answer]:
    """The steps of the history, each with its rows."""
    if any("rows" not in step for step in steps):
        raise InputError(f"{folder / history.HISTORY}: was written by an older version; delete it and run refine again")
    return list(steps)


def _diagnoses(refined: Answer | None, last: Answer | None) -> list[Answer]:
    """Every diagnosis known: those of `refine`, and the last of `diagnose` if it is of another model."""
    found = list(refined["diagnoses"]) if refined else []
    if last and last["effects"] not in [d["effects"] for d in found]:
        found.append(last)
    return found


def _by_scatter(middle: float, whole: float | None) -> str:
    """What scatter alone leaves; where rows scatter unequally, in the mean square too, which is what an rms error meets."""
    if whole is None or whole < UNEQUAL * middle:
        return f"The uncertainty of a row alone, by readings and simulations, gives {number(middle, 3)}."
    return (
        f"The scatter of readings and simulations alone would leave {number(whole, 3)}: the uncertainty of a row, "
        f"{number(middle, 3)} in the middle of the rows, is much larger in some."
    )


def _short(compared: Answer | None, diagnoses: list[Answer], steps: list[Answer], stages: list[Stage]) -> list[str]:
    """The answer in a few sentences."""
    if not (compared or stages or diagnoses):
        return ["Measured, not calibrated yet."]
    found = [stage.short for stage in stages if stage.short]
    if len(steps) > 1:
        first, last = steps[0], steps[-1]
        found.append(
            f"The model {model_name(first['effects'])} leaves an rms error of {number(first['rms_error'], 3)} "
            f"{style.unit_in_words(first['rms_error_unit'])}; {model_name(last['effects'])} leaves "
            f"{number(last['rms_error'], 3)}."
        )
        if last.get("noise_floor"):
            found.append(_by_scatter(last["noise_floor"], last.get("noise_rms")))
    elif compared:
        found.append(
            f"The model is {model_name(compared['effects'])}. {criticism.fit_sentence(compared, held_out=not diagnoses)}"
        )
    if len(steps) > 1 and compared:
        found.append(f"With it {criticism.fit_sentence(compared, held_out=not diagnoses)}")
    if diagnoses:
        found.append(missing.verdict(diagnoses[-1]))
    return found


def _notes(study: Study, compared: Answer | None) -> list[str]:
    """What does not belong together: results older than the files they are of."""
    if not compared:
        return []
    found = []
    if compared["effects"] != list(study.effects):
        found.append("The effects in study.toml are not those of the last comparison: run compare again.")
    if not _compared_as_read(compared["rows"], study):
        found.append("measurements.csv is not what was compared: run compare again.")
    return found + compared["warnings"]


def _compared_as_read(compared: Sequence[Mapping], study: Study) -> bool:
    """Whether the rows of an answer are those of measurements.csv, in what the answer has of them."""
    now = [{name: getattr(row, name) for name in COMPARED} | {"conditions": dict(row.conditions)} for row in study.rows]
    return len(now) == len(compared) and all(
        was[name] == value for was, row in zip(compared, now, strict=True) for name, value in row.items() if name in was
    )


def _named(study: Study, folder: Path) -> str:
    """The study as a command has to name it: with its library."""
    return folder.as_posix() + (f" --library {study.library.as_posix()}" if study.library else "")


def stage_commands(study: Study) -> list[tuple[str, str]]:
    """The stages of the source paper's calibration that a study's rigs have, in words, and the command of each."""
    found = []
    if _bench_readings(study):
        found.append(("The three seed bench tests of the source paper have not been calibrated here:", "bench"))
    if measured_angle(study) is not None:
        found.append(("The powder, whose repose angle was measured, has not been calibrated here:", "calibrate"))
    return found


def _bench_readings(study: Study) -> bool:
    """Whether the seed bench tests can be calibrated: one setting for each of their rigs that has rows."""
    try:
        return bool(readings(study.rows))
    except InputError:
        return False


def _repeat(study: Study, folder: Path, stages: set[str]) -> Table:
    """Which command made which numbers, and the files they stand in; of the stages only those that the study has."""
    place, powder = _named(study, folder), powder_beside(folder)
    commands = {command for _, command in stage_commands(study)}
    of_stages = [
        (
            "powder calibration",
            tuple((powder / name).relative_to(folder).as_posix() for name in ("runs.csv", *POWDER_FILES)),
            decisions.command(powder).removeprefix("pellet-study ").replace(folder.as_posix(), place, 1)
            if powder == folder
            else f"calibrate POWDER_STUDY --results {powder.as_posix()}",
            "calibrate" in commands or bool(stages & set(decisions.STAGES)),
        ),
        ("seed bench tests", ("calibration.csv",), f"bench {place}", "bench" in commands or "bench" in stages),
    ]
    rows = [
        [what, ", ".join(f for f in files if (folder / f).exists()) or NOT_THERE, f"pellet-study {command}"]
        for what, files, command in (
            ("constants, residuals, where it fails", ("compare.json", "compare.txt"), f"compare {place}"),
            ("ranking, next measurement", ("diagnose.json", "diagnose.txt", "refine.json"), f"diagnose {place}"),
            ("effects added, error step by step", ("refine.json", "refine.txt"), f"refine {place}"),
            ("the error ladder", (history.HISTORY,), f"history {place}"),
            *(stage[:3] for stage in of_stages if stage[3]),
        )
    ]
    return table(("numbers", "files", "command"), rows)
