"""A campaign on Dask: a real scheduler and two worker processes on this machine, real rebounds.

SLURM alone has a stand-in: an `sbatch` that starts the job it is given on this machine.
"""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pellet_study.commands import SIMULATING
from tests.faults.driver import command, paragraph, rows, simulating, start, wait_until
from tests.helpers.listening import listening

pytest.importorskip("distributed")
CASES = 40
DASK = Path(sys.executable).with_name("dask")


class Cluster:
    """A scheduler and its workers, in processes of their own."""

    def __init__(self, folder: Path):
        self.folder, self.port, self.processes = folder, 0, []
        folder.mkdir()

    def _start(self, words: list, name: str, **more) -> subprocess.Popen:
        log = open(self.folder / f"{name}.log", "ab")  # noqa: SIM115
        process = subprocess.Popen([DASK, *words], stdout=log, stderr=log, start_new_session=True, **more)
        self.processes.append(process)
        return process

    def scheduler(self) -> subprocess.Popen:
        """Start the scheduler, at the same port as before where there was one."""
        file = self.folder / "scheduler.json"
        file.unlink(missing_ok=True)
        words = ["scheduler", "--host", "127.0.0.1", "--port", self.port, "--no-dashboard", "--scheduler-file", file]
        process = self._start(list(map(str, words)), "scheduler")
        wait_until(lambda: file.exists() and file.stat().st_size > 0, process)
        self.port = int(self.address.rpartition(":")[2])
        return process

    @property
    def address(self) -> str:
        """The scheduler's."""
        return json.loads((self.folder / "scheduler.json").read_text())["address"]

    def worker(self, **environment) -> subprocess.Popen:
        """Start a worker of one thread."""
        name = f"worker{len(self.processes)}"
        words = ["worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
        words += ["--local-directory", str(self.folder / name)]
        scratch = self.folder / f"{name}-tmp"
        scratch.mkdir()
        return self._start(words, name, env={**os.environ, "TMPDIR": str(scratch), **environment})

    def run(self, folder: Path, number: int = CASES) -> subprocess.Popen:
        """A campaign on it."""
        return start(
            folder / "store", folder / "runs.csv", number, env={**os.environ, "PELLET_STUDY_SCHEDULER": self.address}
        )

    def simulating(self) -> list[int]:
        """Processes of YADE of its workers."""
        return simulating(self.folder)


@pytest.fixture
def cluster(tmp_path):
    made = Cluster(tmp_path / "cluster")
    yield made
    for process in made.processes:
        if process.poll() is None:
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def local(tmp_path_factory) -> bytes:
    """The table of the same campaign without Dask."""
    folder = tmp_path_factory.mktemp("local")
    driver = start(folder / "store", folder / "runs.csv", CASES)
    assert driver.wait() == 0, driver.stderr.read()
    return (folder / "runs.csv").read_bytes()


def ended_well(driver: subprocess.Popen, folder: Path) -> str:
    """What a campaign said that ended well; its store holds each case once."""
    said = driver.communicate()[1]
    assert driver.returncode == 0, said
    assert rows(folder / "store") == CASES
    return said


def test_two_workers_give_the_local_table_to_the_byte(tmp_path, cluster, local):
    cluster.scheduler()
    for _ in range(2):
        cluster.worker()
    ended_well(cluster.run(tmp_path), tmp_path)
    assert (tmp_path / "runs.csv").read_bytes() == local
    logs = [(cluster.folder / f"worker{k}.log").read_text() for k in (1, 2)]
    assert all("Registered to" in log for log in logs)
    assert not list(cluster.folder.glob("worker*-tmp/pellet-study-*"))  # workers keep nothing


def test_a_worker_killed_in_the_middle(tmp_path, cluster, local):
    cluster.scheduler()
    first, _ = cluster.worker(), cluster.worker()
    driver = cluster.run(tmp_path)
    wait_until(
        lambda: rows(tmp_path / "store") >= 5 and any(simulating(d) for d in cluster.folder.glob("worker1-tmp")), driver
    )
    assert driver.poll() is None
    first.kill()
    first.wait()
    ended_well(driver, tmp_path)
    assert (tmp_path / "runs.csv").read_bytes() == local
    wait_until(lambda: not cluster.simulating())


def test_the_scheduler_gone_and_back(tmp_path, cluster, local):
    scheduler = cluster.scheduler()
    workers = [cluster.worker() for _ in range(2)]
    driver = cluster.run(tmp_path)
    wait_until(lambda: rows(tmp_path / "store") >= 5, driver)
    assert driver.poll() is None
    for process in (scheduler, *workers):  # a batch system would end the workers' jobs as well
        process.kill()
        process.wait()
    kept = rows(tmp_path / "store")
    cluster.scheduler()
    for _ in range(2):
        cluster.worker()
    said = ended_well(driver, tmp_path)
    assert "lost the scheduler" in said
    assert 5 <= kept < CASES and (tmp_path / "runs.csv").read_bytes() == local


@pytest.mark.parametrize("broken", ["result", "submit"])
def test_a_connection_that_ends_at_any_step_loses_no_case(tmp_path, monkeypatch, broken):
    from distributed.comm import CommClosedError

    from pellet_study.rigs import on_yade
    from pellet_study.simulation import cluster, store

    class Gone:
        """A client whose connection ends at one step, and the future it gives."""

        def __init__(self, status="running"):
            self.status = status

        def nthreads(self):
            return {"worker": 1}

        def run(self, *_, **__):
            return {"worker": None}

        def cancel(self, futures):
            pass

        def submit(self, *_, **__):
            if broken == "submit":
                raise CommClosedError
            return Gone("finished")

        def result(self, **__):
            raise CommClosedError

    rig = on_yade.rig("rebound")
    cases = [{**on_yade.case(rig, seed=seed), "id": str(seed)} for seed in range(8)]
    work = cluster._Work(cases, store.Store(tmp_path), {rig.name: rig}, None)
    with pytest.raises(cluster.SchedulerLost):
        work.run(Gone())
    assert [case["id"] for case in work.unfinished] == [case["id"] for case in cases]


def test_a_worker_without_yade_is_left_out_and_named(tmp_path, cluster, local):
    cluster.scheduler()
    cluster.worker(PATH="/nowhere")
    cluster.worker()
    said = ended_well(cluster.run(tmp_path), tmp_path)
    assert "is left out: YADE was not found" in said
    assert (tmp_path / "runs.csv").read_bytes() == local
    (tmp_path / "none").mkdir()
    cluster.processes.pop().kill()
    other = cluster.run(tmp_path / "none")
    said = other.communicate()[1]
    assert other.returncode == 1 and "no worker of the Dask scheduler can simulate: YADE was not found" in said


def test_ctrl_c_ends_with_130_and_keeps_what_came_back(tmp_path, cluster):
    study = tmp_path / "study"
    assert command("init", study).returncode == 0
    cluster.scheduler()
    cluster.worker()
    driver = subprocess.Popen(
        [sys.executable, "-m", "pellet_study", "bench", study, "--effort", "0.05", "--scheduler", cluster.address],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    wait_until(lambda: rows(study / ".store") >= 1, driver)
    driver.send_signal(signal.SIGINT)
    said = driver.communicate()[1]
    assert driver.returncode == 130 and "what was finished is kept" in said and "Traceback" not in said
    assert rows(study / ".store") >= 1


@pytest.mark.parametrize(
    "address, words",
    [
        ("tcp://127.0.0.1:1", "no Dask scheduler answers"),
        ("head:8786", "expected tcp://HOST:PORT, or slurm:JOBS"),
        ("slurm:0", "expected tcp://HOST:PORT, or slurm:JOBS"),
        ("gopher://127.0.0.1:1", "gopher"),
    ],
)
def test_a_scheduler_that_is_none(tmp_path, address, words):
    study = tmp_path / "study"
    assert command("init", study).returncode == 0
    found = command("bench", study, "--scheduler", address)
    assert found.returncode == 2 and paragraph(found.stderr) and words in found.stderr


def test_without_dask_the_extra_is_named_and_the_local_path_does_not_load_it(tmp_path):
    program = (
        "import sys; sys.modules['distributed'] = None\n"
        "from pellet_study.__main__ import main; sys.exit(main(sys.argv[1:]))"
    )
    study = tmp_path / "study"
    assert command("init", study).returncode == 0
    words = [sys.executable, "-c", program, "bench", study, "--scheduler", "tcp://127.0.0.1:1"]
    found = subprocess.run(words, capture_output=True, text=True)
    assert found.returncode == 2 and "pip install 'pellet-study[dask]'" in found.stderr
    loaded = "import sys, pellet_study.simulation.dispatch; assert not {'dask', 'distributed'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", loaded], check=True)


