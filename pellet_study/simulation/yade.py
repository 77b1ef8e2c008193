"""The YADE executable: which one, which version, in what environment it is started."""

import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import yade_scripts
from pellet_study.errors import InputError, SimulationError
from pellet_study.output.words import shown

OLDEST = 2023  # year of the first version whose Mindlin law has the damping the rigs were checked with
# what another Python, a locale, an MPI or batch system leaves in the environment and YADE would take for its own
LEAKS = (
    "PYTHON",
    "IPYTHON",
    "VIRTUAL_ENV",
    "CONDA",
    "LC_",
    "OMP_",
    "GOMP_",
    "KMP_",
    "OMPI_",
    "PMI",
    "SLURM_",
    "DISPLAY",
    "NPY_",
)
# numpy's powers, logarithms and sums differ there in the last digit from those of other processors, on which the course of a heap hangs
AVX512 = "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR X86_V4"
ANSWER_LIMIT_S = 60.0  # of a call that simulates nothing
MOST_SAID = 1_000_000  # bytes
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
        "(`make study` does it); elsewhere set PELLET_STUDY_YADE to the command. Closed-form rigs, tables, audits and photographs "
        "need none"
    )


def named() -> bool:
    """Whether it is one that the user named."""
    return bool(os.environ.get("PELLET_STUDY_YADE"))


@cache
def version() -> str:
    """Version as YADE reports it, for example `2023.02a`.

    Raises
    ------
    SimulationError : YADE does not start
    """
    with tempfile.TemporaryDirectory(prefix="pellet-study-") as home:
        code, said = _asked([executable(), "--version"], home)
    words = [line.split(":", 1)[1] for line in said.splitlines() if line.startswith("Yade version:")]
    if code or not words:
        raise SimulationError(f"{executable()} --version failed: {shown(said[-500:])}")
    return words[0].strip().split(",")[0]


def _asked(words: Sequence[str], home: str) -> tuple[int, str]:
    """Exit status of a short call of YADE, and what it said; it and all it started end with the time limit.

    Raises
    ------
    SimulationError : it does not end within `ANSWER_LIMIT_S`
    """
    with tempfile.TemporaryFile() as output:  # no pipe: what a process left behind holds open would be waited for
        process = subprocess.Popen(
            words,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            env=environment(home),
            start_new_session=True,
        )
        try:
            code = process.wait(ANSWER_LIMIT_S)
        except subprocess.TimeoutExpired:
            raise SimulationError(
                f"{' '.join(words)} did not end within {ANSWER_LIMIT_S:g} s; try it by hand, and name a YADE that answers in "
                "PELLET_STUDY_YADE"
            ) from None
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        output.seek(0)
        return code, output.read(MOST_SAID).decode(errors="replace")


def lacks() -> dict[str, str]:
    """{what this YADE lacks of what the contact laws use: what that costs}.

    Raises
    ------
    SimulationError : YADE does not run
    """
    script = Path(yade_scripts.__file__).with_name("build.py")
    with tempfile.TemporaryDirectory(prefix="pellet-study-") as home:
        answer = Path(home) / "lacks.json"
        code, said = _asked(command(script, str(answer)), home)
        if code or not answer.exists():
            raise SimulationError(f"{executable()} does not run a script: {shown(said[-500:])}")
        return json.loads(answer.read_text())


def refuse_old() -> None:
    """Nothing is simulated with a version whose contact laws are others.

    Raises
    ------
    InputError : the version is older than the rigs can use
    """
    year = re.match(r"(\d{4})", version())
    if year and int(year[1]) < OLDEST:
        raise InputError(
            f"{executable()} is YADE {version()}; expected {OLDEST} or newer: older contact laws damp a collision "
            "differently. Install a newer one, or name it in PELLET_STUDY_YADE"
        )


def environment(home: str, **more: str) -> dict[str, str]:
    """Environment for a YADE process: nothing of a virtual environment, no listening servers, one thread.

    YADE opens a python prompt and an XMLRPC server on every interface unless it believes to be a process of an MPI
    run; OMPI_COMM_WORLD_RANK makes it believe so, from the start. The message library under Debian 13's MPI takes SIGHUP for
    itself, so that a process whose terminal is closed goes on; UCX_DEBUG_SIGNO=0 leaves the signal alone. numpy does without
    AVX-512, so that fewer kinds of processors give a row other last digits.
    """
    kept = {name: value for name, value in os.environ.items() if not name.startswith(LEAKS)}
    path = SYSTEM_PATH + ":" + os.environ.get("PATH", "")
    kept.update(HOME=home, PATH=path, LC_ALL="C.UTF-8", OMP_NUM_THREADS="1", OMPI_COMM_WORLD_RANK="0")
    settled = {"PYTHONDONTWRITEBYTECODE": "1", "UCX_DEBUG_SIGNO": "0", "NPY_DISABLE_CPU_FEATURES": AVX512}
    settled["PYTHONWARNINGS"] = "ignore:During parsing environment variable"  # of names that this numpy does not know
    return {**kept, **settled, **more}


def command(script: Path, *arguments: str) -> list[str]:
    """Arguments that run a script in YADE: exit afterwards, no window, one thread."""
    return [executable(), "-x", "-n", "-j1", str(script), *arguments]
