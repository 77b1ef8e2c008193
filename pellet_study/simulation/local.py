"""Cases worked through by YADE processes of this machine: one a core, each working through many cases.

A process claims one case after the other from a file all processes share and appends each row to the store as it is
known. So nothing is lost when anything is killed: asked again, only what has no row is computed.
"""

import errno
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pellet_study.errors import SimulationError
from pellet_study.output.terminal import progress
from pellet_study.rigs.declared import Rig
from pellet_study.rigs.scripts import SCRIPTS, fingerprint
from pellet_study.simulation import yade
from pellet_study.simulation.processes import Claims, Worker, ending, free_bytes, signal_of
from pellet_study.simulation.store import Store
from yade_scripts.case import CANNOT_GO_ON, NO_MEMORY, Table, flat

POLL_S = 0.05
START_LIMIT_S = 120.0
TOOK_LONGER = "took longer than its time limit of"
LEAST_SPACE = 65536  # bytes; less is a full disk
BAD_ALLOC = "std::bad_alloc"
OF_THE_CASE = (signal.SIGSEGV, signal.SIGABRT, signal.SIGFPE)
OF_WRAPPERS = (125, 126, 127, 255)  # exit statuses of docker, env and ssh that could not start it, or lost it
MOST_IDLE = 5  # starts of YADE one after the other in which it takes up no case


def from_outside(code: int, words: str) -> bool:
    """Whether a process was ended by the machine or somebody, not by its case; ending in peace without a row is no fault either.

    A case ends YADE by a bad address, an abort, a floating-point exception, or an exit of its own.
    """
    if code in (0, NO_MEMORY) or BAD_ALLOC in words or "KeyboardInterrupt" in words:
        return True
    number = signal_of(code)
    return number not in OF_THE_CASE if number is not None else code in OF_WRAPPERS


def of_memory(reason: str) -> bool:
    """Whether a process ended as those do that had too little memory."""
    return any(word in reason for word in ("SIGKILL", "MemoryError", BAD_ALLOC))


