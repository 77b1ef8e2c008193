"""Faults of the store and the disk."""

import errno
import fcntl
import os
import subprocess
import sys

import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pellet_study.errors import InputError
from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch
from pellet_study.simulation.store import Store, key
from tests.faults.driver import ROOT, UNPRIVILEGED, command, paragraph, start
from yade_scripts.case import Table, flat, unsealed

CASES = 60


@pytest.fixture(scope="module")
def filled(tmp_path_factory):
    """A store of twenty rebounds, its table and rows; written here, as YADE writes them."""
    store = Store(tmp_path_factory.mktemp("store"))
    rig = on_yade.rig("rebound")
    table = Table(store.table(rig), store.columns(rig), checked=True)
    for seed in range(20):
        case = {**on_yade.case("rebound", seed=seed), "id": f"{seed:020x}"}
        status = "ok" if seed % 3 else 'crashed YADE (SIGABRT): "quoted", with a comma'
        height = {"rebound_height_mm": 7.1 + seed / 7} if status == "ok" else {}
        table.append({**flat(case), **height, "status": status})
    return store, rig, store.table(rig).read_bytes(), store.rows(rig)


def test_rows_come_back_with_every_digit(filled):
    _, _, _, whole = filled
    assert whole.loc[f"{1:020x}", "rebound_height_mm"] == 7.1 + 1 / 7
    assert whole.loc[f"{0:020x}", "status"] == 'crashed YADE (SIGABRT): "quoted", with a comma'


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_whatever_is_done_to_the_table_no_row_is_altered_unnoticed(filled, data):
    store, rig, written, whole = filled
    broken = bytearray(written)
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, max(0, len(broken) - 1)))
        kind = data.draw(st.sampled_from(["cut", "drop", "insert", "overwrite", "flip"]))
        piece = data.draw(st.binary(min_size=1, max_size=40))
        if kind == "cut":
            del broken[place:]
        elif kind == "drop":
            del broken[place : place + len(piece)]
        elif kind == "insert":
            broken[place:place] = piece
        elif kind == "overwrite":
            broken[place : place + len(piece)] = piece
        elif broken:
            broken[place] ^= 1 << data.draw(st.integers(0, 7))
    try:
        store.table(rig).write_bytes(bytes(broken))
        found = store.rows(rig)
    finally:
        store.table(rig).write_bytes(written)
    assert set(found.index) <= set(whole.index)
    if len(found):
        same = whole.loc[found.index]
        pd.testing.assert_frame_equal(found, same, check_dtype=False)


def test_a_store_whose_lines_are_torn_is_completed(tmp_path, caplog):
    cases = [on_yade.case("rebound", seed=seed) for seed in range(4)]
    first = dispatch.run(cases, tmp_path)
    table = Store(tmp_path).table(on_yade.rig("rebound"))
    lines = table.read_bytes().splitlines(keepends=True)
    one_digit = bytearray(lines[2])
    one_digit[60] = ord("1") if one_digit[60] != ord("1") else ord("2")
    table.write_bytes(b"".join([lines[0], lines[1], one_digit, b"foreign,1,2\n", lines[4][:-12]]))
    pd.testing.assert_frame_equal(first, dispatch.run(cases, tmp_path))
    assert "3 damaged or foreign lines" in caplog.text
    assert sum(unsealed(line) is not None for line in table.read_bytes().splitlines()) == 4


def test_a_folder_where_the_table_should_be_is_named(tmp_path):
    store = Store(tmp_path)
    store.table(on_yade.rig("rebound")).mkdir()
    with pytest.raises(InputError, match="expected a table of finished cases"):
        dispatch.run([on_yade.case("rebound")], tmp_path)


def test_a_store_that_is_a_link_is_refused(tmp_path):
    study, other = tmp_path / "study", tmp_path / "other"
    study.mkdir()
    other.mkdir()
    (study / "study.toml").touch()
    (study / ".store").symlink_to(other)
    with pytest.raises(InputError, match="link to"):
        dispatch.run([on_yade.case("rebound")], study / ".store")
    (study / ".store").unlink()
    (study / ".store").mkdir()
    for name in ("lock", Store(other).table(on_yade.rig("rebound")).name, "timings.csv", "means.csv"):
        (study / ".store" / name).symlink_to(other / "kept")
        with pytest.raises(InputError, match=f"{name} is a link to"):
            dispatch.run([on_yade.case("rebound")], study / ".store")
        (study / ".store" / name).unlink()
    assert not list(other.iterdir())


