"""The driver, on real YADE processes; faults come from tests/helpers/fault_rigs, whose rig simulates nothing."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from pellet_study.errors import InputError, SimulationError
from pellet_study.rigs import on_yade
from pellet_study.rigs.declarations import rig_in
from pellet_study.simulation import dispatch, local, yade
from tests import HELPERS
from tests.helpers.listening import listening

pytestmark = pytest.mark.yade

NONE, ABORT, HANG, NAN, EXCEPTION, REFUSED, EXIT, QUIET, EMPTY, TYPO = range(10)


FAULTY = rig_in(HELPERS / "fault_rigs" / "faulty.py")


def faulty(seed: int, fault: int = NONE, pause_s: float = 0.0) -> dict:
    return on_yade.case(FAULTY, seed=seed, conditions={"fault": fault, "pause_s": pause_s})


def run(cases: list[dict], store: Path, **more) -> pd.DataFrame:
    """A campaign with the faulty rig."""
    return dispatch.run(cases, store, rigs={"faulty": FAULTY}, **more)


def claimed_by_nobody(folder: Path) -> bool:
    """No process has this folder's campaign on its command line."""
    found = subprocess.run(["pgrep", "-f", str(folder)], capture_output=True, text=True)
    return not [pid for pid in found.stdout.split() if int(pid) != os.getpid()]


def test_rows_come_in_the_order_of_the_cases_and_are_stored(tmp_path):
    cases = [faulty(seed) for seed in (5, 1, 3, 1)]
    rows = run(cases, tmp_path / "store")
    assert list(rows["answer"]) == [15, 3, 9, 3]
    assert set(rows["status"]) == {"ok"}
    stored = pd.concat(pd.read_csv(f) for f in (tmp_path / "store").glob("faulty-*.csv"))
    assert len(stored) == 3  # the case asked twice was run once


def test_a_relative_store_is_found_by_the_processes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert list(run([faulty(2)], Path("study/.store"))["answer"]) == [6]


def test_stored_cases_start_no_yade(tmp_path, monkeypatch):
    cases = [faulty(seed) for seed in range(4)]
    first = run(cases, tmp_path)
    monkeypatch.setattr(local.subprocess, "Popen", lambda *a, **k: pytest.fail("a stored case was simulated again"))
    pd.testing.assert_frame_equal(first, run(cases, tmp_path))


def test_a_failing_case_is_recorded_and_its_neighbours_are_not_lost(tmp_path):
    faults = [NONE, ABORT, NONE, NAN, EXCEPTION, REFUSED, EXIT, HANG, NONE, EMPTY, TYPO]
    rows = run([faulty(k, fault) for k, fault in enumerate(faults)], tmp_path, time_limit_s=15)
    assert list(rows.loc[rows["status"] == "ok", "answer"]) == [0, 6, 24]
    failed = {fault: status for fault, status in zip(faults, rows["status"], strict=True) if fault != NONE}
    assert failed[ABORT] == "crashed YADE (SIGABRT): these are the last words"
    assert failed[HANG] == "took longer than its time limit of 15 s"
    assert failed[NAN] == "not a number: answer"
    assert failed[EXCEPTION] == "ZeroDivisionError: an exception in the rig"
    assert failed[REFUSED] == "the rig's own check refused it"
    assert failed[EXIT].startswith("crashed YADE (exit status 3)")
    assert failed[EMPTY] == "failed without a reason"
    assert failed[TYPO] == "ValueError: simulate returned ['answr'], expected ['answer']"
    assert rows.loc[rows["status"] != "ok", "answer"].isna().all()


def test_failures_are_answers_and_not_tried_again(tmp_path, monkeypatch):
    cases = [faulty(0, ABORT), faulty(1)]
    first = run(cases, tmp_path)
    monkeypatch.setattr(local.subprocess, "Popen", lambda *a, **k: pytest.fail("a recorded failure was tried again"))
    pd.testing.assert_frame_equal(first, run(cases, tmp_path))


DRIVER = """
import sys
from pathlib import Path
from pellet_study.rigs import case
from pellet_study.rigs.declarations import rig_in
from pellet_study.simulation import dispatch
faulty = rig_in(Path(sys.argv[1]))
cases = [case(faulty, seed=k, conditions={"pause_s": 0.25}) for k in range(int(sys.argv[3]))]
dispatch.run(cases, Path(sys.argv[2]), rigs={"faulty": faulty})
"""


