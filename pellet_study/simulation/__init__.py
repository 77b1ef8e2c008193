"""Cases in, rows out: YADE processes on this machine or a cluster, and the store of what they finished.

    settings, yade < store, processes < local < law_cases < law_checks < unseen, slurm < cluster < dispatch

`run` and `Store` are handed on when they are first used, as they need pandas.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pellet_study.simulation.dispatch import run
    from pellet_study.simulation.store import Store

__all__ = ["Store", "run"]

_HOMES = {"Store": "store", "run": "dispatch"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