SBATCH = """#!/bin/sh
# the last argument is the job's script: run it here, in the background, as SLURM would on a node
for script; do :; done
cp "$script" "{folder}/job.sh"
setsid sh "{folder}/job.sh" > "{folder}/job.log" 2>&1 < /dev/null &
echo $! >> "{folder}/jobs"
echo "Submitted batch job $!"
"""
SCANCEL = '#!/bin/sh\nkill -9 -- "-$1" 2>/dev/null || kill -9 "$1" 2>/dev/null; true\n'
JOBQUEUE = """jobqueue:
  slurm:
    cores: 1
    processes: 1
    memory: 2GB
    walltime: "00:30:00"
    interface: lo
    local-directory: {folder}
    job-extra-directives: []
"""


@pytest.fixture
def slurm(tmp_path) -> dict[str, str]:
    """The environment of a machine with that SLURM."""
    folder, commands = tmp_path / "slurm", tmp_path / "bin"
    folder.mkdir()
    commands.mkdir()
    for name, text in (("sbatch", SBATCH.format(folder=folder)), ("scancel", SCANCEL)):
        (commands / name).write_text(text)
        (commands / name).chmod(0o755)
    (tmp_path / "dask").mkdir()
    (tmp_path / "dask" / "jobqueue.yaml").write_text(JOBQUEUE.format(folder=folder))
    return {
        **os.environ,
        "PATH": f"{commands}:{os.environ['PATH']}",
        "DASK_CONFIG": str(tmp_path / "dask"),
        "PELLET_STUDY_SCHEDULER": "slurm:1",
    }


