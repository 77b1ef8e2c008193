"""Simulations from a program: cases of the rigs on YADE, and the powder calibration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pellet_study.errors import InputError
from pellet_study.study.study import Study

if TYPE_CHECKING:
    import pandas as pd


def simulate(
    cases: Sequence[dict],
    store: Path | str = ".store",
    *,
    workers: int | None = None,
    quiet: bool = False,
    scheduler: str | None = None,
    time_limit_s: float | None = None,
) -> pd.DataFrame:
    """Simulate cases on YADE that are not stored yet; a row for each, in their order.

    Parameters
    ----------
    cases : complete cases, each made by `case(rig, conditions=..., parameters=..., seed=...)`
    store : folder of finished simulations, made where it is missing
    workers : YADE processes at once; default one a core
    quiet : no progress bar
    scheduler : address of a Dask scheduler, or `slurm:JOBS`
    time_limit_s : longest time of a case, s; default: what its rig declares

    Returns
    -------
    Columns `rig`, `id`, the inputs, the observables with their unit in the name, and `status`: `ok`, or why there is no
    observable.

    Raises
    ------
    InputError : no YADE, or one too old
    SimulationError : YADE cannot be started, or the machine ran out of disk or memory
    """
    from pellet_study.simulation import dispatch

    return dispatch.run(
        cases, Path(store), workers=workers, quiet=quiet, scheduler=scheduler, time_limit_s=time_limit_s
    )


def calibrate(
    study: Study,
    *,
    until: str = "validation",
    repeats: int | None = None,
    results: Path | str | None = None,
    workers: int | None = None,
    say: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """The source paper's powder calibration: screening, climb, surface, optimum, validation of the repose angle.

    Parameters
    ----------
    study : with the measured repose angle, and the ranges of its parameters A to G
    until : the last stage to do
    repeats : heaps at each point; default 3
    results : folder of the results and of the finished simulations; default the study's
    workers : YADE processes at once; default one a core
    say : told a line a stage

    Returns
    -------
    The keys of the command's JSON: `stages`, `optimum`, `validation`.

    Raises
    ------
    InputError : the study cannot be calibrated so; no folder for the results
    SimulationError : too many heaps failed
    """
    from pellet_study.powder import Chain, Results, plan_of, report
    from pellet_study.powder.decisions import STAGES
    from pellet_study.powder.heaps import FULL, Heaps
    from pellet_study.powder.plan import SYMBOLS

    if until not in STAGES:
        raise InputError(f"until={until!r}: expected one of {', '.join(STAGES)}")
    folder = Path(results) if results is not None else study.folder
    if folder is None:
        raise InputError("the study has no folder: name one with results=")
    sizes = FULL if repeats is None else replace(FULL, repeats=repeats)
    plan = plan_of(study)
    heaps = Heaps(plan, folder / ".store", sizes, workers=workers, say=say or _unsaid)
    chain = Chain(heaps, Results(plan, folder), after=report.write_summary)
    chain.run(STAGES[: STAGES.index(until) + 1])
    report.write(chain)
    return {**report.answer(chain.results), "assumed": study.assumed_without([SYMBOLS[f.name] for f in plan.factors])}


def _unsaid(line: str) -> None:
    """A line a stage, told to nobody."""
