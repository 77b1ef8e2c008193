"""What a study folder remembers: each command's answer, and the error falling step by step."""

import json
from pathlib import Path

from pellet_study.errors import InputError

HISTORY = "history.json"


def read_history(folder: Path) -> list[dict]:
    """Steps recorded in a study folder, the oldest first.

    Raises
    ------
    InputError : the file is not what was written
    """
    file = folder / HISTORY
    if not file.exists():
        return []
    try:
        steps = json.loads(file.read_text(encoding="utf-8"))["steps"]
        if not isinstance(steps, list):
            raise TypeError
        return steps
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{file}: is damaged; delete it to begin the history anew") from None


def record(folder: Path, steps: list[dict]) -> None:
    """Add steps to a study's history; a step that repeats the last one is left out."""
    known = read_history(folder)
    for new in steps:
        if not known or _gist(known[-1]) != _gist(new):
            known.append(new)
    write(folder / HISTORY, {"steps": known})


def _gist(step_told: dict) -> tuple:
    """What two records of the same model agree in, however its fit was begun."""
    errors = [step_told[k] for k in ("rms_error", "holdout_rms_error")]
    return (*step_told["effects"], step_told["dof"], *(None if e is None else f"{e:.3g}" for e in errors))


def write(file: Path, answer: dict) -> None:
    """Write an answer whole or not at all."""
    temporary = file.with_suffix(file.suffix + ".new")
    temporary.write_text(json.dumps(answer, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    temporary.replace(file)


def leave(folder: Path, name: str, page: str, answer: dict) -> None:
    """Keep a command's page and its answer in the study: NAME.txt and NAME.json."""
    (folder / f"{name}.txt").write_text(page + "\n", encoding="utf-8")
    write(folder / f"{name}.json", answer)
