"""A Dask scheduler of our own whose workers are jobs of SLURM: for us alone, while one call runs.

It listens on the interface that jobqueue.yaml names, else on this machine only, speaks TLS with certificates that are made
for the call and end with it, and shows no dashboard, unless jobqueue.yaml asks for one.
"""

import logging
import shutil
from pathlib import Path
from typing import Any

import dask
from dask_jobqueue import SLURMCluster
from dask_jobqueue.slurm import SLURMJob
from distributed import Security, Status

from pellet_study.errors import InputError
from pellet_study.files import writing

log = logging.getLogger(__name__)
SETTINGS = "~/.config/dask/jobqueue.yaml"
LOOPBACK = "lo"
NO_PAGES = {
    "dashboard": False,
    "dashboard_address": "127.0.0.1:0",
}  # what is left answers here only, and has nothing to say
NO_PAGES_OF_WORKERS = ["--no-dashboard", "--dashboard-address", "127.0.0.1:0"]


class Jobs:
    """So many jobs of SLURM, from entering to leaving; `address` and `security` lead to their scheduler."""

    def __init__(self, number: int, keys: Path):
        """`keys` : folder that the nodes see as well and others may not read"""
        self.number, self.keys = number, keys
        self._told = False

    def __enter__(self) -> "Jobs":
        if shutil.which("sbatch") is None:
            raise InputError(
                f"--scheduler slurm:{self.number}: there is no sbatch on the PATH; call it where jobs are submitted from "
                "(a login node), or leave --scheduler away to simulate on this machine"
            )
        self.submitted: list[str] = []
        self.refusals: list[str] = []
        scheduler = dict(dask.config.get("jobqueue.slurm.scheduler-options", {}))
        interface = dask.config.get("jobqueue.slurm.interface", None)
        if not interface and not scheduler.keys() & {"host", "interface"}:
            interface = LOOPBACK
            log.warning(
                "the scheduler listens on this machine only: jobs on other nodes cannot reach it. Name the interface they can "
                "in %s, as jobqueue: slurm: {interface: ib0}",
                SETTINGS,
            )
        pages = {} if scheduler.keys() & NO_PAGES.keys() else NO_PAGES
        extra = dask.config.get("jobqueue.slurm.worker-extra-args", None) or []
        self.security = _certificates(self.keys)
        try:
            with dask.config.set({"distributed.scheduler.http.routes": []} if pages else {}):
                self.cluster = SLURMCluster(
                    job_cls=_asking(self.submitted, self.refusals),
                    interface=interface,
                    security=self.security,
                    scheduler_options={**pages, **scheduler},
                    worker_extra_args=[*NO_PAGES_OF_WORKERS, *extra],
                )
        except (TypeError, ValueError, RuntimeError, OSError) as error:
            raise InputError(
                f"--scheduler slurm:{self.number}: cores, memory and walltime of a job, and an interface of this machine, are "
                f"expected in {SETTINGS} under jobqueue: slurm: ({' '.join(str(error).split())})"
            ) from None
        try:
            self.address = self.cluster.scheduler_address
            self.cluster.scale(jobs=self.number)
        except BaseException:
            self.cluster.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.cluster.close()

    def check(self) -> None:
        """Look at what sbatch answered.

        Raises
        ------
        InputError : it refused every job; in its words
        """
        if not self.refusals or self._told or len(self.refusals) + len(self.submitted) < self.number:
            return
        if not self.submitted:
            raise InputError(f"--scheduler slurm:{self.number}: {self.refusals[0]}; see {SETTINGS}")
        self._told = True
        log.warning("sbatch refused %d of %d jobs: %s", len(self.refusals), self.number, self.refusals[0])


def _certificates(folder: Path) -> Security:
    """Certificates made for this call, in files that a job's worker can name and nobody else may read."""
    try:
        made = Security.temporary().get_tls_config_for_role("worker")
    except ImportError:
        raise InputError(
            "--scheduler slurm:JOBS needs cryptography for its certificates: pip install 'pellet-study[dask]'"
        ) from None
    files = {name: folder / f"{name}.pem" for name in ("ca_file", "cert", "key")}
    for name, file in files.items():
        file.touch(mode=0o600)
        writing.text(file, made[name])
    ends = {
        f"tls_{role}_{name}": str(files[name]) for role in ("client", "scheduler", "worker") for name in ("cert", "key")
    }
    return Security(require_encryption=True, tls_ca_file=str(files["ca_file"]), **ends)


def _asking(submitted: list[str], refusals: list[str]) -> Any:
    """A kind of job that keeps what sbatch answered."""

    class Job(SLURMJob):
        async def _submit_job(self, script_filename: str) -> str:
            try:
                answer = await super()._submit_job(script_filename)
            except (RuntimeError, OSError) as error:
                refusals.append(_words(str(error)))
                self.status = Status.failed  # else the cluster waits for it when it closes
                raise
            submitted.append(answer)
            return answer

    return Job


def _words(error: str) -> str:
    """What sbatch wrote, out of the report of the call."""
    said = error.rpartition("stderr:\n")[2] or error
    return "; ".join(line.strip() for line in said.splitlines() if line.strip())[:500]