def cores() -> int:
    """Number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run(
    cases: Sequence[dict],
    store: Store,
    rigs: Mapping[str, Rig],
    workers: int,
    *,
    quiet: bool = False,
    time_limit_s: float | None = None,
) -> None:
    """Simulate cases that have their id; their rows stand in the store afterwards.

    Raises
    ------
    SimulationError : YADE ends before its first case, or the machine ran out of disk or memory
    """
    Campaign(list(cases), store, rigs, workers, quiet, time_limit_s).run()


class Campaign:
    """The cases of one call, worked through by YADE processes."""

    def __init__(
        self,
        cases: list[dict],
        store: Store,
        rigs: Mapping[str, Rig],
        workers: int,
        quiet: bool,
        limit_s: float | None,
    ):
        self.cases, self.store, self.most, self.quiet = cases, store, min(workers, len(cases)), quiet
        self.limit_s = limit_s
        self.rigs = {name: rigs[name] for name in dict.fromkeys(case["rig"] for case in cases)}
        self.folder = store.new_campaign()
        self.tables = {name: store.table(rig) for name, rig in self.rigs.items()}
        self.seen = {name: table.stat().st_size if table.exists() else 0 for name, table in self.tables.items()}
        self.failed, self.started = 0, 0
        self.finished: set[str] = set()
        self.wanted = {case["id"] for case in cases}
        self.running: list[Worker] = []
        self.not_done: dict[str, str] = {}  # cases that the machine ended, and how
        self.idle, self.claimed = 0, 0  # starts without progress, and how far it went

    def run(self) -> None:
        """Work until every case has a row."""
        bar = progress(len(self.cases), self.quiet)
        try:
            crashed = self._work(self.cases, bar)
            for case, _ in crashed:  # alone: a neighbour's fault or a passing shortage is not held against it
                for again, reason in self._work([case], bar):
                    if again["id"] not in self.not_done:
                        self._record(again, reason)
                        self._count(bar)
        finally:
            for worker in self.running:
                worker.kill()
            for worker in self.running:
                worker.process.wait()
                os.close(worker.held)
            bar.close()
            shutil.rmtree(self.folder, ignore_errors=True)
        lost = [reason for name, reason in self.not_done.items() if name not in self.finished]
        if lost:
            number = f"{len(lost)} of {len(self.cases)} cases"
            kept = f"the others are kept in {self.store.folder}"
            if any(of_memory(reason) for reason in lost):
                raise SimulationError(
                    f"{number} were killed, most likely for want of memory ({lost[0]}); {kept}. Close other programs, or "
                    "give them more memory, and call again"
                )
            raise SimulationError(
                f"{number} are not done: YADE was ended from outside, twice at the same case ({lost[0]}); {kept}. Call again"
            )

    def _work(self, cases: list[dict], bar: Any) -> list[tuple[dict, str]]:
        """Work through a list; returns the cases that crashed YADE, with the reason."""
        folder = Path(tempfile.mkdtemp(dir=self.folder))
        claims = Claims(folder / "claims")
        task = {
            "rigs": {
                name: {"file": str(rig.script), "effects": [str(file) for file in rig.extra], "table": str(table)}
                for (name, rig), table in zip(self.rigs.items(), self.tables.values(), strict=True)
            },
            "timings": str(self.store.folder / "timings.csv"),
            "claims": str(claims.file),
            "cases": cases,
        }
        (folder / "campaign.json").write_text(json.dumps(task))
        crashed: list[tuple[dict, str]] = []
        self.idle, self.claimed = 0, 0
        while True:
            for _ in range(min(self.most - len(self.running), len(cases) - claims.number())):
                self._start(folder)
            if not self.running:
                return crashed
            time.sleep(POLL_S)
            ended = [worker for worker in self.running if worker.process.poll() is not None]
            self._watch(claims, cases)
            self._count(bar)
            for worker in ended:
                self.running.remove(worker)
                os.close(worker.held)
                crash = self._end(worker, cases, claims)
                if crash:
                    crashed.append(crash)

    def _start(self, folder: Path) -> None:
        for rig in self.rigs.values():
            if fingerprint(rig.script, rig.extra) != rig.fingerprint:
                raise SimulationError(f"{rig.script.name} or what it imports changed while it was running; call again")
        self.started += 1
        log = folder / f"w{self.started}.log"
        lifeline, held = os.pipe()
        with open(log, "wb") as output:
            process = subprocess.Popen(
                yade.command(SCRIPTS / "case.py", str(folder / "campaign.json")),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                cwd=folder,
                env=yade.environment(
                    str(folder),
                    PELLET_STUDY_WORKER=f"w{self.started}",
                    PELLET_STUDY_LIFELINE=str(lifeline),
                ),
                pass_fds=[lifeline, self.store.lock],  # so the store stays held until the last process has ended
                start_new_session=True,
            )
        os.close(lifeline)
        self.running.append(Worker(self.started, process, log, held))

    def _watch(self, claims: Claims, cases: list[dict]) -> None:
        """See which case each process is at; kill a process whose case, or whose start, takes too long."""
        now = time.monotonic()
        last = claims.read()
        for worker in self.running:
            index = last.get(worker.name)
            if index != worker.index:
                worker.index, worker.since = index, now
            limit = START_LIMIT_S if index is None else self.limit_of(cases[index])
            if now - worker.since > limit and worker.reason is None:
                what = "YADE did not start within" if index is None else TOOK_LONGER
                worker.kill(f"{what} {limit:g} s")

    def limit_of(self, case: dict) -> float:
        """The longest time of a case, s."""
        return self.limit_s or self.rigs[case["rig"]].time_limit_s

    def _count(self, bar: Any) -> None:
        """Read the rows that are new in the tables."""
        for name, table in self.tables.items():
            if not table.exists() or table.stat().st_size <= self.seen[name]:
                continue
            with open(table, "rb") as stream:
                stream.seek(self.seen[name])
                new = stream.read()
            new = new[: new.rfind(b"\n") + 1]
            self.seen[name] += len(new)
            for line in new.splitlines():
                name = line.split(b",", 1)[0].decode(errors="replace")
                if name in self.wanted:
                    self.finished.add(name)
                    self.failed += not line[: line.rfind(b",")].endswith(b",ok")
                    bar.update()
        bar.set_postfix(running=len(self.running), failed=self.failed, refresh=False)

    def _end(self, worker: Worker, cases: list[dict], claims: Claims) -> tuple[dict, str] | None:
        """A process ended: nothing to say, a case it did not finish and why, or a YADE that does not run."""
        code = worker.process.returncode
        reason = worker.reason or f"crashed YADE ({ending(code)}): {worker.last_words()}"
        full = code != 0 and free_bytes(self.store.folder) < LEAST_SPACE  # then its log is lost as well
        if full or code == CANNOT_GO_ON:
            words = os.strerror(errno.ENOSPC) if full else worker.last_words()
            raise SimulationError(
                f"a simulation could not go on: {words}. Finished cases are kept in {self.store.folder}; "
                "mend it (make room on the disk, or install a complete YADE) and call again"
            )
        outside = worker.reason is None and from_outside(code, reason)
        if worker.index is None:
            said = worker.reason or f"{ending(code)}, {worker.last_words()}"
            self._count_idle(said, claims.number(), len(cases), 1 if outside else MOST_IDLE)
            return None
        case = cases[worker.index]
        if outside:
            self.not_done[case["id"]] = reason
        else:
            self.not_done.pop(case["id"], None)
        return None if case["id"] in self.finished else (case, reason)

    def _count_idle(self, reason: str, claimed: int, number: int, weight: int) -> None:
        """Stop where YADE ends again and again without taking up a case; at once where it failed by itself."""
        if claimed == number and weight == 1:
            return  # there was none left
        self.idle = weight if claimed > self.claimed else self.idle + weight
        self.claimed = claimed
        if self.idle >= MOST_IDLE:
            wrapper = (
                "; a wrapper (sudo, docker, ssh) must pass open descriptors and the environment on"
                if yade.named()
                else ""
            )
            raise SimulationError(
                f"YADE ended before its first case: {reason}. Try it by hand: "
                f"{' '.join(yade.command(SCRIPTS / 'rebound.py', '--example', 'cases.json'))}{wrapper}"
            )

    def _record(self, case: dict, reason: str) -> None:
        """Store a failure YADE could not store itself; it is counted like any other row."""
        names = self.store.columns(self.rigs[case["rig"]])
        Table(self.tables[case["rig"]], names, checked=True).append({**flat(case), "status": reason})
