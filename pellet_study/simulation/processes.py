"""A YADE process of a campaign, the file in which processes claim cases, and how they end."""

import os
import signal
import subprocess
import time
from pathlib import Path

from yade_scripts.case import CLAIM_BYTES, one_line

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
        lines = self.log.read_text(errors="replace").splitlines()
        said = [line.strip() for line in lines if line.strip() and not line.startswith(NOISE)]
        return one_line(said[-1]) if said else "no last words"


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


def ending(code: int) -> str:
    """How a process ended, in words; a shell between reports a signal as 128 + its number."""
    number = -code if code < 0 else code - 128
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"exit status {code}"
