"""Cases worked through on a Dask cluster: chunks of them go to the workers, rows come back into the one store here.

A worker does with its chunk what `campaign` does on this machine, in a temporary folder of its own, so a case's row is
the same to the byte, and no folder needs to be shared. Each worker is asked first whether its programs are the same as
here. The chunk of a worker that is lost is given to another; when the scheduler is lost, what has no row yet is asked
again of the one that comes back.
"""

import logging
import shutil
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pellet_study
from pellet_study.errors import InputError, SimulationError, StudyError
from pellet_study.output.terminal import progress
from pellet_study.rigs.declarations import rig_in
from pellet_study.rigs.declared import Rig
from pellet_study.rigs.on_yade import rigs_of
from pellet_study.rigs.scripts import SCRIPTS
from pellet_study.simulation import local, settings, yade
from pellet_study.simulation.store import Store
from yade_scripts.case import Table, unsealed

try:
    from distributed import Client, Future
    from distributed.comm import CommClosedError
except ImportError:
    raise InputError("--scheduler needs Dask, which is not installed: pip install 'pellet-study[dask]'") from None

log = logging.getLogger(__name__)
POLL_S = 0.1
LOOK_AT_WORKERS_S = 1.0
CONNECT_LIMIT_S = 10.0
RETURN_LIMIT_S = 300.0  # a scheduler that was there is waited for so long, and a worker that can simulate
FETCH_LIMIT_S = 60.0  # a worker that ended with its rows leaves the scheduler waiting for another at its address
MOST_IN_A_CHUNK = 100
CHUNKS_A_THREAD = 4
ATTEMPTS = 3  # workers that a chunk may lose before it is held against the chunk
Files = dict[str, tuple[Path, tuple[Path, ...]]]  # of a rig's script, and of effects beyond its own, by the rig's name


class SchedulerLost(Exception):
    """The connection to the scheduler ended."""


def expectation(rigs: Mapping[str, Rig]) -> dict[str, str]:
    """What a worker must have in common with this machine to give the same rows: versions, and scripts of rigs."""
    prints = {f"script of {name}": rig.fingerprint for name, rig in rigs.items()}
    return {"pellet_study": pellet_study.__version__, "YADE": yade.version(), **prints}


def user_files(rigs: Mapping[str, Rig]) -> Files:
    """Files of the rigs that are the user's own, or have effects of the user's own; workers must see them too."""
    return {
        name: (rig.script, rig.extra)
        for name, rig in rigs.items()
        if rig.extra or not rig.script.is_relative_to(SCRIPTS)
    }


def rigs_here(names: Sequence[str], files: Files) -> dict[str, Rig]:
    """Runs on a worker: rigs by name, the user's own from their files, others as this machine has them."""
    given = {name: rig_in(file, effects) for name, (file, effects) in files.items()}
    return rigs_of([{"rig": name} for name in names], given)


def unfit(expected: dict[str, str], names: Sequence[str], files: Files) -> str | None:
    """Runs on a worker: why it cannot simulate what is expected; None where it can."""
    try:
        found = expectation(rigs_here(names, files))
    except (StudyError, OSError) as error:
        return str(error)
    differing = [what for what in expected if found[what] != expected[what]]
    return f"has {differing[0]} {found[differing[0]]}, here {expected[differing[0]]}" if differing else None


def chunk(cases: list[dict], files: Files, time_limit_s: float | None) -> dict[str, bytes]:
    """Runs on a worker: the cases' lines by rig, as they stand in a store."""
    rigs = rigs_here(sorted({case["rig"] for case in cases}), files)
    with tempfile.TemporaryDirectory(prefix="pellet-study-") as folder, Store(Path(folder)) as store:
        local.run(cases, store, rigs, 1, quiet=True, time_limit_s=time_limit_s)
        return {name: store.table(rig).read_bytes() for name, rig in rigs.items()}


