"""What a command writes into its study, looked at before it works: a file of somebody else's there is refused at once.

Each file is known by a mark that every version of it carries; when it is written it is looked at again, with its content
(`writing`).
"""

import re
from collections.abc import Callable
from pathlib import Path

from pellet_study.files import writing

Known = Callable[[bytes, bytes], bool]


def _marked(pattern: bytes) -> Known:
    mark = re.compile(pattern, re.MULTILINE)
    return lambda there, content: mark.search(there) is not None


PAGE = _marked(rb"^(FIT|WHERE|ANSWER|NEXT|NOTE)\b|lack of fit p|verdict")
SUMMARY = _marked(rb"\A(Bench|Powder) calibration")
RUNS = _marked(rb"\A.*\bid\b")
FIGURES = {
    f"figures/{name}.png": writing.is_figure
    for name in ("readings", "predictions", "residuals", "ranking", "constants", "next_measurement", "ladder")
}
COMPARED: dict[str, Known] = {"compare.txt": PAGE, "compare.json": writing.is_answer}
HISTORY: dict[str, Known] = {"history.json": writing.is_answer, "history_before.json": writing.is_answer}
WRITTEN: dict[str, dict[str, Known]] = {
    "bench": {
        "summary.txt": SUMMARY,
        "runs.csv": RUNS,
        "calibration.csv": _marked(rb"\Arig,parameter,"),
        "sweep_*.csv": _marked(rb"\A.*,standard_error,n,failed"),
        "figures/rebound.png": writing.is_figure,
        "figures/slope_slip.png": writing.is_figure,
        "figures/inclined_roll.png": writing.is_figure,
    },
    "calibrate": {"summary.txt": SUMMARY, "runs.csv": RUNS},
    "compare": COMPARED,
    "add": COMPARED | HISTORY,
    "drop": COMPARED | HISTORY,
    "diagnose": {"diagnose.txt": PAGE, "diagnose.json": writing.is_answer},
    "refine": COMPARED | HISTORY | {"refine.txt": PAGE, "refine.json": writing.is_answer},
}
"""{command: {name in the folder of its results: how what an earlier call wrote is known}}."""


def check(command: str, folder: Path, figures: Path | None = None) -> None:
    """Refuse what a command would not replace when it is done.

    Parameters
    ----------
    folder : of its results; what is none yet holds nothing
    figures : folder of those it is asked to draw, None where it draws none

    Raises
    ------
    InputError : names the file
    """
    written = WRITTEN.get(command, {}) if folder.is_dir() else {}
    for name, known in written.items():
        for file in folder.glob(name) if "*" in name else [folder / name]:
            writing.check(file, ours=known)
    if figures is not None and command in WRITTEN:
        for name, known in FIGURES.items():
            writing.check(figures / Path(name).name, ours=known)