def test_a_folder_of_somebody_else_in_the_store_stays(tmp_path):
    (tmp_path / "campaign-2026").mkdir()
    (tmp_path / "campaign-2026" / "readings.csv").write_text("mine\n")
    with Store(tmp_path) as store:
        left = store.new_campaign()
    with Store(tmp_path):
        assert not left.exists() and (tmp_path / "campaign-2026" / "readings.csv").read_text() == "mine\n"


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_disk_without_locks_is_named(tmp_path, monkeypatch, number):
    """A stand-in for NFS or Lustre mounted without locks."""

    def refuse(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with pytest.raises(InputError, match="no locks.*put the study on a disk that has locks") as refused:
        dispatch.run([on_yade.case("rebound")], tmp_path / ".store")
    assert str(tmp_path / ".store") in str(refused.value)


ON_A_SMALL_DISK = """
mount -t tmpfs -o size={size}k small "{disk}" || exit 90
"{python}" -m tests.faults.driver "{disk}/store" "{disk}/runs.csv" {cases}; echo "ended with $?"
mount -o remount,size=20m "{disk}"
"{python}" -m tests.faults.driver "{disk}/store" "{disk}/runs.csv" {cases}; echo "ended with $?"
wc -l < "$(ls "{disk}"/store/rebound-*.csv)"
cp "{disk}/runs.csv" "{kept}"
"""


@pytest.mark.parametrize("size", [56, 92])
def test_a_disk_that_fills_loses_no_finished_case(tmp_path, size):
    """A real full disk: a file system of a few kilobytes, made larger afterwards."""
    disk = tmp_path / "disk"
    disk.mkdir()
    kept = tmp_path / "kept.csv"
    script = ON_A_SMALL_DISK.format(size=size, disk=disk, python=sys.executable, cases=CASES, kept=kept)
    found = subprocess.run(["unshare", "-rm", "sh", "-c", script], cwd=ROOT, capture_output=True, text=True)
    if found.returncode == 90 or "unshare" in found.stderr:
        pytest.skip(f"no file system can be mounted here: {found.stderr}")
    ends = [line for line in found.stdout.splitlines() if line.startswith("ended")]
    assert ends == ["ended with 1", "ended with 0"], found.stdout + found.stderr
    assert "No space left on device" in found.stderr and "call again" in found.stderr
    assert "damaged" not in found.stderr  # a row is written whole or not at all
    driver = start(tmp_path / "store", tmp_path / "runs.csv", CASES)
    assert driver.wait() == 0
    assert kept.read_bytes() == (tmp_path / "runs.csv").read_bytes()
    assert int(found.stdout.split()[-1]) == CASES + 1  # no case was simulated twice


def test_a_study_that_may_not_be_written_to_is_refused_at_once(tmp_path):
    study = tmp_path / "study"
    assert command("init", study).returncode == 0
    files = {file: file.read_bytes() for file in study.iterdir()}
    study.chmod(0o555)
    try:
        for words in (["bench", study], ["compare", study], ["refine", study]):
            found = command(*words, before=UNPRIVILEGED)
            assert found.returncode == 2 and paragraph(found.stderr)
            assert str(study) in found.stderr and "you may not write there" in found.stderr
    finally:
        study.chmod(0o755)
    assert {file: file.read_bytes() for file in study.iterdir()} == files


def test_a_store_of_somebody_else_is_named(tmp_path):
    study = tmp_path / "study"
    assert command("init", study).returncode == 0
    (study / ".store").mkdir(mode=0o555)
    found = command("bench", study, before=UNPRIVILEGED)
    assert found.returncode == 2 and paragraph(found.stderr) and "Permission denied" in found.stderr
    assert str(study / ".store") in found.stderr


def test_another_version_is_another_case(monkeypatch):
    case = on_yade.case("rebound")
    before = key(case, on_yade.rig("rebound"))
    monkeypatch.setattr("pellet_study.simulation.yade.version", lambda: "2031.01a")
    assert key(case, on_yade.rig("rebound")) != before
