"""Faults of YADE itself, on real YADE; the faulty rig stands in for a simulation that fails."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pandas as pd
import pytest

from pellet_study.errors import SimulationError
from pellet_study.rigs import on_yade
from pellet_study.rigs.declarations import rig_in
from pellet_study.simulation import dispatch, local, yade
from tests.faults.driver import FAULTY, command, paragraph, rows, simulating, wait_until

NONE, BAD_ADDRESS, KILLED, KILLED_ONCE, MEMORY, FULL_DISK, HANG_OUTSIDE = 0, 10, 11, 12, 13, 14, 15
QUIET, GRANDCHILD = 7, 200
FUNCTOR = "Law2_ScGeom_MindlinPhys_Mindlin"


RIG = rig_in(FAULTY)


def faulty(seed: int, fault: int = NONE, **conditions: float) -> dict:
    """A case of the faulty rig."""
    return on_yade.case(RIG, seed=seed, conditions={"fault": fault, **conditions})


def run(cases: list[dict], store: Path, **more) -> pd.DataFrame:
    """A campaign with the faulty rig."""
    return dispatch.run(cases, store, rigs={"faulty": RIG}, **more)


@pytest.fixture
def study(tmp_path):
    """A study with the paper's three readings."""
    assert command("init", tmp_path / "study").returncode == 0
    return tmp_path / "study"


def as_yade(script: Path, text: str) -> dict[str, str]:
    """An environment in which a shell script is YADE."""
    script.write_text("#!/bin/sh\n" + text)
    script.chmod(0o755)
    return {**os.environ, "PELLET_STUDY_YADE": str(script)}


def test_yade_missing(study):
    found = command("bench", study, env={**os.environ, "PATH": "/nowhere", "PELLET_STUDY_YADE": ""})
    assert found.returncode == 2 and paragraph(found.stderr)
    assert "neither yadedaily nor yade is on the PATH" in found.stderr and "apt-get install yade" in found.stderr
    assert not (study / ".store").exists()


def test_yade_named_wrongly(study):
    found = command("bench", study, env={**os.environ, "PELLET_STUDY_YADE": "yaed"})
    assert found.returncode == 2 and paragraph(found.stderr) and "'yaed'" in found.stderr


def test_yade_too_old(study, tmp_path):
    old = as_yade(tmp_path / "old", 'echo "Yade version: 2018.02b"\n')
    found = command("bench", study, env=old)
    assert found.returncode == 2 and paragraph(found.stderr)
    assert "YADE 2018.02b" in found.stderr and "2023 or newer" in found.stderr


def test_a_build_without_a_functor_is_no_outcome_of_the_cases(study, tmp_path):
    without = tmp_path / "without.py"
    without.write_text(
        f"import runpy, sys, yade\ndel yade.{FUNCTOR}\nsys.argv = sys.argv[1:]\n"
        "runpy.run_path(sys.argv[0], run_name='__main__')\n"
    )
    poor = as_yade(
        tmp_path / "poor",
        f'[ "$1" = --version ] && exec yade --version\nexec yade -x -n -j1 "{without}" "$4" "$5"\n',
    )
    found = command("bench", study, "--effort", "0.02", env=poor)
    assert found.returncode == 3 and paragraph(found.stderr)
    assert FUNCTOR in found.stderr and "complete YADE" in found.stderr
    assert rows(study / ".store") == 0  # so a complete YADE of the same version finds nothing that is no answer


def test_a_bad_address_is_the_outcome_of_its_case_alone(tmp_path):
    found = run([faulty(1), faulty(2, BAD_ADDRESS), faulty(3)], tmp_path)
    assert found["status"][1].startswith("crashed YADE (SIGSEGV)")
    assert found["answer"][0] == 3 and found["answer"][2] == 9


def test_a_hang_that_never_returns_to_python_is_stopped(tmp_path):
    found = run([faulty(1, HANG_OUTSIDE), faulty(2)], tmp_path)
    assert found["status"][0] == "took longer than its time limit of 2 s"
    assert found["answer"][1] == 6
    assert simulating(tmp_path) == []