def run(
    cases: Sequence[dict],
    store: Store,
    rigs: Mapping[str, Rig],
    scheduler: str,
    *,
    quiet: bool = False,
    time_limit_s: float | None = None,
) -> None:
    """Simulate cases that have their id on a cluster; their rows stand in the store afterwards.

    Parameters
    ----------
    scheduler : address of a running scheduler (`tcp://host:port`, `tls://...`), or `slurm:JOBS`, which submits that
        many jobs as ~/.config/dask/jobqueue.yaml describes them

    Raises
    ------
    InputError : no such scheduler, or nobody answers there
    SimulationError : no worker can simulate, the scheduler does not come back, or cases have no result
    """
    work = _Work(cases, store, rigs, time_limit_s)
    with _reached(scheduler, store) as there:
        address = there.address
        work.bar = progress(len(cases), quiet)
        try:
            client = _connect(there, CONNECT_LIMIT_S)
            if client is None:
                raise InputError(f"no Dask scheduler answers at {address}; start one with `dask scheduler`")
            while work.unfinished:
                try:
                    with client:
                        work.run(client, there.check)
                except SchedulerLost:
                    log.warning("lost the scheduler at %s; waiting for it to come back", address)
                    client = _connect(there, RETURN_LIMIT_S)
                    if client is None:
                        raise SimulationError(
                            f"the scheduler at {address} did not come back within {RETURN_LIMIT_S:g} s; "
                            f"{len(cases) - len(work.left)} of {len(cases)} cases are kept in {store.folder}; call again"
                        ) from None
        finally:
            work.bar.close()
    if work.failed:
        raise SimulationError(
            f"{len(work.failed)} of {len(cases)} cases have no result ({next(iter(work.failed.values()))}); "
            f"the others are kept in {store.folder}; call again"
        )


@contextmanager
def _reached(scheduler: str, store: Store) -> Iterator["_Scheduler"]:
    """The scheduler that is named; where SLURM is asked for, one of our own and its jobs, until leaving."""
    jobs = settings.jobs_of(scheduler)
    if not jobs:
        yield _Scheduler(scheduler)
        return
    from pellet_study.simulation.slurm import Jobs

    keys = store.new_campaign()
    try:
        with Jobs(jobs, keys) as cluster:
            yield _Scheduler(cluster.address, cluster.security, cluster.check)
    finally:
        shutil.rmtree(keys, ignore_errors=True)


@dataclass
class _Scheduler:
    """Where a scheduler is, how to speak with it, and a look at whether its workers will come."""

    address: str
    security: Any = None  # None: what the settings of Dask say
    check: Callable[[], None] = lambda: None


def _connect(scheduler: _Scheduler, limit_s: float) -> Client | None:
    """A client, or None where nobody answers in time."""
    deadline = time.monotonic() + limit_s
    while True:
        try:
            return Client(scheduler.address, timeout=CONNECT_LIMIT_S, set_as_default=False, security=scheduler.security)
        except OSError:
            if time.monotonic() > deadline:
                return None
            time.sleep(1.0)
        except ValueError as error:
            raise InputError(f"--scheduler {scheduler.address}: {error}") from None


