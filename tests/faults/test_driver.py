"""Faults of the driver: killed, interrupted, doubled; on real rebounds where the answer is compared."""

import os
import random
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.faults.driver import command, rows, simulating, start, wait_until
from tests.helpers.make_study import incline

CASES, MANY = 40, 500
BLOWS = 20


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory) -> bytes:
    """The table of a campaign that nothing happened to."""
    folder = tmp_path_factory.mktemp("undisturbed")
    driver = start(folder / "store", folder / "runs.csv", CASES)
    assert driver.wait() == 0, driver.stderr.read()
    return (folder / "runs.csv").read_bytes()


def test_killed_twenty_times_the_table_is_the_same_to_the_byte(tmp_path):
    store, table, dice = tmp_path / "store", tmp_path / "runs.csv", random.Random(7)
    killed = 0
    while killed < BLOWS:
        driver, had = start(store, table, MANY), rows(store)
        if killed % 4 == 0:
            time.sleep(dice.uniform(0.0, 2.0))  # anywhere: imports, lock, start of YADE
        else:
            more = dice.randint(1, 5)
            wait_until(lambda had=had, more=more: rows(store) >= had + more, driver)
            time.sleep(dice.uniform(0.0, 0.05))
        assert driver.poll() is None, f"it was done after {killed} blows, make MANY larger: {driver.stderr.read()}"
        driver.kill()
        driver.wait()
        killed += 1
    assert not table.exists() and 0 < rows(store) < MANY
    last = start(store, table, MANY)
    assert last.wait() == 0, last.stderr.read()
    whole = start(tmp_path / "undisturbed", tmp_path / "undisturbed.csv", MANY)
    assert whole.wait() == 0, whole.stderr.read()
    assert table.read_bytes() == (tmp_path / "undisturbed.csv").read_bytes()
    assert rows(store) == MANY  # what was finished was not simulated again
    assert not list(store.glob("campaign-*")) and simulating(store) == []


@pytest.mark.parametrize("times", [1, 2])
def test_ctrl_c_once_or_twice_ends_with_130_and_keeps_what_was_finished(tmp_path, times):
    study = tmp_path / "study"
    assert command("init", study).returncode == 0
    driver = subprocess.Popen(
        [*command_line(), "bench", str(study), "--effort", "0.05"],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    wait_until(lambda: rows(study / ".store") >= 4, driver)
    for _ in range(times):
        driver.send_signal(signal.SIGINT)
        time.sleep(0.02)
    said = driver.communicate(timeout=60)[1]
    assert driver.returncode == 130
    assert "Traceback" not in said and "what was finished is kept" in said
    kept = rows(study / ".store")
    wait_until(lambda: not simulating(study / ".store"))
    assert rows(study / ".store") == kept >= 4


def command_line() -> list[str]:
    """How `command` calls it."""
    import sys

    return [sys.executable, "-m", "pellet_study"]


def test_the_store_is_held_until_the_last_process_of_a_killed_driver_has_ended(tmp_path):
    """A process of YADE that is stopped cannot die with its driver; the next driver waits for it."""
    store, table = tmp_path / "store", tmp_path / "runs.csv"
    first = start(store, table, 6, 1.0)
    wait_until(lambda: rows(store) >= 1, first)
    lock = held_by(simulating(store)[0], store / "lock")
    child = subprocess.Popen(["sleep", "3600"], pass_fds=[lock])
    os.close(lock)
    first.kill()
    first.wait()
    wait_until(lambda: not simulating(store))
    second = start(store, table, 6, 1.0)
    try:
        assert "waiting for another pellet-study" in second.stderr.readline()
        assert second.poll() is None and rows(store) < 6
    finally:
        child.kill()
        child.wait()
    assert second.wait() == 0, second.stderr.read()
    assert rows(store) == 6


def held_by(pid: int, lock: Path) -> int:
    """A descriptor of ours that shares the lock of a process's descriptor, as a child of its would."""
    number = next(fd for fd in os.listdir(f"/proc/{pid}/fd") if os.readlink(f"/proc/{pid}/fd/{fd}") == str(lock))
    getter = __import__("ctypes").CDLL(None, use_errno=True).syscall
    pidfd = os.pidfd_open(pid)
    found = getter(438, pidfd, int(number), 0)  # pidfd_getfd
    os.close(pidfd)
    assert found >= 0
    return found


def test_two_drivers_write_one_table(tmp_path, undisturbed):
    drivers = [start(tmp_path / "store", tmp_path / f"runs{k}.csv", CASES) for k in range(2)]
    assert [driver.wait() for driver in drivers] == [0, 0]
    assert [(tmp_path / f"runs{k}.csv").read_bytes() for k in range(2)] == [undisturbed] * 2
    assert rows(tmp_path / "store") == CASES


def test_two_commands_that_edit_one_study_lose_nothing(tmp_path):
    study = incline(tmp_path / "study", c=60.0)
    both = [
        subprocess.Popen(
            [*command_line(), "add", str(study), effect], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        for effect in ("cohesion", "side_wall_friction")
    ]
    assert [process.wait() for process in both] == [0, 0], [process.stderr.read() for process in both]
    written = (study / "study.toml").read_text()
    assert "cohesion = " in written and "side_wall_friction = " in written
    assert not list(study.glob("*.new"))


CLOCK = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <sys/time.h>
#include <time.h>
static long back(void) { static long n; return 10 * ++n; }  /* each look at the clock is ten seconds earlier */
int clock_gettime(clockid_t id, struct timespec *t) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    int status = real(id, t);
    if (id == CLOCK_REALTIME) t->tv_sec -= back();
    return status;
}
int gettimeofday(struct timeval *t, void *zone) {
    struct timespec now; clock_gettime(CLOCK_REALTIME, &now);
    t->tv_sec = now.tv_sec; t->tv_usec = now.tv_nsec / 1000; return 0;
}
time_t time(time_t *t) { struct timespec now; clock_gettime(CLOCK_REALTIME, &now); if (t) *t = now.tv_sec; return now.tv_sec; }
"""


@pytest.mark.skipif(not shutil.which("cc"), reason="needs a C compiler to turn the clock back for some processes only")
def test_a_clock_that_goes_backwards_changes_nothing(tmp_path, undisturbed):
    source, library = tmp_path / "clock.c", tmp_path / "clock.so"
    source.write_text(CLOCK)
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
    environment = {**os.environ, "LD_PRELOAD": str(library)}
    looks = subprocess.run(
        ["python3", "-c", "import time; print(time.time() > time.time())"],
        env=environment,
        capture_output=True,
        text=True,
    )
    assert looks.stdout.strip() == "True"
    driver = start(tmp_path / "store", tmp_path / "runs.csv", CASES, env=environment)
    assert driver.wait() == 0, driver.stderr.read()
    assert (tmp_path / "runs.csv").read_bytes() == undisturbed
