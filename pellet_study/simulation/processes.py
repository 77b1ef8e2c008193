"""A YADE process of a campaign, the file in which processes claim cases, and how they end."""

import os
import signal
import subprocess
import time
from pathlib import Path

from pellet_study.output.words import shown
from yade_scripts.case import CLAIM_BYTES, one_line

MOST_READ = 100_000  # bytes of a log
NOISE = (
    "Welcome to Yade",
    "Using python version",
    "XMLRPC",
    "TCP python prompt",
    "Running script",
    "Master:",
)


class Worker:
    """A YADE process, its log, and the case it is at."""

    def __init__(self, number: int, process: subprocess.Popen, log: Path, held: int):
        self.name, self.process, self.log = f"w{number}", process, log
        self.held = held  # our end of its lifeline
        self.index: int | None = None  # of the case it claimed last
        self.since = time.monotonic()
        self.reason: str | None = None  # why it was killed

    def kill(self, reason: str | None = None) -> None:
        """End it and all it started; the reason is what its case's status then says."""
        self.reason = reason
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass

    def last_words(self) -> str:
        """The last line the simulator wrote that is not its usual banner."""
        with open(self.log, "rb") as stream:
            stream.seek(max(0, self.log.stat().st_size - MOST_READ))
            lines = stream.read().decode(errors="replace").splitlines()
        said = [line.strip() for line in lines if line.strip() and not line.startswith(NOISE)]
        return shown(one_line(said[-1])) if said else "no last words"


class Claims:
    """The file in which processes claim cases, read on from where it was read last."""

    def __init__(self, file: Path):
        self.file, self._read = file, 0
        self._last: dict[str, int] = {}
        file.touch()

    def number(self) -> int:
        """Number of cases claimed."""
        return self.file.stat().st_size // CLAIM_BYTES

    def read(self) -> dict[str, int]:
        """The case each process claimed last."""
        with open(self.file, "rb") as stream:
            stream.seek(self._read * CLAIM_BYTES)
            new = stream.read()
        for start in range(0, len(new) - CLAIM_BYTES + 1, CLAIM_BYTES):
            self._last[new[start : start + CLAIM_BYTES].decode().strip()] = self._read
            self._read += 1
        return self._last


def free_bytes(folder: Path) -> int:
    """Free bytes on the disk of a folder."""
    disk = os.statvfs(folder)
    return disk.f_bavail * disk.f_frsize


def signal_of(code: int) -> int | None:
    """The signal that ended a process, as the system or a shell between says it; None where it ended by itself."""
    number = -code if code < 0 else code - 128
    return number if number in list(signal.Signals) else None


def ending(code: int) -> str:
    """How a process ended, in words; a shell between reports a signal as 128 + its number."""
    number = signal_of(code)
    return f"exit status {code}" if number is None else signal.Signals(number).name