def start_driver(store: Path, number: int) -> subprocess.Popen:
    """A driver of its own; Ctrl-C reaches it even where the tests themselves were started in the background."""
    return subprocess.Popen(
        [sys.executable, "-c", DRIVER, str(FAULTY.script), str(store), str(number)],
        stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def stored(store: Path) -> int:
    return sum(max(0, len(f.read_text().splitlines()) - 1) for f in store.glob("faulty-*.csv"))


@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_a_killed_driver_leaves_no_process_and_the_next_call_goes_on(tmp_path, blow):
    store = tmp_path / "store"
    driver = start_driver(store, 40)
    deadline = time.monotonic() + 240
    while stored(store) < 4 and time.monotonic() < deadline:
        time.sleep(0.05)
    driver.send_signal(blow)
    driver.wait(timeout=10)
    time.sleep(1.5)
    assert claimed_by_nobody(store)
    kept = stored(store)
    assert 4 <= kept < 40
    rows = run([faulty(k, pause_s=0.25) for k in range(40)], store)
    assert list(rows["answer"]) == [3 * k for k in range(40)]
    assert stored(store) == 40  # only what was missing has been run
    assert not list(store.glob("campaign-*"))


def test_two_drivers_on_one_store_share_its_work(tmp_path):
    store = tmp_path / "store"
    drivers = [start_driver(store, 12) for _ in range(2)]
    assert [driver.wait(timeout=240) for driver in drivers] == [0, 0]
    assert stored(store) == 12


def test_a_script_that_changes_during_a_campaign_stops_it(tmp_path, monkeypatch):
    monkeypatch.setattr(local, "fingerprint", lambda *files: "another")
    with pytest.raises(SimulationError, match="changed while it was running"):
        run([faulty(0)], tmp_path)


def test_torn_and_foreign_lines_in_the_store_are_computed_again(tmp_path):
    cases = [faulty(seed) for seed in range(4)]
    first = run(cases, tmp_path)
    table = next(tmp_path.glob("faulty-*.csv"))
    lines = table.read_text().splitlines()
    table.write_text("\n".join([*lines[:3], "rubbish", lines[4][:25]]))  # the last row torn, one lost, one line foreign
    pd.testing.assert_frame_equal(first, run(cases, tmp_path))
    table.write_bytes(b"\x00\xff not a table \x00\n")
    pd.testing.assert_frame_equal(first, run(cases, tmp_path))


def watch_ports(process: subprocess.Popen, mark: Path) -> tuple[list[str], int]:
    """Listening sockets of processes with `mark` on their command line while one lives, and how often they were seen."""
    seen, looks = [], 0
    while process.poll() is None:
        pids = set(subprocess.run(["pgrep", "-f", str(mark)], capture_output=True, text=True).stdout.split())
        pids.discard(str(process.pid))
        seen += listening(pids)
        looks += bool(pids)
        time.sleep(0.005)
    return seen, looks


def test_yade_never_listens_not_even_while_it_starts(tmp_path):
    driver = start_driver(tmp_path / "store", 6)
    seen, looks = watch_ports(driver, tmp_path)
    assert looks > 20
    assert seen == []


def test_the_watch_sees_yade_listen_when_it_is_started_plainly(tmp_path):
    """The test above can fail: a plain YADE does open its ports."""
    script = tmp_path / "plain.py"
    script.write_text("import time\ntime.sleep(1.5)\n")
    process = subprocess.Popen(
        ["sh", "-c", f"yade -x -n -j1 '{script}'; true"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    seen, _ = watch_ports(process, script)
    assert seen


def test_no_temporary_folder_is_left(tmp_path):
    before = set(Path("/tmp").glob("yade-*"))
    run([faulty(0), faulty(1, ABORT), faulty(2)], tmp_path)
    left = set(Path("/tmp").glob("yade-*")) - before
    time.sleep(5)  # a YADE somebody else starts meanwhile removes its own
    assert {folder for folder in left if folder.exists()} == set()


def test_yadedaily_is_preferred_and_a_venv_does_not_leak(tmp_path, monkeypatch):
    """A wrapper named yadedaily is called, without the variables that would bring in another Python's packages."""
    record = tmp_path / "called with"
    wrapper = tmp_path / "bin" / "yadedaily"
    wrapper.parent.mkdir()
    wrapper.write_text(f'#!/bin/sh\nenv > "{record}"\nyade "$@"\n')
    wrapper.chmod(0o755)
    monkeypatch.setenv("PATH", f"{wrapper.parent}:{os.environ['PATH']}")
    monkeypatch.delenv("PELLET_STUDY_YADE", raising=False)
    monkeypatch.setenv("PYTHONPATH", "/nowhere")
    monkeypatch.setenv("VIRTUAL_ENV", "/nowhere")
    monkeypatch.delenv("HOME")
    yade.executable.cache_clear()
    try:
        rows = run([faulty(7)], tmp_path / "a store, with 'quotes' and ümlauts")
        assert list(rows["answer"]) == [21]
        seen = record.read_text()
        assert "PYTHONPATH" not in seen and "VIRTUAL_ENV" not in seen and "\nHOME=" in "\n" + seen
    finally:
        yade.executable.cache_clear()


def test_no_yade_says_how_to_install_it(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("PELLET_STUDY_YADE", raising=False)
    yade.executable.cache_clear()
    try:
        with pytest.raises(InputError, match="apt-get install yade"):
            yade.executable()
    finally:
        yade.executable.cache_clear()


def test_a_yade_that_does_not_run_ends_the_campaign_with_its_words(monkeypatch, tmp_path):
    broken = tmp_path / "broken"
    broken.write_text(
        '#!/bin/sh\n[ "$1" = --version ] && echo "Yade version: 0" && exit 0\necho "no such library" >&2\nexit 1\n'
    )
    broken.chmod(0o755)
    monkeypatch.setenv("PELLET_STUDY_YADE", str(broken))
    yade.executable.cache_clear()
    yade.version.cache_clear()
    try:
        with pytest.raises(SimulationError, match="no such library"):
            run([faulty(0)], tmp_path / "store")
    finally:
        yade.executable.cache_clear()
        yade.version.cache_clear()


def test_the_same_case_gives_the_same_bits_alone_and_among_others(tmp_path):
    one = [on_yade.case("rebound", seed=3)]
    many = [on_yade.case("rebound", seed=k) for k in range(6)]
    alone = dispatch.run(one, tmp_path / "alone", workers=1)
    among = dispatch.run(many, tmp_path / "among", workers=2)
    assert float(alone["rebound_height_mm"][0]) == float(among["rebound_height_mm"][3])


def test_unknown_names_are_refused_with_the_nearest():
    with pytest.raises(InputError, match="did you mean 'rebound'"):
        on_yade.case("rebund")
    with pytest.raises(InputError, match="did you mean 'drop_height_mm'"):
        on_yade.case("rebound", conditions={"drop_hight_mm": 3})
