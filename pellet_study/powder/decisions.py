"""What each stage of the powder calibration decided, and how to ask for it again."""

import json
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.powder.heaps import FULL
from pellet_study.powder.plan import DEFAULT_LAW

STAGES = ("screening", "climb", "surface", "optimum", "validation")


def read_decision(folder: Path, stage: str) -> dict:
    """What the file of a stage's decision says.

    Raises
    ------
    InputError : it cannot be read
    """
    file = folder / stage / "decision.json"
    try:
        decided = json.loads(file.read_text(encoding="utf-8"))
        if not isinstance(decided, dict):
            raise ValueError("no object")
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: is not what `calibrate` wrote ({error}); run calibrate again") from None
    return decided


def repeats_before(folder: Path) -> int | None:
    """Heaps at each point in the stages that a folder has, None where it has none or they do not say."""
    found = (read_decision(folder, s) for s in STAGES if (folder / s / "decision.json").exists())
    return next((decision["repeats"] for decision in found if "repeats" in decision), None)


def command(folder: Path) -> str:
    """The call of `calibrate` that did what stands in a folder, with its options."""
    words = f"pellet-study calibrate {folder.as_posix()}"
    law = next(
        (read_decision(folder, s).get("contact_law") for s in STAGES if (folder / s / "decision.json").exists()), None
    )
    if law not in (None, DEFAULT_LAW):
        words += f" --contact-law {law}"
    if (repeats := repeats_before(folder)) not in (None, FULL.repeats):
        words += f" --repeats {repeats}"
    return words
