"""Where and how simulations run, as given, else as the environment says it, where commands hand their options on."""

import os

from pellet_study.errors import InputError
from pellet_study.tables.numbers import number_given

SCHEDULER, TIME_LIMIT, WORKERS = "PELLET_STUDY_SCHEDULER", "PELLET_STUDY_TIME_LIMIT_S", "PELLET_STUDY_WORKERS"
SCHEMES = ("tcp://", "tls://", "ucx://", "ws://", "wss://")


def scheduler(given: str | None = None) -> str | None:
    """Address of a Dask scheduler, or slurm:JOBS; None: simulate on this machine.

    Raises
    ------
    InputError : it is neither
    """
    given = given or os.environ.get(SCHEDULER) or None
    if given:
        jobs_of(given)
    return given


def jobs_of(address: str) -> int:
    """How many jobs of SLURM an address asks for; 0 where a scheduler is there already.

    Raises
    ------
    InputError : it is no address
    """
    kind, _, jobs = address.partition(":")
    if kind == "slurm" and jobs.isdecimal() and int(jobs) > 0:
        return int(jobs)
    if not address.startswith(SCHEMES):
        raise InputError(f"--scheduler {address}: expected tcp://HOST:PORT, or slurm:JOBS, as slurm:8")
    return 0


def time_limit_s(given: str | None = None) -> float | None:
    """Longest time of a case; None: what its rig declares.

    Raises
    ------
    InputError : it is no such time
    """
    given = given or os.environ.get(TIME_LIMIT)
    if not given:
        return None
    try:
        seconds = number_given(given)
    except ValueError:
        seconds = 0.0
    if not 0 < seconds < float("inf"):
        raise InputError(f"time limit {given!r}: expected a number of seconds above 0")
    return seconds


def workers(given: str | None = None) -> int | None:
    """YADE processes at once on this machine; None: one a core.

    Raises
    ------
    InputError : it is no such number
    """
    given = given or os.environ.get(WORKERS)
    if not given:
        return None
    if not (given.isascii() and given.isdecimal() and int(given) > 0):
        raise InputError(f"--workers {given}: expected at least one YADE process")
    return int(given)
