"""What else lies in the folder of a study that was calibrated stage by stage, as `make study` leaves it: the stages of a powder, and a
study that was asked what it lacks."""

from pathlib import Path

from pellet_study.powder.decisions import stages_in
from pellet_study.study import history

ANSWERS = ("compare.json", "diagnose.json", "refine.json", history.HISTORY)


def powder_beside(folder: Path) -> Path:
    """The folder of a powder's stages: the study's own, else the first within it that has some."""
    if stages_in(folder):
        return folder
    return next((inner for inner in _folders(folder) if stages_in(inner)), folder)


def study_beside(folder: Path) -> Path:
    """The study whose model was criticised: this one, else, where it was calibrated by stages, the first within it that was."""
    if _criticised(folder) or not (_stages(folder) or stages_in(powder_beside(folder))):
        return folder
    return next((inner for inner in _folders(folder) if (inner / "study.toml").exists() and _criticised(inner)), folder)


def _stages(folder: Path) -> bool:
    return (folder / "calibration.csv").exists()


def _criticised(folder: Path) -> bool:
    return any((folder / name).exists() for name in ANSWERS)


def _folders(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    return sorted(inner for inner in folder.iterdir() if inner.is_dir() and not inner.name.startswith("."))
