"""A table of trials that grows row by row: what is in it is not done again."""

import csv
import io
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from pellet_study.files import opening, writing

Show = Callable[[int, int], None]  # told (done, of how many)


def read(file: Path) -> list[dict[str, str]]:
    """Rows of a trial table, those that were cut off left out; none where there is no table."""
    if not file.exists():
        return []
    table = csv.DictReader(io.StringIO(opening.text(file), newline=""))
    return [row for row in table if None not in row and None not in row.values()]


def resume(
    file: Path,
    columns: Sequence[str],
    jobs: Sequence[Sequence],
    one: Callable[..., Mapping | None],
    seconds: float = np.inf,
    show: Show | None = None,
) -> int:
    """Append the row of each job to a table as it is done; returns how many were done.

    Parameters
    ----------
    jobs : arguments of `one`, in the order in which they are done
    one : a job's row, None where it has none
    seconds : after which no further job is begun
    show : told (done, of how many) after each job
    """
    until, count, new = time.monotonic() + seconds, 0, not file.exists()
    with writing.appending(file) as stream:
        writer = csv.DictWriter(stream, columns, lineterminator="\n")
        if new:
            writer.writeheader()
        for job in jobs:
            if time.monotonic() > until:
                break
            row = one(*job)
            if row is not None:
                writer.writerow(row)
                stream.flush()
                count += 1
            if show is not None:
                show(count, len(jobs))
    return count


def write(file: Path, columns: Sequence[str], rows: Iterable[Mapping]) -> None:
    """A whole table."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    writing.text(file, stream.getvalue())
