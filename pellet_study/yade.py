"""The YADE executable: which one, which version, in what environment it is started."""

import os
import shutil
import subprocess
from functools import cache
from pathlib import Path

from pellet_study.errors import InputError, SimulationError

LEAKS = ("VIRTUAL_ENV", "PYTHONPATH", "PYTHONHOME", "CONDA_PREFIX", "PYTHONSTARTUP")
SYSTEM_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"


@cache
def executable() -> str:
    """Path of YADE: $PELLET_STUDY_YADE, else yadedaily, else yade.

    Raises
    ------
    InputError : there is none
    """
    named = os.environ.get("PELLET_STUDY_YADE")
    for name in [named] if named else ["yadedaily", "yade"]:
        path = shutil.which(name)
        if path:
            return str(Path(path).absolute())
    if named:
        raise InputError(
            f"PELLET_STUDY_YADE is {named!r}, which is no executable; set it to the yade command or unset it"
        )
    raise InputError(
        "YADE was not found: neither yadedaily nor yade is on the PATH. On Debian or Ubuntu: apt-get install yade "
        "(`make study` does it); elsewhere set PELLET_STUDY_YADE to the command"
    )


@cache
def version() -> str:
    """Version as YADE reports it, for example `2023.02a`.

    Raises
    ------
    SimulationError : YADE does not start
    """
    found = subprocess.run(
        [executable(), "--version"],
        capture_output=True,
        text=True,
        env=environment("/tmp"),
        stdin=subprocess.DEVNULL,
    )
    words = [line.split(":", 1)[1] for line in found.stdout.splitlines() if line.startswith("Yade version:")]
    if found.returncode or not words:
        raise SimulationError(f"{executable()} --version failed: {(found.stderr or found.stdout).strip()[-500:]}")
    return words[0].strip().split(",")[0]


def environment(home: str, **more: str) -> dict[str, str]:
    """Environment for a YADE process: nothing of a virtual environment, no listening servers, one thread.

    YADE opens a python prompt and an XMLRPC server on every interface unless it believes to be a process of an MPI
    run; OMPI_COMM_WORLD_RANK makes it believe so, from the start.
    """
    kept = {
        key: value for key, value in os.environ.items() if key not in LEAKS and not key.startswith(("LC_", "OMPI_"))
    }
    path = SYSTEM_PATH + ":" + os.environ.get("PATH", "")
    kept.update(HOME=home, PATH=path, LC_ALL="C.UTF-8", OMP_NUM_THREADS="1", OMPI_COMM_WORLD_RANK="0", **more)
    kept.pop("DISPLAY", None)
    return kept


def command(script: Path, *arguments: str) -> list[str]:
    """Arguments that run a script in YADE: exit afterwards, no window, one thread."""
    return [executable(), "-x", "-n", "-j1", str(script), *arguments]
