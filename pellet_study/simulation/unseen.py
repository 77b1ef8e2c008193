"""A YADE whose contact laws nobody has checked: the quick checks once, before its first campaign on a machine."""

import logging
import os
import tempfile
from contextlib import ExitStack
from pathlib import Path

import pandas as pd

from pellet_study.rigs.on_yade import rigs_of
from pellet_study.simulation import law_cases, law_checks, local, yade
from pellet_study.simulation.store import Store, key

CHECKED = ("2023.02a", "2025.2.0")  # all checks of both stand in results/checks/law_checks_versions.csv
NAMED = 3  # checks that are off, in the warning
log = logging.getLogger(__name__)


def check(workers: int) -> pd.DataFrame:
    """Check the laws of a version that is not among `CHECKED`, and warn of what is off; what it found before is read again.

    The rows of the checks are kept in `$XDG_CACHE_HOME/pellet_study/yade-VERSION` (`~/.cache`), or nowhere where that folder
    cannot be made.

    Returns
    -------
    The checks that are off for no known reason, as `law_checks.unexplained` has them; none for a version in `CHECKED`

    Raises
    ------
    SimulationError : YADE ends before its first case
    """
    version = yade.version()
    if version in CHECKED:
        return pd.DataFrame(columns=law_checks.COLUMNS)
    with ExitStack() as stack:
        cases = law_cases.cases(quick=True)
        rigs = rigs_of(cases)
        keyed = [{**case, "id": key(case, rigs[case["rig"]])} for case in cases]
        store = stack.enter_context(Store(_folder(version, stack)))
        missing = [case for case in keyed if case["id"] not in store.rows(rigs[case["rig"]]).index]
        if missing:
            log.warning(
                "YADE %s has not been checked by the makers of this package (%s have): its contact laws are checked first, "
                "this once, in a minute or two",
                version,
                " and ".join(CHECKED),
            )
            local.run(missing, store, rigs, workers, quiet=True)
        rows = [store.rows(rigs[case["rig"]]).loc[[case["id"]]].assign(rig=case["rig"]) for case in keyed]
    off = law_checks.unexplained(law_checks.table(pd.concat(rows).reset_index()))
    if len(off):
        log.warning(
            "YADE %s: %d checks of its contact laws are off, so that its results are not to be trusted: %s%s; "
            "`pellet-study doctor` lists them all",
            version,
            len(off),
            "; ".join(_told(row) for _, row in off.head(NAMED).iterrows()),
            " and more" if len(off) > NAMED else "",
        )
    return off


def _folder(version: str, stack: ExitStack) -> Path:
    """Where the rows of the checks are kept."""
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    folder = Path(cache) / "pellet_study" / f"yade-{version}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="pellet-study-")))
    return folder


def _told(row: pd.Series) -> str:
    return f"{row['check']}, {row['contact_law']}, {row['setting']}: requested {row['requested']:g}, got {row['measured']:g}"
