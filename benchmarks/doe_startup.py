"""Time of `pellet-study pb` and `bbd` beside that of `import statsmodels.api`, in pairs.

Each pair runs both, one after the other, so that the load of the machine hits both alike; the median of the
ratios counts. Run: python benchmarks/doe_startup.py [PAIRS]
"""

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from pellet_study.paper.printed import table

LIMIT = 2.0
"""The commands must answer in less than this many times the import."""

REFERENCE = [sys.executable, "-c", "import statsmodels.api"]


def seconds(command: list[str]) -> float:
    """Wall time of a process."""
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return time.perf_counter() - start


def main(pairs: int) -> int:
    """Print the ratios; 1 if a command is too slow."""
    status = 0
    with tempfile.TemporaryDirectory() as folder:
        for command, number in (("pb", 7), ("bbd", 12)):
            path = Path(folder) / f"{command}.csv"
            table(number).drop(columns="No.").to_csv(path, index=False)
            own = [sys.executable, "-m", "pellet_study", command, str(path)]
            seconds(REFERENCE), seconds(own)  # fill the disk cache
            times = [(seconds(own), seconds(REFERENCE)) for _ in range(pairs)]
            ratio = statistics.median(mine / reference for mine, reference in times)
            medians = [statistics.median(column) for column in zip(*times, strict=True)]
            print(f"{command} {medians[0]:.2f} s, import statsmodels.api {medians[1]:.2f} s, ratio {ratio:.2f}")
            status |= ratio >= LIMIT
    return status


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 7))