def test_a_case_that_took_too_long_is_tried_again_with_more_time(tmp_path):
    slow = faulty(1, pause_s=4.0)
    assert run([slow], tmp_path)["status"][0] == "took longer than its time limit of 2 s"
    assert run([slow], tmp_path)["status"][0] == "took longer than its time limit of 2 s"
    assert run([slow], tmp_path, time_limit_s=60)["answer"][0] == 3
    assert run([slow], tmp_path)["answer"][0] == 3


@pytest.mark.parametrize("rig", ["rebound", "slope_slip", "inclined_roll"])
def test_a_blow_up_is_no_result(tmp_path, rig):
    cases = [
        on_yade.case(rig, contact_law=law, numerics={"time_step_fraction": 5.0})
        for law in ("hertz_mindlin", "cohesive_frictional_local_damping")
    ]
    found = run(cases, tmp_path)
    assert (found["status"] != "ok").all(), found["status"].tolist()
    assert found[list(on_yade.rig(rig).observables)].isna().all(axis=None)


@pytest.mark.parametrize("fault, word", [(KILLED, "SIGKILL"), (MEMORY, "MemoryError")])
def test_killed_for_memory_is_no_outcome_of_the_case(tmp_path, fault, word):
    cases = [faulty(1), faulty(2, fault), faulty(3)]
    for _ in range(2):
        with pytest.raises(SimulationError, match=f"1 of .* killed, most likely for want of memory .*{word}"):
            run(cases, tmp_path, time_limit_s=60)
        assert rows(tmp_path) == 2


@pytest.fixture
def heard(number):
    """A signal that whoever started the tests in the background may have told them to ignore, as YADE then would."""
    before = signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    yield
    signal.signal(number, before)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGXCPU])
def test_a_signal_from_outside_is_no_outcome_of_the_case(tmp_path, number, heard):
    cases = [faulty(1), faulty(2, 100 + number), faulty(3)]
    how = "KeyboardInterrupt" if number == signal.SIGINT else number.name
    for _ in range(2):
        with pytest.raises(SimulationError, match=f"1 of .* cases are not done: .* from outside.*{how}.*Call again"):
            run(cases, tmp_path, time_limit_s=60)
        assert rows(tmp_path) == 2


@pytest.mark.parametrize("number", [signal.SIGSEGV, signal.SIGABRT, signal.SIGFPE])
def test_a_signal_of_the_case_is_its_outcome(tmp_path, number):
    found = run([faulty(1), faulty(2, 100 + number)], tmp_path, time_limit_s=60)
    assert found["status"][1].startswith(f"crashed YADE ({number.name})") and found["answer"][0] == 3


def test_an_end_in_peace_without_a_row_is_no_outcome_of_the_case(tmp_path):
    with pytest.raises(SimulationError, match="1 of 2 cases are not done.*exit status 0"):
        run([faulty(1), faulty(2, QUIET)], tmp_path, time_limit_s=60)
    assert rows(tmp_path) == 1


@pytest.mark.parametrize("code", [0, 143])
def test_a_yade_that_takes_up_no_case_is_not_started_for_ever(study, tmp_path, code):
    """A stub of YADE that ends in peace, or as by a signal, without looking at its cases."""
    idle = as_yade(
        tmp_path / "idle",
        f'[ "$1" = --version ] && exec yade --version\necho start >> "{tmp_path}/starts"\n'
        f"printf 'tired of \\033[2Jit\\n'\nexit {code}\n",
    )
    found = command("bench", study, "--effort", "0.02", env=idle)
    assert found.returncode == 3 and paragraph(found.stderr)
    assert "before its first case" in found.stderr and "tired of \\x1b[2Jit" in found.stderr
    assert "\x1b" not in found.stderr
    assert 1 < len((tmp_path / "starts").read_text().splitlines()) <= 10
    assert rows(study / ".store") == 0


def test_a_wrapper_that_closes_descriptors_is_told(study, tmp_path):
    """As sudo, docker and ssh do."""
    wrapper = tmp_path / "wrapper"
    wrapper.write_text(
        "#!/usr/bin/python3\nimport shutil, subprocess, sys\n"
        "sys.exit(subprocess.call([shutil.which('yade'), *sys.argv[1:]], close_fds=True))\n"
    )
    wrapper.chmod(0o755)
    found = command("bench", study, "--effort", "0.02", env={**os.environ, "PELLET_STUDY_YADE": str(wrapper)})
    assert found.returncode == 3 and paragraph(found.stderr)
    assert "must pass open descriptors and the environment on" in found.stderr


