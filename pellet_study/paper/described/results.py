"""The audit of a described paper as the files of one folder."""

import re
from pathlib import Path

import pandas as pd

from pellet_study.files import writing
from pellet_study.paper.described.analyses import numbers, rows_of
from pellet_study.paper.described.audit import PaperAudit
from pellet_study.paper.html import page, shown


def write(folder: Path, audit: PaperAudit) -> list[Path]:
    """Write audit.csv, audit.html, and of every analysis its coefficients and analysis of variance; returns the paths.

    Parameters
    ----------
    folder : Path
        Made if it is not there; files of the same names are replaced.
    """
    rows = [{**item.as_dict(), "recomputed": shown(item.recomputed)} for item in audit.items]
    for row in rows:
        row["difference"] = "" if row["difference"] is None else f"{row['difference']:.2g}"
    frames = {"audit": pd.DataFrame(rows)}
    for analysis in audit.paper.analyses:
        fit, name = audit.fits[analysis.name], file_name(analysis.name)
        found = numbers(analysis, fit)
        terms = [key[1] for key in found if key[0] == "coefficients"]
        kinds = ("coefficients", "standard_errors", "t", "p")
        frames[f"{name}_coefficients"] = pd.DataFrame(
            [{"term": term, **{kind: found[kind, term] for kind in kinds}} for term in terms]
        )
        frames[f"{name}_anova"] = pd.DataFrame([{**row, "source": source} for source, row in rows_of(fit).items()])
    if audit.target is not None:
        frames["settings"] = pd.DataFrame(
            [
                {
                    "factor": e.name,
                    "lowest": min(e.physical),
                    "highest": max(e.physical),
                    "unidentified": e.unidentified,
                }
                for e in audit.target.extents
            ]
        )
    paths = []
    for name, frame in frames.items():
        if not frame.empty:
            paths.append(folder / f"{name}.csv")
            writing.table(paths[-1], frame, float_format="%.8g")
    paths.append(folder / "audit.html")
    writing.text(paths[-1], page(audit.items, f"Audit of {audit.paper.title}"))
    return paths


def file_name(name: str) -> str:
    """A name of an analysis as a file's: lower case, underscores."""
    return re.sub(r"\W+", "_", name.lower()).strip("_")
