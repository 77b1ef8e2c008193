"""A campaign in a process of its own, to be killed, starved or locked out: python -m tests.faults.driver ...

    python -m tests.faults.driver STORE TABLE NUMBER [pause FAULT]

runs NUMBER cases (real rebounds, or the faulty rig with this pause where one is given) and writes them to TABLE as
`bench` writes runs.csv.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from tests import ROOT

FAULTY = ROOT / "tests" / "helpers" / "fault_rigs" / "faulty.py"
PATIENCE_S = 240.0  # on a machine that does other things too
UNPRIVILEGED = ["setpriv", "--bounding-set=-dac_override,-dac_read_search,-fowner"] if os.geteuid() == 0 else []


def start(store: Path, table: Path, number: int, *fault: float, **more) -> subprocess.Popen:
    """Start it; Ctrl-C reaches it even where the tests themselves were started in the background."""
    return subprocess.Popen(
        [sys.executable, "-m", "tests.faults.driver", str(store), str(table), str(number), *map(str, fault)],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        **more,
    )


def command(*words, **more) -> subprocess.CompletedProcess:
    """`pellet-study ...` in a process of its own."""
    more = {"cwd": ROOT, "capture_output": True, "text": True, "timeout": 2 * PATIENCE_S, **more}
    before = more.pop("before", [])
    return subprocess.run([*before, sys.executable, "-m", "pellet_study", *map(str, words)], **more)


def paragraph(text: str) -> bool:
    """Whether an error is one paragraph without a traceback."""
    return bool(text.strip()) and "Traceback" not in text and "\n\n" not in text.strip()


def rows(store: Path) -> int:
    """Finished cases in a store."""
    return sum(max(0, len(f.read_bytes().splitlines()) - 1) for f in store.glob("*-????????.csv"))


def wait_until(fulfilled, process: subprocess.Popen | None = None) -> None:
    """Wait for something; fail where it takes too long, stop where the process ended."""
    deadline = time.monotonic() + PATIENCE_S
    while not fulfilled() and (process is None or process.poll() is None):
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


def simulating(folder: Path) -> list[int]:
    """Processes of YADE that work in a folder."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                words = (entry / "cmdline").read_bytes().split(b"\0")
                state = (entry / "stat").read_text().rpartition(")")[2].split()[0]
            except OSError:
                continue
            if b"-x" in words and any(word.startswith(bytes(folder)) for word in words) and state != "Z":
                found.append(int(entry.name))
    return found


def main(store: str, table: str, number: str, pause: str = "", fault: str = "0") -> None:
    """The campaign."""
    from pellet_study.bench import report
    from pellet_study.rigs import on_yade
    from pellet_study.rigs.declarations import rig_in
    from pellet_study.simulation import dispatch

    if pause:
        rig = rig_in(FAULTY)
        settings = {"pause_s": float(pause), "fault": float(fault)}
        cases = [on_yade.case(rig, seed=seed, conditions=settings) for seed in range(int(number))]
    else:
        rig = on_yade.rig("rebound")
        cases = [on_yade.case(rig, seed=seed) for seed in range(int(number))]
    report.write_runs([dispatch.run(cases, Path(store), rigs={rig.name: rig})], Path(table))


if __name__ == "__main__":
    from pellet_study.__main__ import _words
    from pellet_study.errors import StudyError

    try:
        main(*sys.argv[1:])
    except StudyError as error:
        sys.exit(f"pellet-study: {error}")
    except OSError as error:  # as the command line does
        sys.exit(f"pellet-study: {_words(error)}")
