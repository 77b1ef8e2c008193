"""`pellet-study doctor`: what is installed, which YADE, whether its contact laws pass their checks."""

from __future__ import annotations

import argparse
import importlib.metadata
import platform
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pellet_study.errors import StudyError
from pellet_study.files import writing
from pellet_study.output.terminal import done

if TYPE_CHECKING:
    import pandas as pd

EPILOG = """\
examples:
  pellet-study doctor
  pellet-study doctor --results results/checks    every check, and what the rigs' answers depend on (an hour)
"""
PACKAGES = ("numpy", "scipy", "pandas", "statsmodels", "pyDOE3", "matplotlib", "tqdm")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.epilog = EPILOG
    parser.add_argument(
        "--results", type=Path, metavar="FOLDER", help="run all checks and write their tables there (resumable)"
    )


def run(arguments: argparse.Namespace) -> dict:
    """Report; write the full tables where asked."""
    from pellet_study import __version__
    from pellet_study.simulation import dispatch, law_checks, yade

    answer: dict[str, Any] = {
        "pellet_study": __version__,
        "python": platform.python_version(),
        "yade": None,
        "version": None,
    }
    answer["packages"] = {name: importlib.metadata.version(name) for name in PACKAGES}
    print(f"pellet-study {__version__}, Python {answer['python']}, {dispatch.cores()} cores")
    print("  " + ", ".join(f"{name} {version}" for name, version in answer["packages"].items()))
    try:
        answer["yade"], answer["version"] = yade.executable(), yade.version()
    except StudyError as error:
        print(f"YADE: {error}")
        return {**answer, "ok": False, "checks": []}
    print(f"YADE {answer['version']}: {answer['yade']}")
    answer["lacks"] = yade.lacks()
    for what, cost in answer["lacks"].items():
        print(f"  this build lacks {what}: {cost}")
    if arguments.results is None:
        with tempfile.TemporaryDirectory() as folder:
            table = _law_checks(Path(folder) / ".store", quick=True)
    else:
        table = _law_checks(arguments.results / ".store", quick=False)
        _write(table, arguments.results / "law_checks.csv")
        _full(arguments.results)
    broken = law_checks.unexplained(table)
    known = int((~table["within"]).sum()) - len(broken)
    print(f"contact laws: {int(table['within'].sum())} of {len(table)} checks within 2 % or 0.005;")
    print(f"  {known} are outside for a reason the table states, {len(broken)} without one")
    for _, row in broken.iterrows():
        print(
            f"  {row['check']} {row['contact_law']} {row['setting']}: requested {row['requested']:g}, got {row['measured']:g}"
        )
    if len(broken):
        print("This YADE's contact laws differ from those the rigs were built on: do not trust its results.")
    done(arguments.results or "above", "init FOLDER" if broken.empty else None)
    return {**answer, "ok": broken.empty, "checks": table.astype(object).where(table.notna(), None).to_dict("records")}


def _law_checks(store: Path, quick: bool) -> pd.DataFrame:
    from pellet_study.simulation import dispatch, law_cases, law_checks

    return law_checks.table(dispatch.run(law_cases.cases(quick=quick), store))


def _full(folder: Path) -> None:
    from pellet_study.bench import sensitivity

    _write(sensitivity.time_steps_table(), folder / "time_steps.csv")
    for name, table in sensitivity.TABLES.items():
        found = table(folder / ".store")
        _write(found, folder / f"{name}.csv")
        print(found.round(4).to_string(index=False, max_colwidth=40), end="\n\n")


def _write(table: pd.DataFrame, file: Path) -> None:
    writing.table(file, table, float_format="%.6g")
