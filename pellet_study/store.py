"""Finished cases, kept as CSV rows in a folder: one table a rig, appended by the YADE processes as they finish."""

import fcntl
import hashlib
import json
import os
import shutil
import sys
from pathlib import Path

import pandas as pd

from pellet_study import rigs, yade
from yade_scripts import case as case_file

READ_AS_TEXT = {"id": str, "status": str, "contact_law": str}


def key(case: dict) -> str:
    """The case's id: a hash of everything the answer depends on (case, scripts, YADE version)."""
    inputs = {name: value for name, value in case.items() if name != "id"}
    text = json.dumps([inputs, rigs.rig(case["rig"]).fingerprint, yade.version()], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:20]


class Store:
    """The folder of finished cases; `with store:` holds it for one writer at a time."""

    def __init__(self, folder: Path):
        self.folder = Path(folder).resolve()

    def __enter__(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        self._lock = os.open(self.folder / "lock", os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print(f"waiting for another pellet-study that works in {self.folder}", file=sys.stderr)
            fcntl.flock(self._lock, fcntl.LOCK_EX)
        for left in self.folder.glob("campaign-*"):  # of a driver that was killed
            shutil.rmtree(left, ignore_errors=True)
        return self

    def __exit__(self, *_):
        os.close(self._lock)

    def columns(self, rig: rigs.Rig) -> list[str]:
        """Columns of a rig's table."""
        return case_file.columns(vars(rig))

    def table(self, rig: rigs.Rig) -> Path:
        """File of a rig's table; another set of columns is another file."""
        names = hashlib.sha256(",".join(self.columns(rig)).encode()).hexdigest()[:8]
        return self.folder / f"{rig.name}-{names}.csv"

    def rows(self, rig: rigs.Rig) -> pd.DataFrame:
        """What is stored for a rig, indexed by id; torn or foreign lines are left out."""
        names, file = self.columns(rig), self.table(rig)
        if file.exists() and file.stat().st_size:
            try:
                found = pd.read_csv(
                    file,
                    dtype=READ_AS_TEXT,
                    on_bad_lines="skip",
                    encoding_errors="replace",
                    keep_default_na=False,
                    na_values={name: [""] for name in names},
                )
            except (pd.errors.ParserError, pd.errors.EmptyDataError):
                found = pd.DataFrame()
            if list(found.columns) == names:
                whole = found["status"].notna() & found["id"].str.fullmatch("[0-9a-f]{20}", na=False)
                found = found[whole].drop_duplicates("id", keep="last").set_index("id")
                numbers = [name for name in names if name not in READ_AS_TEXT]
                found[numbers] = found[numbers].apply(pd.to_numeric, errors="coerce")
                return found.astype({"seed": int})
            file.replace(file.with_suffix(".unreadable"))
            print(f"{file} is no table of finished cases; set aside as {file.stem}.unreadable", file=sys.stderr)
        return pd.DataFrame(columns=names).set_index("id")
