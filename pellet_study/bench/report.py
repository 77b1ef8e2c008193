"""What `bench` found, as files in the study and as JSON; and read from those files again."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pellet_study.bench import figures
from pellet_study.bench.chain import BenchResult
from pellet_study.bench.parabola import fit_parabola
from pellet_study.bench.readings import Reading
from pellet_study.bench.seeds import Mean
from pellet_study.bench.stages import STAGES
from pellet_study.bench.text import summary
from pellet_study.doe.answers import plain
from pellet_study.errors import InputError
from pellet_study.files import opening, writing
from pellet_study.output import style


def answer(results: Sequence[BenchResult]) -> dict[str, Any]:
    """The stages as JSON."""
    return {"stages": [_stage(result) for result in results]}


def _stage(result: BenchResult) -> dict[str, Any]:
    stage, check = result.stage, result.verification
    return {
        "rig": stage.rig,
        "parameter": stage.parameter,
        "value": result.value,
        "interval": plain(result.interval),
        "r2": result.curve.r2,
        "coefficients": [float(c) for c in result.curve.coefficients],
        "coefficient_intervals": [[float(x) for x in pair] for pair in result.curve.intervals],
        "observable": stage.observable,
        "measured": result.reading.value,
        "verification": check and check.value,
        "verification_standard_error": check and check.standard_error,
        "verification_error_percent": result.verification_error_percent,
        "joint_prediction": result.joint and result.joint.value,
    }


def write_runs(runs: Sequence[pd.DataFrame], file: Path) -> None:
    """Every simulation of a call as one table, sorted by case id; written whole or not at all."""
    together = pd.concat(runs).drop_duplicates("id").sort_values("id")
    writing.table(file, together)


def write(results: Sequence[BenchResult], folder: Path, contact_law: str, at_contact: bool = False) -> str:
    """Write sweeps, calibration, figures and summary into the study; returns the summary."""
    table = []
    for stage in STAGES:  # what an earlier call with other measurements left
        writing.remove(folder / f"sweep_{stage.rig}.csv")
        for file in (folder / "figures").glob(f"{stage.rig}.*"):
            writing.remove(file)
    for result in results:
        stage = result.stage
        writing.table(folder / f"sweep_{stage.rig}.csv", result.sweep.round(6))
        style.save(figures.sweep(result), folder / "figures" / f"{stage.rig}.png")
        record = _stage(result)
        low, high = record.pop("interval")
        coefficients = dict(zip(("c0", "c1", "c2"), record.pop("coefficients"), strict=True))
        record.pop("coefficient_intervals")
        table.append({**record, "interval_low": low, "interval_high": high, **coefficients})
    writing.table(folder / "calibration.csv", pd.DataFrame(table), float_format="%.6g")
    text = summary(results, contact_law, at_contact)
    writing.text(folder / "summary.txt", text + "\n")
    return text


def read(folder: Path) -> list[BenchResult]:
    """The stages as `write` left them in a study (sds and conditions of the readings are not kept there).

    Raises
    ------
    InputError : a file is not what was written
    """
    file = folder / "calibration.csv"
    found = []
    try:
        for record in pd.read_csv(opening.stream(file)).to_dict(orient="records"):
            stage = next(s for s in STAGES if s.rig == record["rig"])
            file = folder / f"sweep_{stage.rig}.csv"
            sweep = pd.read_csv(opening.stream(file))
            check = None
            if np.isfinite(record["verification"]):
                check = Mean(record["verification"], record["verification_standard_error"], 0, 0)
            found.append(
                BenchResult(
                    stage,
                    Reading(record["measured"], None, 1, {}),
                    sweep,
                    fit_parabola(sweep[stage.parameter].to_numpy(), sweep[stage.observable].to_numpy()),
                    plain(record["value"]),
                    (record["interval_low"], record["interval_high"]),
                    check,
                )
            )
    except (OSError, ValueError, KeyError, StopIteration) as error:
        raise InputError(f"{file}: is not what `bench` wrote ({error}); run `pellet-study bench` again") from None
    return found