def test_a_yade_that_does_not_say_its_version_is_given_up(tmp_path, monkeypatch):
    """A stub of YADE that hangs, and leaves a process that holds its output."""
    stuck = as_yade(tmp_path / "stuck", "sleep 77 &\nsleep 78\n")
    monkeypatch.setattr(yade, "ANSWER_LIMIT_S", 1.0)
    monkeypatch.setenv("PELLET_STUDY_YADE", stuck["PELLET_STUDY_YADE"])
    for cached in (yade.executable, yade.version):
        cached.cache_clear()
    try:
        began = time.monotonic()
        with pytest.raises(SimulationError, match="did not end within 1 s.*PELLET_STUDY_YADE"):
            yade.version()
        assert time.monotonic() - began < 20
    finally:
        for cached in (yade.executable, yade.version):
            cached.cache_clear()


def test_a_grandchild_that_survives_does_not_keep_the_store(tmp_path):
    assert run([faulty(2, GRANDCHILD)], tmp_path)["answer"][0] == 6
    began = time.monotonic()
    assert run([faulty(3)], tmp_path, time_limit_s=60)["answer"][0] == 9
    assert time.monotonic() - began < 60


def test_killed_once_for_memory_is_tried_again_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("FAULTY_MARK", str(tmp_path / "mark"))
    found = run([faulty(1), faulty(2, KILLED_ONCE), faulty(3)], tmp_path / "store")
    assert list(found["answer"]) == [3, 6, 9]


def test_a_system_that_fails_a_case_stops_the_campaign_and_is_no_outcome(tmp_path):
    with pytest.raises(SimulationError, match="No space left on device.*call again"):
        run([faulty(1, FULL_DISK), faulty(2, FULL_DISK)], tmp_path, time_limit_s=60)
    assert rows(tmp_path) == 0 and simulating(tmp_path) == []


def test_the_time_limit_is_the_rigs_unless_one_is_given(monkeypatch):
    one = local.Campaign.__new__(local.Campaign)
    one.rigs = {name: on_yade.rig(name) for name in ("rebound", "inclined_roll")}
    one.limit_s = None
    assert [one.limit_of({"rig": name}) for name in one.rigs] == [60.0, 120.0]
    one.limit_s = 5.0
    assert [one.limit_of({"rig": name}) for name in one.rigs] == [5.0, 5.0]


def test_a_driver_that_dies_takes_a_hanging_yade_with_it(tmp_path):
    from tests.faults.driver import start

    driver = start(tmp_path / "store", tmp_path / "table.csv", 2, 0, HANG_OUTSIDE)
    claimed = tmp_path / "store"
    wait_until(lambda: any(f.stat().st_size for f in claimed.glob("campaign-*/*/claims")), driver)
    driver.kill()
    driver.wait()
    deadline = time.monotonic() + 2
    while simulating(claimed) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert simulating(claimed) == []


def test_the_environment_of_another_python_does_not_reach_yade(monkeypatch):
    for name in (
        "PYTHONPATH",
        "PYTHONHOME",
        "IPYTHONDIR",
        "CONDA_PREFIX",
        "VIRTUAL_ENV",
        "OMP_PROC_BIND",
        "SLURM_JOB_ID",
    ):
        monkeypatch.setenv(name, "/nowhere")
    given = yade.environment("/somewhere")
    assert not [name for name, value in given.items() if value == "/nowhere"]
    assert given["HOME"] == "/somewhere" and given["UCX_DEBUG_SIGNO"] == "0"


def test_numpy_says_nothing_of_what_it_does_without(tmp_path, monkeypatch):
    """Nothing that YADE's Python prints at its start may be taken for the last words of a process that died."""
    monkeypatch.setenv("NPY_ENABLE_CPU_FEATURES", "AVX2")  # numpy refuses both of them at once
    script = tmp_path / "quiet.py"
    script.write_text("import os\nimport numpy\nos._exit(3)\n")
    words = yade.command(script)
    done = subprocess.run(words, env=yade.environment(str(tmp_path)), capture_output=True, text=True)
    assert done.returncode == 3
    assert "CPU features" not in done.stdout + done.stderr and "AVX" not in done.stdout + done.stderr