def named(word: Path) -> list[int]:
    """Processes whose arguments name it."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                found += [int(entry.name)] if bytes(word) in (entry / "cmdline").read_bytes() else []
            except OSError:
                continue
    return found


def test_slurm_jobs_give_the_local_table_and_only_this_machine_hears_them(tmp_path, slurm, local):
    pytest.importorskip("dask_jobqueue")
    folder = tmp_path / "slurm"
    driver = start(tmp_path / "store", tmp_path / "runs.csv", CASES, env=slurm)
    seen, open_to_others = set(), []
    try:
        while driver.poll() is None:
            seen |= {(pid == driver.pid, at) for pid in (driver.pid, *named(folder)) for at in listening([pid])}
            keys = tmp_path.glob("store/campaign-*/key.pem")
            open_to_others += [
                file for file in keys if file.stat().st_mode & 0o077 or file.parent.stat().st_mode & 0o077
            ]
            time.sleep(0.2)
        said = ended_well(driver, tmp_path)
    finally:
        for job in (folder / "jobs").read_text().split() if (folder / "jobs").exists() else []:
            subprocess.run([tmp_path / "bin" / "scancel", job], check=False)
    assert (tmp_path / "runs.csv").read_bytes() == local
    script = (folder / "job.sh").read_text()
    assert "#SBATCH -t 00:30:00" in script and "tls://127.0.0.1:" in script and "--tls-key" in script
    addresses = {at.split()[1] for _, at in seen}
    assert {ours for ours, _ in seen} == {True, False}  # the scheduler's, and the worker's
    assert all(address.startswith("0100007F:") for address in addresses), addresses
    assert not any(address.endswith(f":{8787:04X}") for address in addresses)  # Dask's dashboard
    assert not open_to_others and not list(tmp_path.glob("store/campaign-*")) and "this machine only" not in said


def refused(tmp_path: Path, environment: dict) -> str:
    """What `bench` says where SLURM takes no job."""
    study = tmp_path / "study"
    assert command("init", study).returncode == 0
    before = time.monotonic()
    found = command("bench", study, "--scheduler", "slurm:2", env=environment)
    assert found.returncode == 2 and paragraph(found.stderr) and time.monotonic() - before < 60
    assert not list(study.glob(".store/campaign-*"))
    return found.stderr


def test_what_sbatch_refuses_is_told_in_its_words(tmp_path, slurm):
    pytest.importorskip("dask_jobqueue")
    words = "sbatch: error: invalid partition specified: normal"
    (tmp_path / "bin" / "sbatch").write_text(f"#!/bin/sh\necho '{words}' >&2\nexit 1\n")
    said = refused(tmp_path, slurm)
    assert words in said and "jobqueue.yaml" in said and len(said.splitlines()) == 1


def test_a_machine_without_sbatch_is_told_at_once(tmp_path, slurm):
    (tmp_path / "bin" / "sbatch").unlink()
    assert "there is no sbatch on the PATH" in refused(tmp_path, slurm)


def test_without_a_named_interface_the_scheduler_is_heard_by_this_machine_only(tmp_path, slurm):
    settings = tmp_path / "dask" / "jobqueue.yaml"
    settings.write_text(settings.read_text().replace("    interface: lo\n", ""))
    (tmp_path / "bin" / "sbatch").write_text("#!/bin/sh\ncp $1 $0.job\nexit 1\n")
    assert "listens on this machine only" in refused(tmp_path, slurm)
    assert "tls://127.0.0.1:" in (tmp_path / "bin" / "sbatch.job").read_text()


@pytest.mark.parametrize("name", SIMULATING)
def test_the_options_of_simulations_are_those_of_every_command_that_simulates(name):
    said = command(name, "--help").stdout
    assert all(option in said for option in ("--scheduler", "--time-limit", "--workers"))


@pytest.mark.parametrize(
    "option, given", [("--scheduler", "h:8786"), ("--time-limit", "0"), ("--time-limit", "1,5"), ("--workers", "0")]
)
def test_an_option_of_simulations_that_cannot_be_used_is_refused_before_the_study_is_read(option, given):
    found = command("compare", "/nowhere", option, given)
    assert (
        found.returncode == 2 and paragraph(found.stderr) and given in found.stderr and "/nowhere" not in found.stderr
    )
