"""The machine-readable form of each answer, and the history a study keeps of what was done."""

import json
from dataclasses import asdict
from pathlib import Path

from pellet_study.compare import Comparison
from pellet_study.diagnose import Diagnosis, NextMeasurement
from pellet_study.errors import InputError
from pellet_study.pages import drift_words
from pellet_study.refine import Refinement

HISTORY = "history.json"


def step(found: Comparison) -> dict:
    """A model beside the measurements, in numbers."""
    return {
        "effects": list(found.effects),
        "parameters": found.parameters,
        "intervals": {name: list(limits) for name, limits in found.intervals.items()},
        "chi2": found.chi2,
        "dof": found.dof,
        "lack_of_fit_p": found.lack_of_fit_p,
        "rms_error": found.rms_error,
        "holdout_rms_error": found.holdout_rms_error,
        "rms_error_unit": found.rms_error_unit,
        "level_out_rms_error": found.level_out_rms_error,
    }


def comparison(found: Comparison) -> dict:
    """Keys of `compare`, `add`, `drop`."""
    return {
        **step(found),
        "not_identified": list(found.not_identified),
        "at_bound": list(found.at_bound),
        "fits": found.fits,
        "where": [{**asdict(d), "words": drift_words(d)} for d in found.drifts],
        "needed_setup_percent": found.needed_setup_percent,
        "rows": [
            {
                "rig": r.row.rig,
                "observable": r.row.observable,
                "conditions": dict(r.row.conditions),
                "value": r.row.value,
                "predicted": r.predicted,
                "residual": r.residual,
                "z": r.z,
                "split": r.row.split,
            }
            for r in found.rows
        ],
        "warnings": list(found.warnings),
    }


def tied(names: tuple[tuple[str, ...], ...]) -> list:
    """A single effect as its name, a pair as an inner list."""
    return [n[0] if len(n) == 1 else list(n) for n in names]


def proposal(found: NextMeasurement | None) -> dict | None:
    """The next measurement."""
    return None if found is None else asdict(found)


def diagnosis(found: Diagnosis) -> dict:
    """Keys of `diagnose`."""
    return {
        "verdict": found.verdict,
        "missing": list(found.missing),
        "ranking": [
            {**asdict(s), "interval": list(s.interval) if s.interval else None} for s in found.ranking
        ],
        "tied": tied(found.tied),
        "next_measurement": proposal(found.next_measurement),
        "gate_p": found.gate_p,
        "warnings": list(dict.fromkeys(found.warnings)),
    }


def refinement(found: Refinement) -> dict:
    """Keys of `refine`."""
    return {
        "verdict": found.verdict,
        "added": list(found.added),
        "tied": tied(found.tied),
        "steps": [step(c) for c in found.steps],
        "diagnoses": [diagnosis(d) for d in found.diagnoses],
        "next_measurement": proposal(found.last.next_measurement or found.diagnoses[0].next_measurement),
        "warnings": list(dict.fromkeys(w for d in found.diagnoses for w in d.warnings)),
    }


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
        if not known or any(
            known[-1].get(k) != new[k] for k in ("effects", "chi2", "rms_error", "parameters")
        ):
            known.append(new)
    write(folder / HISTORY, {"steps": known})


def write(file: Path, answer: dict) -> None:
    """Write an answer whole or not at all."""
    temporary = file.with_suffix(file.suffix + ".new")
    temporary.write_text(json.dumps(answer, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    temporary.replace(file)
