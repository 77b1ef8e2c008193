"""One case of the heap rig run by hand in a process of its own, and what it cost."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pandas as pd

from pellet_study.rigs.scripts import SCRIPTS
from pellet_study.simulation import yade


def child(command: list[str], folder: Path, environment: dict | None = None) -> float:
    """Run a program, what it says in said.txt; its user and system seconds, children included."""
    with open(folder / "said.txt", "w") as said:
        started = subprocess.Popen(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=said, stderr=subprocess.STDOUT
        )
        *_, used = os.wait4(started.pid, 0)
    return used.ru_utime + used.ru_stime


def by_hand(case: dict, folder: Path) -> tuple[pd.Series, float]:
    """The rig's row of one case run by hand, as the README says, and its cpu seconds."""
    (folder / "cases.json").write_text(json.dumps([{"id": "heap"} | {k: v for k, v in case.items() if k != "rig"}]))
    command = yade.command(SCRIPTS / "repose.py", "cases.json", "observables.csv")
    seconds = child(command, folder, yade.environment(str(folder)))
    if not (folder / "observables.csv").exists():
        sys.exit(f"YADE left no result; it said at last:\n{(folder / 'said.txt').read_text()[-2000:]}")
    return pd.read_csv(folder / "observables.csv").iloc[0], seconds
