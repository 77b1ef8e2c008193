"""What a script of this folder finds on the YADE of Debian 13 (.ci/debian13): called there, it prints a table as CSV."""

import io
import subprocess
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).resolve().parents[1]


def table(script: str, first_column: str, *arguments: str) -> pd.DataFrame:
    """The table that `SCRIPT --here ARGUMENTS` prints there, which begins with that column."""
    words = " ".join(["make install yade >&2 && .venv/bin/python", f"benchmarks/{script}", "--here", *arguments])
    command = [ROOT / ".ci" / "debian13", "sh", "-c", words]
    found = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout
    return pd.read_csv(io.StringIO(found[found.index(f"{first_column},") :]), dtype={"yade": str})
