"""What a study folder remembers: each command's answer, and the error falling step by step."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.files import opening, writing
from pellet_study.output.words import plain

HISTORY, BEFORE = "history.json", "history_before.json"
ROW = ("rig", "observable", "conditions", "value", "split")


def read_history(folder: Path, name: str = HISTORY) -> list[dict]:
    """Steps recorded in a study folder, the oldest first; `name` is of the file.

    Raises
    ------
    InputError : the file is not what was written
    """
    file = folder / name
    if not file.exists():
        return []
    try:
        steps = opening.json_in(file)["steps"]
        if not isinstance(steps, list):
            raise TypeError("`steps` is no list")
        for step in steps:
            _gist(step), step["chi2"], step["lack_of_fit_p"]
        return steps
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{file}: is damaged ({type(error).__name__}: {error}); delete it, and `pellet-study refine {folder}` begins the "
            "history anew"
        ) from None


def record(folder: Path, steps: list[dict]) -> str:
    """Add steps to a study's history; a step that repeats the last one is left out, and steps that are its last already.

    Steps of other rows, or of a rig since changed, do not belong beside them: these are put aside, and a new history begins.

    Returns
    -------
    what to say of that; empty where it goes on
    """
    known, said = read_history(folder), ""
    added = steps[0].get("measured")  # rows that `refine` took in as the next measurement: the history goes on
    if known and not added and not same_basis(known[-1], steps[0]):
        writing.json(folder / BEFORE, {"steps": [*read_history(folder, BEFORE), *known]})
        known = []
        said = (
            f"the rows of measurements.csv, or a rig, have changed since the last step of the history: a new one begins; the old "
            f"steps are in {folder / BEFORE}"
        )
    if [*map(_gist, known[-len(steps) :])] == [*map(_gist, steps)]:
        return said
    for new in steps:
        if not known or _gist(known[-1]) != _gist(new):
            known.append(new)
    writing.json(folder / HISTORY, {"steps": known})
    return said


def same_basis(step: Mapping, other: Mapping) -> bool:
    """Whether two answers are of the same rows and rigs; of older ones, which do not say it, the rows are compared."""
    if "basis" in step and "basis" in other:
        return bool(step["basis"] == other["basis"])
    rows = [[[row.get(name) for name in ROW] for row in one.get("rows") or []] for one in (step, other)]
    return not all(rows) or rows[0] == rows[1]


def _gist(step_told: dict) -> tuple:
    """What two records of the same model agree in, however its fit was begun."""
    errors = [step_told[k] for k in ("rms_error", "holdout_rms_error")]
    return (*step_told["effects"], step_told["dof"], *(None if e is None else f"{e:.3g}" for e in errors))


def recorded(folder: Path, effects: Sequence[str]) -> bool:
    """Whether the last comparison and the last step of the history are of a model with these effects."""
    steps = read_history(folder)
    try:
        compared = opening.json_in(folder / "compare.json")["effects"]
    except (OSError, ValueError, KeyError, TypeError):
        return False
    return bool(steps) and compared == steps[-1]["effects"] == list(effects)


def leave(folder: Path, name: str, page: str, answer: dict) -> None:
    """Keep a command's page and its answer in the study: NAME.txt and NAME.json."""
    writing.text(folder / f"{name}.txt", plain(page) + "\n")
    writing.json(folder / f"{name}.json", answer)