class _Work:
    """The cases of one call, and the chunks that are with workers."""

    bar: Any = None

    def __init__(self, cases: Sequence[dict], store: Store, rigs: Mapping[str, Rig], time_limit_s: float | None):
        self.left = {case["id"]: case for case in cases}
        self.failed: dict[str, str] = {}  # cases that are not tried again, and why
        self.store, self.time_limit_s = store, time_limit_s
        self.rigs = {name: rigs[name] for name in sorted({case["rig"] for case in cases})}
        self.expected, self.files = expectation(self.rigs), user_files(self.rigs)
        self.lost: dict[str, int] = {}  # how often a case was with a worker that ended

    @property
    def unfinished(self) -> list[dict]:
        """Cases that have no row and did not fail either: all of them, wherever the connection broke."""
        return [case for name, case in self.left.items() if name not in self.failed]

    def run(self, client: Client, check: Callable[[], None] = lambda: None) -> None:
        """Have all that is unfinished done, by the workers of one scheduler; `check` raises where none will come.

        Raises
        ------
        SchedulerLost : it went away; what was with its workers is unfinished still
        SimulationError : no worker can simulate
        """
        self.waiting = deque(self.unfinished)
        threads: dict[str, int] = {}  # of the workers that can simulate
        refused: dict[str, str] = {}
        asked: dict[Future, tuple[str, list[dict]]] = {}
        looked, able = 0.0, time.monotonic()
        try:
            while self.waiting or asked:
                if client.status != "running":
                    raise SchedulerLost
                now = time.monotonic()
                if now - looked > LOOK_AT_WORKERS_S:
                    looked = now
                    self._look(client, threads, refused)
                    check()
                    able = now if threads else able
                    if (refused and not threads and not asked) or now - able > RETURN_LIMIT_S:
                        why = next(iter(refused.values()), "none is there")
                        raise SimulationError(f"no worker of the Dask scheduler can simulate: {why}")
                for future, (worker, cases) in list(asked.items()):
                    if future.status == "pending" and worker in threads:
                        continue
                    del asked[future]
                    self._end(future, cases)
                for worker, number in threads.items():
                    for _ in range(number - sum(at == worker for at, _ in asked.values())):
                        cases = self._next(sum(threads.values()))
                        if cases:
                            future = client.submit(
                                chunk,
                                cases,
                                self.files,
                                self.time_limit_s,
                                workers=[worker],
                                allow_other_workers=False,
                                pure=False,
                            )
                            asked[future] = worker, cases
                time.sleep(POLL_S)
        except (CommClosedError, ConnectionError, TimeoutError, CancelledError):
            raise SchedulerLost from None
        except OSError:
            if client.status == "running":
                raise  # the disk here, not the connection
            raise SchedulerLost from None
        finally:
            if client.status == "running":
                client.cancel(list(asked))

    def _look(self, client: Client, threads: dict[str, int], refused: dict[str, str]) -> None:
        """See which workers are there; ask those that are new whether they can simulate."""
        there = client.nthreads()
        for known in (threads, refused):
            for gone in known.keys() - there.keys():
                del known[gone]
        new = [worker for worker in there if worker not in threads and worker not in refused]
        if not new:
            return
        reasons = client.run(unfit, self.expected, list(self.rigs), self.files, workers=new, on_error="return")
        for worker, reason in reasons.items():
            if reason is None:
                threads[worker] = there[worker]
                continue
            refused[worker] = _words(reason) if isinstance(reason, BaseException) else reason
            log.warning("worker %s is left out: %s", worker, refused[worker])

    def _next(self, threads: int) -> list[dict]:
        """The next chunk; smaller ones towards the end, so that all workers end together."""
        size = max(1, min(MOST_IN_A_CHUNK, len(self.waiting) // (CHUNKS_A_THREAD * threads)))
        return [self.waiting.popleft() for _ in range(min(size, len(self.waiting)))]

    def _end(self, future: Future, cases: list[dict]) -> None:
        """A chunk came back, or its worker is gone."""
        status = future.status
        if status == "finished":
            try:
                tables = future.result(timeout=FETCH_LIMIT_S)
            except TimeoutError:
                self._lose(cases, "its rows cannot be fetched")
                raise
            self._keep(tables)
            self._fail(cases, "the worker returned no row")
        elif status == "error":
            self._fail(cases, _words(future.exception()))
        else:
            future.cancel()
            self._lose(cases, "its workers ended")
            self.waiting.extendleft(case for case in cases if self.lost[case["id"]] < ATTEMPTS)
        self.bar.update(sum(case["id"] not in self.left for case in cases))

    def _lose(self, cases: list[dict], reason: str) -> None:
        """Count an attempt that came to nothing; the last one is a failure."""
        for case in cases:
            self.lost[case["id"]] = self.lost.get(case["id"], 0) + 1
        self._fail([case for case in cases if self.lost[case["id"]] >= ATTEMPTS], reason)

    def _fail(self, cases: list[dict], reason: str) -> None:
        self.failed.update({case["id"]: reason for case in cases if case["id"] in self.left})

    def _keep(self, tables: dict[str, bytes]) -> None:
        """Put lines that came back into the store, those of cases that were asked for."""
        for name, lines in tables.items():
            rig = self.rigs[name]
            table = Table(self.store.table(rig), self.store.columns(rig), checked=True)
            for line in lines.splitlines():
                body = unsealed(line)
                if body and self.left.pop(body.split(b",", 1)[0].decode(errors="replace"), None):
                    table.add(line + b"\n")


def _words(error: BaseException) -> str:
    """An exception of a worker in one line."""
    return " ".join(str(error).split())[:300] or type(error).__name__
