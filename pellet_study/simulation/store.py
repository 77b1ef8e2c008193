"""Finished cases, kept as CSV rows in a folder: one table a rig, appended by the YADE processes as they finish."""

import hashlib
import io
import json
import logging
import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from pellet_study.errors import InputError
from pellet_study.files import locking, opening, writing
from pellet_study.rigs.declared import Rig
from pellet_study.simulation import yade
from yade_scripts import case as case_file

log = logging.getLogger(__name__)
LARGEST = 2_000_000_000  # bytes of a table of finished cases
MARK = ".pellet-study"  # in folders of its own
READ_AS_TEXT = {"id": str, "status": str, "contact_law": str}


def key(case: Mapping, rig: Rig) -> str:
    """The id of a rig's case: a hash of everything the answer depends on (case, scripts, YADE version)."""
    inputs = {name: value for name, value in case.items() if name != "id"}
    text = json.dumps([inputs, rig.fingerprint, yade.version()], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:20]


class Store:
    """The folder of finished cases; `with store:` holds it for one writer at a time."""

    def __init__(self, folder: Path):
        self.named, self.folder = Path(folder), Path(folder).resolve()

    def __enter__(self) -> "Store":
        opening.fill_streams()
        writing.folder(self.named)
        self._refuse_links()
        self.lock = os.open(self.folder / "lock", os.O_RDWR | os.O_CREAT | writing.NO_FOLLOW, 0o644)
        try:
            locking.hold(self.lock, self.folder, self._wait)
            for left in self.folder.glob("campaign-*"):  # of a driver that was killed
                if (left / MARK).is_file() and not left.is_symlink():
                    shutil.rmtree(left, ignore_errors=True)
        except BaseException:
            os.close(self.lock)
            raise
        return self

    def __exit__(self, *_: object) -> None:
        locking.release(self.lock)  # what a process of YADE left behind shares it, and would hold it on
        os.close(self.lock)

    def _wait(self) -> None:
        log.warning("waiting for another pellet-study that works in %s", self.folder)

    def _refuse_links(self) -> None:
        """Refuse a table, or the lock, that is a link: rows would be written where it leads."""
        for entry in os.scandir(self.folder):
            if entry.is_symlink():
                writing.refuse_link(Path(entry.path))

    def new_campaign(self) -> Path:
        """A folder for one call, removed by the next one where this one is killed."""
        folder = Path(tempfile.mkdtemp(prefix="campaign-", dir=self.folder))
        (folder / MARK).touch()
        return folder

    def kinds(self, rig: Rig) -> dict[str, type[str]]:
        """What some columns of a rig's table are read as; the others as what they look like."""
        return READ_AS_TEXT | {name: str for name in rig.conditions if rig.options(name)}

    def columns(self, rig: Rig) -> list[str]:
        """Columns of a rig's table."""
        return case_file.columns(vars(rig))

    def table(self, rig: Rig) -> Path:
        """File of a rig's table; another set of columns is another file."""
        names = hashlib.sha256(",".join(self.columns(rig)).encode()).hexdigest()[:8]
        return self.folder / f"{rig.name}-{names}.csv"

    def rows(self, rig: Rig) -> pd.DataFrame:
        """What is stored for a rig, indexed by id; torn, altered or foreign lines are left out."""
        names, file = self.columns(rig), self.table(rig)
        if file.exists() and not file.is_file():
            raise InputError(f"{file}: expected a table of finished cases, found something else; move it away")
        lines = opening.content(file, LARGEST).split(b"\n")[1:] if file.exists() else []
        whole = [body for body in map(case_file.unsealed, lines) if body]
        lost = len(lines) - len(whole) - (not (lines and lines[-1]))
        if lost > 0:
            log.warning("%s: %s damaged or foreign lines are left out, their cases computed again", file, lost)
        if not whole:
            return pd.DataFrame(columns=names).set_index("id")
        found = pd.read_csv(
            io.BytesIO(b"\n".join(whole)),
            header=None,
            names=names,
            dtype=self.kinds(rig),
            keep_default_na=False,
            na_values={name: [""] for name in names},
        )
        return found.drop_duplicates("id", keep="last").set_index("id")
