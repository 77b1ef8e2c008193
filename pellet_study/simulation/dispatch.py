"""Cases in, rows out: what is stored is read, what is missing is simulated on this machine or on a Dask cluster."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from pellet_study.errors import SimulationError
from pellet_study.rigs.declared import Rig
from pellet_study.rigs.on_yade import rigs_of
from pellet_study.simulation import local, settings, unseen, yade
from pellet_study.simulation.store import Store, key

LIMIT_IN_STATUS = re.compile(re.escape(local.TOOK_LONGER) + r" ([\d.e+]+) s")

cores = local.cores


def run(
    cases: Sequence[dict],
    store: Path,
    *,
    rigs: Mapping[str, Rig] | None = None,
    workers: int | None = None,
    quiet: bool = False,
    scheduler: str | None = None,
    time_limit_s: float | None = None,
) -> pd.DataFrame:
    """Simulate the cases that are not stored yet, and return the row of each.

    Parameters
    ----------
    cases : complete cases (`rigs.case`)
    store : folder of finished cases, made where it is missing
    rigs : those of the cases' rigs by name that are not the package's, as a study's catalogue has them
    workers : YADE processes at once on this machine; default $PELLET_STUDY_WORKERS, else one a core
    quiet : no progress; else a bar, or a line every five minutes where stderr is no terminal
    scheduler : address of a Dask scheduler, or `slurm:JOBS`; default $PELLET_STUDY_SCHEDULER, else this machine
    time_limit_s : longest time of a case, s; default $PELLET_STUDY_TIME_LIMIT_S, else what its rig declares

    Returns
    -------
    One row a case, in the order of `cases`: `rig`, `id`, inputs, observables, `status` (`ok`, or the reason why the
    observables are missing). A failed case is an answer like any other and is not tried again, unless it took longer
    than a limit below today's.

    Raises
    ------
    InputError : no YADE, or one too old
    SimulationError : YADE ends before its first case, or the machine ran out of disk or memory
    """
    scheduler = scheduler or settings.scheduler()
    limit = time_limit_s or settings.time_limit_s()
    workers = workers or settings.workers() or cores()
    used = rigs_of(cases, rigs)
    keyed = [{**case, "id": key(case, used[case["rig"]])} for case in cases]
    with Store(store) as opened:
        known = {name: opened.rows(rig) for name, rig in used.items()}
        done = {name: _done(table, limit or used[name].time_limit_s) for name, table in known.items()}
        missing = {case["id"]: case for case in keyed if case["id"] not in done[case["rig"]]}
        if missing:
            yade.refuse_old()
            unseen.check(workers)
            if scheduler:
                from pellet_study.simulation import cluster

                cluster.run(list(missing.values()), opened, used, scheduler, quiet=quiet, time_limit_s=limit)
            else:
                local.run(list(missing.values()), opened, used, workers, quiet=quiet, time_limit_s=limit)
            known = {name: opened.rows(rig) for name, rig in used.items()}
    lost = [case["id"] for case in keyed if case["id"] not in known[case["rig"]].index]
    if lost:
        raise SimulationError(f"{len(lost)} of {len(keyed)} cases have no row in {store}; call again, others are kept")
    return _in_order(keyed, known)


def _in_order(keyed: Sequence[dict], known: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """The row of each case, from the tables of the rigs."""
    rows = []
    for name, table in known.items():
        places = [place for place, case in enumerate(keyed) if case["rig"] == name]
        found = table.loc[[keyed[place]["id"] for place in places]].reset_index()
        rows.append(found.assign(rig=name, place=places))
    if not rows:
        return pd.DataFrame(columns=["rig", "id", "status"])
    return pd.concat(rows).sort_values("place").drop(columns="place").reset_index(drop=True)


def _done(table: pd.DataFrame, limit_s: float) -> set[str]:
    """Ids that need no simulation: all but those that ran into a shorter time limit than today's."""
    failed = table.index[table["status"] != "ok"]
    stopped = {name: LIMIT_IN_STATUS.fullmatch(table["status"][name]) for name in failed}
    return set(table.index) - {name for name, found in stopped.items() if found and float(found[1]) < limit_s}
